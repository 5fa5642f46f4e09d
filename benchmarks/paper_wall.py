"""The paper's wall on a rail: what the sensor of section 2 gives there, and the law it is held against."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import truncnorm

from depthsim.camera import Camera
from depthsim.materials import Material, Materials
from depthsim.presets import PRESETS
from depthsim.raycast import Caster
from depthsim.scene import Scene
from depthsim.sensor import Sensor, load_profile
from depthsim.sensor.sensor import Measurement
from depthsim.units import SATURATED

Floats = NDArray[np.float64]

FLOOR, NEAR, FAR = 0.005, 0.5, 8.0
WIDTH, HEIGHT = 460, 320
M = {"cement": 0.35, "formboard": 0.50, "plastic": 0.85}
"""[1/m] as the paper's text has them."""
REAL_D435 = ((0.84, 0.004), (1.7, 0.015), (3.1, 0.053))
"""(distance, std) [m] of a real D435: disparity noise of 0.04 to 0.06 px at every range, so std grows as d²."""
SEED = 2023


@dataclass(frozen=True)
class Series:
    """One material along the rail; every array has one value for each distance [m]."""

    distance: Floats
    std: Floats
    zeros: Floats
    """share of the pixels without a return: the holes asked for, and depths that the noise took below 0"""
    saturated: Floats

    def until(self, far: float) -> NDArray[np.bool_]:
        """Which distances are at most ``far`` [m]."""
        return self.distance <= far + 1e-9


def wall(tag: str) -> Scene:
    """A wall of 60 by 60 m at x = 0."""
    corners = np.array([[0, -30, -30], [0, 30, -30], [0, 30, 30], [0, -30, 30]], np.float64)
    faces = np.array([[0, 2, 1], [0, 3, 2]], np.uint32)
    return Scene("wall", corners, faces, np.zeros(2, np.uint8), (tag,))


def camera() -> Camera:
    """460x320 with the D435's baseline and its nominal 87 degrees across the width."""
    d435 = PRESETS["d435"]
    focal = WIDTH / 2 / np.tan(np.radians(d435.fov[0] / 2))
    keys = {"width": WIDTH, "height": HEIGHT, "fx": focal, "fy": focal, "baseline": d435.baseline}
    return Camera.model_validate(keys | {"cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2, "name": "D435 460x320"})


def pose(distance: float) -> Floats:
    """The camera at -distance on the x axis, looking along it, upright."""
    return np.array([[0, 0, 1, -distance], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]], np.float64)


def sensor(tag: str) -> Sensor:
    """The paper's sensor before a wall of one material."""
    materials = Materials({name: Material.model_validate({"m": m}) for name, m in M.items()})
    return Sensor(Caster(wall(tag)), camera(), load_profile("paper").effects, materials)


def law(tag: str, distance: Floats) -> Floats:
    """std of the paper's law [m]."""
    return np.asarray(FLOOR * np.exp(M[tag] * distance))


def measure(tag: str, distances: Floats) -> Series:
    """Drive along the rail and take the std of the depth error over each image."""
    eye = sensor(tag)
    rows, last = [], None
    for index, distance in enumerate(distances):
        last = eye.measure(pose(distance), index=index, seed=SEED, threads=1, out=last)
        rows.append(_statistics(last, eye.camera.depth_scale))
    std, zeros, saturated = np.array(rows).T
    return Series(distances, std, zeros, saturated)


def _statistics(frame: Measurement, unit: float) -> tuple[float, float, float]:
    returned = (frame.depth_raw > 0) & (frame.depth_raw < SATURATED)
    error = frame.depth_raw[returned] * unit - frame.clean.depth[returned].astype(np.float64)
    return float(error.std()), float((frame.depth_raw == 0).mean()), float((frame.depth_raw == SATURATED).mean())


def r2(data: Floats, model: Floats) -> float:
    """Coefficient of determination, 1 - Σ(data - model)² / Σ(data - mean)²."""
    return float(1 - ((data - model) ** 2).sum() / ((data - data.mean()) ** 2).sum())


def clipped_std(tag: str, distance: Floats) -> Floats:
    """std of the law's Gaussian where what is below half a unit is a hole [m]."""
    std = law(tag, distance)
    return np.asarray(std * truncnorm.std((0.0005 - distance) / std, np.inf))


def first_off(series: Series, tag: str, share: float = 0.01) -> float | None:
    """From which distance [m] on every std is off the law by more than ``share``; None if the last is not."""
    near = np.flatnonzero(np.abs(series.std / law(tag, series.distance) - 1) <= share)
    after = near[-1] + 1 if near.size else 0
    return float(series.distance[after]) if after < series.distance.size else None


def real_d435(distance: Floats) -> Floats:
    """std of a real D435, k·d² through its three figures [m]."""
    d, std = np.array(REAL_D435).T
    return np.asarray(np.exp(np.mean(np.log(std / d**2))) * distance**2)
