"""From gathered costs to whole disparities: the lowest, checked against the rest and against the right image."""

import numpy as np

from depthsim.kernels import kernel


@kernel
def choose_rows(  # noqa: ANN201 - numba
    start, stop, cost, total, margin, worst, uniqueness, left_right, out,
):  # fmt: skip
    """Rows ``start`` to ``stop`` of the disparity.

    cost: (H, W, D) int16 window costs. total: the same, gathered along paths.
    worst: highest window cost. uniqueness: share by which every other disparity must be worse.
    out: (H, W) int16 [px], -1 where there is none.
    """
    _, width, disparities = cost.shape
    best, right = np.empty(width, np.int32), np.empty(width, np.int32)
    lowest, right_lowest = np.empty(width, np.int16), np.empty(width, np.int16)
    for y in range(start, stop):
        right_lowest[:] = np.int16(32767)
        right[:] = -1
        for x in range(width):
            here = total[y, x]
            low = here[0]
            for d in range(disparities):
                low = here[d] if here[d] < low else low
            at = 0
            while here[at] != low:
                at += 1
            best[x], lowest[x] = at, low
            for d in range(min(disparities, x + 1)):
                if here[d] < right_lowest[x - d]:
                    right_lowest[x - d] = here[d]
                    right[x - d] = d
        for x in range(width):
            d, out[y, x] = best[x], np.int16(-1)
            if d > x - margin or d >= disparities - 1 or cost[y, x, d] > worst:
                continue
            if abs(right[x - d] - d) > left_right:
                continue
            limit, here, second = lowest[x] * (1 + uniqueness), total[y, x], np.int16(32767)
            for other in range(disparities):
                value = here[other] if abs(other - d) > 1 else np.int16(32767)
                second = value if value < second else second
            if second < limit:
                continue
            out[y, x] = d


@kernel
def drop_torn_rows(start, stop, cost, whole, reach, share, out):  # noqa: ANN201 - numba
    """Drop the pixels whose window holds two surfaces and fits the other one nearly as well.

    whole: (H, W) int16, -1 where there is none; out: a copy of it, rows ``start`` to ``stop`` of which are changed.
    reach: how far along the row the other surface may begin [px]. share: by which its cost must be higher.
    """
    _, width = whole.shape
    for y in range(start, stop):
        for x in range(width):
            d = whole[y, x]
            if d < 0:
                continue
            limit = cost[y, x, d] * (1 + share)
            for other in range(max(x - reach, 0), min(x + reach + 1, width)):
                e = whole[y, other]
                if e >= 0 and abs(e - d) > 1 and cost[y, x, e] < limit:
                    out[y, x] = -1
                    break
