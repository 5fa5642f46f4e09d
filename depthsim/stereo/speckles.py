"""Dropping small patches of disparity that nothing beside them supports."""

import numpy as np

from depthsim.kernels import kernel


@kernel
def drop_speckles(disparity, size, step):  # noqa: ANN201 - numba
    """Set to -1 what belongs to a connected patch of fewer than ``size`` pixels.

    disparity: (H, W) float32 [px], negative where there is none; changed in place. Two neighbours, across or down,
    belong together where they differ by at most ``step``.
    """
    width = disparity.shape[1]
    flat = disparity.reshape(-1)
    seen = np.zeros(flat.size, np.bool_)
    patch = np.empty(flat.size, np.int32)
    for first in range(flat.size):
        if seen[first] or flat[first] < 0:
            continue
        seen[first] = True
        patch[0], count, at = first, 1, 0
        while at < count:
            here = patch[at]
            at += 1
            x = here % width
            for side in range(4):
                if (side == 0 and x == 0) or (side == 1 and x == width - 1):
                    continue
                other = here + (-1 if side == 0 else 1 if side == 1 else -width if side == 2 else width)
                if other < 0 or other >= flat.size or seen[other] or flat[other] < 0:
                    continue
                if abs(flat[other] - flat[here]) <= step:
                    seen[other] = True
                    patch[count] = other
                    count += 1
        if count < size:
            for k in range(count):
                flat[patch[k]] = -1
