"""The pictures of a diagnosis: what is missed along each axis, and over time, before and after."""

import io
from typing import Any

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.flight.data.axes import axes_of
from depthsim.gap.flight.findings import Flown
from depthsim.gap.flight.where.localize import profile

_BEFORE, _AFTER, _FLOOR = "#c8553d", "#1f6feb", "#8a8f98"
_LONGEST = 60.0
"""[s] of a log that is drawn."""
_SHOWN = ("speed", "airspeed_direction", "thrust", "acceleration", "angular_rate", "altitude")


def axes_png(flown: Flown) -> bytes:
    """RMS of the residual above the noise along every axis, before and after the causes were added."""
    axes = [axis for axis in axes_of(flown.state) if axis.name in _SHOWN]
    rows = -(-len(axes) // 3)
    figure, panels = _figure(rows, 3, (10.0, 2.7 * rows))
    noise = 0 * flown.noise
    shape = np.sqrt(len(flown.noise))
    for panel, axis in zip(panels.ravel(), axes, strict=False):
        for residual, colour, name in ((flown.before, _BEFORE, "before"), (flown.after, _AFTER, "after")):
            parts = profile(residual, flown.state, noise, axis)
            middle = [0.5 * (low + high) for low, high, _ in parts]
            panel.plot(
                middle, [rms / shape for _, _, rms in parts], color=colour, marker="o", ms=3.5, lw=1.8, label=name
            )
        panel.axhline(flown.diagnosis.gap.floor, color=_FLOOR, lw=1.2, ls=(0, (4, 2)), label="noise")
        panel.set_xlabel(f"{axis.name.replace('_', ' ')} [{axis.unit}]")
        panel.set_ylim(bottom=0)
        panel.locator_params(axis="x", nbins=5)
        _plain(panel)
    for panel in panels.ravel()[len(axes) :]:
        panel.set_axis_off()
    for panel in panels[:, 0]:
        panel.set_ylabel("RMS missed [m/s²]")
    panels[0, 0].legend(frameon=False, fontsize=9)
    return _png(figure)


def time_png(flown: Flown) -> bytes:
    """The residual over the first minute in the air, along each axis of the body."""
    axes = flown.problem.records.axes
    part = flown.problem.records.parts[0]
    rows = np.arange(min(len(part), int(_LONGEST / part.step)))
    time = part.log.t[part.rows[rows]] - part.log.t[part.rows[0]]
    figure, panels = _figure(len(axes), 1, (10.0, 1.7 * len(axes) + 0.6), sharex=True)
    for number, (panel, axis) in enumerate(zip(panels.ravel(), axes, strict=True)):
        panel.axhspan(-2 * flown.noise[number], 2 * flown.noise[number], color="#e6e9ed", lw=0, label="noise, ±2 σ")
        _line(panel, time, flown.before[rows, number], _BEFORE, "before")
        _line(panel, time, flown.after[rows, number], _AFTER, "after")
        panel.set_ylabel(f"body {'xyz'[axis]} [m/s²]")
        _plain(panel)
    panels.ravel()[0].legend(frameon=False, fontsize=9, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    panels.ravel()[-1].set_xlabel("time in the air [s]")
    return _png(figure)


def _line(panel: Any, time: Floats, values: Floats, colour: str, name: str) -> None:
    panel.plot(time, values, color=colour, lw=1.1, label=name)


def _figure(rows: int, columns: int, size: tuple[float, float], **keys: Any) -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained", dpi=130)
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False, **keys)


def _plain(panel: Any) -> None:
    panel.grid(True, color="#e3e5e8", linewidth=0.8)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)


def _png(figure: Any) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()
