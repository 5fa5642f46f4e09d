"""The one kind of error that a user sees: what is wrong with an input, where, and how to fix it."""

from collections.abc import Callable
from pathlib import Path


class InputError(Exception):
    """Bad input, reported in one line: ``FILE: PLACE: PROBLEM; FIX``.

    The command line prints the line and exits with status 2; a library caller catches it like any exception.
    ``place`` may be empty where the whole file is meant. Arguments of functions are named in back quotes, as in
    "give another `out`": the command line puts its flags there.
    """

    def __init__(self, file: str | Path, place: str, problem: str, fix: str) -> None:
        self.file, self.place, self.problem, self.fix = str(file), place, problem, fix
        super().__init__(self._line())

    def _line(self) -> str:
        parts = [self.file, self.place, f"{self.problem}; {self.fix}"]
        return ": ".join(_shown(part) for part in parts if part)

    def reword(self, words: Callable[[str], str]) -> None:
        """Put other words for what the parts of the line say, such as the flags of a command for arguments."""
        parts = (self.file, self.place, self.problem, self.fix)
        self.file, self.place, self.problem, self.fix = map(words, parts)
        self.args = (self._line(),)


_LONGEST = 1500
"""Characters of a part of the line: what a broken file holds may be as long as the file."""


def _shown(part: str) -> str:
    """A part on one line, without what would steer a terminal, and with its middle left out where it is very long."""
    line = " ".join(part.split())
    if not line.isprintable():
        line = "".join(mark if mark.isprintable() else ascii(mark)[1:-1] for mark in line)
    half = _LONGEST // 2
    return line if len(line) <= _LONGEST else f"{line[:half]} ... {line[-half:]}"
