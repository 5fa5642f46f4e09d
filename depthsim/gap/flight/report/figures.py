"""The pictures of a diagnosis: what is missed along each axis, and over time, before and after."""

import io
from collections.abc import Sequence
from typing import Any

from depthsim.flight.table import Floats
from depthsim.gap.flight.report.drawing import AxisErrors, FlightDrawing

_BEFORE, _AFTER, _FLOOR = "#c8553d", "#1f6feb", "#8a8f98"


def axes_png(axes: Sequence[AxisErrors], floor: float) -> bytes:
    """RMS of the residual above the noise along every axis, before and after the causes were added."""
    rows = -(-len(axes) // 3)
    figure, panels = _figure(rows, 3, (10.0, 2.7 * rows))
    for panel, axis in zip(panels.ravel(), axes, strict=False):
        for rms, colour, name in ((axis.before, _BEFORE, "before"), (axis.after, _AFTER, "after")):
            panel.plot(axis.middle, rms, color=colour, marker="o", ms=3.5, lw=1.8, label=name)
        panel.axhline(floor, color=_FLOOR, lw=1.2, ls=(0, (4, 2)), label="noise")
        panel.set_xlabel(axis.label)
        panel.set_ylim(bottom=0)
        panel.locator_params(axis="x", nbins=5)
        _plain(panel)
    for panel in panels.ravel()[len(axes) :]:
        panel.set_axis_off()
    for panel in panels[:, 0]:
        panel.set_ylabel("RMS missed [m/s²]")
    panels[0, 0].legend(frameon=False, fontsize=9)
    return _png(figure)


def time_png(drawing: FlightDrawing) -> bytes:
    """The residual over the first minute in the air, along each axis of the body."""
    count = len(drawing.noise)
    figure, panels = _figure(count, 1, (10.0, 1.7 * count + 0.6), sharex=True)
    for number, (panel, name) in enumerate(zip(panels.ravel(), drawing.body_axes, strict=True)):
        panel.axhspan(-2 * drawing.noise[number], 2 * drawing.noise[number], color="#e6e9ed", lw=0, label="noise, ±2 σ")
        _line(panel, drawing.time, drawing.before[:, number], _BEFORE, "before")
        _line(panel, drawing.time, drawing.after[:, number], _AFTER, "after")
        panel.set_ylabel(f"body {name} [m/s²]")
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
