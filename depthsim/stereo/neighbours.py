"""The neighbour test: depth stays where enough of what lies around it has passed the tests on its own."""

import numpy as np

from depthsim.kernels import kernel


@kernel
def drop_lonely_rows(start, stop, firm, across, down, share, out):  # noqa: ANN201 - numba
    """Set rows ``start`` to ``stop`` of ``out`` to -1 where too few of the window's pixels are firm.

    firm: (H, W) uint8, 1 where a pixel is sure of its match. across, down: half the window; only what lies inside the
    image counts. share: of the window that must be firm. out: (H, W) int16, changed.
    """
    height, width = firm.shape
    column = np.zeros(width, np.int32)
    for y in range(max(start - down, 0), min(start + down, height)):
        for x in range(width):
            column[x] += firm[y, x]
    for y in range(start, stop):
        if y + down < height:
            for x in range(width):
                column[x] += firm[y + down, x]
        rows = min(y + down, height - 1) - max(y - down, 0) + 1
        count = 0
        for x in range(min(across, width)):
            count += column[x]
        for x in range(width):
            if x + across < width:
                count += column[x + across]
            if x - across > 0:
                count -= column[x - across - 1]
            columns = min(x + across, width - 1) - max(x - across, 0) + 1
            if count < share * (rows * columns):
                out[y, x] = np.int16(-1)
        if y >= down:
            for x in range(width):
                column[x] -= firm[y - down, x]
