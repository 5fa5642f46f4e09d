"""The rivals: what each of the leading effects would close."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from depthsim.gap.depth.fit.search import Candidate
from depthsim.gap.depth.fit.select import Choice
from depthsim.gap.diagnosis import Cause
from depthsim.gap.report.figures import FIXED, OTHER, SOFT, TIED, Picture, figure, png

_NAMES = "first", "second", "third", "fourth", "fifth"


def candidates_picture(choice: Choice, causes: Sequence[Cause], before: float, floor: float) -> Picture | None:
    """A bar for each of the leaders of each step, by how much of the gap is closed with it. causes: those named."""
    steps = [step for step in choice.looked_at if step]
    if not steps:
        return None
    whole = max(before - floor, 1e-12)
    rows = sum(len(step) for step in steps) + 1.8 * len(steps)
    with figure(9.6, 0.24 * rows + 0.5) as drawn:
        ratios = [len(step) + 0.8 for step in steps]
        axes = drawn.subplots(len(steps), 1, squeeze=False, height_ratios=ratios)[:, 0]
        for number, (ax, step) in enumerate(zip(axes, steps, strict=True)):
            _step(ax, step, causes, before, whole)
            beside = ", ".join(part.effect for part in step[0].model.parts[:-1])
            ax.set_title(f"{_NAMES[min(number, 4)]} cause" + (f", beside {beside}" if beside else ""))
        axes[-1].set_xlabel("share of the gap that is closed on held-out frames [%]")
        caption = (
            "The effects that came nearest, each fitted on some frames and judged on the others. Blue: named as a "
            "cause. Pale blue: explains these frames equally well. Grey: fitted and not taken."
        )
        return Picture(png(drawn), caption)


def _step(ax: Axes, step: Sequence[Candidate], causes: Sequence[Cause], before: float, whole: float) -> None:
    named = {cause.effect for cause in causes}
    ties = {name for cause in causes for name in cause.indistinguishable_from}
    first = next((row for row, one in enumerate(step) if one.newest.effect in named), -1)
    for row, one in enumerate(step):
        closed = 100 * (before - one.gap) / whole
        effect = one.newest.effect
        colour = FIXED if row == first else TIED if effect in ties else OTHER
        ax.barh(row, max(closed, 0), color=colour, height=0.72)
        ax.text(max(closed, 0) + 1, row, f"{closed:.1f}", va="center", fontsize=8, color=SOFT)
    ax.set_yticks(range(len(step)), [_label(one) for one in step])
    ax.invert_yaxis()
    ax.set_xlim(0, 110)
    ax.axvline(100, color="#9aa5b1", lw=0.9, ls=":")
    ax.tick_params(axis="y", length=0)


def _label(one: Candidate) -> str:
    gone = sorted(one.newest.replaces)
    return one.newest.effect + (f" for {', '.join(gone)}" if gone else "")
