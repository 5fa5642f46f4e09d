"""What two-sample tests look at: pixels of a recording beside those of simulations of it, as rows of features."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.materials import load_materials
from depthsim.raycast import Caster, Geometry
from depthsim.runs import Run
from depthsim.scenefile import load_scene
from depthsim.sensor import Effect, Sensor, load_profile
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import camera_for

Floats = NDArray[np.float64]


class Bench:
    """A run beside simulations of it."""

    def __init__(self, run: Path, profile: Path, most: int) -> None:
        """most: how many frames are looked at, spread over the run."""
        self.run = Run.open(run)
        assert self.run.scene is not None
        self.scene = load_scene(self.run.scene)
        self.caster = Caster(self.scene)
        self.effects = load_profile(profile).effects
        self.motion = Motion.along(self.run.trajectory, self.run.truth)
        step = max(1, len(self.run) // most)
        self.frames = list(range(0, len(self.run), step))[:most]

    def simulated(self, effects: tuple[Effect, ...], index: int, seed: int = 77) -> tuple[Floats, Geometry]:
        """Depth [m] and clean geometry of a frame."""
        sensor = Sensor(self.caster, camera_for(self.run.camera, effects), effects)
        stamp = float(self.run.stamps[index])
        measured = sensor.measure(self.run.poses[index], index=index, stamp=stamp, seed=seed, motion=self.motion)
        units = measured.depth_raw.astype(np.float64)
        return np.where(units == 65535, 0, units * self.run.camera.depth_scale), measured.clean

    def recorded(self, index: int) -> Floats:
        """Depth of a frame of the recording [m]."""
        return np.asarray(self.run.depth(index), np.float64)

    def rows(self, index: int, depths: list[tuple[Floats, Floats]], chosen: NDArray[np.integer]) -> list[Floats]:
        """Of each (frame, frame before it) the features of the ``chosen`` pixels, (pixels, features)."""
        before = max(index - 1, 0)
        clean, last_clean = (self.simulated(self.effects, at)[1] for at in (index, before))
        found = [_features(self, index, depth, clean, last, last_clean) for depth, last in depths]
        return [features.reshape(len(features), -1)[:, chosen].T for features in found]


def _features(bench: Bench, index: int, depth: Floats, clean: Geometry, last: Floats, last_clean: Geometry) -> Floats:
    """(features, height, width), in the order of NAMED_BY."""
    camera = bench.run.camera
    z = clean.depth.astype(np.float64)
    there = (depth > 0) & (z > 0)
    residual = np.where(there, depth - z, np.nan)
    before = np.where((last > 0) & (last_clean.depth > 0), last - last_clean.depth, np.nan)
    v, u = np.mgrid[: camera.height, : camera.width].astype(np.float64)
    left, up = np.full_like(z, np.nan), np.full_like(z, np.nan)
    left[:, 1:], up[1:] = residual[:, :-1], residual[:-1]
    disparity = np.divide(camera.focal_baseline, z, out=np.zeros_like(z), where=z > 0)
    edge = np.hypot(*np.gradient(disparity))
    measured = np.divide(camera.focal_baseline, depth, out=np.zeros_like(z), where=depth > 0)
    pose = bench.run.poses[index]
    height = pose[2, 3] + z * (pose[2, 0] * camera.rays[0] + pose[2, 1] * camera.rays[1] + pose[2, 2])
    m = np.array([*(load_materials()[tag].m for tag in bench.scene.tags), *[0.0] * (256 - len(bench.scene.tags))])
    linear, angular = (np.linalg.norm(v) for v in bench.motion.velocity(float(bench.run.stamps[index])))
    flat = np.ones_like(z)
    return np.stack(
        [
            z, np.degrees(np.arccos(np.clip(clean.cosine, 0, 1))), m[clean.tag], u, v, np.hypot(*camera.rays), edge,
            height, there, residual, np.abs(residual), left, up, before, measured % 1.0,
            bench.run.stamps[index] * flat, (linear + angular) * flat,
        ]
    )  # fmt: skip
