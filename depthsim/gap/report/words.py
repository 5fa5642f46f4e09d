"""A diagnosis in words: the texts that terminal and page share."""

import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from depthsim.sensor.effect import effect_class, effect_ids, parameters_of
from depthsim.sensor.parameter import learned_of

if TYPE_CHECKING:  # a diagnosis shows itself in these words
    from depthsim.gap.diagnosis import Cause, Cut, Diagnosis, Gap, Nearest, Task

Tone = Literal["good", "fair", "bad"]
STUB = "new_effect.py"
RAY_LENGTHS = (
    "the depths are the lengths of their rays, and not along the optical axis: divide each by the root of 1 + x² + y², "
    "where x and y are its ray at z = 1; until then no effect is looked for"
)
_LITTLE = 0.1
"""Of the gap: with less left beside causes, it may be due to their formulas alone."""
SENSOR = "sensor.yaml"
_LINE = 76
_EVEN, _ROUNDING = 0.05, 1e-4
"""How far the middle of an interval may be off its value, as a share of its width or of the value."""


@dataclass(frozen=True)
class Origin:
    """What was diagnosed, as it is named on the command line. scene, materials: None where the defaults were taken."""

    run: str
    report: str
    sensor: str
    scene: str | None = None
    materials: str | None = None


@dataclass(frozen=True)
class Step:
    """Something to do next; command: the line to give for it."""

    text: str
    command: str = ""


@dataclass(frozen=True)
class Parameter:
    """A parameter of a cause, with its unit. low, high: its 95 % interval; None where it was held."""

    name: str
    value: str
    low: str | None
    high: str | None
    unit: str
    about: str

    @property
    def text(self) -> str:
        """``sigma 0.05 px (95 %: 0.04 to 0.06)``."""
        unit = f" {self.unit}" if self.unit else ""
        interval = "" if self.low is None else f" (95 %: {self.low} to {self.high})"
        return f"{self.name} {self.value}{unit}{interval}"


def verdict(diagnosis: "Diagnosis") -> str:
    """The answer in one sentence."""
    gap, names = diagnosis.gap, _listed([cause.effect for cause in diagnosis.causes])
    match diagnosis.verdict:
        case "no_gap":
            return "No gap: recording and simulation differ no more than two runs of one sensor do."
        case "explained":
            return (
                f"Explained: {names} added, {percent(gap.closed_fraction)} of the gap is closed; "
                "what is left does not stand out."
            )
        case "partly_explained":
            return (
                f"Partly explained: {names} added, {percent(gap.closed_fraction)} of the gap is closed; "
                "for what is left no effect was found."
            )
    return "Unexplained: there is a gap, and no known effect accounts for it."


def tone(diagnosis: "Diagnosis") -> Tone:
    """How good the news is."""
    tones: dict[str, Tone] = {"no_gap": "good", "explained": "good", "partly_explained": "fair"}
    return tones.get(diagnosis.verdict, "bad")


def gap_lines(gap: "Gap", *, causes: bool) -> list[tuple[str, str]]:
    """The figures of the gap, and what each is. causes: whether anything was added."""
    lines = [(f"{figure(gap.before)} {gap.unit}", "recording against simulation")]
    if causes:
        lines.append((f"{figure(gap.after)} {gap.unit}", "with the causes added"))
    lines.append((f"{figure(gap.floor)} {gap.unit}", "the floor: two runs of one sensor"))
    if causes:
        lines.append((closed_text(gap.closed_fraction, gap.ci95), "closed, on frames that nothing was fitted on"))
    return lines


def closed_text(fraction: float, interval: tuple[float, float]) -> str:
    """``92 % (95 %: 88 to 96 %)``."""
    low, high = (f"{100 * x:.0f}" for x in interval)
    return f"{percent(fraction)} (95 %: {low} to {high} %)"


def about(effect: str) -> str:
    """What an effect does, in a line; empty for an effect that is not in the bank."""
    if effect not in effect_ids():
        return ""
    text = (effect_class(effect).__doc__ or "").strip().split("\n\n")[0]
    return " ".join(text.replace("``", "").replace("`", "").split()).rstrip(".")


