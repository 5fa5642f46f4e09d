"""Counting: each pixel's bin into the histogram of its cell, along every axis at once.

Most axes count errors, and many pixels of a frame lie in the same cells of several of them. Such axes are counted
together: each set of such pixels has one histogram, which is added to those of all its cells.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from depthsim.gap.depth.data.histograms import (
    ACROSS,
    BEFORE,
    BINS,
    ERROR,
    FAR_LEFT,
    FAR_UP,
    LEFT,
    UP,
)
from depthsim.kernels import kernel
from depthsim.lanes import count_true, load_bytes, load_ints, store

NO_CELL = np.uint16(65535)
ROOM = 40
"""Of a histogram of errors where some are added: five times eight."""
SPARE = ROOM
"""How many counts lie beyond those of the axes: what is counted nowhere is counted there."""
_LANES = 64
_NO_BIN = np.uint8(255)


def places(
    cells: NDArray[np.uint16],
    kinds: NDArray[np.int64],
    offsets: NDArray[np.int64],
    size: int,
    *,
    rows: NDArray[np.integer],
    across: NDArray[np.float32],
    follows: bool,
    left: int,
    up: int,
) -> NDArray[np.unsignedinteger]:
    """(axes, pixels): where the histogram of each pixel's cell begins in the counts; ``size`` is nowhere.

    cells: (axes, pixels), NO_CELL where a pixel is not counted. kinds, offsets: of each axis, see ``axis.layout``.
    rows: the rows of the picture that the pixels make up; across: (pixels,) the depth beyond an edge, 0 where there is
    none; follows: whether the frame before is known; left, up: as in :func:`histograms.codes`.
    """
    pixels = cells.shape[1]
    v, u = np.repeat(rows, pixels // len(rows)), np.tile(np.arange(pixels // len(rows)), len(rows))
    has = {LEFT: u >= 1, UP: v >= 1, FAR_LEFT: u >= left, FAR_UP: v >= up, ACROSS: across > 0}
    has[BEFORE] = np.full(pixels, follows)
    out = np.empty(cells.shape, np.uint16 if size + SPARE < 65536 else np.uint32)
    for w, kind in enumerate(kinds):
        counted = cells[w] != NO_CELL
        if int(kind) in has:
            counted &= has[int(kind)]
        out[w] = np.where(counted, offsets[w] + cells[w].astype(np.int64) * BINS[kind], size)
    return out


class Together(NamedTuple):
    """A frame's pixels in the cells of several axes that are counted together, set by set; see :func:`count_together`.

    places: (pixels,) where the histogram of each pixel's set begins. begins: (sets, axes) where those of its cells do.
    """

    places: NDArray[np.uint32]
    begins: NDArray[np.unsignedinteger]


_ADDING = 4
"""Times what it takes to count a pixel along an axis, that it takes to add a set's histogram to a cell's."""


def bundles(places: NDArray[np.unsignedinteger], kinds: NDArray[np.int64]) -> list[list[int]]:
    """The axes of errors that are best counted together, by a typical frame's ``places``; one alone is none."""
    found: list[tuple[list[int], NDArray[np.int64], int]] = []
    pixels = places.shape[1]
    for axis in map(int, np.flatnonzero(kinds == ERROR)):
        tried = []
        for number, (axes, sets, count) in enumerate(found):
            finer, finer_count = _parted(sets, count, places[axis])
            tried.append((finer_count * (len(axes) + 1) - count * len(axes), number, finer, finer_count))
        cost, number, sets, count = min(tried, key=lambda one: one[0], default=(pixels, 0, np.empty(0, np.int64), 0))
        if cost * _ADDING < pixels and tried:
            found[number] = [*found[number][0], axis], sets, count
        else:
            found.append(([axis], *_parted(np.zeros(pixels, np.int64), 1, places[axis])))
    return [axes for axes, _, _ in found if len(axes) > 1]


def together(places: NDArray[np.unsignedinteger], axes: Sequence[int]) -> Together:
    """A frame's pixels in the cells of some axes of errors. places: of all axes, see :func:`places`."""
    sets, count = np.zeros(places.shape[1], np.int64), 1
    for axis in axes:
        sets, count = _parted(sets, count, places[axis])
    begins = np.empty((count, len(axes)), places.dtype)
    for number, axis in enumerate(axes):
        begins[sets, number] = places[axis]
    return Together((sets * ROOM).astype(np.uint32), begins)


