"""How sure the fitted parameters are."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.divergence import Floats, Ruler
from depthsim.gap.depth.data.evidence import Counts, Evidence
from depthsim.gap.depth.fit.optimize import Model, loss, neighbours
from depthsim.gap.resampling import jackknife, jackknife_half, jackknife_variance
from depthsim.sensor.effect import Effect

_LEAST_SHARE = 0.002
"""Of what determines a parameter: an axis with less says nothing of it."""


def parameter_intervals(evidence: Evidence, ruler: Ruler, base: Sequence[Effect], model: Model) -> list[dict[str, Any]]:
    """For each cause its fitted parameters' 95 % intervals; a parameter that its bounds determine has none.

    By the jackknife over blocks of frames: each block is left out of recording and simulation, and the parameters move
    as the last slope of the fit has it. Where the recording has another formula, the axes ask for values that differ by
    more than chance: as much is added, twice their standard deviation (:func:`_disagreement`). A loss with many minima
    has no such slope: there the interval reaches to all :func:`neighbours` that the blocks do not distinguish from the
    best.
    """
    blocks = evidence.train
    if model.jacobian is None or not len(model.x) or len(blocks) < 3:
        return [{} for _ in model.parts]
    real, simulated = evidence.real_counts(blocks), evidence.simulate(model.build(base), blocks)
    slope = model.jacobian
    normal = slope.T @ slope
    inverse = np.linalg.pinv(normal + 1e-9 * np.eye(len(normal)) * max(float(np.trace(normal)), 1e-12))
    toward = slope @ inverse
    axis_of_bin = ruler.axis_of_cell[ruler.cell_of_bin]

    def by_axis(per_bin: Floats) -> Floats:
        """(axes, parameters) sums. per_bin: (bins, parameters)."""
        return np.stack([np.bincount(axis_of_bin, column, ruler.axes) for column in per_bin.T], axis=1)

    def moves(kept: NDArray[np.int64]) -> Floats:
        """(axes, parameters) by how much each axis moves the parameters, if only some blocks are kept."""
        difference = ruler.roots(real[kept].sum(axis=0)) - ruler.roots(simulated[kept].sum(axis=0))
        return by_axis(toward * difference[:, None])

    every = np.arange(len(blocks))
    left_out = np.array([moves(np.delete(every, k)) for k in every])
    # The simulation's own chance is as large as the recording's and is in the differences already.
    apart = _disagreement(moves(every), left_out, by_axis(slope * toward))
    half = np.minimum(np.hypot(jackknife_half(left_out.sum(axis=1)), 2 * apart), 50)
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
            if free.low < free.high or free.whole:
                own[free.label] = [free.decode(least), free.decode(most)]
        at += len(x)
        found.append(own)
    return found


def _disagreement(moves: Floats, left_out: Floats, shares: Floats) -> Floats:
    """(parameters,) the standard deviation of the values that the axes ask for, less what of it is chance.

    moves: (axes, parameters) by how much each axis moves the parameters; left_out: (blocks, axes, parameters) the same
    without each block; shares: (axes, parameters) how much of what determines a parameter is of each axis.

    Source: DerSimonian and Laird, "Meta-Analysis in Clinical Trials", 1986: the variance between studies.
    """
    shares = np.where(shares > _LEAST_SHARE, shares, 0)
    weights = shares / np.maximum(shares.sum(axis=0), 1e-12)
    between = (moves**2 - jackknife_variance(left_out)) / np.maximum(shares, _LEAST_SHARE) ** 2
    return np.asarray(np.sqrt(np.maximum((weights * between).sum(axis=0), 0)))
