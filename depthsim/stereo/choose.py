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
    narrow,
    slide,
    spread,
    store,
    widen,
)
from depthsim.stereo.cost import LANES
from depthsim.stereo.paths import step

JUMP = 2
"""[px] Between neighbours, that makes two surfaces of them."""
ROWS = 4
"""Rows whose paths go on in turn: each step has to wait for the one before it."""


@inlined
def mean_of(a, b):  # noqa: ANN201 - numba
    """Of bytes, rounded up at a half: one machine instruction."""
    return narrow(widen(a) + widen(b) + np.uint16(1), np.uint16(1))


@inlined
def _gather(to_right, to_left, vertical, out, padded):
    """The mean of all four paths of a pixel; returns the lowest. Addresses; ``vertical`` has the mean of two."""
    lows = spread(np.uint8(255), LANES)
    for d in range(0, padded, LANES):
        along = mean_of(load_bytes(to_right + d, LANES), load_bytes(to_left + d, LANES))
        total = mean_of(along, load_bytes(vertical + d, LANES))
        store(out + d, total)
        lows = least(lows, total)
    return least_of(lows)


@inlined
def _first(values, wanted, padded):
    """Where, from an address on, the first byte is that equals ``wanted``."""
    for d in range(0, padded, LANES):
        at = first_true(load_bytes(values + d, LANES) == wanted)
        if at < LANES:
            return d + at
    return padded


@inlined
def _lowest_point(at, before, lowest, after, disparities):
    """Of a parabola through the lowest cost, at ``at``, and the two beside it."""
    down, up = np.float32(before) - np.float32(lowest), np.float32(after) - np.float32(lowest)
    lower = np.float32((down - up) / (np.float32(2) * max(down + up, np.float32(1))))
    return np.float32(at + lower) if (at > 0) & (at < disparities - 1) else np.float32(at)


@inlined
def _look_on(total, at, lanes, column, above, lowest, where, padded):
    """What else the costs, from an address on, say of a pixel whose lowest is at ``at``.

    Returns how many of them are below ``above``, and the lowest but for those at ``at`` and beside it. lanes: address
    of 0 to 63.
    The right image's pixels take this ``column`` where its costs are lower than or equal to theirs. lowest, where:
    addresses of the costs and columns of those that this pixel may be, in the order of disparities; for the pixel to
    the right they stood one place on.
    """
    crowd, lows = np.int32(0), spread(np.uint8(255), LANES)
    low, place, lane = load_bytes(lowest, LANES), load_bytes(where, LANES), load_bytes(lanes, LANES)
    for d in range(0, padded, LANES):
        here = load_bytes(total + d, LANES)
        crowd += count_true(here < above)
        # Outside these 64 is as good as just outside.
        beside = np.uint8(min(max(at - 1 - d, -3), LANES))
        lows = least(lows, choose(lane - beside <= np.uint8(2), np.uint8(255), here))
        next_low, next_place = load_bytes(lowest + d + LANES, LANES), load_bytes(where + d + LANES, LANES)
        before = slide(low, next_low, 1)
        lower = here <= before
        store(lowest + d, choose(lower, here, before))
        store(where + d, choose(lower, column, slide(place, next_place, 1)))
        low, place = next_low, next_place
    return crowd, least_of(lows)


