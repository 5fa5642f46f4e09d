"""Random smooth motions of a hand-held camera or a drone, as a function of time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from benchmarks.withheld_data.world import World
from depthsim.scenefile import load_scene
from depthsim.trajectory import Trajectory, load_trajectory

Rng = np.random.Generator
Floats = NDArray[np.float64]
AROUND = 1.0
"""[s] A route is known this long before its first and after its last frame."""


@dataclass(eq=False)
class Route:
    """Camera to world as a smooth function of time [s]; the frames lie in 0 to ``duration``."""

    duration: float
    position: CubicSpline
    rotation: RotationSpline

    def at(self, times: ArrayLike) -> Floats:
        """(N, 4, 4) poses."""
        t = np.clip(np.atleast_1d(np.asarray(times, np.float64)), -AROUND, self.duration + AROUND)
        poses = np.zeros((len(t), 4, 4))
        poses[:, :3, :3] = self.rotation(t).as_matrix()
        poses[:, :3, 3] = self.position(t)
        poses[:, 3, 3] = 1
        return poses

    def rates(self, time: float) -> tuple[Floats, Floats]:
        """Velocity [m/s] and angular velocity [rad/s] at a time, both in the camera's axes."""
        step = 1e-3
        before, after = self.at([time - step, time + step])
        velocity = (after[:3, 3] - before[:3, 3]) / (2 * step)
        turn = Rotation.from_matrix(before[:3, :3].T @ after[:3, :3]).as_rotvec() / (2 * step)
        return self.at(time)[0, :3, :3].T @ velocity, turn

    def trajectory(self, stamps: Floats) -> Trajectory:
        """The exact poses at ``stamps``."""
        poses = self.at(stamps)
        return Trajectory(stamps, poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3]).as_quat())


def draw_route(rng: Rng, world: World, duration: float, style: str) -> Route:
    """A random route. style: ``still`` (nearly), ``hand``, ``lively`` (hand-held, faster turns) or ``glide``."""
    if world.kind.startswith("house:"):
        return _along_house(rng, world, duration, style)
    knots = np.arange(-AROUND - 0.5, duration + AROUND + 0.75, 0.25)
    low, high = world.room[0] + (0.35, 0.35, 0.4), world.room[1] - (0.35, 0.35, 0.4)
    high[2] = min(high[2], 2.0)
    start = rng.uniform(low, high)
    # Look across the room, at something that is not too near.
    target = rng.uniform(world.room[0], world.room[1])
    for _ in range(20):
        if np.linalg.norm((target - start)[:2]) > 0.45 * np.linalg.norm(world.room[1, :2]):
            break
        target = rng.uniform(world.room[0], world.room[1])
    target[2] = rng.uniform(0.2, 1.4)
    if style == "glide":
        way = rng.normal(size=3) * (1, 1, 0.2)
        speed = rng.uniform(0.2, min(1.5, 2.0 / max(duration, 0.5)))
        middle = way / np.linalg.norm(way) * speed * (knots - duration / 2)[:, None]
        positions = start + middle + _wander(rng, knots, 0.04, (0.3, 1.2))
    else:
        reach, turns = {"still": (0.004, (0.1, 0.4)), "hand": (0.12, (0.2, 0.8)), "lively": (0.22, (0.4, 1.3))}[style]
        positions = start + _wander(rng, knots, reach, turns)
    positions = np.clip(positions, low, high)
    aim = {"still": 0.004, "hand": 0.25, "lively": 0.7, "glide": 0.3}[style]
    targets = target + _wander(rng, knots, aim, (0.15, 0.9) if style != "lively" else (0.4, 1.4))
    roll = _wander(rng, knots, 0.005 if style == "still" else 0.06, (0.2, 1.0))[:, 0]
    return _route(duration, knots, positions, targets - positions, roll)


def _wander(rng: Rng, t: Floats, reach: float, frequencies: tuple[float, float]) -> Floats:
    """(N, 3) a sum of three sines an axis, about ``reach`` in size [m], frequencies in Hz."""
    f = rng.uniform(*frequencies, (3, 3))
    phase, size = rng.uniform(0, 2 * np.pi, (3, 3)), rng.uniform(0.3, 1.0, (3, 3)) * reach / 1.5
    return np.sum(size * np.sin(2 * np.pi * f * t[:, None, None] + phase), axis=1)


def _along_house(rng: Rng, world: World, duration: float, style: str) -> Route:
    """A part of one of the scene's own routes, slowed to at most 2 m/s and shaken by a hand."""
    known = load_scene(world.kind.split(":")[1])
    name = str(rng.choice([name for name in known.trajectories if name != "stand"]))
    full = load_trajectory(name, known, rate=20.0)
    speed = np.linalg.norm(np.diff(full.positions, axis=0), axis=1).max() * 20.0
    slow = {"still": 0.01, "hand": 0.5, "lively": 1.6, "glide": 1.0}[style] * rng.uniform(0.6, 1.2) / speed
    slow = min(slow, full.duration * 0.9 / (duration + 2 * AROUND + 1))
    begin = rng.uniform(0.02, 0.98) * (full.duration - slow * (duration + 2 * AROUND + 1))
    knots = np.arange(-AROUND - 0.5, duration + AROUND + 0.75, 0.25)
    part = full.at(np.clip(begin + slow * (knots + AROUND + 0.5), 0, full.duration)).matrices()
    shake = 0.002 if style == "still" else 0.02
    turn = {"still": 0.002, "hand": 0.05, "lively": 0.2, "glide": 0.05}[style]
    positions = part[:, :3, 3] + _wander(rng, knots, shake, (0.2, 1.0))
    directions = part[:, :3, 2] + _wander(rng, knots, turn, (0.2, 1.0))
    return _route(duration, knots, positions, directions, _wander(rng, knots, turn / 4, (0.2, 1.0))[:, 0])


def _route(duration: float, knots: Floats, positions: Floats, ahead: Floats, roll: Floats) -> Route:
    z = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frames = np.stack([x, np.cross(z, x), z], axis=2)
    rolled = Rotation.from_matrix(frames) * Rotation.from_rotvec(roll[:, None] * (0.0, 0.0, 1.0))
    return Route(duration, CubicSpline(knots, positions), RotationSpline(knots, rolled))
