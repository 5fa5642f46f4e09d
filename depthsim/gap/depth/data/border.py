"""Rows and columns at the picture's border that are empty in every frame, though what lies there is seen elsewhere.

Depth that was resampled into another camera's picture, or rectified, covers less than the whole of it. How many rows
and columns that are is a count, and needs no fit.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from depthsim.units import SATURATED

Border = tuple[int, int, int, int]
"""Columns on the left and on the right, rows at the top and at the bottom."""
_FULL, _SEEN = 0.98, 0.5
"""Of a line's pixels: with so many empty it is of the border; and of the pixels as far away elsewhere at most."""
_LEAST = 2
"""[px] A single line may be lost by a filter."""
_ENOUGH = 200
"""Pixels of the scene in the border, and as far away elsewhere."""


def find_border(frames: Iterable[tuple[NDArray, NDArray[np.uint16], NDArray]], height: int) -> Border | None:
    """The empty border of some frames; None where there is none, or where it may be due to how far things are.

    frames: of each the rows of the picture that are looked at, (rows, width) what is stored there, and the clean depth.
    height: of the picture. A border on the left alone is a stereo camera's, which is as wide as the disparity.
    """
    looked = [(rows, (units == 0) | (units >= SATURATED), depth) for rows, units, depth in frames]
    if not looked:
        return None
    width = looked[0][1].shape[1]
    empty, seen = np.zeros((height, width)), np.zeros((height, width))
    for rows, holes, _ in looked:
        empty[rows] += holes
        seen[rows] += 1
    top, bottom = _ends(empty.sum(axis=1), seen.sum(axis=1))
    inner = slice(top, height - bottom)
    left, right = _ends(empty[inner].sum(axis=0), seen[inner].sum(axis=0))
    inside = np.zeros((height, width), np.bool_)
    inside[inner, left : width - right] = True
    if not (right or top or bottom) or inside.sum() < inside.size / 2:
        return None
    within = np.concatenate([inside[rows][depth > 0] for rows, _, depth in looked])
    far, lost = (np.concatenate([frame[k][frame[2] > 0] for frame in looked]) for k in (2, 1))
    if np.count_nonzero(~within) < _ENOUGH:
        return None
    nearest, farthest = np.quantile(far[~within], (0.1, 0.9))
    alike = within & (far >= nearest) & (far <= farthest)
    if np.count_nonzero(alike) < _ENOUGH or lost[alike].mean() > _SEEN:
        return None
    return left, right, top, bottom


def _ends(empty: NDArray[np.float64], seen: NDArray[np.float64]) -> tuple[int, int]:
    """How many lines at either end are empty; lines that are not looked at are as those about them."""
    at = np.flatnonzero(seen)
    full = empty[at] >= _FULL * seen[at]
    if full.all():
        return 0, 0
    whole = np.flatnonzero(~full)
    first = int(at[whole[0] - 1]) + 1 if whole[0] else 0
    last = len(seen) - int(at[whole[-1] + 1]) if whole[-1] + 1 < len(at) else 0
    return (first if first >= _LEAST else 0), (last if last >= _LEAST else 0)
