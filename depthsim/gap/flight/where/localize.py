"""Where a gap lies: for each axis the part of it that has most, with its share."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.table import Floats
from depthsim.gap.diagnosis import Cut, What, rounded
from depthsim.gap.flight.data.axes import AXES, Axis, State
from depthsim.gap.flight.data.evidence import Problem
from depthsim.gap.flight.where.correction import Learned

_PARTS = 4


def cuts(
    problem: Problem, residual: Floats, state: State, learned: Sequence[Learned], noise: Floats
) -> tuple[Cut, ...]:
    """The axes in the order of ``learned``. residual: (n, A) [m/s²]; noise: (A,)."""
    axes, limit = {axis.name: axis for axis in AXES}, problem.config.significance
    found: list[Cut] = []
    for one in learned:
        if one.closed < limit.least_axis or len(found) == limit.most_axes:
            continue
        if one.axis == "axis":
            found.append(_body_axis(problem, residual, noise, one))
        elif one.axis == "time":
            parts = _equal(np.arange(len(state.time)))
            found.append(_most(residual, noise, parts, state.time, "time", "s", one))
        elif one.axis == "place" and state.place is not None:
            xy = state.place[:, :2]
            found.append(_most(residual, noise, _quarters(xy), xy, "place", "m", one))
        else:
            axis = axes[one.axis]
            value = axis.value(state)
            found.append(_most(residual, noise, _parts_of(axis, value), value, axis.name, axis.unit, one))
    return tuple(found)


def profile(residual: Floats, state: State, noise: Floats, axis: Axis) -> list[tuple[float, float, float]]:
    """(low, high, RMS above the noise) of each part of an axis, for a picture."""
    value = axis.value(state)
    floor = float((noise**2).sum())
    found = []
    for rows in _parts_of(axis, value, 8):
        power = float((residual[rows] ** 2).sum(axis=1).mean()) - floor
        found.append((float(value[rows].min()), float(value[rows].max()), float(np.sqrt(max(power, 0.0)))))
    return found


def _parts_of(axis: Axis, value: Floats, parts: int = _PARTS) -> list[NDArray[np.int_]]:
    if axis.name == "airspeed_direction":
        edges = np.linspace(-180, 180, parts + 1)
        found = [np.flatnonzero((value >= a) & (value < b)) for a, b in pairwise(edges)]
        return [rows for rows in found if rows.size]
    return _equal(value, parts)


def _equal(value: Floats | NDArray[np.int_], parts: int = _PARTS) -> list[NDArray[np.int_]]:
    return [rows for rows in np.array_split(np.argsort(value, kind="stable"), parts) if rows.size]


def _powers(residual: Floats, noise: Floats, parts: list[NDArray[np.int_]]) -> list[float]:
    """Squares above the noise, summed over the samples of each part."""
    return [max(float((residual[rows] ** 2).sum() - len(rows) * (noise**2).sum()), 0.0) for rows in parts]


def _most(
    residual: Floats, noise: Floats, parts: list[NDArray[np.int_]], value: Floats, name: str, unit: str, one: Learned
) -> Cut:
    """The part with most; value: (n,) of an axis in ``unit``, or (n, 2) places."""
    powers = _powers(residual, noise, parts)
    at = int(np.argmax(powers))
    share = powers[at] / max(sum(powers), 1e-12)
    low, high = value[parts[at]].min(axis=0), value[parts[at]].max(axis=0)
    if name == "place":
        where = label = f"x {low[0]:.1f} to {high[0]:.1f}, y {low[1]:.1f} to {high[1]:.1f}"
        interval = None
    else:
        where, label = f"{name.replace('_', ' ')} {low:.3g} to {high:.3g}", None
        interval = rounded((float(low), float(high)), 4)
    text = f"{share:.0%} of the gap at {where} {unit}; a correction learned on it closes {_closed(one)} of its power"
    what = "correlation" if name == "time" else _what(residual, parts[at])
    return Cut(
        axis=name, interval=interval, label=label, unit=unit, share_of_gap=rounded(share, 4), what=what,
        text=" ".join(text.split()),
    )  # fmt: skip


def _body_axis(problem: Problem, residual: Floats, noise: Floats, one: Learned) -> Cut:
    powers = np.maximum((residual**2).sum(axis=0) - len(residual) * noise**2, 0.0)
    at = int(np.argmax(powers))
    share = float(powers[at] / max(powers.sum(), 1e-12))
    label = "xyz"[problem.records.axes[at]]
    text = f"{share:.0%} of the gap along body {label}; a constant force closes {_closed(one)} of its power"
    what = _what(residual, np.arange(len(residual)))
    return Cut(axis="axis", label=label, share_of_gap=rounded(share, 4), what=what, text=text)


def _quarters(xy: Floats) -> list[NDArray[np.int_]]:
    """Samples by the side of the middle that they lie on, in x and in y."""
    sides = (xy > np.median(xy, axis=0)) @ np.array([1, 2])
    return [np.flatnonzero(sides == side) for side in range(4) if (sides == side).any()]


def _closed(one: Learned) -> str:
    return f"{max(one.closed, 0.0):.0%}"


def _what(residual: Floats, rows: NDArray[np.int_]) -> What:
    """bias where the mean makes up most of the power, spread otherwise."""
    part = residual[rows]
    mean = float((part.mean(axis=0) ** 2).sum())
    return "bias" if mean > 0.5 * float((part**2).mean(axis=0).sum()) else "spread"
