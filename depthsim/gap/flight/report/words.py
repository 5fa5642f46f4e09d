"""A diagnosis in sentences, for the terminal and the page."""

from typing import Any

from depthsim.gap.diagnosis import Cause, Cut, Diagnosis

VERDICTS = {
    "no_gap": "No gap: the model flies as the log does, within its noise.",
    "explained": "Explained: the causes below account for the gap; what is left does not stand out.",
    "partly_explained": "Partly explained: the causes below close a part; for what is left no effect was found.",
    "unexplained": "Unexplained: there is a gap, and no effect of the bank is what causes it.",
}


def gap_line(diagnosis: Diagnosis) -> str:
    """The figures of the gap."""
    gap = diagnosis.gap
    low, high = gap.ci95
    line = f"{gap.before:.3f} {gap.unit} before, {gap.after:.3f} after, {gap.floor:.3f} is noise"
    if diagnosis.causes:
        line += f"; {gap.closed_fraction:.0%} closed (95 %: {low:.0%} to {high:.0%})"
    return line


def parameters(cause: Cause) -> str:
    """Parameters with their intervals."""
    found = []
    for name, value in cause.parameters.items():
        if name == "formula":
            continue
        if isinstance(value, list):
            found.append(f"{name} {', '.join(_figure(one) for one in value)}")
            continue
        interval = cause.ci95.get(name)
        span = f" ({_figure(interval[0])} to {_figure(interval[1])})" if interval is not None else ""
        found.append(f"{name} {_figure(value)}{span}")
    return "; ".join(found)


def place(cut: Cut) -> str:
    """Which part of an axis."""
    if cut.interval is not None:
        return f"{cut.interval[0]:.3g} to {cut.interval[1]:.3g} {cut.unit}".strip()
    return f"{cut.label} {cut.unit}".strip()


def learned(cut: Cut) -> str:
    """What a correction learned on the axis would close."""
    return cut.text.rpartition("; ")[2]


def next_steps(diagnosis: Diagnosis) -> list[str]:
    """What to do now."""
    steps = []
    for cause in diagnosis.causes:
        others = " or ".join(cause.indistinguishable_from)
        if others:
            steps.append(f"{cause.effect} is indistinguishable from {others} here. {cause.advice}")
        elif cause.advice:
            steps.append(f"{cause.effect}: {cause.advice}")
    if diagnosis.unexplained is not None:
        axes = ", ".join(cut.axis.replace("_", " ") for cut in diagnosis.unexplained.where[:2])
        steps.append(f"Look for what the model lacks that goes with {axes}, and record flights that vary it alone.")
    if diagnosis.causes:
        steps.append("Fly the vehicle.yaml of this report, and diagnose another flight with it.")
    return steps


def _figure(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, (int, float)) else str(value)
