"""All that the page of a flight's diagnosis draws, measured once and kept as drawing.json."""

from pathlib import Path
from typing import Literal

import numpy as np

from depthsim.gap.flight.data.axes import Axis, axes_of
from depthsim.gap.flight.findings import Findings
from depthsim.gap.flight.where.localize import profile
from depthsim.gap.report.drawing import Array, Drawn

_LONGEST = 60.0
"""[s] of a log that is drawn."""
_SHOWN = ("speed", "airspeed_direction", "thrust", "acceleration", "angular_rate", "altitude")


class AxisErrors(Drawn):
    """RMS of the residual [m/s²] in the parts of an axis, before and after; middle: of each part."""

    label: str
    middle: tuple[float, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]


class FlightDrawing(Drawn):
    """What the page draws beside diagnosis.json.

    time: (n,) [s] in the air; before, after: (n, A) residuals [m/s²]; noise: (A,) [m/s²]; body_axes: the names of A.
    """

    kind: Literal["flight"] = "flight"
    title: str
    subtitle: str
    axes: tuple[AxisErrors, ...]
    body_axes: tuple[str, ...]
    time: Array
    before: Array
    after: Array
    noise: Array


def measure_drawing(found: Findings) -> FlightDrawing:
    """Measure what is to be drawn of a diagnosis."""
    records = found.problem.records
    names = ", ".join(Path(name).name for name in records.files)
    seconds = sum(part.seconds for part in records.parts)
    part = records.parts[0]
    rows = np.arange(min(len(part), int(_LONGEST / part.step)))
    return FlightDrawing(
        title=f"Flight diagnosis: {found.problem.model.vehicle.name}",
        subtitle=f"{names}; {seconds:.0f} s in the air",
        axes=tuple(_errors(found, axis) for axis in axes_of(found.state, found.problem.config) if axis.name in _SHOWN),
        body_axes=tuple("xyz"[axis] for axis in records.axes),
        time=part.log.t[part.rows[rows]] - part.log.t[part.rows[0]],
        before=found.before[rows],
        after=found.after[rows],
        noise=found.noise,
    )


def _errors(found: Findings, axis: Axis) -> AxisErrors:
    shape = np.sqrt(len(found.noise))
    before, after = (profile(r, found.state, 0 * found.noise, axis) for r in (found.before, found.after))
    return AxisErrors(
        label=f"{axis.name.replace('_', ' ')} [{axis.unit}]",
        middle=tuple(0.5 * (low + high) for low, high, _ in before),
        before=tuple(rms / shape for _, _, rms in before),
        after=tuple(rms / shape for _, _, rms in after),
    )
