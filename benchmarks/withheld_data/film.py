"""The camera that films: clean geometry, the noise that the simulator knows, and the formulas of what it does not."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks.withheld_data.route import Route
from benchmarks.withheld_data.world import World
from depthsim.camera import Camera
from depthsim.raycast import Geometry
from depthsim.trajectory import Trajectory

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Rng = np.random.Generator


@dataclass(frozen=True)
class Base:
    """The part of the noise that the simulator has: the paper's, or a constant one in disparity.

    m: of each tag as it really is [1/m]; empty for a base in disparity. sigma: [px], 0 for the paper's law.
    rate: share of holes.
    """

    m: dict[str, float]
    sigma: float = 0.0
    rate: float = 0.01


class Formula:
    """One physical effect by one formula: ``amount`` says how much of it, the rest is drawn at random once.

    effect: the id of the effect. statistic: by what its strength is measured (strength.py). span: from the least to
    the greatest amount. Numbers that a subclass keeps as plain attributes are its parameters in the record.
    Each hook changes one step of how a frame is made, and does nothing unless a subclass says so.
    """

    effect: ClassVar[str]
    statistic: ClassVar[str] = "change"
    span: ClassVar[tuple[float, float]] = (1e-3, 1.0)
    axes: ClassVar[tuple[str, ...]] = ()
    names: ClassVar[tuple[str, ...]] = ()
    amount: float = 0.0

    def __init__(self, rng: Rng, film: "Film") -> None:
        """Draw what is not the amount."""

    @property
    def name(self) -> str:
        """What the formula is called in the record."""
        return type(self).__name__

    def parameters(self) -> dict[str, Any]:
        """The amount and what was drawn."""
        plain = {k: v for k, v in vars(self).items() if not k.startswith("_") and k != "amount"}
        return {"amount": float(self.amount), **{k: _plain(v) for k, v in plain.items()}}

    def known(self) -> dict[str, Any]:
        """Parameters of depthsim's effect of this id that mean the same here, by its names and in its units."""
        return {}

    def plausible(self) -> bool:
        """Whether a real camera could have this amount."""
        return True

    def shown(self, index: int) -> int:
        """The frame whose picture stands in the place of frame ``index``."""
        return index

    def delay(self, take: "Take") -> float | Floats:
        """Time of the picture minus its stamp [s]; (height,) for one a row."""
        return 0.0

    def off(self, film: "Film", times: Floats) -> Floats | None:
        """(N, 4, 4) what the poses told are off by at some times [s]: true pose = pose told · off. None: nothing."""
        return None

    def mount(self) -> Floats | None:
        """(4, 4) how the camera is mounted against its poses: true pose = pose · mount."""
        return None

    def rays(self, take: "Take", rays: Floats) -> Floats:
        """(2, height, width) directions at z = 1, from what the calibration says."""
        return rays

    def bias(self, take: "Take") -> None:
        """Systematic errors: change ``take.z``."""

    def mix(self, take: "Take") -> None:
        """Depths of neighbouring surfaces: change ``take.z``."""

    def spread(self, take: "Take") -> None:
        """Change ``take.sigma``, the standard deviation of the depth [m]."""

    def field(self, take: "Take", white: Floats) -> Floats:
        """The unit noise in place of ``white``."""
        return white

    def tail(self, take: "Take") -> None:
        """Outliers, after the noise: change ``take.z``."""

    def steps(self, take: "Take") -> None:
        """Steps of the disparity, after the noise: change ``take.z``."""

    def lose(self, take: "Take") -> Mask | None:
        """(height, width) the pixels that become holes, None for none."""
        return None

    def finish(self, take: "Take") -> None:
        """What is done to the finished picture, holes and all: change ``take.z``."""


