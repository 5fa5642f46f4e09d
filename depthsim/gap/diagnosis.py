"""What a diagnosis says: diagnosis.json, as an object. The same for a depth sensor and for a flight."""

import json
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, PrivateAttr, model_serializer

from depthsim.errors import InputError
from depthsim.runs.storing import write_whole
from depthsim.yamlfile import parse_json, read_text, validate

FILE = "diagnosis.json"
Verdict = Literal["no_gap", "explained", "partly_explained", "unexplained"]
What = Literal["bias", "spread", "missing", "correlation", "tail"]
Interval = tuple[FiniteFloat, FiniteFloat]


def rounded(value: Any, figures: int = 5) -> Any:
    """Floats with so many figures, in dictionaries, lists and tuples too: what is beyond depends on the machine."""
    if isinstance(value, dict):
        return {key: rounded(one, figures) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(rounded(one, figures) for one in value)
    return float(f"{value:.{figures}g}") if isinstance(value, float) else value


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Gap(_Part):
    """How far simulation and recording differ, before and after the causes are added.

    measure, unit: what is measured. floor: what two runs of one sensor differ by.
    closed_fraction: (before - after) / (before - floor), 0 without a gap; ci95: its 95 % interval.
    """

    measure: str
    unit: str
    before: FiniteFloat
    after: FiniteFloat
    floor: FiniteFloat
    closed_fraction: FiniteFloat
    ci95: Interval


class Cut(_Part):
    """A part of the data in which a part of the gap lies.

    axis: one of the axes of diagnosis.json, or two joined by " x ". interval [unit] or label: which part of it; of a
    depth recording's time, in seconds from its first frame.
    share_of_gap: 0 to 1. what: in what way simulation and recording differ there. text: the same in words.
    """

    axis: str
    interval: Interval | None = None
    label: str | None = None
    unit: str = ""
    share_of_gap: FiniteFloat
    what: What
    text: str = ""

    @property
    def names(self) -> set[str]:
        """The axis, or the two that are joined."""
        return set(self.axis.split(" x "))

    @model_serializer(mode="wrap")
    def _leave_out_what_is_not_there(self, handler: Any) -> dict[str, Any]:
        return {key: value for key, value in handler(self).items() if value is not None}


class Cause(_Part):
    """An effect that the simulator lacks, or has with a wrong value.

    parameters: as fitted; ci95: their 95 % intervals, for those that were fitted.
    closed_fraction: what of the gap this effect closes, on data that it was not fitted on; ci95_closed: its interval.
    Of a depth sensor's causes the closed fractions add up to that of the gap.
    indistinguishable_from: effects that explain these data as well. advice: the recording that would distinguish them.
    """

    effect: str
    parameters: dict[str, Any]
    ci95: dict[str, Any] = Field(default_factory=dict)
    closed_fraction: FiniteFloat
    ci95_closed: Interval
    indistinguishable_from: tuple[str, ...] = ()
    advice: str = ""


class Nearest(_Part):
    """An effect that comes near and is no cause: what it closes of the gap, and why it is none."""

    effect: str
    closed_fraction: FiniteFloat
    why_not: str


class Unexplained(_Part):
    """What is left. fraction: of the gap; where: the same cuts for what is left; description: in words.

    nearest: effects that come near, but do not act where the gap lies, or leave too much of it.

    learnable: the share of the gap that a correction learned on those axes would close, on data held out; None unasked.
    """

    fraction: FiniteFloat
    where: tuple[Cut, ...]
    description: str
    learnable: FiniteFloat | None = None
    nearest: tuple[Nearest, ...] = ()


class Task(_Part):
    """A figure that a robot's software sees, of the recording, of the simulator, and of that with the causes.

    unit: of all three, each on the same pixels of the same frames; None where there is no such figure, and ``reason``
    says why. ci95: 95 % intervals of ``recording``, ``before`` and ``after``, and of how far the two simulations are
    off the recording (``before_off``, ``after_off``: simulated - recorded); what is not known is left out.
    """

    name: str
    unit: str
    recording: FiniteFloat | None
    before: FiniteFloat | None
    after: FiniteFloat | None
    ci95: dict[str, Interval] = Field(default_factory=dict)
    reason: str = ""


class Diagnosis(_Part):
    """The whole answer. ``where`` and ``causes`` are ranked: the first is the one to act on.

    notes: what a reader must know besides, such as columns that a log lacks. tasks: what the gap costs, where it was
    asked for; only of a depth sensor.

    ``print`` shows it in lines, a notebook shows it with the curves of its report.
    """

    version: Literal[1] = 1
    verdict: Verdict
    gap: Gap
    where: tuple[Cut, ...]
    causes: tuple[Cause, ...]
    unexplained: Unexplained | None
    notes: tuple[str, ...] = ()
    tasks: tuple[Task, ...] = ()
    _report: Path | None = PrivateAttr(None)

    @model_serializer(mode="wrap")
    def _leave_out_tasks_that_were_not_asked_for(self, handler: Any) -> dict[str, Any]:
        return {key: value for key, value in handler(self).items() if key != "tasks" or value}

    @property
    def report(self) -> Path | None:
        """The folder of the report that it is from, or was written to."""
        return self._report

    def in_report(self, folder: str | Path) -> "Diagnosis":
        """The same, with the report that has its pictures."""
        copy = self.model_copy()
        copy._report = Path(folder)
        return copy

    # Where the report lies is no part of what it says.
    def __eq__(self, other: object) -> bool:
        return isinstance(other, Diagnosis) and self.to_json() == other.to_json()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        causes = ", ".join(cause.effect for cause in self.causes)
        gap = f"{self.gap.before:.3g} to {self.gap.after:.3g} {self.gap.unit}, floor {self.gap.floor:.3g}"
        return f"<Diagnosis: {self.verdict}, causes: {causes or 'none'}, gap: {gap}>"

    def __str__(self) -> str:
        from depthsim.gap.report.notebook import text

        return text(self)

    def _repr_html_(self) -> str:
        from depthsim.gap.report.notebook import html

        return html(self, self._report)

    @classmethod
    def read(cls, folder: str | Path) -> "Diagnosis":
        """The diagnosis of a report. Raises :class:`InputError` where there is none, or another file's content."""
        file = Path(folder) / FILE
        try:
            value = parse_json(read_text(file, "a diagnosis.json"))
        except ValueError as error:
            raise InputError(file, "", f"is not JSON ({error})", "run diagnose again") from None
        return validate(cls, value, file).in_report(folder)

    def to_json(self) -> str:
        """The text of diagnosis.json."""
        return json.dumps(self.model_dump(mode="json"), indent=1, ensure_ascii=False, allow_nan=False) + "\n"

    def write(self, folder: Path) -> Path:
        """Write diagnosis.json into ``folder``, whole or not at all."""
        file = folder / FILE
        write_whole(file, self.to_json().encode())
        return file