def _parted(sets: NDArray[np.int64], count: int, places: NDArray[np.unsignedinteger]) -> tuple[NDArray[np.int64], int]:
    """The set of each pixel, and how many there are, if those in different cells of one more axis are parted."""
    first = int(places.min())
    known = np.full((count, (int(places.max()) - first) // int(BINS[ERROR]) + 2), -1, np.int64)
    out = np.empty(len(sets), np.int64)
    return out, _part(sets, places, first, int(BINS[ERROR]), known, out)


def pack(counts: NDArray[np.uint32]) -> bytes:
    """Counts to be kept, most of which are small, in a quarter of their memory."""
    return isal_zlib.compress(counts, 0)


def unpack(packed: bytes) -> NDArray[np.uint32]:
    """What :func:`pack` has packed, flat and not to be written."""
    return np.frombuffer(isal_zlib.decompress(packed), np.uint32)


@kernel
def _part(sets, places, first, bins, known, out):
    found = 0
    for k in range(sets.size):
        cell = (np.int64(places[k]) - first + bins - 1) // bins  # what is nowhere may lie beside the grid
        if known[sets[k], cell] < 0:
            known[sets[k], cell] = found
            found += 1
        out[k] = known[sets[k], cell]
    return found


@kernel
def count_together(codes, places, begins, histograms, counts):  # noqa: ANN201 - numba
    """As :func:`count`, for axes of a :class:`Together`. histograms: zero, of a size that is enough; left as it was."""
    for k in range(places.size):
        histograms[np.int64(places[k]) + np.int64(codes[k])] += np.uint32(1)
    sets, axes = begins.shape
    flat, own, to = begins.reshape(-1), np.int64(histograms.ctypes.data), np.int64(counts.ctypes.data)
    for first in range(0, sets * axes, axes):
        # What lies beyond the bins is 0, so that it does not matter where it is added.
        a, b, c = load_ints(own, 8), load_ints(own + 32, 8), load_ints(own + 64, 8)
        d, e = load_ints(own + 96, 8), load_ints(own + 128, 8)
        own += 4 * ROOM
        for w in range(first, first + axes):
            at = to + 4 * np.int64(flat[np.uint64(w)])
            store(at, load_ints(at, 8) + a)
            store(at + 32, load_ints(at + 32, 8) + b)
            store(at + 64, load_ints(at + 64, 8) + c)
            store(at + 96, load_ints(at + 96, 8) + d)
            store(at + 128, load_ints(at + 128, 8) + e)
    histograms[: sets * ROOM] = 0


@kernel
def count(codes, kinds, places, axes, counts):  # noqa: ANN201 - numba
    """Add a frame to ``counts``, along some axes: (size + SPARE,). codes: (kinds, pixels), places: (axes, pixels).

    Four pixels far apart in turn: neighbours often fall into one bin, and an addition waits for the last to the same.
    """
    part = places.shape[1] // 4
    for w in axes:
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
def count_whole(codes, kinds, places, begins, axes, counts):  # noqa: ANN201 - numba
    """As :func:`count`, for axes of one cell each, less what is counted nowhere. begins: of the cells, by axis.

    So few bins are looked for in many pixels at once, which is far faster than to look where each belongs.
    """
    own = np.empty(places.shape[1], np.uint8)
    at, whole = np.int64(own.ctypes.data), own.size // _LANES * _LANES
    for w in axes:
        bins, place, begin = codes[kinds[w]], places[w], np.uint32(begins[w])
        for k in range(own.size):
            here, value = np.uint32(place[k]), bins[k]
            own[k] = value if here == begin else _NO_BIN
        for value in range(BINS[kinds[w]]):
            found = 0
            for k in range(0, whole, _LANES):
                found += np.int64(count_true(load_bytes(at + k, _LANES) == np.uint8(value)))
            for k in range(whole, own.size):
                found += np.int64(own[k] == np.uint8(value))
            counts[np.int64(begin) + value] += np.uint32(found)


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
