"""What a correction that knows one axis, and no formula, would close of the gap on frames held out.

It gives every simulated pixel the weight with which its error, in its cell of the axis, is commoner in the recording;
then all axes are measured again with those weights. Where no effect of the bank explains the gap, this is what an
effect that depends on the axis alone could close.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Seed
from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.simulate import LOCATING
from depthsim.sensor.effect import Effect

Floats = NDArray[np.float64]
_LEARNING = Seed("learning")


def learnable(evidence: Evidence, ruler: Ruler, effects: Sequence[Effect], axes: Sequence[int]) -> dict[int, float]:
    """For each of ``axes`` the share of the gap of a sensor with ``effects`` that a correction along it closes."""
    train = evidence.simulate(effects, evidence.train, seed=_LEARNING).sum(axis=0).astype(np.float64)
    real_train = evidence.real_counts(evidence.train).sum(axis=0).astype(np.float64)
    held_out = evidence.test[:: max(1, round(len(evidence.test) / 3))]
    real = evidence.real_counts(held_out).sum(axis=0)
    pictures = {block: evidence.pictures(effects, block, seed=LOCATING[0]) for block in held_out}
    plain, another = (evidence.simulate(effects, held_out, seed=seed).sum(axis=0) for seed in LOCATING)
    gap, floor = ruler.gap(real, plain), ruler.gap(another, plain)
    return {
        axis: _closes(evidence, ruler, real, pictures, gap, floor, _correction(evidence, axis, real_train, train))
        for axis in axes
    }


def _closes(
    evidence: Evidence,
    ruler: Ruler,
    real: NDArray[np.integer],
    pictures: dict[int, list[NDArray[np.uint16]]],
    gap: float,
    floor: float,
    correction: tuple[object, ...],
) -> float:
    """The share of the gap that a correction closes on the frames held out."""

    def corrected(block: int) -> Floats:
        return evidence.recount(block, pictures[block], correction)

    after = ruler.gap(real, np.sum(evidence.each(corrected, list(pictures)), axis=0))
    return (gap - after) / (gap - floor) if gap > floor else 0.0


def _correction(evidence: Evidence, number: int, real: Floats, simulated: Floats) -> tuple[object, ...]:
    """What :func:`counting.count_corrected` needs: how much commoner each bin is in the recording, cell by cell."""
    limit = evidence.config.where
    a, b = (evidence.cells(number, counts) for counts in (real, simulated))
    # Bins with little in them are drawn to what the axis has as a whole.
    prior_a, prior_b = ((x.sum(axis=0) + 1e-9) / max(x.sum(), 1) for x in (a, b))
    share_a, share_b = (
        (x + limit.softening * prior) / np.maximum(x.sum(axis=1, keepdims=True) + limit.softening, 1e-9)
        for x, prior in ((a, prior_a), (b, prior_b))
    )
    ratio = np.clip(share_a / np.maximum(share_b, 1e-12), 0, limit.largest_weight)
    excess = np.maximum(share_a - ratio * share_b, 0)
    excess[excess < 1e-5] = 0
    most = (excess > 0).sum(axis=1)
    return number, int(evidence.offsets[number]), ratio.reshape(-1), excess.reshape(-1), most
