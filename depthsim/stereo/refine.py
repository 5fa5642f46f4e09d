"""Sub-pixel disparity: a least-squares shift of the right image against the left, over each pixel's support region.

The shift is that of B. Lucas and T. Kanade, "An iterative image registration technique", IJCAI 1981, with the mean of
both images' slopes, which makes a step exact to second order. The region is a cross, as in K. Zhang, J. Lu and
G. Lafruit, "Cross-based local stereo matching using orthogonal integral images", IEEE TCSVT 19(7), 2009, and as the
D4 chip's "RAU support vectors" (west, east, north, south): it ends where the disparity is another, so it does not
reach over edges.
"""

import numpy as np

from depthsim.kernels import inlined, kernel

STEPS = 32
"""Steps of a pixel: fractional_bits = 5 in librealsense, src/proc/disparity-transform.h; measured as well."""
ALIKE = 1
"""[px] A disparity that differs by more from the pixel's own ends its support region."""


@kernel
def normalise_rows(start, stop, image, across, down, floor, out):  # noqa: ANN201 - numba
    """out = (image - mean) / sqrt(variance + floor²) over a window, so that gain and offset of the image cancel."""
    height, width = image.shape
    total, square = np.empty(width, np.float64), np.empty(width, np.float64)
    for y in range(start, stop):
        total[:] = 0
        square[:] = 0
        for k in range(-down, down + 1):
            row = image[min(max(y + k, 0), height - 1)]
            for x in range(width):
                value = np.float64(row[x])
                total[x] += value
                square[x] += value * value
        sum1, sum2, count = 0.0, 0.0, (2 * across + 1) * (2 * down + 1)
        for k in range(-across, across + 1):
            sum1 += total[min(max(k, 0), width - 1)]
            sum2 += square[min(max(k, 0), width - 1)]
        for x in range(width):
            mean = sum1 / count
            variance = max(sum2 / count - mean * mean, 0.0)
            out[y, x] = np.float32((image[y, x] - mean) / np.sqrt(variance + floor * floor))
            entering, leaving = min(x + across + 1, width - 1), max(x - across, 0)
            sum1 += total[entering] - total[leaving]
            sum2 += square[entering] - square[leaving]


@inlined
def _cubic(row, at, t):
    """``row`` between ``at`` and ``at + 1`` at the share t, by Catmull and Rom's cubic."""
    a, b, c, d = row[at - 1], row[at], row[at + 1], row[at + 2]
    half = np.float32(0.5)
    slope = c - a
    square = np.float32(2) * a - np.float32(5) * b + np.float32(4) * c - d
    cube = np.float32(3) * (b - c) + d - a
    return b + half * t * (slope + t * (square + t * cube))


@inlined
def _arms(line, at, arm):
    """The part of ``line`` about ``at`` that is at most ``arm`` away and whose disparity is alike."""
    low, high = at, at + 1
    while low > 0 and at - low < arm and abs(line[low - 1] - line[at]) <= ALIKE:
        low -= 1
    while high < line.size and high - at <= arm and abs(line[high] - line[at]) <= ALIKE:
        high += 1
    return low, high


@inlined
def _tilt(line, low, high):
    """The change of disparity per pixel from ``low`` to ``high``, both of which have one, or 0."""
    if high - low < 3 or line[low] < 0 or line[high - 1] < 0:
        return np.float32(0)
    return (line[high - 1] - line[low]) / np.float32(high - 1 - low)


@kernel
def shift_rows(start, stop, left, right, whole, disparity, arm, sums):  # noqa: ANN201 - numba
    """Add up the normal equations along the row, within the support region.

    whole: (H, W) int16, negative where there is none; it shapes the regions. disparity: (H, W) float32, the best that
    is known so far. sums: (H, W, 2) float64: weight, and weight · disparity.
    """
    _, width = disparity.shape
    prefix = np.zeros((width + 1, 3), np.float64)
    for y in range(start, stop):
        source = right[y]
        for x in range(width):
            d = disparity[y, x]
            weight, moment = np.float32(0), np.float32(0)
            place = np.float32(x) - d
            at = np.int64(np.floor(place))
            if d >= 0 and 0 < x < width - 1 and at >= 2 and at < width - 3:
                t = place - np.float32(at)
                before, here = _cubic(source, at - 1, t), _cubic(source, at, t)
                after = _cubic(source, at + 1, t)
                slope = (left[y, x + 1] - left[y, x - 1] + after - before) * np.float32(0.25)
                weight = slope * slope
                moment = weight * d + slope * (here - left[y, x])
            prefix[x + 1, 0] = prefix[x, 0] + weight
            prefix[x + 1, 1] = prefix[x, 1] + moment
            prefix[x + 1, 2] = prefix[x, 2] + weight * x
        for x in range(width):
            low, high = _arms(whole[y], x, arm)
            weight = prefix[high, 0] - prefix[low, 0]
            off = prefix[high, 2] - prefix[low, 2] - weight * x
            # What lies off the middle counts as what it would be at the middle.
            sums[y, x, 0] = weight
            sums[y, x, 1] = prefix[high, 1] - prefix[low, 1] - off * _tilt(disparity[y], low, high)


@kernel
def solve_columns(start, stop, whole, sums, arm, least, out):  # noqa: ANN201 - numba
    """Add the sums along columns within the support region, and solve for the disparity [px] in steps of 1/32.

    least: sum of slope² below which there is too little to see.
    out: (H, W) float32, the disparity so far, written; -1 where there is none.
    """
    height, _ = whole.shape
    prefix = np.zeros((height + 1, 3), np.float64)
    line, before = np.empty(height, np.int16), np.empty(height, np.float32)
    for x in range(start, stop):
        for y in range(height):
            prefix[y + 1, 0] = prefix[y, 0] + sums[y, x, 0]
            prefix[y + 1, 1] = prefix[y, 1] + sums[y, x, 1]
            prefix[y + 1, 2] = prefix[y, 2] + sums[y, x, 0] * y
            line[y], before[y] = whole[y, x], out[y, x]
        for y in range(height):
            out[y, x] = np.float32(-1)
            if line[y] < 0:
                continue
            low, high = _arms(line, y, arm)
            weight, moment = prefix[high, 0] - prefix[low, 0], prefix[high, 1] - prefix[low, 1]
            # Nothing to see is less than any threshold, zero too.
            if weight < least or weight <= 0:
                continue
            off = prefix[high, 2] - prefix[low, 2] - weight * y
            value = (moment - off * _tilt(before, low, high)) / weight
            value = min(max(value, line[y] - 1.0, 0.0), line[y] + 1.0)
            out[y, x] = np.float32(np.floor(value * STEPS + 0.5) / STEPS)
