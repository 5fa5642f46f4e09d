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
    first, begin = np.empty(height * width, np.int32), np.empty(height * width, np.int32)
    length, pixels = np.empty(height * width, np.int32), np.empty(height * width, np.int32)
    rows = np.empty((2, width), np.int32)
    count = 0
    for y in range(height):
        above, row = rows[(y + 1) % 2], rows[y % 2]
        joined = -1
        for x in range(width):
            here = disparity[y, x]
            row[x] = -1
            if here < 0:
                continue
            if x == 0 or row[x - 1] < 0 or abs(here - disparity[y, x - 1]) > step:
                first[count], begin[count], length[count] = count, y * width + x, 0
                count += 1
                joined = -1
            run = count - 1
            row[x] = run
            length[run] += 1
            if y == 0 or above[x] < 0 or above[x] == joined or abs(here - disparity[y - 1, x]) > step:
                continue
            joined = above[x]
            a, b = _root(first, joined), _root(first, run)
            first[max(a, b)] = min(a, b)
    for run in range(count):
        pixels[run] = length[run]
    for run in range(count - 1, -1, -1):
        if first[run] != run:
            pixels[first[run]] += pixels[run]
    for run in range(count):
        pixels[run] = pixels[first[run]]
        if pixels[run] < size:
            y, x = begin[run] // width, begin[run] % width
            disparity[y, x : x + length[run]] = -1
