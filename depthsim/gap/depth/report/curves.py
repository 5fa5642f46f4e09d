"""Bias, spread and holes along an axis, cell by cell, with 95 % bands from blocks of frames."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.axis import Axis
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.histograms import ERROR, ERROR_HOLE, ERROR_NO_SURFACE, MAGNITUDES
from depthsim.gap.report.drawing import Array, Drawn
from depthsim.gap.resampling import jackknife_half

Floats = NDArray[np.float64]
_EDGES = np.concatenate([[-140], -MAGNITUDES[::-1], [0], MAGNITUDES, [140]]).astype(np.float64)
_FEWEST = 60
"""Pixels that a cell needs to be drawn."""


Series = tuple[str, str, NDArray[np.integer] | NDArray[np.float64]]
"""A name, a colour, and (blocks, size) counts."""


class Curve(Drawn):
    """Bias and spread in units of the simulator's spread, holes as a share: (3, groups); band: half of their 95 %."""

    name: str
    colour: str
    value: Array
    band: Array


class AxisCurves(Drawn):
    """The curves of all sensors along one axis.

    edges: (groups + 1,) where the groups of cells begin and end, None where they have names alone. spread: (groups,)
    the simulator's spread there [mm], for the axis range alone.
    """

    label: str
    edges: Array | None
    names: tuple[str, ...]
    spread: Array | None
    curves: tuple[Curve, ...]


@dataclass(frozen=True)
class _Groups:
    """group: (cells,) the place of each cell in the drawing, -1 for none; edges, names as in :class:`AxisCurves`."""

    group: NDArray[np.int64]
    edges: Floats | None
    names: tuple[str, ...]

    @property
    def count(self) -> int:
        return int(self.group.max()) + 1


def axis_curves(evidence: Evidence, number: int, series: Sequence[Series]) -> AxisCurves:
    """What is drawn along the axis ``number``, one that :func:`best_axes` gives."""
    axis, groups = evidence.axes[number], _groups(evidence.axes[number])
    assert groups is not None
    spread = _spread(evidence, groups.edges) if axis.name == "range" and groups.edges is not None else None
    curves = tuple(
        Curve(name=name, colour=colour, value=value, band=band)
        for name, colour, counts in series
        for value, band in [_curve(evidence, number, groups, counts)]
    )
    return AxisCurves(label=axis.title, edges=groups.edges, names=groups.names, spread=spread, curves=curves)


def _curve(
    evidence: Evidence, number: int, drawn: _Groups, counts: NDArray[np.integer] | NDArray[np.float64]
) -> tuple[Floats, Floats]:
    """Value and band of one sensor. counts: (blocks, size)."""
    own = evidence.cells(number, counts).astype(np.float64)
    grouped = np.zeros((len(counts), drawn.count, own.shape[-1]))
    kept = drawn.group >= 0
    for cell in np.flatnonzero(kept):
        grouped[:, drawn.group[cell]] += own[:, cell]
    total = grouped.sum(axis=0)
    value = _numbers(total)
    value[:, total.sum(axis=1) < _FEWEST] = np.nan
    if len(counts) < 3:
        return value, np.zeros_like(value)
    return value, jackknife_half(np.array([_numbers(total - one) for one in grouped]))


def _numbers(counts: Floats) -> Floats:
    """(3, groups) from (groups, bins)."""
    out = np.full((3, len(counts)), np.nan)
    for k, row in enumerate(counts):
        seen = row[:ERROR_HOLE]
        if row.sum() > 0:
            out[2, k] = row[ERROR_HOLE:ERROR_NO_SURFACE].sum() / row.sum()
        if seen.sum() > 0:
            sums = np.concatenate([[0], np.cumsum(seen)]) / seen.sum()
            low, middle, high = np.interp([0.1587, 0.5, 0.8413], sums, _EDGES)
            out[0, k], out[1, k] = middle, (high - low) / 2
    return out


def _groups(axis: Axis) -> _Groups | None:
    """How an axis is drawn; None where it cannot be."""
    if axis.kind != ERROR or not axis.single:
        return None
    if axis.bars is not None:
        return _Groups(axis.bars[0], None, axis.bars[1])
    if axis.edges is None:
        return None
    edges, wide = axis.edges, np.diff(axis.edges) > 1e-9
    if wide.sum() < 2:
        return None
    group = np.where(wide, np.cumsum(wide) - 1, -1)
    return _Groups(group, np.concatenate([edges[:-1][wide], edges[1:][wide][-1:]]).astype(np.float64), ())


def _spread(evidence: Evidence, edges: Floats) -> Floats:
    """(groups,) the mean of the simulator's spread between ranges [mm]."""
    count = len(edges) - 1
    summed, pixels = np.zeros(count), np.zeros(count)
    for frame in list(evidence.frames.values())[:: max(1, len(evidence.frames) // 8)]:
        ok = frame.per_spread > 0
        place = np.clip(np.searchsorted(edges, frame.geometry.depth.reshape(-1)[ok]) - 1, 0, count - 1)
        summed += np.bincount(place, 1000 / frame.per_spread[ok], count)
        pixels += np.bincount(place, minlength=count)
    return np.asarray(summed / np.maximum(pixels, 1))


def best_axes(evidence: Evidence, ranked: Sequence[int], most: int) -> list[int]:
    """The axes to draw: the first of ``ranked`` that can be, each axis once; range is always among them."""
    by_axis: dict[str, int] = {}
    for number in (*ranked, *range(len(evidence.axes))):
        axis = evidence.axes[number]
        wanted = number in ranked or axis.name in ("range", "incidence")
        if wanted and axis.name not in by_axis and _groups(axis) is not None:
            by_axis[axis.name] = number
    selected = list(by_axis)[:most]
    if "range" in by_axis and "range" not in selected:
        selected[-1:] = ["range"] if len(selected) == most else [*selected[-1:], "range"]
    return [by_axis[axis] for axis in selected]
