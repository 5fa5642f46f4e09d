"""Holes that come in rows or columns: their share changes from one line to the next by more than chance."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

_LEAST = 20
"""Pixels of a line that could have depth, where it counts."""


def holes_in_lines(pictures: Iterable[tuple[NDArray[np.uint16], NDArray[np.bool_]]]) -> float:
    """Variance of the share of holes from line to line, over that of holes drawn one by one; of rows or of columns.

    pictures: (height, width) as they are stored, each with where a surface is seen. What changes slowly over the
    picture is left out: of each line that is looked at which is beside the mean of its neighbours.
    """
    seen, expected = np.zeros(2), np.zeros(2)
    for units, surface in pictures:
        for axis in (0, 1):
            pixels, holes = surface.sum(axis=1 - axis), (surface & (units == 0)).sum(axis=1 - axis)
            rate = float(holes.sum()) / max(float(pixels.sum()), 1.0)
            share, per = holes / np.maximum(pixels, 1), 1 / np.maximum(pixels, 1)
            three = np.minimum(np.minimum(pixels[:-2], pixels[2:]), pixels[1:-1]) >= _LEAST
            beside = share[1:-1] - (share[:-2] + share[2:]) / 2
            seen[axis] += float((beside**2)[three].sum())
            expected[axis] += rate * (1 - rate) * float((per[1:-1] + (per[:-2] + per[2:]) / 4)[three].sum())
    return float((seen / np.maximum(expected, 1e-12)).max())
