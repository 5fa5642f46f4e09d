"""Semi-global matching: costs are gathered along straight paths that charge for changes of disparity.

H. Hirschmüller, "Stereo processing by semiglobal matching and mutual information", IEEE PAMI 30(2), 2008, Eq. 13; four
paths: right, left, down and up. Of two, fewer or no paths the pairs of ``benchmarks/stereo_matching.py`` lose: without
the one upwards 3 % of the pixels by day. Whole numbers in a byte each, so that the sum does not depend on the order of
the paths; what does not fit is a disparity that loses anyway, and stays at 255.
"""

import numpy as np

from depthsim.kernels import inlined, kernel
from depthsim.lanes import add_clipped, least, least_of, load_bytes, narrow, slide, spread, store, widen
from depthsim.llvm import prefetch
from depthsim.stereo.cost import LANES

BLOCK = 16
"""Columns that the vertical paths take at a time: what they keep stays in the processor's cache."""

_LAST = LANES - 1
AHEAD = 4
"""Rows that costs are asked for ahead: they stand too far apart for the processor to guess."""


@inlined
def step(cost, before, lowest, small, large, here, padded):  # noqa: ANN201 - numba
    """One pixel further along a path; returns the lowest of ``here``.

    cost, before, here: addresses of the pixel's costs, and of the path's at the last pixel and at this one. The byte
    before them and the one after the last disparity hold 255; 64 bytes on both sides are read.
    """
    jump = np.uint8(min(np.int64(lowest) + large, 255))
    lows = spread(np.uint8(255), LANES)
    # Bytes that have just been written are read as they were written: others would have to wait for them.
    below, same = load_bytes(before - LANES, LANES), load_bytes(before, LANES)
    for d in range(0, padded, LANES):
        above = load_bytes(before + d + LANES, LANES)
        sideways = add_clipped(least(slide(below, same, _LAST), slide(same, above, 1)), np.uint8(small))
        value = least(least(same, sideways), jump) - np.uint8(lowest)
        below, same = same, above
        value = add_clipped(value, load_bytes(cost + d, LANES))
        store(here + d, value)
        lows = least(lows, value)
    return least_of(lows)


@kernel
def vertical(start, stop, cost, small, large, out):  # noqa: ANN201 - numba
    """The mean of the paths down and up, in the columns of blocks ``start`` to ``stop``.

    cost, out: (H, W, P) uint8.
    """
    height, width, padded = cost.shape
    # Between rows there are bytes that stay 255, for the first column to find before its costs.
    row = BLOCK * padded + LANES
    down = np.full((height + 1) * row + LANES, 255, np.uint8)
    ends = np.full(2 * row + LANES, 255, np.uint8)
    lowest = np.zeros(BLOCK, np.uint8)
    first, end = down.ctypes.data + LANES, ends.ctypes.data + LANES
    for block in range(start, stop):
        left = block * BLOCK
        count = min(BLOCK, width - left)
        down[LANES:row] = np.uint8(0)
        lowest[:] = np.uint8(0)
        for y in range(height):
            for i in range(count):
                before, costs = first + y * row + i * padded, cost[y, left + i].ctypes.data
                for d in range(0, padded, LANES):
                    prefetch(costs + AHEAD * width * padded + d)
                lowest[i] = step(costs, before, lowest[i], small, large, before + row, padded)
        ends[LANES:row] = np.uint8(0)
        lowest[:] = np.uint8(0)
        for k in range(height):
            y = height - 1 - k
            here, there = end + (k % 2) * row, end + (1 - k % 2) * row
            for i in range(count):
                before, after, costs = here + i * padded, there + i * padded, cost[y, left + i].ctypes.data
                for d in range(0, padded, LANES):
                    prefetch(costs - AHEAD * width * padded + d)
                    prefetch(out[y, left + i].ctypes.data - AHEAD * width * padded + d)
                lowest[i] = step(costs, before, lowest[i], small, large, after, padded)
                to, gathered = out[y, left + i].ctypes.data, first + (y + 1) * row + i * padded
                for d in range(0, padded, LANES):
                    both = widen(load_bytes(gathered + d, LANES)) + widen(load_bytes(after + d, LANES))
                    store(to + d, narrow(both + np.uint16(1), np.uint16(1)))
