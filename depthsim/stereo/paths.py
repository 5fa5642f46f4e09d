"""Semi-global matching: costs are gathered along straight paths that charge for changes of disparity.

H. Hirschmüller, "Stereo processing by semiglobal matching and mutual information", IEEE PAMI 30(2), 2008, Eq. 13; four
paths: right, left, down and up. Whole numbers, so that the sum does not depend on the order of the paths.
"""

import numpy as np

from depthsim.kernels import inlined, kernel

_FAR = np.int16(16000)


@inlined
def _step(cost, before, lowest, small, large, here, total):
    """One pixel further along a path; returns the lowest of ``here``.

    before, here: (D + 2,) the path's costs at the last pixel and at this one, with a guard at both ends.
    total: (D,) what the path's costs are added to.
    """
    jump = np.int16(lowest + large)
    best = _FAR
    for d in range(cost.size):
        value = before[d + 1]
        down, up = np.int16(before[d] + small), np.int16(before[d + 2] + small)
        value = down if down < value else value
        value = up if up < value else value
        value = jump if jump < value else value
        value = np.int16(np.int16(cost[d] + value) - lowest)
        here[d + 1] = value
        total[d] = np.int16(total[d] + value)
        best = value if value < best else best
    return best


@kernel
def across(start, stop, cost, small, large, total):  # noqa: ANN201 - numba
    """The paths right and left in rows ``start`` to ``stop``; ``total`` is written anew."""
    _, width, disparities = cost.shape
    ends = np.full((2, disparities + 2), _FAR, np.int16)
    for y in range(start, stop):
        total[y] = np.int16(0)
        for step in (1, -1):
            ends[:, 1:-1] = np.int16(0)
            lowest, now = np.int16(0), 0
            for k in range(width):
                x = k if step == 1 else width - 1 - k
                lowest = _step(cost[y, x], ends[now], lowest, small, large, ends[1 - now], total[y, x])
                now = 1 - now


@kernel
def downwards(start, stop, cost, small, large, total):  # noqa: ANN201 - numba
    """The paths down and up in columns ``start`` to ``stop``; added to ``total``."""
    height, _, disparities = cost.shape
    ends = np.full((2, stop - start, disparities + 2), _FAR, np.int16)
    lowest = np.zeros(stop - start, np.int16)
    for step in (1, -1):
        ends[:, :, 1:-1] = np.int16(0)
        lowest[:] = np.int16(0)
        now = 0
        for k in range(height):
            y = k if step == 1 else height - 1 - k
            for i in range(stop - start):
                x = start + i
                lowest[i] = _step(cost[y, x], ends[now, i], lowest[i], small, large, ends[1 - now, i], total[y, x])
            now = 1 - now
