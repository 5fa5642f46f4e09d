"""What those who make runs have in common: jobs go in, events come out."""

from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from depthsim.errors import InputError


@dataclass(frozen=True)
class Job:
    """A run to make. expect: its sha256, where it was whole and is to be checked."""

    run: int
    expect: str | None = None


@dataclass(frozen=True)
class Event:
    """What became of a job.

    frame: one more frame is whole. done: the run is, and ``row`` says what it is. error: it ended in an
    :class:`InputError` of ``parts``; a ``fatal`` one is the target's and ends the sweep, ``wait`` is one that may pass.
    lost: its worker died at it. back: its worker died before its turn.
    """

    kind: Literal["frame", "done", "error", "lost", "back"]
    run: int
    parts: tuple[str, str, str, str] = ("", "", "", "")
    fatal: bool = False
    wait: bool = False
    row: dict[str, Any] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """The error in one line."""
        return str(InputError(*self.parts))


class Makers(Protocol):
    """Workers, wherever they are."""

    def free(self) -> int:
        """How many more jobs can be taken now."""

    def submit(self, job: Job) -> None:
        """Take a job."""

    def wait(self, seconds: float) -> list[Event]:
        """What has happened, after at most so long."""

    def close(self) -> None:
        """End the workers."""


def event_of(message: dict[str, Any]) -> Event:
    """The event in a worker's message."""
    kind, run = message["kind"], message["run"]
    if kind == "error":
        return Event("error", run, tuple(message["parts"]), message["fatal"], message["wait"])
    row = {key: value for key, value in message.items() if key != "kind"}
    return Event(kind, run, row=row)


def lost(run: int, how: str) -> Event:
    """The event of a worker that died at ``run``."""
    return Event("lost", run, (f"run {run}", "", f"its worker died ({how})", "see whether its machine has memory left"))
