"""What a rigid motion of the camera, and what errors of a sensor, do to the disparities of one frame, to first order.

A frame is taken at a pose that is off by ξ = (turn [rad], shift [m]), in the camera's own axes: pose · exp(ξ). A
pixel that sees a plane with normal n through the depth z along the ray q = (x, y, 1) then has its disparity f·b / z
changed by f·b / (z² n·q) · n·shift + f·b / (z n·q) · (q × n)·turn: point-to-plane registration (Chen and Medioni
1992), in the unit in which a stereo camera's noise is alike at all ranges.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.sensor.effects.fixed_pattern import spline

Floats = NDArray[np.float64]
SAMPLES = 5_000
"""Pixels that are looked at in a frame, about."""
_JUMP = 0.03
"""Neighbouring samples that leave the tangent plane by this share of the depth are at an edge or a curve."""
_GRAZING = 0.1
"""Least cosine of the incidence."""
_TILES = 6, 4
"""Tiles across and down, which fall by turns to one half of the pixels and the other."""
_MARGIN = 0.08
"""Share of a tile at each of its sides that belongs to neither half, so that noise of neighbours is in one alone."""
_PATTERN = 5, 7
"""Knots, down and across, of a bias that is locked to the pixel."""
_RANGES = 5
"""Knots of a bias that depends on the disparity."""
_DRIFT = 3
"""The degree of a scale that drifts with time."""


@dataclass(frozen=True)
class Frame:
    """One frame's pixels that can tell. residual: measured minus cast disparity [px]. nuisance: (pixels, nuisances)
    what each does to it, see :class:`Look`. disparity: cast [px]. half: 0 or 1, 2 where in neither. place: number of
    the pixel among those that are looked at.
    """

    residual: Floats
    nuisance: Floats
    disparity: Floats
    half: NDArray[np.int8]
    place: NDArray[np.intp]

    @property
    def rigid(self) -> Floats:
        """(pixels, 6) what a turn [rad] and a shift [m] do: of the mount it is a nuisance."""
        return self.nuisance[:, :6]


@dataclass
class Look:
    """How the frames of a recording are looked at: with a pixel in several, at any pose.

    stamps: of first and last frame [s]. of_optics: whether other optics than a lens are nuisances, see :attr:`priors`.
    knots: disparities [px] between which a bias that depends on it is linear.
    """

    run: Run
    caster: Caster
    camera: Camera
    stride: int
    rays: NDArray[np.float32]
    span: tuple[float, float]
    of_optics: bool = False
    knots: Floats = field(default_factory=lambda: np.empty(0))
    measured: dict[int, NDArray[np.float32]] = field(default_factory=dict)
    trusted: dict[int, NDArray[np.bool_]] = field(default_factory=dict)

    @classmethod
    def at(cls, run: Run, caster: Caster, samples: int = SAMPLES, *, of_optics: bool = False) -> "Look":
        """At about ``samples`` pixels of each frame."""
        full = run.camera
        stride = max(1, round(np.sqrt(full.width * full.height / samples)))
        rays = np.ascontiguousarray(full.rays[:, stride // 2 :: stride, stride // 2 :: stride])
        camera = full.model_copy(update={"width": rays.shape[2], "height": rays.shape[1]})
        return cls(run, caster, camera, stride, rays, (float(run.stamps[0]), float(run.stamps[-1])), of_optics)

    def load(self, index: int) -> None:
        """Read a frame's picture, once."""
        some = (slice(self.stride // 2, None, self.stride),) * 2
        self.measured[index] = self.run.depth(index)[some].copy()
        mask = self.run.mask(index)
        self.trusted[index] = np.ones(self.camera.shape, np.bool_) if mask is None else (mask[some] != 0)

    def cut_disparities(self, frames: list[int]) -> None:
        """Place the knots where the disparities are."""
        depth = np.concatenate([np.empty(0, np.float32), *(self.measured[i][self.measured[i] > 0] for i in frames)])
        shares = np.linspace(0.01, 0.99, _RANGES)
        found = np.quantile(self.run.camera.focal_baseline / depth, shares) if depth.size else np.ones(_RANGES)
        self.knots = found + 1e-3 * np.arange(_RANGES)  # so that no two are alike

    def frame(self, index: int, pose: Floats, twist: Floats) -> Frame:
        """A frame against the scene as seen from ``pose``. twist: (6,) the camera's velocity, [rad/s] and [m/s]."""
        stamp = float(self.run.stamps[index])
        met = self.caster.cast(self.camera, pose, rays=self.rays, stamps=stamp, threads=1)
        x, y = self.rays.astype(np.float64)
        normal = np.einsum("ij,hwi->jhw", pose[:3, :3], met.normals(self.caster.scene, stamp).astype(np.float64))
        depth, measured = met.depth.astype(np.float64), self.measured[index]
        along = normal[0] * x + normal[1] * y + normal[2]
        flat = met.hit & (met.cosine > _GRAZING) & _is_flat(depth, along, normal, x, y)
        use = flat & (measured > 0) & self.trusted[index]
        fb = self.run.camera.focal_baseline
        z, a, x, y, n = depth[use], along[use], x[use], y[use], normal[:, use]
        d = fb / z
        turn = np.stack([y * n[2] - n[1], n[0] - x * n[2], x * n[1] - y * n[0]])
        rigid = np.concatenate([d / a * turn, d / (z * a) * n])
        aside, r2 = d / a * n[:2], x * x + y * y  # what a ray does that goes a little to the right, or down
        bent = (aside[0] * x + aside[1] * y) * r2
        optics = [bent, *aside, *aside * (x, y), bent * r2] if self.of_optics else [bent]
        nuisance = self._nuisances(index, rigid, twist, d, optics, use)
        return Frame(fb / measured[use] - d, nuisance, d, self._halves()[use], np.flatnonzero(use))

    def _nuisances(
        self, index: int, rigid: Floats, twist: Floats, disparity: Floats, optics: list[Floats], use: NDArray[np.bool_]
    ) -> Floats:
        begin, end = self.span
        time = 2 * (float(self.run.stamps[index]) - begin) / max(end - begin, 1e-9) - 1
        moved, down = twist @ rigid, (np.nonzero(use)[0] + 0.5) / len(use) - 0.5
        angle = 2 * np.pi * disparity
        drifts = [-disparity * time**k for k in range(1, _DRIFT + 1)]
        hats = [np.interp(disparity, self.knots, unit) for unit in np.eye(len(self.knots))]
        parts = [*rigid, moved, moved * down, np.sin(angle), np.cos(angle), *drifts, *hats, *optics]
        found = np.empty((len(disparity), len(self.priors)))
        for column, part in enumerate(parts):
            found[:, column] = part
        found[:, len(parts) :] = self._pattern[use.reshape(-1)]
        return found

    @cached_property
    def _pattern(self) -> Floats:
        """(samples, knots) what each knot of a bias that is locked to the pixel does."""
        down, across = (spline(knots, size) for knots, size in zip(_PATTERN, self.camera.shape, strict=True))
        return (down[:, None, :, None] * across[:, None, :]).reshape(len(down) * len(across), -1)

    @property
    def priors(self) -> Floats:
        """(nuisances,) how large each may be: turn and shift of the mount, stamps, rows, steps, drift, a bias by the
        disparity, optics (a lens, and if asked for principal point, focal lengths and its second term) and a bias by
        the pixel.

        Over a few frames other optics take up some of what random errors leave on average.
        """
        mount, camera, optics = [0.1] * 3 + [0.1] * 3, [0.2, 0.1, 0.2, 0.2], [0.1] * (6 if self.of_optics else 1)
        pattern = [0.2] * (_PATTERN[0] * _PATTERN[1])
        return np.array([*mount, *camera, *[0.1] * _DRIFT, *[2.0] * len(self.knots), *optics, *pattern])

    in_time: ClassVar[list[int]] = [6, 7, *range(10, 10 + _DRIFT)]
    """The nuisances that change with time or motion: stamps, rows, drift."""
    by_disparity: ClassVar[slice] = slice(10 + _DRIFT, 10 + _DRIFT + _RANGES)
    """Those that are a bias at each of ``knots``."""

    def _halves(self) -> NDArray[np.int8]:
        height, width = self.camera.shape
        places = np.arange(height) * _TILES[1] / height, np.arange(width) * _TILES[0] / width
        inner = [np.abs(at % 1 - 0.5) < 0.5 - _MARGIN for at in places]
        tile = np.add.outer(*(at.astype(np.int8) for at in places)) % 2
        return np.where(np.logical_and.outer(*inner), tile, 2).astype(np.int8)


def _is_flat(depth: Floats, along: Floats, normal: Floats, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """(height, width): where all four neighbours lie near the tangent plane."""
    flat = np.ones(depth.shape, np.bool_)
    plane = depth * along
    for axis in (0, 1):
        for step in (1, -1):
            there = [np.roll(part, -step, axis) for part in (depth, x, y)]
            seen = normal[0] * there[1] + normal[1] * there[2] + normal[2]
            with np.errstate(divide="ignore", invalid="ignore"):
                off = np.abs(plane / seen - there[0]) / depth
            near = off < _JUMP
            edge = [slice(None), slice(None)]
            edge[axis] = slice(-1, None) if step == 1 else slice(0, 1)
            near[tuple(edge)] = True
            flat &= near
    return flat
