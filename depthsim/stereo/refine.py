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
from depthsim.lanes import choose, load_floats, load_words, round_down, spread, store, sum_of

STEPS = 32
"""Steps of a pixel: fractional_bits = 5 in librealsense, src/proc/disparity-transform.h; measured as well."""
_REACH = 3
"""[px] Of Lanczos' kernel (C. E. Duchon, "Lanczos filtering in one and two dimensions", J. Applied Meteorology 18,
1979). Dots at 424x240 are narrower than a pixel: cubic interpolation moves them by up to 0.04 px, and by differences of
neighbours in place of the kernel's own slope the steps go so far wrong that two of them leave 0.12 px."""
LANES = 16
"""Pixels that are solved at a time."""
ALIKE = 1
"""[px] A disparity that differs by more from the pixel's own ends its support region."""


@kernel
def normalise_rows(start, stop, image, across, down, floor, out):  # noqa: ANN201 - numba
    """out = (image - mean) / sqrt(variance + floor²) over a window, so that gain and offset of the image cancel.

    image: (H, W) float32 of whole numbers below 2 ** 16, so that sums are exact wherever they begin.
    """
    height, width = image.shape
    total, square = np.zeros(width, np.float64), np.zeros(width, np.float64)
    sums, squares = np.empty(width, np.float64), np.empty(width, np.float64)
    share = 1 / ((2 * across + 1) * (2 * down + 1))
    for y in range(start - 2 * down, stop):
        row = image[min(max(y + down, 0), height - 1)]
        for x in range(width):
            value = np.float64(row[x])
            total[x] += value
            square[x] += value * value
        if y < start:
            continue
        sum1, sum2 = 0.0, 0.0
        for k in range(-across, across + 1):
            sum1 += total[min(max(k, 0), width - 1)]
            sum2 += square[min(max(k, 0), width - 1)]
        for x in range(width):
            sums[x], squares[x] = sum1, sum2
            entering, leaving = min(x + across + 1, width - 1), max(x - across, 0)
            sum1 += total[entering] - total[leaving]
            sum2 += square[entering] - square[leaving]
        here, line = image[y], out[y]
        for x in range(width):
            mean = sums[x] * share
            variance = max(squares[x] * share - mean * mean, 0.0)
            line[x] = np.float32((here[x] - mean) / np.sqrt(variance + floor * floor))
        row = image[min(max(y - down, 0), height - 1)]
        for x in range(width):
            value = np.float64(row[x])
            total[x] -= value
            square[x] -= value * value


def _kernel() -> NDArray[np.float32]:
    """(32, 2, 8) the weights of six pixels, and two zeros, in value and slope between the middle two, by 32nds."""

    def weights(t: NDArray[np.float64]) -> NDArray[np.float64]:
        away = t[:, None] - np.arange(1 - _REACH, _REACH + 1)
        bell = np.sinc(away) * np.sinc(away / _REACH)
        return np.asarray(bell / bell.sum(axis=1, keepdims=True))

    t, step = np.arange(STEPS) / STEPS, 1e-5
    both = np.stack([weights(t), (weights(t + step) - weights(t - step)) / (2 * step)], axis=1)
    return np.pad(both, ((0, 0), (0, 0), (0, 8 - 2 * _REACH))).astype(np.float32)


_KERNEL = _kernel()


@inlined
def _grow(row, other, k, arm):
    """Lengthen arms of k - 1 px by one where ``other``, k px away, is alike."""
    before = np.int16(k - 1)
    for x in range(row.size):
        away = np.uint16(other[x] - row[x] + ALIKE)
        longer = np.int16(k) if away <= np.uint16(2 * ALIKE) else before
        arm[x] = longer if arm[x] == before else arm[x]


@kernel
def arms_of_rows(start, stop, whole, across, down, out):  # noqa: ANN201 - numba
    """How far the support regions of rows ``start`` to ``stop`` reach: while the disparity is alike, and no further.

    whole: (H, W) int16. across, down: most [px]. out: (4, H, W) int16: to the left, right, up and down [px].
    """
    height, width = whole.shape
    for y in range(start, stop):
        row = whole[y]
        out[:, y] = np.int16(0)
        for k in range(1, min(across, width - 1) + 1):
            _grow(row[k:], row[:-k], k, out[0, y, k:])
            _grow(row[:-k], row[k:], k, out[1, y, :-k])
        for k in range(1, down + 1):
            if y >= k:
                _grow(row, whole[y - k], k, out[2, y])
            if y + k < height:
                _grow(row, whole[y + k], k, out[3, y])


@inlined
def _tilt(line, first, last):
    """The change of disparity per pixel from ``first`` to ``last``, both of which have one, or 0."""
    if last - first < 2 or line[first] < 0 or line[last] < 0:
        return np.float32(0)
    return (line[last] - line[first]) / np.float32(last - first)


