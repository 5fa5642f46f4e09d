"""Which part of an axis holds most of what lies along it."""

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.axis import Axis

Floats = NDArray[np.float64]
_MOST = 3
"""Cells without an order that are named at most."""


def main_part(axis: Axis, shares: Floats, enough: float = 0.7) -> NDArray[np.int64]:
    """The fewest cells that hold ``enough`` of the whole: in a row, in a rectangle, or the three largest at most.

    shares: (cells,) of the axis, 1 together.
    """
    if axis.edges is not None:
        return shortest_row(shares, enough)
    if axis.columns:
        return smallest_rectangle(shares.reshape(-1, axis.columns), enough)
    order = np.argsort(-shares)
    return order[: min(int(np.searchsorted(np.cumsum(shares[order]), enough)) + 1, _MOST)]


def shortest_row(shares: Floats, enough: float) -> NDArray[np.int64]:
    """The shortest row of cells that holds ``enough`` of the whole, or all of them."""
    sums = np.concatenate([[0], np.cumsum(shares)])
    best = (0, len(shares))
    for begin in range(len(shares)):
        end = int(np.searchsorted(sums, sums[begin] + enough - 1e-12))
        if end <= len(shares) and end - begin < best[1] - best[0]:
            best = (begin, end)
    return np.arange(*best)


def smallest_rectangle(shares: Floats, enough: float) -> NDArray[np.int64]:
    """The cells of the smallest rectangle of (rows, columns) that holds ``enough`` of the whole, or all of them."""
    rows, columns = shares.shape
    best = np.arange(shares.size)
    for top in range(rows):
        for bottom in range(top + 1, rows + 1):
            band = shares[top:bottom].sum(axis=0)
            across = shortest_row(band, enough)
            if (bottom - top) * len(across) < len(best) and band[across].sum() >= enough - 1e-12:
                best = (np.arange(top, bottom)[:, None] * columns + across).ravel()
    return best
