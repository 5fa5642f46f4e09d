"""Sub-pixel disparity: a least-squares shift of the right image against the left, over each pixel's support region.

The shift is that of B. Lucas and T. Kanade, "An iterative image registration technique", IJCAI 1981, with the mean of
both images' slopes, which makes a step exact to second order. The region is a cross, as in K. Zhang, J. Lu and
G. Lafruit, "Cross-based local stereo matching using orthogonal integral images", IEEE TCSVT 19(7), 2009, and as the
D4 chip's "RAU support vectors" (west, east, north, south): it ends where the disparity is another, so it does not
reach over edges.
"""

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import inlined, kernel

STEPS = 32
"""Steps of a pixel: fractional_bits = 5 in librealsense, src/proc/disparity-transform.h; measured as well."""
_REACH = 3
"""[px] Of Lanczos' kernel (C. E. Duchon, "Lanczos filtering in one and two dimensions", J. Applied Meteorology 18,
1979). Dots at 424x240 are narrower than a pixel: cubic interpolation moves them by up to 0.04 px, and by differences of
neighbours in place of the kernel's own slope the steps go so far wrong that two of them leave 0.12 px."""
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


def _kernel() -> NDArray[np.float32]:
    """(32, 6, 2) the weights of six pixels in the value and in the slope between the middle two, by 32nds."""

    def weights(t: NDArray[np.float64]) -> NDArray[np.float64]:
        away = t[:, None] - np.arange(1 - _REACH, _REACH + 1)
        bell = np.sinc(away) * np.sinc(away / _REACH)
        return np.asarray(bell / bell.sum(axis=1, keepdims=True))

    t, step = np.arange(STEPS) / STEPS, 1e-5
    return np.stack([weights(t), (weights(t + step) - weights(t - step)) / (2 * step)], axis=-1).astype(np.float32)


_KERNEL = _kernel()


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
        near, far = left[y], right[y]
        for x in range(width):
            d = disparity[y, x]
            weight, moment = np.float32(0), np.float32(0)
            place = np.int64(x * STEPS) - np.int64(d * np.float32(STEPS))
            at, phase = place // STEPS - (_REACH - 1), place % STEPS
            if d >= 0 and _REACH <= x < width - _REACH and at >= 0 and at <= width - 2 * _REACH:
                here, slope = np.float32(0), np.float32(0)
                for k in range(2 * _REACH):
                    here += _KERNEL[phase, k, 0] * far[at + k]
                    slope += _KERNEL[phase, k, 1] * far[at + k] + _KERNEL[0, k, 1] * near[x - (_REACH - 1) + k]
                slope *= np.float32(0.5)
                weight = slope * slope
                moment = weight * d + slope * (here - near[x])
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