@kernel
def shift_rows(start, stop, left, right, arms, disparity, sums):  # noqa: ANN201 - numba
    """Add up the normal equations along the row, within the support region.

    arms: (2, H, W) int16, left and right, of :func:`arms_of_rows`. disparity: (H, W) float32, the best that is known so
    far, below 0 where there is none. sums: (2, H, W) float32: weight, and weight · disparity.
    """
    _, width = disparity.shape
    prefix = np.zeros((width + 1, 3), np.float64)
    # Two more than there are: eight are read, and the last two weigh nothing.
    near, far = np.zeros(width + 2, np.float32), np.zeros(width + 2, np.float32)
    weights, row, other = _KERNEL.ctypes.data, near.ctypes.data, far.ctypes.data
    level = load_floats(weights + 32, 8)
    for y in range(start, stop):
        near[:width], far[:width] = left[y], right[y]
        for x in range(width):
            d = disparity[y, x]
            weight, moment = np.float32(0), np.float32(0)
            place = np.int64(x * STEPS) - np.int64(d * np.float32(STEPS))
            at, phase = place // STEPS - (_REACH - 1), place % STEPS
            if d >= 0 and _REACH <= x < width - _REACH and at >= 0 and at <= width - 2 * _REACH:
                there = load_floats(other + 4 * at, 8)
                here = sum_of(there * load_floats(weights + 64 * phase, 8))
                slopes = there * load_floats(weights + 64 * phase + 32, 8)
                slope = sum_of(slopes + load_floats(row + 4 * (x - (_REACH - 1)), 8) * level) * np.float32(0.5)
                weight = slope * slope
                moment = weight * d + slope * (here - near[x])
            prefix[x + 1, 0] = prefix[x, 0] + weight
            prefix[x + 1, 1] = prefix[x, 1] + moment
            prefix[x + 1, 2] = prefix[x, 2] + weight * x
        line, to_left, to_right, weights_out, moments_out = disparity[y], arms[0, y], arms[1, y], sums[0, y], sums[1, y]
        for x in range(width):
            # Without sign: numba looks whether others count from the end.
            low, high = np.uint32(x - to_left[x]), np.uint32(x + to_right[x] + 1)
            total = prefix[high, 0] - prefix[low, 0]
            off = prefix[high, 2] - prefix[low, 2] - total * x
            weights_out[x] = total
            # What lies off the middle counts as what it would be at the middle.
            moments_out[x] = prefix[high, 1] - prefix[low, 1] - off * _tilt(line, low, np.uint32(high - 1))


@inlined
def _add_row(k, arm, weights, moments, disparity, weight, moment, off, end, span):
    """Add what lies ``k`` rows away (below 0: above), where the support region reaches as far; addresses, and vectors.

    off: weight · rows away. end, span: disparity at the region's end, and how many rows it has beside the middle one.
    """
    reaches = load_words(arm, LANES) > np.uint16(abs(k) - 1)
    more = choose(reaches, load_floats(weights, LANES), np.float32(0))
    weight, off = weight + more, off + more * np.float32(k)
    moment = moment + choose(reaches, load_floats(moments, LANES), np.float32(0))
    end = choose(reaches, load_floats(disparity, LANES), end)
    return weight, moment, off, end, span + choose(reaches, np.float32(1), spread(np.float32(0), LANES))


@kernel
def solve_rows(start, stop, whole, arms, down, sums, least, before, out):  # noqa: ANN201 - numba
    """Add the sums along columns within the support region, and solve for the disparity [px] in steps of 1/32.

    All pictures have 16 numbers more behind them, which are read. whole: (H, W) float32, -1 where there is none.
    arms: (2, H, W) int16, up and down, of :func:`arms_of_rows`, at most ``down``. least: sum of slope² below which
    there is too little to see. before: (H, W) float32, the disparity so far. out: (H, W), the next; -1 where there is
    none.
    """
    height, width = whole.shape
    found = np.empty(LANES, np.float32)
    none = spread(np.float32(-1), LANES)
    for y in range(start, stop):
        for x in range(0, width, LANES):
            weight, moment = (
                load_floats(sums[0, y, x:].ctypes.data, LANES),
                load_floats(sums[1, y, x:].ctypes.data, LANES),
            )
            off = span = spread(np.float32(0), LANES)
            low = high = load_floats(before[y, x:].ctypes.data, LANES)
            for k in range(1, down + 1):
                if y >= k:
                    weight, moment, off, low, span = _add_row(
                        -k, arms[0, y, x:].ctypes.data, sums[0, y - k, x:].ctypes.data, sums[1, y - k, x:].ctypes.data,
                        before[y - k, x:].ctypes.data, weight, moment, off, low, span,
                    )  # fmt: skip
                if y + k < height:
                    weight, moment, off, high, span = _add_row(
                        k, arms[1, y, x:].ctypes.data, sums[0, y + k, x:].ctypes.data, sums[1, y + k, x:].ctypes.data,
                        before[y + k, x:].ctypes.data, weight, moment, off, high, span,
                    )  # fmt: skip
            # What lies off the middle counts as what it would be at the middle.
            both = choose(low < high, low, high)
            sloped = choose(span > np.float32(1), both, np.float32(-1))
            tilt = choose(sloped < np.float32(0), np.float32(0), (high - low) / span)
            here = load_floats(whole[y, x:].ctypes.data, LANES)
            value = (moment - off * tilt) / weight
            lowest = choose(here > np.float32(1), here - np.float32(1), np.float32(0))
            value = choose(value > lowest, value, lowest)
            value = choose(value < here + np.float32(1), value, here + np.float32(1))
            value = round_down(value * np.float32(STEPS) + np.float32(0.5)) * np.float32(1 / STEPS)
            # Nothing to see is less than any threshold, zero too.
            value = choose(weight > np.float32(0), choose(weight < np.float32(least), np.float32(-1), value), none)
            store(found.ctypes.data, choose(here < np.float32(0), np.float32(-1), value))
            for i in range(min(LANES, width - x)):
                out[y, x + i] = found[i]
