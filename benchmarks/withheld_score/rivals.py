"""Two ways that a user would try to find the cause with what is at hand."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.materials import load_materials
from depthsim.raycast import Caster, Geometry
from depthsim.runs import Run
from depthsim.scenefile import load_scene
from depthsim.sensor import Effect, Sensor, effect_class, effect_ids, load_profile
from depthsim.sensor.motion import Motion

FRAMES = 6
NO_GAP = "no gap"
Floats = NDArray[np.float64]

NAMED_BY: dict[str, str] = {
    "range": "disparity_noise",
    "incidence": "incidence_noise",
    "material": "material_noise",
    "u": "invalid_band",
    "v": "rolling_shutter",
    "radius": "vignetting_noise",
    "edge": "flying_pixels",
    "height": "ambient_light",
    "validity": "fill_rate",
    "residual": "baseline_scale",
    "size": "heavy_tails",
    "left": "spatial_correlation",
    "up": "spatial_correlation",
    "previous": "temporal_correlation",
    "fraction": "subpixel_bias",
    "time": "thermal_drift",
    "speed": "motion_noise",
}
"""What a user would take each feature of the classifier for."""


class _Bench:
    """A run beside simulations of it."""

    def __init__(self, run: Path, profile: Path) -> None:
        self.run = Run.open(run)
        assert self.run.scene is not None
        self.scene = load_scene(self.run.scene)
        self.caster = Caster(self.scene)
        self.effects = load_profile(profile).effects
        self.motion = Motion.along(self.run.trajectory, self.run.truth)
        step = max(1, len(self.run) // FRAMES)
        self.frames = list(range(0, len(self.run), step))[:FRAMES]

    def simulated(self, effects: tuple[Effect, ...], index: int) -> tuple[Floats, Geometry]:
        """Depth [m] and clean geometry of a frame."""
        sensor = Sensor(self.caster, self.run.camera, effects)
        stamp = float(self.run.stamps[index])
        measured = sensor.measure(self.run.poses[index], index=index, stamp=stamp, seed=77, motion=self.motion)
        units = measured.depth_raw.astype(np.float64)
        return np.where(units == 65535, 0, units * self.run.camera.depth_scale), measured.clean


def by_rmse(run: Path, profile: Path) -> str:
    """The effect, at its default values, whose addition lowers the depth RMSE most; ``no gap`` where none does."""
    bench = _Bench(run, profile)

    def rmse(effects: tuple[Effect, ...]) -> float:
        total, count = 0.0, 0
        for index in bench.frames:
            simulated, _ = bench.simulated(effects, index)
            real = bench.run.depth(index).astype(np.float64)
            both = (simulated > 0) & (real > 0)
            total, count = total + float(np.sum((simulated - real)[both] ** 2)), count + int(both.sum())
        return float(np.sqrt(total / max(count, 1)))

    there = {effect.id for effect in bench.effects}
    best, name = rmse(bench.effects), NO_GAP
    for effect in effect_ids():
        if effect not in there:
            value = rmse((*bench.effects, effect_class(effect)()))
            best, name = (value, effect) if value < best else (best, name)
    return name


def by_importance(run: Path, profile: Path) -> str:
    """The effect of the feature with the highest permutation importance in a classifier of real against simulated."""
    from sklearn.ensemble import HistGradientBoostingClassifier
    from sklearn.inspection import permutation_importance
    from sklearn.metrics import roc_auc_score

    bench = _Bench(run, profile)
    rng = np.random.default_rng(0)
    samples, labels, halves = [], [], []
    for place, index in enumerate(bench.frames):
        simulated, clean = bench.simulated(bench.effects, index)
        before = max(index - 1, 0)
        previous_simulated, previous_clean = bench.simulated(bench.effects, before)
        chosen = rng.choice(simulated.size, min(2500, simulated.size), replace=False)
        real, previous = bench.run.depth(index).astype(float), bench.run.depth(before).astype(float)
        for label, depth, last in ((1, real, previous), (0, simulated, previous_simulated)):
            features = _features(bench, index, depth, clean, last, previous_clean)
            samples.append(features.reshape(len(features), -1)[:, chosen].T)
            labels.append(np.full(len(chosen), label))
            halves.append(np.full(len(chosen), place % 2))
    x, y, half = np.concatenate(samples), np.concatenate(labels), np.concatenate(halves)
    model = HistGradientBoostingClassifier(max_iter=60, random_state=0).fit(x[half == 0], y[half == 0])
    test_x, test_y = x[half == 1], y[half == 1]
    # Within what chance gives, a user would say that there is nothing.
    if roc_auc_score(test_y, model.predict_proba(test_x)[:, 1]) < 0.51:
        return NO_GAP
    found = permutation_importance(model, test_x, test_y, scoring="neg_log_loss", n_repeats=2, random_state=0)
    return NAMED_BY[list(NAMED_BY)[int(np.argmax(found.importances_mean))]]


def _features(bench: _Bench, index: int, depth: Floats, clean: Geometry, last: Floats, last_clean: Geometry) -> Floats:
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
    linear, angular = bench.motion.speeds(float(bench.run.stamps[index]))
    flat = np.ones_like(z)
    return np.stack(
        [
            z, np.degrees(np.arccos(np.clip(clean.cosine, 0, 1))), m[clean.tag], u, v, np.hypot(*camera.rays), edge,
            height, there, residual, np.abs(residual), left, up, before, measured % 1.0,
            bench.run.stamps[index] * flat, (linear + angular) * flat,
        ]
    )  # fmt: skip
