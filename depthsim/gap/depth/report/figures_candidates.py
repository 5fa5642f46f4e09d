"""What each of the leading effects would close."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from depthsim.gap.depth.report.drawing import CandidateStep
from depthsim.gap.report.figures import FIXED, OTHER, SOFT, TIED, Picture, figure, png

_COLOURS = {"cause": FIXED, "tie": TIED, "other": OTHER}


def candidates_picture(steps: Sequence[CandidateStep]) -> Picture:
    """A bar for each of the leaders of each step, by how much of the gap is closed with it."""
    rows = sum(len(step.bars) for step in steps) + 1.8 * len(steps)
    with figure(9.6, 0.24 * rows + 0.5) as drawn:
        ratios = [len(step.bars) + 0.8 for step in steps]
        axes = drawn.subplots(len(steps), 1, squeeze=False, height_ratios=ratios)[:, 0]
        for ax, step in zip(axes, steps, strict=True):
            _step(ax, step)
            ax.set_title(step.title)
        axes[-1].set_xlabel("share of the gap that is closed on held-out frames [%]")
        caption = (
            "The effects that came nearest, each fitted on some frames and validated on the others. Blue: named as a "
            "cause. Pale blue: explains these frames equally well. Grey: fitted and not taken."
        )
        return Picture(png(drawn), caption)


def _step(ax: Axes, step: CandidateStep) -> None:
    for row, bar in enumerate(step.bars):
        closed = 100 * bar.closed
        ax.barh(row, max(closed, 0), color=_COLOURS[bar.kind], height=0.72)
        ax.text(max(closed, 0) + 1, row, f"{closed:.1f}", va="center", fontsize=8, color=SOFT)
    ax.set_yticks(range(len(step.bars)), [bar.label for bar in step.bars])
    ax.invert_yaxis()
    ax.set_xlim(0, 110)
    ax.axvline(100, color="#9aa5b1", lw=0.9, ls=":")
    ax.tick_params(axis="y", length=0)