@dataclass(eq=False)
class Take:
    """One frame being made. z: depth as measured so far [m], 0 is a hole; sigma: its noise [m]."""

    film: "Film"
    index: int
    stamp: float
    pose: Floats
    poses: Floats
    directions: Floats
    geometry: Geometry
    z: Floats
    sigma: Floats

    def rng(self, key: str, index: int | None = None) -> Rng:
        """Random numbers of a purpose in this frame, or in frame ``index``."""
        return self.film.rng(key, self.index if index is None else index)

    @property
    def hit(self) -> Mask:
        """Where there is a surface."""
        return self.geometry.depth > 0

    @property
    def disparity(self) -> Floats:
        """f·b / z of what is measured so far [px]; 0 for a hole."""
        return self.film.inverse(self.z)

    @cached_property
    def clean_disparity(self) -> Floats:
        """f·b / z of the surface [px]; 0 for nothing hit."""
        return self.film.inverse(self.geometry.depth.astype(np.float64))

    @cached_property
    def angle(self) -> Floats:
        """Angle of incidence [rad]."""
        return np.arccos(np.clip(self.geometry.cosine.astype(np.float64), 0, 1))

    @cached_property
    def points(self) -> Floats:
        """(height, width, 3) the points met, in the world [m]."""
        z = self.geometry.depth.astype(np.float64)
        local = np.stack([self.directions[0] * z, self.directions[1] * z, z], axis=-1)
        rotation, origin = self._rows
        return np.einsum("vij,vuj->vui", rotation, local) + origin[:, None]

    @cached_property
    def normals(self) -> Floats:
        """(height, width, 3) unit normals in the world, on the side that is seen; 0 for nothing hit."""
        normal = self.geometry.normals(self.film.world.scene).astype(np.float64)
        away = np.sum(normal * (self.points - self._rows[1][:, None]), axis=-1) > 0
        return np.where(away[..., None], -normal, normal)

    @cached_property
    def origins(self) -> Floats:
        """(height, 1, 3) where the camera is, a row."""
        return self._rows[1][:, None]

    @property
    def _rows(self) -> tuple[Floats, Floats]:
        height = self.film.camera.height
        poses = self.poses if self.poses.ndim == 3 else np.broadcast_to(self.poses, (height, 4, 4))
        return poses[:, :3, :3], poses[:, :3, 3]


