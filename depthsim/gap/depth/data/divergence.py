"""How far the histograms of two runs are apart."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.axis import Axis
from depthsim.gap.depth.data.histograms import BINS

MEASURE = "Jensen-Shannon divergence of the errors' distributions, mean over all axes"
UNIT = "bits per pixel"
Floats = NDArray[np.float64]
_LEAST = 1e-300
"""In place of 0, which has no logarithm to multiply 0 by."""
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
        """(cells,) share of the cell in its axis, over the number of axes that saw anything."""
        in_axis = np.bincount(self.axis_of_cell, totals, self.axes)
        seen = max(int((in_axis > 0).sum()), 1)
        return totals / np.maximum(in_axis[self.axis_of_cell], 1) / seen

    def roots(self, counts: Counted) -> Floats:
        """(size,) square roots of the shares within each cell, each times the root of the cell's weight.

        The squared distance of two of them is what :func:`fit` makes least: twice the mean squared Hellinger distance.
        """
        totals = self.totals(counts)
        per = self.weights(totals) / np.maximum(totals, 1)
        return np.asarray(np.sqrt(counts * per[self.cell_of_bin]))

    def divergence(self, a: Counted, b: Counted) -> Floats:
        """(cells,) Jensen–Shannon divergence of the histograms in each cell [bits], 0 where one is empty."""
        return self._divergence(a, b, self.totals(a))

    def _divergence(self, a: Counted, b: Counted, n: Floats) -> Floats:
        m = self.totals(b)
        filled = np.flatnonzero(a + b)  # a small part of all
        cell = self.cell_of_bin[filled]
        p, q = a[filled] / np.maximum(n, 1)[cell], b[filled] / np.maximum(m, 1)[cell]
        middle = (p + q) / 2
        bits = p * np.log2(np.maximum(p / middle, _LEAST)) + q * np.log2(np.maximum(q / middle, _LEAST))
        return np.where((n > 0) & (m > 0), np.bincount(cell, bits, len(n)) / 2, 0)

    def by_axis(self, a: Counted, b: Counted) -> Floats:
        """(axes,) mean divergence of each axis's cells [bits per pixel]."""
        totals = self.totals(a)
        in_axis = np.bincount(self.axis_of_cell, totals, self.axes)
        summed = np.bincount(self.axis_of_cell, totals * self._divergence(a, b, totals), self.axes)
        return np.asarray(summed / np.maximum(in_axis, 1))

    def over_axes(self, by_axis: Floats, counts: Counted) -> Floats:
        """(...) the mean of by_axis (..., axes) over the axes in which any pixel was counted; 0 if there is none.

        Which axes those are is for the scene, the poses and the mask to say, so they are the same for a recording and
        for whatever sensor is simulated on it, one without any randomness included.
        """
        counted = np.bincount(self.axis_of_cell, self.totals(counts), self.axes) > 0
        return np.asarray(by_axis[..., counted].sum(axis=-1) / max(int(counted.sum()), 1))

    def gap(self, a: Counted, b: Counted) -> float:
        """The gap: the mean over the axes of :meth:`by_axis` [bits per pixel]."""
        return float(self.over_axes(self.by_axis(a, b), a))