@kernel
def choose_rows(  # noqa: ANN201 - numba
    start, stop, cost, vertical, disparities, steps, margin, worst, left_right, median, peak, out, fine, firm,
):  # fmt: skip
    """Rows ``start`` to ``stop`` of the disparity.

    cost: (H, W, P) uint8 window costs. vertical: the same, the mean of the paths down and up.
    steps: what a path charges for a change of 1 px, and for a larger one. worst: highest window cost.
    left_right: most that the right image's own disparity may differ by [px]. median: how much the cost at the quantile
    must be above the lowest, and how many disparities are below the quantile.
    peak: share by which every other disparity must be worse for the pixel to be firm.
    out: (H, W) int16 [px], -1 where there is none. fine: (H, W) float32 [px], the lowest point between the costs, also
    where ``out`` is -1. firm: (H, W) uint8, 1 where left and right agree to 1 px, too.
    """
    small, large = steps
    above, most = median
    _, width, padded = cost.shape
    # The byte before a pixel's costs is the last of the pixel's before it, or one of these: 255.
    ends = np.full((ROWS, (width + 2) * padded + LANES), 255, np.uint8)
    base, low = ends.ctypes.data + LANES, np.empty(ROWS, np.uint8)
    back = np.full(4 * padded + LANES, 255, np.uint8)
    best, right = np.empty(width, np.int16), np.empty(width, np.uint8)
    lowest, second = np.empty(width, np.uint8), np.empty(width, np.uint8)
    crowd, before, after = np.empty(width, np.int32), np.empty(width, np.uint8), np.empty(width, np.uint8)
    # Costs, 0 to 63, and costs and columns of the right image's pixels that a pixel may be: one array, as numba frees
    # those of which nothing but the address is used any more.
    bytes_ = np.empty((4, padded + LANES), np.uint8)
    for d in range(LANES):
        bytes_[1, d] = np.uint8(d)
    pace = padded + LANES
    sums = bytes_.ctypes.data
    lanes, right_lowest, right_column = sums + pace, sums + 2 * pace, sums + 3 * pace
    for first in range(start, stop, ROWS):
        end = min(first + ROWS, stop)
        low[:] = np.uint8(0)
        ends[:, LANES : LANES + padded] = np.uint8(0)
        for x in range(width):
            for y in range(first, end):
                row = y - first
                here = base + row * ends.shape[1] + x * padded
                low[row] = step(cost[y, x].ctypes.data, here, low[row], small, large, here + padded, padded)
        for y in range(first, end):
            bytes_[2:] = np.uint8(255)
            back[LANES : LANES + padded] = np.uint8(0)
            least_so_far = np.uint8(0)
            now, gathered = 0, base + (y - first) * ends.shape[1] + padded
            for k in range(width):
                x = width - 1 - k
                here = back.ctypes.data + LANES + now * 2 * padded
                there = back.ctypes.data + LANES + (1 - now) * 2 * padded
                least_so_far = step(cost[y, x].ctypes.data, here, least_so_far, small, large, there, padded)
                now = 1 - now
                lowest[x] = _gather(gathered + x * padded, there, vertical[y, x].ctypes.data, sums, padded)
                at = _first(sums, lowest[x], padded)
                best[x] = at
                before[x], after[x] = bytes_[0, np.uint32(max(at, 1) - 1)], bytes_[0, np.uint32(at + 1)]
                limit, column = np.uint8(min(np.int64(lowest[x]) + above, 255)), np.uint8(x)
                crowd[x], second[x] = _look_on(sums, at, lanes, column, limit, right_lowest, right_column, padded)
                right[x] = bytes_[3, 0]
            for x in range(width):
                fine[y, x] = _lowest_point(best[x], before[x], lowest[x], after[x], disparities)
            for x in range(width):
                d = best[x]
                out[y, x], firm[y, x] = np.int16(-1), np.uint8(0)
                if d > x - margin or d >= disparities - 1 or cost[y, x, d] > worst:
                    continue
                # Columns are known by their last byte: a difference of 256 px is none.
                off = abs(np.int64(np.int8(np.uint8(right[x - d] - np.uint8(x)))))
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


@inlined
def _around(row, reach, low, high):
    """The lowest and highest disparity within ``reach`` of each pixel."""
    width = row.size
    low[:], high[:] = np.int16(32767), np.int16(-1)
    for k in range(-min(reach, width - 1), min(reach, width - 1) + 1):
        first, end = max(0, -k), min(width, width - k)
        _stretch(row[first + k : end + k], low[first:end], high[first:end])


@inlined
def _is_torn(costs, d, others, share):
    """Whether a pixel at disparity ``d`` fits one of ``others`` as well, which is of another surface."""
    limit = costs[d] * (1 + share)
    for e in others:  # noqa: SIM110 - numba
        if e >= 0 and abs(e - d) > JUMP and costs[e] < limit:
            return True
    return False


@kernel
def drop_torn_rows(start, stop, cost, whole, reach, share, out):  # noqa: ANN201 - numba
    """Drop the pixels whose window, in the left image or in the right, holds two surfaces and fits the other as well.

    whole: (H, W) int16, -1 where there is none; out: a copy of it, rows ``start`` to ``stop`` of which are changed.
    reach: how far along the row and the column the other surface may begin [px]. share: by which its cost must be
    higher. In the right image it is half of both, along the row alone: then shadows end as far from objects as a
    D435's. Along columns a D435 leaves no jump without a hole either.
    """
    height, width = whole.shape
    low, high, right = np.empty(width, np.int16), np.empty(width, np.int16), np.empty(width, np.int16)
    right_low, right_high = np.empty(width, np.int16), np.empty(width, np.int16)
    for y in range(start, stop):
        row = whole[y]
        # What the right image's pixels show, the nearest where there are two.
        right[:] = np.int16(-1)
        for x in range(width):
            if row[x] >= 0:
                right[x - row[x]] = max(right[x - row[x]], row[x])
        _around(row, reach, low, high)
        _around(right, reach // 2, right_low, right_high)
        above, below = max(y - reach, 0), min(y + reach + 1, height)
        for other in range(above, below):
            _stretch(whole[other], low, high)
        for x in range(width):
            d = row[x]
            if d < 0:
                continue
            at, costs = x - d, cost[y, x]
            if high[x] - d > JUMP or d - low[x] > JUMP:
                beside = row[max(x - reach, 0) : min(x + reach + 1, width)]
                if _is_torn(costs, d, beside, share) or _is_torn(costs, d, whole[above:below, x], share):
                    out[y, x] = -1
                    continue
            if right_high[at] - d <= JUMP and d - right_low[at] <= JUMP:
                continue
            limit = cost[y, x, d] * (1 + share / 2)
            for other in range(max(at - reach // 2, 0), min(at + reach // 2 + 1, width)):
                e = right[other]
                if e >= 0 and abs(e - d) > JUMP and at + e < width and cost[y, at + e, e] < limit:
                    out[y, x] = -1
                    break
