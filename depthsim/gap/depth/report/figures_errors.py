"""How the errors of single pixels are distributed, and how those of neighbours go together."""

from collections.abc import Sequence

import numpy as np

from depthsim.gap.depth.report.errors import FAR, NEAR, Correlations, ErrorShares
from depthsim.gap.report.figures import Picture, figure, png


def errors_picture(samples: Sequence[ErrorShares]) -> Picture:
    """Histograms of the errors, near and far."""
    with figure(9.6, 3.0) as drawn:
        for k, (ax, edges) in enumerate(zip(drawn.subplots(1, 2), (NEAR, FAR), strict=True)):
            for one in samples:
                share = np.where(one.far > 0, one.far, np.nan) if k else one.near
                style = "--" if "causes" in one.name else "-"
                label = f"{one.name}, {100 * one.holes:.1f} % holes"
                ax.stairs(share, edges, color=one.colour, lw=1.6, ls=style, label=label, baseline=None)
            ax.set(xlabel="error [x spread of the simulator]", ylabel="density", title=("the core", "the tails")[k])
            ax.grid(True)
            if k:
                ax.set_yscale("log")
            else:
                ax.set_ylim(bottom=0)
                handles, names = ax.get_legend_handles_labels()
        drawn.legend(handles, names, loc="outside upper left", ncols=len(names))
        return Picture(
            png(drawn), "All errors together, as densities. Left on a linear scale, right on a logarithmic one."
        )


def correlation_picture(samples: Sequence[Correlations]) -> Picture:
    """How errors of pixels some way apart, and of the same pixel in successive frames, are correlated."""
    with figure(9.6, 2.8) as drawn:
        axes = drawn.subplots(1, 3, sharey=True)
        for one in samples:
            style = "--" if "causes" in one.name else "-"
            for ax, values in zip(axes, (one.rows, one.columns, one.frames), strict=True):
                ax.plot(range(len(values)), values, style, marker="o", ms=3, lw=1.6, color=one.colour, label=one.name)
        for ax, title in zip(axes, ("along a row [px]", "along a column [px]", "successive frames"), strict=True):
            ax.set(xlabel=f"distance {title}" if "px" in title else "frames apart")
            ax.axhline(0, color="#9aa5b1", lw=0.8, zorder=1)
            ax.grid(True)
        axes[0].set_ylabel("correlation of the errors")
        axes[2].set_xticks(range(len(samples[0].frames)))
        handles, names = axes[0].get_legend_handles_labels()
        drawn.legend(handles, names, loc="outside upper left", ncols=len(names))
        return Picture(png(drawn), "How the errors of neighbouring pixels, and of one pixel in time, go together.")
