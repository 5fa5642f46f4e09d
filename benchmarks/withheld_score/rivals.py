"""Two ways that a user would try to find the cause with what is at hand."""

from pathlib import Path

import numpy as np

from benchmarks.withheld_score.pixels import Bench
from depthsim.sensor import Effect, effect_class, effect_ids

FRAMES = 6
NO_GAP = "no gap"

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


def by_rmse(run: Path, profile: Path) -> str:
    """The effect, at its default values, whose addition lowers the depth RMSE most; ``no gap`` where none does."""
    bench = Bench(run, profile, FRAMES)

    def rmse(effects: tuple[Effect, ...]) -> float:
        total, count = 0.0, 0
        for index in bench.frames:
            simulated, _ = bench.simulated(effects, index)
            real = bench.recorded(index)
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

    bench = Bench(run, profile, FRAMES)
    rng = np.random.default_rng(0)
    samples, labels, halves = [], [], []
    for place, index in enumerate(bench.frames):
        before = max(index - 1, 0)
        simulated, previous = (bench.simulated(bench.effects, at)[0] for at in (index, before))
        chosen = rng.choice(simulated.size, min(2500, simulated.size), replace=False)
        pairs = [(bench.recorded(index), bench.recorded(before)), (simulated, previous)]
        for label, features in zip((1, 0), bench.rows(index, pairs, chosen), strict=True):
            samples.append(features)
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
