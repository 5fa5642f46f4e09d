"""How far the histograms of two runs are apart."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.axis import Axis
from depthsim.gap.depth.data.histograms import BINS
from depthsim.kernels import kernel

MEASURE = "Jensen-Shannon divergence of the errors' distributions, mean over all axes"
UNIT = "bits per pixel"
Floats = NDArray[np.float64]
_LEAST = 1e-300
"""In place of 0, which has no logarithm to multiply 0 by."""
_FEW = 0.02
"""Of the pixels: an axis that counts fewer has less weight, in proportion."""
Counted = NDArray[np.integer] | NDArray[np.float64]
"""(size,) how many pixels are in each bin; weighted ones are no whole numbers."""


@dataclass(frozen=True)
class Ruler:
    """Measures in the axes of one diagnosis.

    starts: where each cell begins in the counts; axis_of_cell: which axis it belongs to; cell_of_bin likewise.
    """

    starts: NDArray[np.int64]
    axis_of_cell: NDArray[np.int64]
    cell_of_bin: NDArray[np.int64]
    axes: int

    @classmethod
    def of(cls, axes: list[Axis]) -> "Ruler":
        """The ruler of these axes."""
        bins = np.concatenate([np.full(axis.size, BINS[axis.kind]) for axis in axes])
        starts = np.concatenate([[0], np.cumsum(bins)[:-1]])
        axis_of_cell = np.concatenate([np.full(axis.size, w) for w, axis in enumerate(axes)])
        return cls(starts, axis_of_cell, np.repeat(np.arange(len(bins)), bins), len(axes))

    def totals(self, counts: Counted) -> Floats:
        """(cells,) how many pixels were counted."""
        return np.asarray(np.add.reduceat(counts.astype(np.float64), self.starts))

    def weights(self, totals: Floats) -> Floats:
        """(cells,) share of the cell in its axis, times that axis' own weight, see :meth:`_of_axes`."""
        in_axis = np.bincount(self.axis_of_cell, totals, self.axes)
        per: Floats = self._of_axes(totals) / np.maximum(in_axis, 1)
        return np.asarray(totals * per[self.axis_of_cell])

    def roots(self, counts: Counted) -> Floats:
        """(size,) square roots of the shares within each cell, each times the root of the cell's weight.

        The squared distance of two of them is what :func:`fit` makes least: twice the mean squared Hellinger distance.
        """
        totals = self.totals(counts)
        per = self.weights(totals) / np.maximum(totals, 1)
        return np.asarray(np.sqrt(counts * per[self.cell_of_bin]))

    def divergence(self, a: Counted, b: Counted) -> Floats:
        """(cells,) Jensen–Shannon divergence of the histograms in each cell [bits], 0 where one is empty."""
        shares, ratios = np.empty((2, len(a))), np.empty((2, len(a)))
        _shares(np.asarray(a, np.float64), np.asarray(b, np.float64), self.starts, shares, ratios)
        shares *= np.log2(ratios, out=ratios)
        return np.maximum(np.add.reduceat(shares[0] + shares[1], self.starts) / 2, 0)

    def by_axis(self, a: Counted, b: Counted) -> Floats:
        """(axes,) mean divergence of each axis's cells [bits per pixel]."""
        totals = self.totals(a)
        in_axis = np.bincount(self.axis_of_cell, totals, self.axes)
        summed = np.bincount(self.axis_of_cell, totals * self.divergence(a, b), self.axes)
        return np.asarray(summed / np.maximum(in_axis, 1))

    def over_axes(self, by_axis: Floats, counts: Counted) -> Floats:
        """(...) the mean of by_axis (..., axes), weighted by :meth:`_of_axes`; 0 if no pixel was counted.

        How many pixels an axis has is for the scene, the poses and the mask to say, so it is the same for a recording
        and for whatever sensor is simulated on it, one without any randomness included.
        """
        return np.asarray((by_axis * self._of_axes(self.totals(counts))).sum(axis=-1))

    def _of_axes(self, totals: Floats) -> Floats:
        """(axes,) the weight of each axis, with a sum of 1, or 0 without pixels.

        The same for all but those that count few pixels, such as edges before one wall: they have mostly chance.
        """
        pixels = np.asarray(np.bincount(self.axis_of_cell, totals, self.axes), np.float64)
        weight = np.minimum(pixels / max(_FEW * float(pixels.max(initial=0)), 1.0), 1)
        return np.asarray(weight / max(float(weight.sum()), 1e-12))

    def gap(self, a: Counted, b: Counted) -> float:
        """The gap: the mean over the axes of :meth:`by_axis` [bits per pixel]."""
        return float(self.over_axes(self.by_axis(a, b), a))


@kernel
def _shares(a, b, starts, shares, ratios):
    """(2, size) the share of each bin in its cell, in ``a`` and ``b``, and its ratio to the mean of both; no shares in
    cells that one has not."""
    for cell in range(starts.size):
        begin, end = starts[cell], starts[cell + 1] if cell + 1 < starts.size else a.size
        x, y, p, q = a[begin:end], b[begin:end], shares[0, begin:end], shares[1, begin:end]
        r, s = ratios[0, begin:end], ratios[1, begin:end]
        n, m = x.sum(), y.sum()
        in_both = n > 0 and m > 0
        n, m = 1 / n if in_both else 0.0, 1 / m if in_both else 0.0
        for k in range(x.size):  # without branches, which the vector unit has none of
            p[k], q[k] = x[k] * n, y[k] * m
            both = max(p[k] + q[k], _LEAST)
            r[k], s[k] = max(2 * p[k] / both, _LEAST), max(2 * q[k] / both, _LEAST)  # 1 of what is alike
