"""Dropping small patches of disparity that nothing beside them supports."""

import numpy as np

from depthsim.kernels import inlined, kernel


@inlined
def _root(first, run):
    """The first run of a patch, as far as it is known."""
    while first[run] != run:
        first[run] = first[first[run]]
        run = first[run]
    return run


@kernel
def drop_speckles(disparity, size, step):  # noqa: ANN201 - numba
    """Set to -1 what belongs to a connected patch of fewer than ``size`` pixels.

    disparity: (H, W) float32 [px], negative where there is none; changed in place. Two neighbours, across or down,
    belong together where they differ by at most ``step``.
    """
    height, width = disparity.shape
    # Runs along the rows are numbered, and runs of one patch point to the one of them that came first.
    runs = np.empty((height, width), np.int32)
    first, pixels = np.empty(height * width, np.int32), np.zeros(height * width, np.int32)
    count = 0
    for y in range(height):
        joined = -1
        for x in range(width):
            here = disparity[y, x]
            runs[y, x] = -1
            if here < 0:
                continue
            if x == 0 or runs[y, x - 1] < 0 or abs(here - disparity[y, x - 1]) > step:
                first[count] = count
                count += 1
                joined = -1
            run = count - 1
            runs[y, x] = run
            pixels[run] += 1
            if y == 0 or runs[y - 1, x] < 0 or runs[y - 1, x] == joined or abs(here - disparity[y - 1, x]) > step:
                continue
            joined = runs[y - 1, x]
            a, b = _root(first, joined), _root(first, run)
            first[max(a, b)] = min(a, b)
    for run in range(count - 1, -1, -1):
        if first[run] != run:
            pixels[first[run]] += pixels[run]
    for run in range(count):
        pixels[run] = pixels[first[run]]
    for y in range(height):
        for x in range(width):
            if runs[y, x] >= 0 and pixels[runs[y, x]] < size:
                disparity[y, x] = -1