class Film:
    """All that a run is made of. ``formulas`` is what the simulator lacks; without any it films as the simulator.

    on_route: whether the frames are taken on the route, and the poses told are off it. Otherwise it is the other way
    round, so that what errors of the poses change is seen in the frames.
    """

    def __init__(self, world: World, route: Route, camera: Camera, stamps: Floats, base: Base, seed: int) -> None:
        self.world, self.route, self.camera, self.stamps = world, route, camera, stamps
        self.base, self.seed = base, seed
        self.poses = route.at(stamps)
        self.formulas: Sequence[Formula] = ()
        self.on_route = False
        self.v, self.u = np.mgrid[: camera.height, : camera.width].astype(np.float64)
        self.calibrated = camera.rays.astype(np.float64)

    def __len__(self) -> int:
        return len(self.stamps)

    def rng(self, key: str, index: int) -> Rng:
        """Random numbers that depend on the run's seed, what they are for, and the frame."""
        return np.random.default_rng([self.seed, zlib.crc32(key.encode()), index])

    def inverse(self, x: Floats) -> Floats:
        """Depth to disparity, or back; 0 stays 0."""
        return np.divide(self.camera.focal_baseline, x, out=np.zeros_like(x), where=x > 0)

    def off(self, times: Floats, formulas: Sequence[Formula]) -> Floats:
        """(N, 4, 4) true pose = pose told · off."""
        whole = np.broadcast_to(np.eye(4), (len(times), 4, 4))
        for formula in formulas:
            one = formula.off(self, times)
            whole = whole if one is None else whole @ one
        return whole

    def told(self, times: Floats) -> Trajectory:
        """The poses that are recorded, of frames that are taken on the route."""
        poses = self.route.at(times) @ np.linalg.inv(self.off(times, self.formulas))
        return Trajectory(times, poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3]).as_quat())

    def law(self, z: Floats, tag: NDArray[np.uint8], m: dict[str, float] | None = None) -> Floats:
        """The base noise at depth ``z`` [m]."""
        if self.base.sigma:
            return self.base.sigma * z * z / self.camera.focal_baseline
        table = self.world.table(m or self.base.m)
        return np.where(z > 0, 0.005 * np.exp(np.minimum(table[tag] * z, 40.0)), 0.0)

    def make(self, index: int, formulas: Sequence[Formula] | None = None, noise: bool = True) -> Take:
        """Frame ``index``; with other formulas than its own if they are given, and without noise on request."""
        formulas = self.formulas if formulas is None else formulas
        for formula in formulas:
            index = formula.shown(index)
        take = self._cast(index, formulas)
        for formula in formulas:
            formula.bias(take)
        before = take.z.copy()
        for formula in formulas:
            formula.mix(take)
        mixed = take.z != before
        take.sigma[mixed] = self.law(take.z, take.geometry.tag)[mixed]
        for formula in formulas:
            formula.spread(take)
        if noise:
            self._add_noise(take, formulas)
        for formula in formulas:
            formula.steps(take)
        self._make_holes(take, formulas, noise)
        for formula in formulas:
            formula.finish(take)
        return take

    def _cast(self, index: int, formulas: Sequence[Formula]) -> Take:
        stamp, pose = float(self.stamps[index]), self.poses[index]
        empty = np.zeros(self.camera.shape)
        nothing = Geometry.empty((0, 0), False)
        take = Take(self, index, stamp, pose, pose, self.calibrated, nothing, empty, empty.copy())
        delay: float | Floats = sum((formula.delay(take) for formula in formulas), start=0.0)
        if np.any(delay):
            poses = self.route.at(stamp + np.atleast_1d(delay))
            take.poses = poses if len(poses) > 1 else poses[0]
        if not self.on_route and any(type(formula).off is not Formula.off for formula in formulas):
            take.poses = take.poses @ self.off(np.array([stamp]), formulas)[0]
        for formula in formulas:
            mount = formula.mount()
            if mount is not None:
                take.poses = take.poses @ mount
        for formula in formulas:
            take.directions = formula.rays(take, take.directions)
        rays = take.directions.astype(np.float32) if take.directions is not self.calibrated else None
        many = take.poses[None] if take.poses.ndim == 3 else take.poses
        geometry = self.world.caster.cast(self.camera, many, rays=rays, threads=2)
        take.geometry = geometry[0] if take.poses.ndim == 3 else geometry
        take.z = take.geometry.depth.astype(np.float64)
        take.sigma = self.law(take.z, take.geometry.tag)
        return take

    def _add_noise(self, take: Take, formulas: Sequence[Formula]) -> None:
        unit = take.rng("noise").standard_normal(self.camera.shape)
        for formula in formulas:
            unit = formula.field(take, unit)
        there = take.z > 0
        if self.base.sigma:
            d = take.disparity
            d = d + unit * take.sigma * d * d / self.camera.focal_baseline
            take.z = np.where(there, self.inverse(np.maximum(d, 0)), 0)
        else:
            take.z = np.where(there, np.maximum(take.z + unit * take.sigma, 0), 0)
        for formula in formulas:
            formula.tail(take)

    def _make_holes(self, take: Take, formulas: Sequence[Formula], noise: bool) -> None:
        lost = take.rng("holes").random(self.camera.shape) < self.base.rate
        lost &= noise
        for formula in formulas:
            more = formula.lose(take)
            if more is not None:
                lost |= more
        take.z = np.where(lost, 0.0, take.z)

    def units(self, take: Take) -> NDArray[np.uint16]:
        """The finished frame as 16 bits: 0 is a hole, 65535 too far."""
        value = np.floor(np.clip(np.nan_to_num(take.z) / self.camera.depth_scale + 0.5, 0, 65535))
        return value.astype(np.uint16)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist() if value.size <= 16 else f"array of {value.shape}"
    return value.item() if isinstance(value, np.generic) else value
