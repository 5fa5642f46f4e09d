"""The last step of the D4 chip: every disparity becomes the mean of those around it that are like it.

librealsense's advanced mode has numbers for it (``STRsm``); the "disparity difference threshold" is 4 px in the default
preset. What they do is not published; 120 frames of a D435 show it: a step of less than 4 px is a straight ramp over 9
pixels, along rows and along columns, and a larger one stays a step.
"""

import numpy as np

from depthsim.kernels import inlined, kernel

_f = np.float32


@inlined
def _add_like(here, there, weight, step, total, count):
    """Add what lies some pixels away, by its weight, where it differs by less than ``step``."""
    for x in range(here.size):
        like = weight[x] if abs(there[x] - here[x]) < step else _f(0)
        total[x] += like * there[x]
        count[x] += like


@kernel
def smooth_rows(start, stop, disparity, across, down, step, steps, out):  # noqa: ANN201 - numba
    """Rows ``start`` to ``stop`` of the mean of what is alike: along the row, and of these means along the column.

    disparity: (H, W) float32 [px], below 0 where there is none. across, down: half the window. step: less than that is
    alike [px]. steps: of a pixel, that the mean is rounded to. out: (H, W) float32, -1 where there is none.
    """
    height, width = disparity.shape
    size, reach = 2 * down + 1, min(across, width - 1)
    # Of the last rows: the mean along the row, and of how many it is.
    means, counts = np.empty((size, width), np.float32), np.empty((size, width), np.float32)
    valid, total, count = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    end = min(stop + down, height)
    for v in range(max(start - down, 0), stop + down):
        if v < end:
            here, mean, number = disparity[v], means[v % size], counts[v % size]
            for x in range(width):
                valid[x] = _f(1) if here[x] >= _f(0) else _f(0)
            mean[:], number[:] = _f(0), _f(0)
            for k in range(-reach, reach + 1):
                a, b = max(0, -k), min(width, width - k)
                _add_like(here[a:b], here[a + k : b + k], valid[a + k : b + k], step, mean[a:b], number[a:b])
            for x in range(width):
                number[x] *= valid[x]
                mean[x] /= max(number[x], _f(1))
        y = v - down
        if y < start:
            continue
        total[:], count[:] = _f(0), _f(0)
        for row in range(max(y - down, 0), min(y + down + 1, height)):
            _add_like(means[y % size], means[row % size], counts[row % size], step, total, count)
        for x in range(width):
            mean_here = np.floor(total[x] / max(count[x], _f(1)) * _f(steps) + _f(0.5)) / _f(steps)
            out[y, x] = mean_here if disparity[y, x] >= _f(0) else _f(-1)
