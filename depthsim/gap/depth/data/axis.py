"""One axis along which the gap is looked for: its cells, what is counted there, and what they are called."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.counting import NO_CELL
from depthsim.gap.depth.data.covariates import Covariates
from depthsim.gap.depth.data.histograms import BINS

Cells = Callable[[Covariates, int], NDArray[np.integer]]


@dataclass(frozen=True)
class Axis:
    """One way to cut the pixels of a run into cells.

    name: as in diagnosis.json; two joined by " x " for a pair. kind: which histogram is counted in every cell.
    size: how many cells there are. cells: the cell of every pixel of a frame, from its covariates and its number; -1 is
    none. label: some of the cells in words. unit: of the axis, or empty.
    single: whether it is cut along itself alone, and not a pair or a closer look at an axis that is there already.
    edges: (size + 1,) where the cells begin and end [unit], None where they have no order. columns: of cells that are
    places in the picture, row by row; 0 for others. bars: for an axis that is drawn by names, the bar of each
    cell, (size,), and the names. drawn_as: what a drawing says beside it, where that is not its name and unit.
    """

    name: str
    kind: int
    size: int
    cells: Cells
    label: Callable[[NDArray[np.int64]], str]
    unit: str = ""
    single: bool = True
    edges: NDArray[np.floating] | None = None
    columns: int = 0
    bars: tuple[NDArray[np.int64], tuple[str, ...]] | None = None
    drawn_as: str = ""

    @property
    def names(self) -> set[str]:
        """The axis, or the two of a pair."""
        return set(self.name.split(" x "))

    @property
    def title(self) -> str:
        """What a drawing says beside the axis."""
        unit = {"": "", "1": " [share of the corner's]", "deg": " [°]"}.get(self.unit, f" [{self.unit}]")
        return self.drawn_as or self.name.replace("_", " ") + unit

    def interval(self, cells: NDArray[np.int64]) -> tuple[float, float] | None:
        """The part of the axis that the cells cover [unit], or None where it has no order."""
        if self.edges is None or not len(cells):
            return None
        return float(self.edges[cells.min()]), float(self.edges[cells.max() + 1])


def frame_cells(axes: list[Axis], c: Covariates, frame: int, mask: NDArray[np.bool_] | None) -> NDArray[np.uint16]:
    """(axes, pixels): the cell of each pixel on each axis; NO_CELL where it is not counted. mask: (height, width)."""
    out = np.empty((len(axes), c.depth.size), np.uint16)
    for w, axis in enumerate(axes):
        cell = np.asarray(axis.cells(c, frame))
        counted = (cell >= 0) & (cell < axis.size)
        out[w] = np.where(counted if mask is None else counted & mask, cell, NO_CELL).reshape(-1)
    return out


def layout(axes: list[Axis]) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """The kind of each axis, where its counts begin, and how many counts there are in all."""
    kinds = np.array([axis.kind for axis in axes], np.int64)
    sizes = np.array([axis.size for axis in axes], np.int64) * BINS[kinds]
    return kinds, np.concatenate([[0], np.cumsum(sizes)[:-1]]), int(sizes.sum())
