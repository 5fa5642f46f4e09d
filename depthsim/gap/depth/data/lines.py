"""Holes, or outliers, that come in rows or columns: their share changes from line to line by more than chance."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

_LEAST = 20
"""Pixels of a line that could have depth, where it counts."""
_FAR = 5 / 0.6745
"""Of the median of what errors are off by, which is 0.6745 of a normal distribution's standard deviation."""


def in_lines(pictures: Iterable[tuple[NDArray[np.bool_], NDArray[np.bool_]]], widest: int = 1) -> float:
    """Variance of the share of some pixels from line to line, over that of pixels drawn one by one; of rows or columns.

    pictures: (height, width) which pixels they are, such as holes, each with those that could be. widest: the most rows
    or columns [px] that are one line; in wider ones than one pixel clumps vary as much, and so such rows are held
    against columns as wide, and columns against rows. What changes slowly over the picture is left out: of each line
    that is looked at which is beside the mean of its neighbours.
    """
    seen, expected = np.zeros((widest, 2)), np.zeros((widest, 2))
    for some, surface in pictures:
        for axis in (0, 1):
            pixels, marked = surface.sum(axis=1 - axis), (surface & some).sum(axis=1 - axis)
            for number in range(widest):
                variance, by_chance = _of_lines(pixels, marked, number + 1)
                seen[number, axis] += variance
                expected[number, axis] += by_chance
    times = seen / np.maximum(expected, 1e-12)
    times[1:] /= np.maximum(times[1:, ::-1], 1.0)
    return float(times.max())


def _of_lines(pixels: NDArray[np.int64], marked: NDArray[np.int64], wide: int) -> tuple[float, float]:
    """Sum of the squares of how the share of one line differs from its neighbours', and what that is by chance.

    pixels, marked: (rows,) how many pixels of a row could be marked, and are. wide: rows in a line.
    """
    rate, lines = float(marked.sum()) / max(float(pixels.sum()), 1.0), len(pixels) // wide
    pixels, marked = (one[: lines * wide].reshape(lines, wide).sum(axis=1) for one in (pixels, marked))
    share, per = marked / np.maximum(pixels, 1), 1 / np.maximum(pixels, 1)
    three = np.minimum(np.minimum(pixels[:-2], pixels[2:]), pixels[1:-1]) >= _LEAST
    beside = share[1:-1] - (share[:-2] + share[2:]) / 2
    by_chance = rate * (1 - rate) * float((per[1:-1] + (per[:-2] + per[2:]) / 4)[three].sum())
    return float((beside**2)[three].sum()), by_chance


def far_off(depth: NDArray[np.float64], clean: NDArray[np.float64], seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(height, width) where the disparity is off by more than five times its spread. seen: pixels that have depth."""
    if not seen.any():
        return seen
    error = np.divide(1.0, depth, out=np.zeros_like(depth), where=seen)
    error -= np.divide(1.0, clean, out=np.zeros_like(clean), where=seen)
    beside = np.abs(error - np.median(error[seen]))
    return seen & (beside > _FAR * np.median(beside[seen]))
