"""Tiles: blocks of pixels that have one value each, as a picture has that was decimated and scaled back to its size."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

_SIDES = range(8, 1, -1)
"""[px] The factors of a decimation, the largest first: of tiles of four those of two are alike, too."""
_ALIKE = 0.9
"""Of the tiles without holes, that are alike all over."""
_BESIDE = 0.5
"""The same of tiles half a side farther, at most: depth without noise is alike all over on what is flat."""


def find_tiles(pictures: Iterable[NDArray[np.uint16]]) -> int | None:
    """The side of the tiles [px], from the first row and column on; None where there are none.

    pictures: (height, width) as they are stored, each as a whole.
    """
    some = list(pictures)
    for side in _SIDES:
        alike = [_alike(units, side) for units in some]
        beside = [_alike(units[side // 2 :, side // 2 :], side) for units in some]
        if some and np.mean(alike) >= _ALIKE and np.mean(beside) <= _BESIDE:
            return side
    return None


def _alike(units: NDArray[np.uint16], side: int) -> float:
    """Share of the tiles without holes whose pixels all have one value."""
    down, across = (n // side for n in units.shape)
    tiles = units[: down * side, : across * side].reshape(down, side, across, side)
    least, most = tiles.min(axis=(1, 3)), tiles.max(axis=(1, 3))
    whole = least > 0
    return float((whole & (least == most)).sum() / max(whole.sum(), 1))
