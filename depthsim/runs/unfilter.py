"""Undoing PNG's row filters; each pixel needs the one before it, so a loop it is, and numba makes it a fast one."""

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import kernel


@kernel
def unfilter(rows: NDArray[np.uint8], step: int, image: NDArray[np.uint8]) -> bool:
    """Undo the filters of PNG's section 9.2 (None, Sub, Up, Average, Paeth); False for a row with another number.

    rows: (height, 1 + n), the filter's number and n filtered bytes. step: bytes a pixel.
    image: (height, n), all zero; it is written.
    """
    height, size = image.shape
    above = np.zeros(size, np.uint8)
    for y in range(height):
        kind, row, out = rows[y, 0], rows[y, 1:], image[y]
        if kind == 0:
            out[:] = row
        elif kind == 1:
            out[:step] = row[:step]
            for i in range(step, size):
                out[i] = row[i] + out[i - step]
        elif kind == 2:
            for i in range(size):
                out[i] = row[i] + above[i]
        elif kind == 3:
            for i in range(size):
                left = np.int32(out[i - step]) if i >= step else np.int32(0)
                out[i] = row[i] + ((left + np.int32(above[i])) >> 1)
        elif kind == 4:
            for i in range(step):
                out[i] = row[i] + above[i]
            for i in range(step, size):
                a, b, c = np.int32(out[i - step]), np.int32(above[i]), np.int32(above[i - step])
                to_a, to_b, to_c = abs(b - c), abs(a - c), abs(a + b - c - c)
                nearest = a if to_a <= to_b and to_a <= to_c else (b if to_b <= to_c else c)
                out[i] = row[i] + nearest
        else:
            return False
        above = out
    return True
