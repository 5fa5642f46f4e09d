"""Tables of numbers as CSV: columns found by name, every fault reported with its line and column."""

import csv
import math
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.yamlfile import read_text

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Table:
    """Columns of finite numbers, (N,) each, and where they stood.

    ``lines``: (N,) line numbers in the file. ``left_out``: names of the columns that nobody asked for. ``dropped``:
    rows that were left out because a cell of theirs was not measured.
    """

    path: Path
    columns: Mapping[str, Floats]
    lines: tuple[int, ...]
    left_out: tuple[str, ...]
    dropped: int = 0

    def __len__(self) -> int:
        return len(self.lines)

    def fault(self, row: int, problem: str, fix: str) -> InputError:
        """What is wrong with a row, as an error to raise."""
        return InputError(self.path, f"line {self.lines[row]}", problem, fix)

    def stack(self, names: Iterable[str]) -> Floats:
        """Some columns side by side, (N, len(names))."""
        return np.stack([self.columns[name] for name in names], axis=1)


def header(path: Path, what: str) -> list[str]:
    """The names of the columns alone."""
    return _header(_rows(path, what), path)[0]


def read_table(path: Path, what: str, wanted: Callable[[str], bool], *, drop_unmeasured: bool = False) -> Table:
    """Read the columns that are ``wanted``; ``what`` says for a message which file was looked for.

    The first line holds the names. Lines that start with # are comments. Columns that are not wanted may hold anything.
    Raises :class:`InputError` for a missing file, no header, a name given twice, a row that is too short or too long,
    and a wanted cell that is no finite number; with ``drop_unmeasured`` rows with empty cells or NaN are left out
    instead, and so are columns that hold nothing else.
    """
    rows = _rows(path, what)
    names, begin = _header(rows, path)
    kept = [index for index, name in enumerate(names) if wanted(name)]
    for number, row in rows[begin:]:
        if len(row) != len(names):
            fix = "write every row whole: the file may be cut off" if len(row) < len(names) else "write no more cells"
            raise InputError(path, f"line {number}", f"has {len(row)} cells, the header has {len(names)}", fix)
    body = rows[begin:]
    if drop_unmeasured:
        kept = [index for index in kept if not body or not all(_blank(row[index]) for _, row in body)]
        body = [(number, row) for number, row in body if not any(_blank(row[index]) for index in kept)]
    columns = {names[index]: _column([row[index] for _, row in body], names[index], body, path) for index in kept}
    left_out = tuple(name for index, name in enumerate(names) if index not in kept)
    return Table(path, columns, tuple(number for number, _ in body), left_out, len(rows) - begin - len(body))


def write_table(columns: Mapping[str, Floats], path: Path) -> None:
    """Write columns as CSV with the shortest decimals that read back as the same numbers; whole or not at all."""
    lines = [",".join(columns)]
    texts = [[repr(value) for value in column.tolist()] for column in columns.values()]
    lines.extend(map(",".join, zip(*texts, strict=True)))
    part = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")
        os.replace(part, path)
    except OSError as error:
        problem = (error.strerror or "cannot be written").lower()
        raise InputError(path, "", problem, "give a path that can be written to") from None


def _rows(path: Path, what: str) -> list[tuple[int, list[str]]]:
    """Rows that are neither empty nor comments, with their line numbers."""
    reader = csv.reader(read_text(path, what).splitlines())
    try:
        return [(reader.line_num, row) for row in reader if row and not row[0].lstrip().startswith("#")]
    except csv.Error as error:
        raise InputError(path, f"line {reader.line_num}", f"is not CSV ({error})", "correct that line") from None


def _header(rows: list[tuple[int, list[str]]], path: Path) -> tuple[list[str], int]:
    if not rows:
        raise InputError(path, "", "is empty", "write a line of column names, then a row for each sample")
    number, cells = rows[0]
    names = [cell.strip() for cell in cells]
    place = f"line {number}"
    if len(names) == 1 and any(mark in names[0] for mark in ";\t "):
        raise InputError(path, place, "is not separated by commas", "put a comma between the columns")
    if all(_number(name) is not None for name in names):
        raise InputError(
            path, place, "holds numbers, not column names", "put the names of the columns first, without #"
        )
    for index, name in enumerate(names):
        if name in names[:index]:
            raise InputError(path, place, f"column {name!r} comes twice", "give each column a name of its own")
    return names, 1


def _column(words: list[str], name: str, body: list[tuple[int, list[str]]], path: Path) -> Floats:
    try:
        values = np.array(list(map(float, words)))
        if np.isfinite(values).all() and not any("_" in word for word in words):
            return values
    except ValueError:
        pass
    for word, (number, _) in zip(words, body, strict=True):
        value = _number(word)
        if value is None:
            shown = repr(word.strip()[:40]) if word.strip() else "empty"
            raise InputError(path, f"line {number}, {name}", f"is {shown}, not a number", "write a number")
        if not math.isfinite(value):
            raise InputError(path, f"line {number}, {name}", f"is {word.strip()}", "drop rows that were not measured")
    raise AssertionError("one of the words is no finite number")


def _blank(word: str) -> bool:
    """Whether a cell says that nothing was measured."""
    return word.strip().lower() in ("", "nan", "inf", "-inf", "+inf", "null", "none")


def _number(word: str) -> float | None:
    try:
        return None if "_" in word else float(word)  # float() itself takes 1_000
    except ValueError:
        return None
