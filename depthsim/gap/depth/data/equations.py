"""Normal equations of a rigid motion and nuisances, from the pixels of a frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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


def equations(slopes: Floats, target: Floats, weight: Floats, pixels: NDArray[np.intp]) -> Equations:
    """Of (all, nuisances) slopes, of which the first six are of a rigid motion, and (all,) errors and weights; of some
    of the pixels."""
    nn, n = np.zeros((slopes.shape[1],) * 2), np.zeros(slopes.shape[1])
    _gather(pixels, slopes, weight, target, nn, n)
    return Equations(nn[:6, :6], nn[:6], nn, n[:6], n)


@kernel
def _gather(pixels, columns, weight, target, whole, right):
    """whole += columns' · weight · columns, right += columns' · weight · target; BLAS's threads would be in the way.

    Four pixels at a time, because loading and storing ``whole`` costs as much as a term.
    """
    count = columns.shape[1]
    fours = pixels.size // 4 * 4
    for k in range(0, fours, 4):
        p, q, r, s = pixels[k], pixels[k + 1], pixels[k + 2], pixels[k + 3]
        a, b, c, d = columns[p], columns[q], columns[r], columns[s]
        for i in range(count):
            e, f, g, h = weight[p] * a[i], weight[q] * b[i], weight[r] * c[i], weight[s] * d[i]
            right[i] += (e * target[p] + f * target[q]) + (g * target[r] + h * target[s])
            line = whole[i]
            for j in range(count):
                line[j] += (e * a[j] + f * b[j]) + (g * c[j] + h * d[j])
    for k in range(fours, pixels.size):
        p = pixels[k]
        a = columns[p]
        for i in range(count):
            e = weight[p] * a[i]
            right[i] += e * target[p]
            line = whole[i]
            for j in range(count):
                line[j] += e * a[j]


def together(parts: Sequence[Equations]) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """jj, jn, nn, j, n of some parts together."""
    jj, jn, nn, j, n = (
        np.sum([getattr(part, name) for part in parts], axis=0) for name in ("jj", "jn", "nn", "j", "n")
    )
    return jj, jn, nn, j, n
