"""How sure the fitted parameters are."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.resampling import jackknife_half
from depthsim.sensor.effect import Effect


def parameter_intervals(evidence: Evidence, ruler: Ruler, base: Sequence[Effect], model: Model) -> list[dict[str, Any]]:
    """For each cause its fitted parameters' 95 % intervals, by the jackknife over blocks of frames.

    Each block is left out of recording and simulation, and the parameters move as the last slope of the fit has it.
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
    found: list[dict[str, Any]] = []
    at = 0
    for part, x in zip(model.parts, model.split(model.x), strict=True):
        own: dict[str, Any] = {}
        for free, value, width in zip(part.free, x, half[at : at + len(x)], strict=True):
            own[free.label] = [free.decode(value - width), free.decode(value + width)]
        at += len(x)
        found.append(own)
    return found
