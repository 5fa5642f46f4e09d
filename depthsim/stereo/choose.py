"""The paths along a row, and from gathered costs to whole disparities, checked against the rest and the right image."""

import numpy as np

from depthsim.kernels import inlined, kernel
from depthsim.lanes import (
    choose,
    count_true,
    first_true,
    least,
    least_of,
    load_bytes,
    load_words,
    slide,
    spread,
    store,
    widen,
)
from depthsim.stereo.cost import LANES
from depthsim.stereo.paths import step

JUMP = 2
"""[px] Between neighbours, that makes two surfaces of them."""


@inlined
def _gather(to_right, to_left, vertical, out, padded):
    """Add up all four paths of a pixel, the mean of the vertical two twice; returns the lowest sum. Addresses."""
    lows = spread(np.uint16(65535), LANES)
    for d in range(0, padded, LANES):
        up_down = widen(load_bytes(vertical + d, LANES))
        total = widen(load_bytes(to_right + d, LANES)) + widen(load_bytes(to_left + d, LANES)) + up_down + up_down
        store(out + 2 * d, total)
        lows = least(lows, total)
    return least_of(lows)


@inlined
def _first(values, wanted, padded):
    """Where, from an address on, the first number is that equals ``wanted``."""
    for d in range(0, padded, LANES):
        at = first_true(load_words(values + 2 * d, LANES) == wanted)
        if at < LANES:
            return d + at
    return padded


@inlined
def _look_on(total, at, count, above, lowest, disparity, padded):
    """What else the sums, from an address on, say of a pixel whose lowest is at ``at``.

    Returns how many of them are below ``above``, and the lowest but for those at ``at`` and beside it. The right
    image's pixels take what these costs are lower than or equal to. lowest, disparity: addresses of the sums and
    disparities of those that this pixel may be, in the order of disparities; when it was the pixel to the right they
    stood one place on. count: 0, 1, 2, ...
    """
    crowd, lows = np.int32(0), spread(np.uint16(65535), LANES)
    low, place = load_words(lowest, LANES), load_words(disparity, LANES)
    for d in range(0, padded, LANES):
        here, own = load_words(total + 2 * d, LANES), load_words(count + 2 * d, LANES)
        crowd += count_true(here < above)
        lows = least(lows, choose(own - np.uint16(at - 1) <= np.uint16(2), np.uint16(65535), here))
        next_low, next_place = (
            load_words(lowest + 2 * (d + LANES), LANES),
            load_words(disparity + 2 * (d + LANES), LANES),
        )
        before, after = slide(low, next_low, 1), slide(place, next_place, 1)
        lower = here <= before
        store(lowest + 2 * d, choose(lower, here, before))
        store(disparity + 2 * d, choose(lower, own, after))
        low, place = next_low, next_place
    return crowd, least_of(lows)


@kernel
def choose_rows(  # noqa: ANN201 - numba
    start, stop, cost, vertical, disparities, steps, margin, worst, left_right, median, peak, out, firm,
):  # fmt: skip
    """Rows ``start`` to ``stop`` of the disparity.

    cost: (H, W, P) uint8 window costs. vertical: the same, the mean of the paths down and up.
    steps: what a path charges for a change of 1 px, and for a larger one. worst: highest window cost.
    left_right: most that the right image's own disparity may differ by [px]. median: how much the sum at the quantile
    must be above the lowest, and how many disparities are below the quantile.
    peak: share by which every other disparity must be worse for the pixel to be firm.
    out: (H, W) int16 [px], -1 where there is none. firm: (H, W) uint8, 1 where left and right agree to 1 px, too.
    """
    small, large = steps
    above, most = median
    _, width, padded = cost.shape
    # The byte before a pixel's costs is the last of the pixel's before it, or one of these: 255.
    ends = np.full((width + 2) * padded + LANES, 255, np.uint8)
    base = ends.ctypes.data + LANES
    back = np.full(4 * padded + LANES, 255, np.uint8)
    total, count = np.empty(padded, np.uint16), np.arange(padded).astype(np.uint16)
    sums = total.ctypes.data
    best = np.empty(width, np.int16)
    lowest, second = np.empty(width, np.uint16), np.empty(width, np.uint16)
    crowd = np.empty(width, np.int32)
    right = np.empty(width, np.uint16)
    # Of the right image's pixels that a pixel of the left one may be; an array, because numba frees an array of which
    # nothing but the address is used any more.
    seen = np.empty((2, padded + LANES), np.uint16)
    right_lowest, right_place, counted = seen[0].ctypes.data, seen[1].ctypes.data, count.ctypes.data
    for y in range(start, stop):
        low = np.uint8(0)
        ends[LANES : LANES + padded] = np.uint8(0)
        for x in range(width):
            low = step(cost[y, x].ctypes.data, base + x * padded, low, small, large, base + (x + 1) * padded, padded)
        seen[:] = np.uint16(65535)
        back[LANES : LANES + padded] = np.uint8(0)
        low = np.uint8(0)
        now = 0
        for k in range(width):
            x = width - 1 - k
            here = back.ctypes.data + LANES + now * 2 * padded
            there = back.ctypes.data + LANES + (1 - now) * 2 * padded
            low = step(cost[y, x].ctypes.data, here, low, small, large, there, padded)
            now = 1 - now
            lowest[x] = _gather(base + (x + 1) * padded, there, vertical[y, x].ctypes.data, sums, padded)
            at = _first(sums, lowest[x], padded)
            best[x] = at
            limit = np.uint16(min(np.int64(lowest[x]) + above, 65535))
            crowd[x], second[x] = _look_on(sums, at, counted, limit, right_lowest, right_place, padded)
            right[x] = seen[1, 0]
        for x in range(width):
            d = best[x]
            out[y, x], firm[y, x] = np.int16(-1), np.uint8(0)
            if d > x - margin or d >= disparities - 1 or cost[y, x, d] > worst:
                continue
            off = abs(np.int64(right[x - d]) - d)
            if off > left_right or crowd[x] > most:
                continue
            out[y, x] = d
            firm[y, x] = np.uint8(off <= 1 and second[x] >= lowest[x] * (1 + peak))


@inlined
def _stretch(row, low, high):
    """Let the lowest and highest disparity take in those of ``row``."""
    for x in range(row.size):
        low[x] = min(low[x], row[x] if row[x] >= 0 else np.int16(32767))
        high[x] = max(high[x], row[x])


@kernel
def drop_torn_rows(start, stop, cost, whole, reach, share, out):  # noqa: ANN201 - numba
    """Drop the pixels whose window holds two surfaces and fits the other one nearly as well.

    whole: (H, W) int16, -1 where there is none; out: a copy of it, rows ``start`` to ``stop`` of which are changed.
    reach: how far along the row the other surface may begin [px]. share: by which its cost must be higher.
    """
    _, width = whole.shape
    low, high = np.empty(width, np.int16), np.empty(width, np.int16)
    for y in range(start, stop):
        row = whole[y]
        low[:], high[:] = np.int16(32767), np.int16(-1)
        for k in range(-min(reach, width - 1), min(reach, width - 1) + 1):
            first, end = max(0, -k), min(width, width - k)
            _stretch(row[first + k : end + k], low[first:end], high[first:end])
        for x in range(width):
            d = row[x]
            if d < 0 or (high[x] - d <= JUMP and d - low[x] <= JUMP):
                continue
            limit = cost[y, x, d] * (1 + share)
            for other in range(max(x - reach, 0), min(x + reach + 1, width)):
                e = row[other]
                if e >= 0 and abs(e - d) > JUMP and cost[y, x, e] < limit:
                    out[y, x] = -1
                    break
