"""The rough shell of a mine drift: a horseshoe section driven along a bent line through rock."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from depthsim.procedural.noise import facets, fractal, smooth
from depthsim.procedural.part import Floats, Part
from depthsim.procedural.primitives import grid_faces

AXIS = 1.45
"""Height of the line that the section is star-shaped about [m]."""


def outline(count: int, inset: float = 0.0) -> Floats:
    """(count, 2) points (to the left, up) of the horseshoe, even along it, from the right end of the floor [m].

    The drift is 3.6 m wide at the floor, 4 m at the springing of the arch and 3.4 m high. Counter-clockwise as seen
    by who looks down the drift from its far end. ``inset`` moves walls and back inwards.
    """
    arch = np.linspace(0, np.pi, 60)
    wide = 2.0 - inset
    points = np.concatenate(
        [
            [[-1.8 + inset, 0.0], [1.8 - inset, 0.0]],
            np.stack([wide * np.cos(arch), 1.4 + wide * np.sin(arch)], axis=1),
            [[-1.8 + inset, 0.0]],
        ]
    )
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.arange(count) / count * length[-1]
    return np.stack([np.interp(at, length, points[:, axis]) for axis in range(2)], axis=1)


@dataclass(frozen=True)
class Drift:
    """The line of a drift: x = s, y a gentle bend, for s from 0 to ``length`` [m]."""

    length: float

    def line(self, s: ArrayLike) -> tuple[Floats, Floats]:
        """(N, 2) points of the middle line and (N, 2) unit vectors to its left, at floor level."""
        at = np.atleast_1d(np.asarray(s, dtype=np.float64))
        turn = 2 * np.pi / 44
        middle = np.stack([at, 2.2 * np.sin(turn * at)], axis=1)
        ahead = np.stack([np.ones_like(at), 2.2 * turn * np.cos(turn * at)], axis=1)
        ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
        return middle, np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)

    def at(self, s: ArrayLike, left: ArrayLike, up: ArrayLike) -> Floats:
        """(N, 3) points at ``s`` along the drift, ``left`` of its middle line and ``up`` from its floor [m]."""
        middle, side = self.line(s)
        offset = np.broadcast_to(np.asarray(left, dtype=np.float64), len(middle))
        height = np.broadcast_to(np.asarray(up, dtype=np.float64), len(middle))
        return np.column_stack([middle + side * offset[:, None], height])

    def heading(self, s: float) -> float:
        """The yaw of the drift at ``s`` [degrees]."""
        _, side = self.line(s)
        return float(np.degrees(np.arctan2(-side[0, 0], side[0, 1])))

    def surface(self, rows: int, around: int, seed: int) -> Floats:
        """(rows, around, 3) points of the rock's surface, even along the drift and around its section [m]."""
        s = np.linspace(0, self.length, rows)
        section = outline(around)
        middle, side = self.line(s)
        out = section - (0, AXIS)
        out /= np.linalg.norm(out, axis=1, keepdims=True)

        def place(offset: Floats) -> Floats:
            """The section pushed out by ``offset`` (rows, around) [m]."""
            flat = section + out * offset[..., None]
            return np.concatenate([middle[:, None] + side[:, None] * flat[..., :1], flat[..., 1:]], axis=2)

        # The floor is mucked out and driven flat; walls and back stay as the blast left them.
        wall = np.clip((section[:, 1] - 0.05) / 0.5, 0, 1)
        niches = _niches(s[:, None], section) * wall
        coarse, fine = (part.reshape(rows, around) for part in _roughness(place(niches).reshape(-1, 3), seed))
        coarse *= 0.15 + 0.85 * wall
        # Soft, so that what would stick out too far into the drift is pressed flat, not cut off.
        return place(niches + np.where(coarse < 0, 0.36 * np.tanh(coarse / 0.36), coarse) + fine)

    def shell(self, surface: Floats, seed: int) -> Part:
        """The closed shell of :meth:`surface`, its ends rough faces of rock; it looks inward."""
        ends = [self._face(surface[0], -1, seed + 5), self._face(surface[-1], 1, seed + 6)]
        layers = np.concatenate([ends[0][::-1], surface, ends[1]])
        vertices = layers.reshape(-1, 3)
        index = np.arange(len(vertices)).reshape(layers.shape[:2])
        index[0], index[-1] = index[0, 0], index[-1, 0]
        index = np.concatenate([index, index[:, :1]], axis=1)
        used, inverse = np.unique(grid_faces(index[:, ::-1]), return_inverse=True)
        return Part.of(vertices[used], inverse.reshape(-1, 3), "rock")

    def _face(self, rim: Floats, direction: int, seed: int, rings: int = 36) -> Floats:
        """(rings, around, 3) the end of the drift as rings from its rim to one point, bulging by noise."""
        center = self.at(0 if direction < 0 else self.length, 0.0, AXIS)[0]
        share = (1 - (np.arange(1, rings + 1) / rings))[:, None, None]
        points = center + (rim - center) * share
        coarse, fine = _roughness(points.reshape(-1, 3) + 31.7, seed)
        rough = 0.9 * (coarse + fine).reshape(rings, -1)
        rough[-1] = rough[-1].mean()
        points[..., 0] += direction * (rough + 0.5) * np.sqrt(1 - share[..., 0] ** 2)
        return points


def _roughness(points: Floats, seed: int) -> tuple[Floats, Floats]:
    """How far rock stands back from the planned section, negative where it sticks out [m]: coarse and fine."""
    bent = points + 0.22 * np.stack([smooth(points / 1.3, seed + 50 + axis) for axis in range(3)], axis=1)
    large = 0.3 * fractal(smooth, points / 3.1, seed, 2)
    broken = 0.46 * fractal(facets, bent / 1.25, seed + 1, 3, gain=0.5)
    return large + broken, 0.045 * fractal(facets, bent / 0.21, seed + 2, 2)


def _niches(s: Floats, section: Floats) -> Floats:
    """A refuge in the left wall and the stub of a crosscut in the right one, as extra depth [m]."""
    left, up = section.T

    def window(value: Floats, low: float, high: float, soft: float) -> Floats:
        ramp = np.clip((value - low) / soft, 0, 1) * np.clip((high - value) / soft, 0, 1)
        return ramp * ramp * (3 - 2 * ramp)

    refuge = 1.1 * window(s, 14.0, 16.2, 0.35) * window(up, -0.3, 2.3, 0.4) * (left > 1)
    crosscut = 1.9 * window(s, 25.2, 28.6, 0.5) * window(up, -0.3, 2.9, 0.5) * (left < -1)
    return np.asarray(refuge + crosscut)
