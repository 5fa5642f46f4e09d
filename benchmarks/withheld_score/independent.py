"""A two-sample test that shares nothing with the diagnosis: do trees tell the recording from a simulation of it?

Boosted trees (scikit-learn) see of every pixel its range, angle, material, place, the error and its size, those of
its neighbours and of the frame before. They learn on half of the frames and are asked about the others. What they know
is the fall of the cross entropy below one bit a pixel: 0 where recording and simulation are alike, 1 where every pixel
gives itself away.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.withheld_score.pixels import Bench, Floats

FRAMES, PIXELS, NULLS = 16, 2500, 3
LEAST = 0.001
"""[bits] What the null is at least: differences below this would need more pixels to be seen at all."""


def told_apart(run: Path, profile: Path) -> dict[str, float]:
    """bits: a pixel by which the recording differs from its simulation with ``profile``; null: the most that any of
    ``NULLS`` further simulations differs from that one."""
    bench = Bench(run, profile, FRAMES)
    frames = [bench.recorded(i) for i in bench.frames], [bench.recorded(max(i - 1, 0)) for i in bench.frames]
    first = _simulated(bench, 101)
    nulls = [_bits(bench, _simulated(bench, 102 + k), first) for k in range(NULLS)]
    return {"bits": _bits(bench, frames, first), "null": max(*nulls, LEAST)}


Pictures = tuple[list[Floats], list[Floats]]
"""Some frames, and the frames before them."""


def _simulated(bench: Bench, seed: int) -> Pictures:
    now = [bench.simulated(bench.effects, i, seed)[0] for i in bench.frames]
    return now, [bench.simulated(bench.effects, max(i - 1, 0), seed)[0] for i in bench.frames]


def _bits(bench: Bench, one: Pictures, other: Pictures) -> float:
    from sklearn.ensemble import HistGradientBoostingClassifier

    rng = np.random.default_rng(0)
    x: list[Floats] = []
    y: list[NDArray[np.integer]] = []
    half: list[NDArray[np.integer]] = []
    for place, index in enumerate(bench.frames):
        pairs = [(now[place], before[place]) for now, before in (one, other)]
        chosen = rng.choice(pairs[0][0].size, min(PIXELS, pairs[0][0].size), replace=False)
        for label, features in enumerate(bench.rows(index, pairs, chosen)):
            x.append(features)
            y.append(np.full(len(chosen), label))
            # Neighbours in time are alike: pairs of frames go together.
            half.append(np.full(len(chosen), place // 2 % 2))
    features, labels, halves = np.concatenate(x), np.concatenate(y), np.concatenate(half)
    found = []
    for learned in (0, 1):
        here, there = halves == learned, halves != learned
        if here.any() and there.any():
            model = HistGradientBoostingClassifier(
                max_iter=60, max_leaf_nodes=15, l2_regularization=5.0, random_state=0
            )
            share = model.fit(features[here], labels[here]).predict_proba(features[there])[:, 1]
            right = np.where(labels[there] == 1, share, 1 - share)
            found.append(1 + float(np.mean(np.log2(np.clip(right, 1e-6, 1)))))
    return float(np.mean(found)) if found else 0.0
