"""Recording against simulation along the axes that matter."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from depthsim.gap.depth.report.curves import AxisCurves
from depthsim.gap.report.figures import Picture, figure, png


def curves_picture(axes: Sequence[AxisCurves]) -> Picture:
    """Bias, spread and holes along each of ``axes``, a row of pictures for each."""
    with figure(9.6, 2.25 * len(axes) + 0.4) as drawn:
        grid = drawn.subplots(len(axes), 3, squeeze=False)
        for row, axis in zip(grid, axes, strict=True):
            _row(list(row), axis)
        handles, names = grid[0, 0].get_legend_handles_labels()
        drawn.legend(handles, names, loc="outside upper left", ncols=len(names))
        caption = (
            "Bias (median error), spread (half of the middle 68 %) and holes along the axes that matter most, with "
            "95 % bands from blocks of frames. x: times the spread of the simulator at the same range and material."
        )
        return Picture(png(drawn), caption)


def _row(row: list[Axes], place: AxisCurves) -> None:
    metric = place.spread is not None
    count = place.curves[0].value.shape[1]
    size = np.ones(count) if place.spread is None else place.spread
    scale = np.stack([np.ones(count), size, np.full(count, 100.0)])
    titles = "bias [x]", f"spread [{'mm' if metric else 'x'}]", "holes [%]"
    for k, ax in enumerate(row):
        for one in place.curves:
            _line(ax, place, one.value[k] * scale[k], one.band[k] * scale[k], one.name, one.colour)
        ax.set(title=titles[k], xlabel=place.label)
        ax.grid(True)
        if k == 0:
            ax.axhline(0, color="#9aa5b1", lw=0.8, zorder=1)
            low, high = ax.get_ylim()
            ax.set_ylim(min(low, -0.2), max(high, 0.2))
        elif k == 1 and metric:
            ax.set_yscale("log")
        else:
            ax.set_ylim(bottom=0)
            if k == 2:
                ax.set_ylim(top=max(ax.get_ylim()[1], 1.0))
        if place.edges is None:
            ax.set_xticks(range(len(place.names)), place.names, rotation=40, ha="right", fontsize=7.5)


def _line(ax: Axes, place: AxisCurves, value: np.ndarray, band: np.ndarray, name: str, colour: str) -> None:
    known = np.isfinite(value)
    if place.edges is None:
        shift = {0: -0.15, 1: 0.0, 2: 0.15}[min(len(ax.containers), 2)]
        x = np.arange(len(value)) + shift
        ax.errorbar(x[known], value[known], band[known], fmt="o", ms=4, lw=1.2, capsize=2, color=colour, label=name)
        return
    x = (place.edges[:-1] + place.edges[1:]) / 2
    ax.fill_between(x[known], (value - band)[known], (value + band)[known], color=colour, alpha=0.18, lw=0)
    style = "--" if name != "recording" and "causes" in name else "-"
    ax.plot(x[known], value[known], style, color=colour, lw=1.6, marker="o", ms=2.5, label=name)
