"""The picture of the paper's protocol: measured std against distance, and its ratio to the law."""

from pathlib import Path

from benchmarks.paper_wall import M, Series, clipped_std, first_off, law, real_d435


def plot(file: Path, series: dict[str, Series]) -> None:
    """std against distance on a logarithmic axis, and below it the ratio to the law."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator

    figure = Figure(figsize=(7.6, 6.6), layout="constrained", dpi=150)
    top, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.1))
    for (tag, one), colour in zip(series.items(), ("#1f4e79", "#5b8e55", "#c8553d"), strict=True):
        d, label = one.distance, f"{tag}, m = {M[tag]:.2f}"
        top.plot(d, law(tag, d), color="black", linewidth=0.9, zorder=3)
        top.plot(d, one.std, ".", color=colour, markersize=4, label=label)
        below.plot(d, one.std / law(tag, d), ".", color=colour, markersize=3)
        off = first_off(one, tag)
        if off:
            beyond = d >= off
            below.plot(d[beyond], (clipped_std(tag, d) / law(tag, d))[beyond], color="black", linewidth=0.9)
            below.annotate(
                "depths below 0\nare holes", (d[-1], one.std[-1] / law(tag, d)[-1]), (d[-1] - 2.2, 0.925),
                fontsize=8.5, va="center", arrowprops={"arrowstyle": "-", "color": "#8a8f98"},
            )  # fmt: skip
    d = next(iter(series.values())).distance
    top.plot(d, real_d435(d), color="#8a8f98", linestyle=(0, (5, 2)), linewidth=1.6, label="a real D435: std ∝ d²")
    top.plot([], [], color="black", linewidth=0.9, label="0.005 m · exp(m·d)")
    top.set_yscale("log")
    top.set_ylabel("std of the depth error over the image [m]")
    top.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    top.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    top.yaxis.set_minor_locator(LogLocator(subs=()))
    top.legend(frameon=False, fontsize=9, loc="upper left")
    below.set_ylim(0.88, 1.02)
    below.set_ylabel("measured / law")
    below.set_xlabel("distance d [m]")
    for axis in (top, below):
        axis.grid(True, color="#e3e5e8", linewidth=0.8)
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(file, metadata={"Software": None})
