"""The picture of a fit: what is left of the force at each speed, under each law."""

import io

import numpy as np

from depthsim.flight.fit.fit import DragFit

_COLOURS = ("#8a8f98", "#c8553d", "#1f4e79", "#5b8e55", "#b08bbb", "#d9a441", "#3b8ea5")
_STYLES = ("-", "-", (0, (5, 2)), (0, (1, 1.5)), (0, (3, 1, 1, 1)), (0, (2, 2)), "-")
_BINS = 14
_LEAST = 30


def plot_png(fit: DragFit) -> bytes:
    """A PNG of the RMSE against lateral speed, a line for each law, over how much was flown at each speed."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 5.2), layout="constrained", dpi=150)
    FigureCanvasAgg(figure)
    panel, below = figure.subplots(2, 1, sharex=True, height_ratios=(4, 1))
    edges = np.linspace(0, float(np.quantile(fit.speed, 0.999)), _BINS + 1)
    place = np.digitize(fit.speed, edges) - 1
    full = [index for index in range(_BINS) if (place == index).sum() >= _LEAST]
    middle = (edges[:-1] + edges[1:])[full] / 2
    for law, colour, style in zip(fit.laws, _COLOURS, _STYLES, strict=True):
        squares = (fit.residuals[law.law.name] ** 2).mean(axis=1)
        rmse = [np.sqrt(squares[place == index].mean()) for index in full]
        label = f"{law.law.name}, unseen flights {law.judgement.removed.mean:.4f}"
        panel.plot(middle, rmse, color=colour, linestyle=style, linewidth=2, marker="o", markersize=3, label=label)
    panel.set_ylim(bottom=0)
    panel.set_ylabel("lateral specific force left, RMSE [m/s²]")
    panel.set_title(f"{fit.vehicle.name}: {len(fit.per_flight)} flights, {fit.cutoff:g} Hz low-pass", fontsize=11)
    panel.legend(frameon=False, fontsize=8.5)
    below.hist(fit.speed, bins=edges, weights=np.full(fit.speed.size, 100 / fit.speed.size), color="#c9ced6")
    below.set_ylabel("share [%]")
    below.set_xlabel("lateral speed in the body frame [m/s]")
    for axes in (panel, below):
        axes.grid(True, color="#e3e5e8", linewidth=0.8)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()