def parameters(cause: "Cause") -> list[Parameter]:
    """The parameters of a cause, those that were fitted first; of a table by material only what was fitted.

    What no fit varies is left out where it is as usual, but for geometry: that is counted in the recording.
    """
    declared = parameters_of(effect_class(cause.effect)) if cause.effect in effect_ids() else {}
    counted = bool(declared) and effect_class(cause.effect).exact
    found = []
    tables = learned_of(effect_class(cause.effect)) if declared else {}
    for name, value in cause.parameters.items():
        if name in tables:  # hundreds of numbers, which the profile has
            continue
        as_usual = name in declared and declared[name].frozen and value == declared[name].default
        if as_usual and not counted:
            continue
        unit, words = (declared[name].unit, declared[name].about) if name in declared else ("", "")
        unit, times = ("%", 100) if unit == "share" else ("" if unit == "1" else unit, 1)
        parts = value if isinstance(value, Mapping) else {"": value}
        for tag, number in parts.items():
            label = f"{name}.{tag}" if tag else name
            interval = cause.ci95.get(label)
            if tag and interval is None and cause.ci95:
                continue
            low, high = (figure(times * x) for x in interval) if interval else (None, None)
            found.append(Parameter(label, figure(times * number), low, high, unit, words))
    return sorted(found, key=lambda parameter: parameter.low is None)


def place(cut: "Cut") -> str:
    """Where a cut lies: its part of its axis."""
    name = cut.axis.replace("_", " ")
    if cut.interval is not None:
        low, high = (0.0 if abs(end) < 1e-6 else end for end in cut.interval)
        unit = "" if cut.unit == "1" else f" {cut.unit}"
        ends = (f"{end:.0f}" if abs(end) >= 1000 else f"{end:.3g}" for end in (low, high))
        return f"{name} {' to '.join(ends)}{unit}"
    return f"{name}: {cut.label}" if cut.label and cut.label != name else name


def task_head(*, causes: bool) -> list[str]:
    """The head of the table of what the gap costs. causes: whether any were added."""
    return ["", "recording", "simulated", *(["with the causes"] if causes else [])]


def task_name(name: str) -> str:
    """The name of a figure, as people write it."""
    words = name.replace("kiss_icp", "KISS-ICP").split("_")
    return " ".join({"rms": "RMS", "ate": "ATE", "z": "Z", "open3d": "Open3D"}.get(word, word) for word in words)


def task_row(task: "Task", *, causes: bool) -> list[str]:
    """A figure with its unit, and its values, each with half of its 95 % interval, or its ends where it is lopsided.

    A star is at a simulated one that differs from the recording's by more than chance.
    """
    cells = [f"{task_name(task.name)} [{task.unit}]"]
    for name in ("recording", "before", "after")[: 3 if causes else 2]:
        value, ends, off = getattr(task, name), task.ci95.get(name), task.ci95.get(f"{name}_off")
        text = "-" if value is None else figure(value)
        if ends is not None and value is not None:
            low, high = ends
            even = abs(high + low - 2 * value) <= max(_EVEN * (high - low), _ROUNDING * abs(value))
            text += f" ± {_two((high - low) / 2)}" if even else f" ({_two(low)} to {_two(high)})"
        cells.append(text + (" *" if off is not None and not off[0] <= 0 <= off[1] else ""))
    return cells


def _two(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.2g}"


def task_notes(tasks: "tuple[Task, ...]") -> list[str]:
    """What is to be known of the table: what a star is, and why figures are not there."""
    notes = []
    if any(ends in task.ci95 for task in tasks for ends in ("before_off", "after_off")):
        notes.append("* differs from the recording by more than chance; ± is half of a 95 % interval")
        if any(task.name.startswith("drift_") and task.ci95 for task in tasks):
            notes.append(
                "drift, ATE and surface error are of the first frames in a row, those that were fitted to among them: "
                "of simulated runs the geometric mean, and between which figures one more would lie"
            )
    else:
        notes.append("the frames are too few for intervals")
    for reason in dict.fromkeys(task.reason for task in tasks if task.reason):
        names = _listed([task_name(task.name) for task in tasks if task.reason == reason])
        notes.append(f"{names}: {reason}")
    return notes


