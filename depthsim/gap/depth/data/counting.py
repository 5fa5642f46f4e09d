"""Counting: each pixel's bin into the histogram of its cell, along every axis at once."""

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.histograms import ACROSS, BEFORE, BINS, FAR_LEFT, FAR_UP, LAG_LEFT, LAG_UP, LEFT, UP
from depthsim.kernels import kernel

NO_CELL = np.uint16(65535)
SPARE = int(BINS.max())
"""How many counts lie beyond those of the axes: what is counted nowhere is counted there."""


def places(
    cells: NDArray[np.uint16],
    kinds: NDArray[np.int64],
    offsets: NDArray[np.int64],
    size: int,
    *,
    rows: NDArray[np.integer],
    across: NDArray[np.float32],
    follows: bool,
) -> NDArray[np.unsignedinteger]:
    """(axes, pixels): where the histogram of each pixel's cell begins in the counts; ``size`` is nowhere.

    cells: (axes, pixels), NO_CELL where a pixel is not counted. kinds, offsets: of each axis, see ``axis.layout``.
    rows: the rows of the picture that the pixels make up; across: (pixels,) the depth beyond an edge, 0 where there is
    none; follows: whether the frame before is known.
    """
    pixels = cells.shape[1]
    v, u = np.repeat(rows, pixels // len(rows)), np.tile(np.arange(pixels // len(rows)), len(rows))
    has = {LEFT: u >= 1, UP: v >= 1, FAR_LEFT: u >= LAG_LEFT, FAR_UP: v >= LAG_UP, ACROSS: across > 0}
    has[BEFORE] = np.full(pixels, follows)
    out = np.empty(cells.shape, np.uint16 if size + SPARE < 65536 else np.uint32)
    for w, kind in enumerate(kinds):
        counted = cells[w] != NO_CELL
        if int(kind) in has:
            counted &= has[int(kind)]
        out[w] = np.where(counted, offsets[w] + cells[w].astype(np.int64) * BINS[kind], size)
    return out


@kernel
def count(codes, kinds, places, counts):  # noqa: ANN201 - numba
    """Add a frame to ``counts``: (size + SPARE,). codes: (kinds, pixels), places: (axes, pixels).

    Four pixels far apart in turn: neighbours often fall into one bin, and an addition waits for the last to the same.
    """
    part = places.shape[1] // 4
    for w in range(kinds.size):
        bins, begin = codes[kinds[w]], places[w]
        a, b, c, d = begin[:part], begin[part : 2 * part], begin[2 * part : 3 * part], begin[3 * part : 4 * part]
        e, f, g, h = bins[:part], bins[part : 2 * part], bins[2 * part : 3 * part], bins[3 * part : 4 * part]
        for k in range(part):
            counts[np.int64(a[k]) + np.int64(e[k])] += np.uint32(1)
            counts[np.int64(b[k]) + np.int64(f[k])] += np.uint32(1)
            counts[np.int64(c[k]) + np.int64(g[k])] += np.uint32(1)
            counts[np.int64(d[k]) + np.int64(h[k])] += np.uint32(1)
        for k in range(4 * part, begin.size):
            counts[np.int64(begin[k]) + np.int64(bins[k])] += np.uint32(1)


@kernel
def count_corrected(codes, kinds, places, counts, axis, begin, ratio, excess, most):  # noqa: ANN201 - numba
    """As :func:`count`, corrected along one axis; counts are float64.

    Each pixel has the weight ``ratio`` of its bin there; ``excess`` is the share of the bins that the simulator
    (almost) never fills, which no weight could bring: every pixel of the cell gets it in the axes of the same kind.
    begin: where the axis's counts begin; most: (cells,) the number of such bins.
    """
    many, nowhere = BINS[kinds[axis]], counts.size - SPARE
    for k in range(places.shape[1]):
        weight, cell = 1.0, np.int64(-1)
        if places[axis, k] != nowhere:
            cell = (np.int64(places[axis, k]) - begin) // many
            weight = ratio[cell * many + codes[kinds[axis], k]]
        for w in range(kinds.size):
            at = np.int64(places[w, k])
            counts[at + codes[kinds[w], k]] += weight
            if cell >= 0 and most[cell] > 0 and kinds[w] == kinds[axis] and at != nowhere:
                for b in range(many):
                    counts[at + b] += excess[cell * many + b]
