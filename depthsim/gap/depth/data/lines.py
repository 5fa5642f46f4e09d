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
            of_row, marked_of_row = surface.sum(axis=1 - axis), (surface & some).sum(axis=1 - axis)
            rate = float(marked_of_row.sum()) / max(float(of_row.sum()), 1.0)
            for wide in range(1, widest + 1):
                lines = len(of_row) // wide
                pixels, marked = (
                    one[: lines * wide].reshape(lines, wide).sum(axis=1) for one in (of_row, marked_of_row)
                )
                share, per = marked / np.maximum(pixels, 1), 1 / np.maximum(pixels, 1)
                three = np.minimum(np.minimum(pixels[:-2], pixels[2:]), pixels[1:-1]) >= _LEAST
                beside = share[1:-1] - (share[:-2] + share[2:]) / 2
                seen[wide - 1, axis] += float((beside**2)[three].sum())
                by_chance = float((per[1:-1] + (per[:-2] + per[2:]) / 4)[three].sum())
                expected[wide - 1, axis] += rate * (1 - rate) * by_chance
    times = seen / np.maximum(expected, 1e-12)
    times[1:] /= np.maximum(times[1:, ::-1], 1.0)
    return float(times.max())


def far_off(depth: NDArray[np.float64], clean: NDArray[np.float64], seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(height, width) where the disparity is off by more than five times its spread. seen: pixels that have depth."""
    if not seen.any():
        return seen
    error = np.divide(1.0, depth, out=np.zeros_like(depth), where=seen)
    error -= np.divide(1.0, clean, out=np.zeros_like(clean), where=seen)
    beside = np.abs(error - np.median(error[seen]))
    return seen & (beside > _FAR * np.median(beside[seen]))