def near(one: "Nearest") -> list[str]:
    """An effect that is no cause, what it closes, and why it is none."""
    return [one.effect, percent(one.closed_fraction), one.why_not]


def tie(cause: "Cause") -> str:
    """What else would explain these frames; empty where nothing would."""
    if not cause.indistinguishable_from:
        return ""
    return f"In these frames {cause.effect} is indistinguishable from {_listed(cause.indistinguishable_from, 'or')}."


def lacks_an_effect(diagnosis: "Diagnosis") -> bool:
    """Whether what is unexplained needs an effect that the bank has not."""
    left = diagnosis.unexplained
    return left is not None and bool(left.where) and RAY_LENGTHS not in diagnosis.notes


def next_steps(diagnosis: "Diagnosis", origin: Origin) -> list[Step]:
    """What to do with the answer, with the very commands."""
    if diagnosis.verdict == "no_gap":
        return [Step("Nothing is to be fixed. Simulate with this sensor:", generate_command(origin))]
    steps = []
    if diagnosis.causes:
        steps.append(Step("Simulate with the causes added:", generate_command(origin)))
    steps += [Step(sentence(cause.advice)) for cause in diagnosis.causes if cause.advice]
    if RAY_LENGTHS in diagnosis.notes:
        steps.append(Step("Write depth in place of the lengths of rays, and diagnose again:", diagnose_command(origin)))
    elif lacks_an_effect(diagnosis):
        report, left = Path(origin.report), 1 - diagnosis.gap.closed_fraction
        needs = "What is left needs an effect that is not in the bank."
        if diagnosis.causes and left < _LITTLE:
            needs = (
                f"What is left, {percent(left)} of the gap, may be how the real causes differ from these formulas; if "
                "it matters, it needs an effect that is not in the bank."
            )
        steps.append(
            Step(
                f"{needs} {report / STUB} is the beginning of one: say "
                "there what the sensor does, put it into depthsim/sensor/effects/, and diagnose again:",
                diagnose_command(origin),
            )
        )
    steps.append(Step("See it on the scene:", command("view", origin.report)))
    return steps


def generate_command(origin: Origin) -> str:
    """The line that simulates the recording with the sensor of the report."""
    name = Path(origin.run).name or "run"
    scene = [origin.scene] if origin.scene is not None else []
    sensor = str(Path(origin.report) / SENSOR)
    materials = ["--materials", origin.materials] if origin.materials else []
    return command(
        "generate", *scene, "--like", origin.run, "--sensor", sensor, *materials, "--out", f"{name}_simulated"
    )


def diagnose_command(origin: Origin) -> str:
    """The line that makes the diagnosis again, with what was found as the sensor."""
    scene = ["--scene", origin.scene] if origin.scene is not None else []
    sensor = ["--sensor", str(Path(origin.report) / SENSOR)]
    materials = ["--materials", origin.materials] if origin.materials else []
    return command("diagnose", origin.run, *scene, *sensor, *materials, "--out", f"{origin.report}_2")


def percent(share: float) -> str:
    """``92 %``; with a decimal below 10 %."""
    return f"{100 * share:.1f} %" if 0 < abs(share) < 0.0995 else f"{100 * share:.0f} %"


def figure(value: object) -> str:
    """A number with three figures; anything else as it is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def sentence(text: str) -> str:
    """With a capital and a full stop; nothing stays nothing."""
    return f"{text[:1].upper()}{text[1:].rstrip('.')}." if text else ""


def comment(text: str) -> str:
    """Text as comment lines of YAML or Python, whatever it holds."""
    lines, line = [], "#"
    for word in re.split(r"\s+", text.strip()):
        if len(line) + len(word) > _LINE and line != "#":
            lines.append(line)
            line = "#"
        line = f"{line} {word}"
    return "\n".join([*lines, line]) + "\n"


def command(*words: str) -> str:
    """A command line of depthsim."""
    return shlex.join(["depthsim", *words])


def _listed(names: "list[str] | tuple[str, ...]", last: str = "and") -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}" if names else "nothing"
