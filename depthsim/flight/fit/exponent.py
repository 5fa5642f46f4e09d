"""Whether the flights distinguish drag that grows with thrust from drag that does not."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthsim.flight.fit.motion import Motion
from depthsim.flight.fit.sums import Sums, identified, interval95, solve
from depthsim.flight.table import Floats


@dataclass(frozen=True)
class Exponent:
    """Drag ∝ v · T^exponent about the mean thrust: 0 for the linear law, 1/2 for √T and for kT + b.

    variation: standard deviation of the thrust over its mean, in the air.
    """

    value: float
    low: float
    high: float
    variation: float


def thrust_exponent(motions: Sequence[Motion], thrusts: Sequence[Floats], mass: float) -> Exponent | None:
    """The exponent from some flights, or None where thrust or speed does not vary. thrusts: (N, K) [N] of each."""
    totals = [thrust.sum(axis=1) for thrust in thrusts]
    inside = [motion.smooth(total) for motion, total in zip(motions, totals, strict=True)]
    mean = float(np.concatenate(inside).mean())
    if not mean > 0.1 * mass:
        return None
    blocks = []
    for motion, total in zip(motions, totals, strict=True):
        v = motion.velocity[:, :2]
        columns = np.zeros((len(v), 2, 3))
        columns[:, 0, 0], columns[:, 1, 1] = -v[:, 0], -v[:, 1]
        columns[:, :, 2] = -(total / mean - 1)[:, None] * v
        y = motion.force[:, :2]
        blocks.append(Sums.of_blocks(y, motion.smooth(columns), np.ones_like(y), motion.rate))
    whole = Sums.stacked([flight.total() for flight in blocks])
    if not identified(whole):
        return None
    theta, (low, high) = solve(whole), interval95(blocks)
    drag = theta[:2].mean()
    if not drag > 0:
        return None
    variation = float(np.concatenate(inside).std() / mean)
    return Exponent(float(theta[2] / drag), float(low[2] / drag), float(high[2] / drag), variation)
