"""The one kind of error that a user sees: what is wrong with an input, where, and how to mend it."""

from pathlib import Path


class InputError(Exception):
    """Bad input, told in one line: ``FILE: PLACE: PROBLEM; MEND``.

    The command line prints the line and exits with status 2; a library caller catches it like any exception.
    ``place`` may be empty where the whole file is meant.
    """

    def __init__(self, file: str | Path, place: str, problem: str, mend: str) -> None:
        self.file, self.place, self.problem, self.mend = str(file), place, problem, mend
        parts = [self.file, place, f"{problem}; {mend}"]
        super().__init__(": ".join(" ".join(part.split()) for part in parts if part))
