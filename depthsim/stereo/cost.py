"""Matching cost: how many bits of the census differ, added over a window, for every pixel and disparity.

Census transform: R. Zabih and J. Woodfill, "Non-parametric local transforms for computing visual correspondence",
ECCV 1994. It asks only which of two pixels is brighter, so exposure, vignetting and gain cancel.
"""

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import inlined, kernel
from depthsim.lanes import (
    choose,
    differing_bits,
    load_bytes,
    load_floats,
    load_words,
    narrow,
    spread,
    store,
    widen,
)

ACROSS, DOWN = 4, 3
BITS = (2 * ACROSS + 1) * (2 * DOWN + 1) - 1
"""Bits of the 9x7 census."""
OUTSIDE = 18
"""Bits for a disparity that leaves the right image: worse than a match and better than chance (31), so that the band at
the left keeps the disparity of what lies beside it and is known to be outside."""


LANES = 64
"""Disparities that are worked on at a time."""
_PIXELS = 16
"""The same of the census."""


@kernel
def census(start, stop, image, tolerance, out):  # noqa: ANN201 - numba
    """Rows ``start`` to ``stop`` of the code of every pixel: for every second neighbour, brighter and darker.

    image: (H + 2 DOWN, W + 2 ACROSS) float32, padded; behind it stand _PIXELS numbers more, which are read.
    tolerance: what the two may differ by and count as neither. out: (H, W) uint64.
    """
    width = out.shape[1]
    codes = np.empty((2, width + _PIXELS), np.int32)
    brighter, darker = codes[0], codes[1]
    for y in range(start, stop):
        for x in range(0, width, _PIXELS):
            here = load_floats(image[y + DOWN, x + ACROSS :].ctypes.data, _PIXELS)
            more = less = spread(np.int32(0), _PIXELS)
            bit = np.int32(1 << (BITS // 2 - 1))
            for dy in range(2 * DOWN + 1):
                there = image[y + dy, x:].ctypes.data
                for dx in range((dy + DOWN + ACROSS) % 2, 2 * ACROSS + 1, 2):
                    if dy == DOWN and dx == ACROSS:
                        continue
                    difference = load_floats(there + 4 * dx, _PIXELS) - here
                    more = choose(difference > tolerance, more + bit, more)
                    less = choose(difference < -tolerance, less + bit, less)
                    bit = np.int32(bit >> np.int32(1))
            store(brighter[x:].ctypes.data, more)
            store(darker[x:].ctypes.data, less)
        for x in range(width):
            out[y, x] = (np.uint64(np.uint32(brighter[x])) << np.uint64(32)) | np.uint64(np.uint32(darker[x]))


def put_in_border(image: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Write a picture into the middle of ``out``, (H + 2 DOWN, W + 2 ACROSS), and around it what is at its border."""
    rows = out[DOWN:-DOWN]
    rows[:, ACROSS:-ACROSS], rows[:, :ACROSS], rows[:, -ACROSS:] = image, image[:, :1], image[:, -1:]
    out[:DOWN], out[-DOWN:] = rows[0], rows[-1]


def noise_level(image: NDArray[np.float32]) -> float:
    """Standard deviation of an image's noise, from the calmer part of the image.

    J. Immerkær, "Fast noise variance estimation", Computer Vision and Image Understanding 64(2), 1996: a mask that is
    blind to edges. The third decile in place of the mean keeps texture and dots out.
    """
    if min(image.shape) < 3:
        return 0.0
    # A ninth of the rows has the same decile, and sorting is what takes the time.
    count = -(-(len(image) - 2) // 9)
    above, here, below = (image[first::9][:count] for first in range(3))
    bent = above - 2 * here + below
    bent = np.abs(bent[:, :-2] - 2 * bent[:, 1:-1] + bent[:, 2:])
    # 0.3853 is the third decile of the absolute value of a standard normal number.
    return _third_decile(bent.ravel()) / (6 * 0.3853)


def _third_decile(values: NDArray[np.float32]) -> float:
    """As NumPy's percentile has it, which imports masked arrays: 0.02 s of a start."""
    place = 0.3 * (values.size - 1)
    below = int(place)
    above = min(below + 1, values.size - 1)
    low, high = np.partition(values, [below, above])[[below, above]]
    return float(low + (high - low) * (place - below))


@inlined
def _next_column(code, codes, x, lanes, padded, at, sums):
    """Add the bits that differ between ``code``, in column ``x``, and ``codes`` to sums, in place of those ``at``.

    Addresses: codes of the right image at x, x - 1, ...; lanes: 0 to 63; at: bytes, of rows before; sums: words.
    """
    for d in range(0, padded, LANES):
        bits = differing_bits(code, codes + 8 * d, LANES)
        if x < padded:
            inside = load_bytes(lanes, LANES) < np.uint8(min(max(x + 1 - d, 0), LANES))
            bits = choose(inside, bits, np.uint8(OUTSIDE))
        more = widen(bits) - widen(load_bytes(at + d, LANES))
        store(at + d, bits)
        store(sums + 2 * d, load_words(sums + 2 * d, LANES) + more)


def shift_of(window: tuple[int, int]) -> int:
    """By how many bits a window's sum is cut to stand in a byte, with room for what paths add."""
    return max((BITS * window[0] * window[1] // 144).bit_length(), 0)


@kernel
def cost_rows(start, stop, left, right, disparities, across, down, shift, out):  # noqa: ANN201 - numba
    """Fill rows ``start`` to ``stop`` of the cost.

    left, right: (H, W) uint64 census. across, down: half the window. shift: of :func:`shift_of`.
    out: (H, W, P) uint8, P a multiple of 64 above ``disparities``; 255 from there on. At the image's border the window
    repeats the last row and column, so all costs are sums of as many.
    """
    height, width, padded = out.shape
    size = 2 * down + 1
    ring = np.zeros((size, width, padded), np.uint8)
    column = np.zeros((width, padded), np.uint16)
    flipped = np.zeros(width + padded, np.uint64)
    run = np.empty(padded, np.uint16)
    lanes = np.arange(LANES).astype(np.uint8)
    sums = run.ctypes.data
    for v in range(start - 2 * down, stop):
        y = min(max(v + down, 0), height - 1)
        row, oldest = left[y], ring[(v + down) % size]
        # The right row backwards, so that d runs upwards in memory.
        for x in range(width):
            flipped[x] = right[y, width - 1 - x]
        # A sum along the row takes in a column as soon as that is known: then it is still in the fastest memory.
        for k in range(width + across):
            x = min(k, width - 1)
            entering = column[x].ctypes.data
            if k < width:
                codes = flipped[width - 1 - x :].ctypes.data
                _next_column(row[x], codes, x, lanes.ctypes.data, padded, oldest[x].ctypes.data, entering)
            if v < start:
                continue
            if k == 0:
                # As if the first column stood in all places of the window.
                for d in range(padded):
                    run[d] = np.uint16(column[0, d] * (2 * across + 1))
            leaving, at = column[max(k - 2 * across - 1, 0)].ctypes.data, max(k - across, 0)
            to = out[v, at].ctypes.data
            for d in range(0, padded, LANES):
                total = load_words(sums + 2 * d, LANES) + load_words(entering + 2 * d, LANES)
                total = total - load_words(leaving + 2 * d, LANES)
                store(sums + 2 * d, total)
                store(to + d, narrow(total, np.uint16(shift)))
            for d in range(disparities, padded):
                out[v, at, d] = np.uint8(255)
