"""Normal equations of a rigid motion and nuisances, from the pixels of a frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthsim.gap.depth.data.rigid import Floats
from depthsim.kernels import kernel


@dataclass
class Equations:
    """Normal equations of some pixels. jj, jn, nn: information of rigid motion and nuisances; j, n: right sides."""

    jj: Floats
    jn: Floats
    nn: Floats
    j: Floats
    n: Floats

    def left(self, beta: Floats) -> Floats:
        """(6,) the right side without the nuisances."""
        return self.j - self.jn @ beta


def equations(rigid: Floats, nuisance: Floats, target: Floats, weight: Floats) -> Equations:
    """Of (pixels, 6) and (pixels, nuisances) slopes, (pixels,) errors and weights."""
    both = np.hstack([rigid, nuisance])
    whole, right = np.zeros((both.shape[1],) * 2), np.zeros(both.shape[1])
    _gather(both, weight, target, whole, right)
    return Equations(whole[:6, :6], whole[:6, 6:], whole[6:, 6:], right[:6], right[6:])


@kernel
def _gather(columns, weight, target, whole, right):
    """whole += columns' · weight · columns, right += columns' · weight · target; BLAS's threads would be in the way."""
    count = columns.shape[1]
    for p in range(columns.shape[0]):
        row = columns[p]
        for i in range(count):
            heavy = weight[p] * row[i]
            right[i] += heavy * target[p]
            line = whole[i]
            for j in range(count):
                line[j] += heavy * row[j]


def together(parts: Sequence[Equations]) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """jj, jn, nn, j, n of some parts together."""
    jj, jn, nn, j, n = (
        np.sum([getattr(part, name) for part in parts], axis=0) for name in ("jj", "jn", "nn", "j", "n")
    )
    return jj, jn, nn, j, n
