"""Matching cost: how many bits of the census differ, added over a window, for every pixel and disparity.

Census transform: R. Zabih and J. Woodfill, "Non-parametric local transforms for computing visual correspondence",
ECCV 1994. It asks only which of two pixels is brighter, so exposure, vignetting and gain cancel.
"""

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import inlined, kernel
from depthsim.llvm import count_bits

ACROSS, DOWN = 4, 3
BITS = (2 * ACROSS + 1) * (2 * DOWN + 1) - 1
"""Bits of the 9x7 census."""
OUTSIDE = 18
"""Bits for a disparity that leaves the right image: worse than a match and better than chance (31), so that the band at
the left keeps the disparity of what lies beside it and is known to be outside."""


@kernel
def census(start, stop, image, tolerance, out):  # noqa: ANN201 - numba
    """Rows ``start`` to ``stop`` of the code of every pixel: for every second neighbour, brighter and darker.

    image: (H, W) float32; its border is repeated. tolerance: what the two may differ by and count as neither.
    out: (H, W) uint64.
    """
    height, width = image.shape
    for y in range(start, stop):
        row = out[y]
        row[:] = np.uint64(0)
        for dy in range(-DOWN, DOWN + 1):
            above = image[min(max(y + dy, 0), height - 1)]
            for dx in range(-ACROSS, ACROSS + 1):
                if (dx == 0 and dy == 0) or (dx + dy) % 2 != 0:
                    continue
                for x in range(width):
                    difference = above[min(max(x + dx, 0), width - 1)] - image[y, x]
                    bits = np.uint64(difference > tolerance) | (np.uint64(difference < -tolerance) << np.uint64(1))
                    row[x] = (row[x] << np.uint64(2)) | bits


def noise_level(image: NDArray[np.float32]) -> float:
    """Standard deviation of an image's noise, from the calmer part of the image.

    J. Immerkær, "Fast noise variance estimation", Computer Vision and Image Understanding 64(2), 1996: a mask that is
    blind to edges. The third decile in place of the mean keeps texture and dots out.
    """
    if min(image.shape) < 3:
        return 0.0
    bent = image[:, :-2] - 2 * image[:, 1:-1] + image[:, 2:]
    bent = np.abs(bent[:-2] - 2 * bent[1:-1] + bent[2:])
    # 0.3853 is the third decile of the absolute value of a standard normal number.
    return float(np.percentile(bent, 30)) / (6 * 0.3853)


@inlined
def _hamming_row(left, right, disparities, out):
    """out[x, d] = bits that differ between left[x] and right[x - d]."""
    width = left.size
    # The right row backwards, so that d runs upwards in memory.
    flipped = np.empty(width + disparities, np.uint64)
    for x in range(width):
        flipped[x] = right[width - 1 - x]
    for x in range(width):
        at, code = width - 1 - x, left[x]
        inside = min(disparities, x + 1)
        for d in range(inside):
            out[x, d] = np.uint8(count_bits(code ^ flipped[at + d]))
        for d in range(inside, disparities):
            out[x, d] = np.uint8(OUTSIDE)


@kernel
def cost_rows(start, stop, left, right, across, down, out):  # noqa: ANN201 - numba
    """Fill rows ``start`` to ``stop`` of the cost.

    left, right: (H, W) uint64 census. across, down: half the window. out: (H, W, D) int16; at the image's border the
    window repeats the last row and column, so all costs are sums of as many.
    """
    height, width, disparities = out.shape
    size = 2 * down + 1
    ring = np.empty((size, width, disparities), np.uint8)
    column = np.zeros((width, disparities), np.int16)
    for k in range(start - down, start + down):
        y = min(max(k, 0), height - 1)
        _hamming_row(left[y], right[y], disparities, ring[k % size])
        part = ring[k % size]
        for x in range(width):
            for d in range(disparities):
                column[x, d] = np.int16(column[x, d] + np.int16(part[x, d]))
    for v in range(start, stop):
        y = min(v + down, height - 1)
        newest = ring[(v + down) % size]
        _hamming_row(left[y], right[y], disparities, newest)
        for x in range(width):
            for d in range(disparities):
                column[x, d] = np.int16(column[x, d] + np.int16(newest[x, d]))
        row = out[v]
        row[0] = np.int16(0)
        for k in range(-across, across + 1):
            part = column[min(max(k, 0), width - 1)]
            for d in range(disparities):
                row[0, d] = np.int16(row[0, d] + part[d])
        for x in range(1, width):
            entering, leaving = column[min(x + across, width - 1)], column[max(x - across - 1, 0)]
            before, here = row[x - 1], row[x]
            for d in range(disparities):
                here[d] = np.int16(np.int16(before[d] + entering[d]) - leaving[d])
        oldest = ring[(v - down) % size]
        for x in range(width):
            for d in range(disparities):
                column[x, d] = np.int16(column[x, d] - np.int16(oldest[x, d]))
