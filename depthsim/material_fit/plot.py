"""The picture of a fit: std against distance, the law, and the law it has to beat."""

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from depthsim.material_fit.curve import Curve
from depthsim.material_fit.fit import MaterialFit, SpreadKind

_POINTS, _LAW, _OTHER, _GREY = "#1f4e79", "#c8553d", "#5b8e55", "#8a8f98"


def plot_png(curves: Sequence[Curve], fits: Sequence[MaterialFit], spread: SpreadKind = "spatial") -> bytes:
    """A PNG with a panel for each material. On its logarithmic axis the paper's law is a straight line."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(len(curves), 3)
    rows = -(-len(curves) // columns)
    figure = Figure(figsize=(6.4 if len(curves) == 1 else 4.6 * columns, 4.4 * rows), layout="constrained", dpi=150)
    FigureCanvasAgg(figure)
    panels = np.ravel(figure.subplots(rows, columns, squeeze=False, sharey=True))
    for panel, curve, fit in zip(panels, curves, fits, strict=False):
        _draw(panel, curve, fit, spread)
    for panel in panels[len(curves) :]:
        panel.set_visible(False)
    for panel in panels[::columns]:
        panel.set_ylabel("std of the depth [mm]")
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()


def _draw(panel: Any, curve: Curve, fit: MaterialFit, spread: SpreadKind) -> None:
    from matplotlib.ticker import LogLocator, ScalarFormatter

    prefix = "" if spread == "spatial" else "temporal_"
    d, std, robust = curve.column("distance"), curve.column(f"{prefix}std") * 1000, curve.column("robust_std") * 1000
    error = 1.96 * std / np.sqrt(2 * np.maximum(curve.column(f"{prefix}count") - 1, 1))
    along = np.linspace(fit.span[0], fit.span[1], 200)
    low, high = fit.ci95
    if fit.floor_ci95 is None:
        band = [fit.floor * np.exp(m * along) * 1000 for m in (low, high)]
        panel.fill_between(along, *band, color=_LAW, alpha=0.18, linewidth=0)
    law = f"{fit.floor * 1000:.3g} mm · exp({fit.m:.3f} d),  R² {fit.r2:.2f}"
    panel.plot(along, fit.std(along) * 1000, color=_LAW, linewidth=2, label=law, zorder=3)
    quadratic = f"{fit.k * 1000:.3g} mm · d²,  R² {fit.quadratic.r2:.2f}"
    panel.plot(along, fit.k * along**2 * 1000, color=_OTHER, linewidth=1.6, linestyle=(0, (5, 2)), label=quadratic)
    small = 5.0 if d.size < 30 else 3.0
    panel.errorbar(
        d, std, error, fmt="o", color=_POINTS, markersize=small, elinewidth=1, label=f"{spread} std", zorder=2
    )
    if spread == "spatial":
        panel.plot(d, robust, "_", color=_GREY, markersize=8, label="1.4826 · MAD", zorder=1)
    panel.set_yscale("log")
    panel.set_ylim(0.7 * min(std.min(), robust.min()), 1.6 * std.max())
    panel.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panel.yaxis.set_major_formatter(ScalarFormatter())
    panel.yaxis.set_minor_locator(LogLocator(subs=()))
    panel.set_xlabel("distance d [m]")
    panel.set_title("{}\nm = {} 1/m  (95 %: {} to {})".format(fit.tag, *fit.m_text), fontsize=10)
    panel.grid(True, which="major", color="#e3e5e8", linewidth=0.8)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    panel.legend(frameon=False, fontsize=8.5, loc="upper left")
