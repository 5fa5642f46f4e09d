"""How sure the fitted parameters are."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.evidence import Counts, Evidence
from depthsim.gap.depth.fit.optimize import Model, loss, neighbours
from depthsim.gap.resampling import jackknife, jackknife_half
from depthsim.sensor.effect import Effect


def parameter_intervals(evidence: Evidence, ruler: Ruler, base: Sequence[Effect], model: Model) -> list[dict[str, Any]]:
    """For each cause its fitted parameters' 95 % intervals, by the jackknife over blocks of frames.

    Each block is left out of recording and simulation, and the parameters move as the last slope of the fit has it. A
    loss with many minima has no such slope: there the interval reaches to all :func:`neighbours` that the blocks do not
    distinguish from the best.
    """
    blocks = evidence.train
    if model.jacobian is None or not len(model.x) or len(blocks) < 3:
        return [{} for _ in model.parts]
    real, simulated = evidence.real_counts(blocks), evidence.simulate(model.build(base), blocks)
    slope = model.jacobian
    normal = slope.T @ slope
    inverse = np.linalg.pinv(normal + 1e-9 * np.eye(len(normal)) * max(float(np.trace(normal)), 1e-12))
    moved = []
    for left_out in range(len(blocks)):
        kept = np.delete(np.arange(len(blocks)), left_out)
        difference = ruler.roots(real[kept].sum(axis=0)) - ruler.roots(simulated[kept].sum(axis=0))
        moved.append(inverse @ (slope.T @ difference))
    # The simulation's own chance is as large as the recording's and is in the differences already.
    half = np.minimum(jackknife_half(np.array(moved)), 50)
    low, high = model.x - half, model.x + half

    def worse(there: Counts, kept: NDArray[np.int64]) -> float:
        target, *both = (ruler.roots(counts[kept].sum(axis=0)) for counts in (real, there, simulated))
        return loss(target, both[0]) - loss(target, both[1])

    for k, x in neighbours(model):
        there = evidence.simulate(model.build(base, x), blocks)
        if jackknife(partial(worse, there), len(blocks))[1][0] <= 0:
            low[k], high[k] = min(low[k], x[k]), max(high[k], x[k])
    found: list[dict[str, Any]] = []
    at = 0
    for part, x in zip(model.parts, model.split(model.x), strict=True):
        own: dict[str, Any] = {}
        for free, least, most in zip(part.free, low[at : at + len(x)], high[at : at + len(x)], strict=True):
            own[free.label] = [free.decode(least), free.decode(most)]
        at += len(x)
        found.append(own)
    return found
