"""Which folders hold the wall, at which distance each."""

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from depthsim.errors import InputError
from depthsim.yamlfile import beside, read_text

LIST = "distances.csv"
_NAME = re.compile(r"(?:.+[_-])?(\d+(?:\.\d+)?|\.\d+)\s*(m|cm|mm)?", re.IGNORECASE)
_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}


@dataclass(frozen=True)
class Capture:
    """Depth pictures of a wall at one distance [m]."""

    folder: Path
    distance: float
    files: tuple[Path, ...]


def find_captures(folders: Sequence[Path]) -> list[Capture]:
    """The captures in some folders, in order of distance.

    A folder either holds depth pictures itself, or folders of them. Its distance is its name (``1.25``, ``0.50m``,
    ``cement_150cm``, ``800mm``; metres without a unit), or stands in a ``distances.csv`` with the columns folder and
    distance_m beside it. The pictures are the PNG files in it, or in its ``depth`` folder.
    """
    captures: list[Capture] = []
    for folder in folders:
        if not folder.is_dir():
            problem = "is a file, not a folder" if folder.exists() else "no such folder"
            raise InputError(folder, "", problem, "give a folder of captures, or the folder of a run")
        captures += _in_list(folder / LIST) if (folder / LIST).exists() else _by_name(folder)
    return sorted(captures, key=lambda capture: capture.distance)


def _by_name(folder: Path) -> list[Capture]:
    inside = [item for item in sorted(folder.iterdir()) if item.is_dir() and item.name != "depth" and _pictures(item)]
    if _pictures(folder):
        inside = [folder]
    if not inside:
        fix = f"put depth PNGs into folders named by their distance, such as {folder.name}/0.50m/"
        raise InputError(folder, "", "holds no depth pictures", fix)
    captures = []
    for item in inside:
        name = item.resolve().name
        match = _NAME.fullmatch(name)
        if not match:
            raise InputError(item, "", f"{name!r} is no distance", f"name it as 0.50m or 150cm, or write a {LIST}")
        metres = float(match[1]) * _METRES[(match[2] or "m").lower()]
        captures.append(_capture(item, metres, item, ""))
    return captures


def _in_list(file: Path) -> list[Capture]:
    try:
        rows = list(csv.reader(read_text(file, "a list of distances").splitlines()))
    except csv.Error as error:
        raise InputError(file, "", f"is not CSV ({error})", "write lines of `folder,distance_m`") from None
    captures, seen = [], 0
    for number, row in enumerate(rows, start=1):
        words, place = [word.strip() for word in row], f"line {number}"
        if not any(words) or words[0].startswith("#"):
            continue
        seen += 1
        if seen == 1:
            if words != ["folder", "distance_m"]:
                raise InputError(file, place, f"has the columns {','.join(words)[:60]!r}", "write `folder,distance_m`")
            continue
        if len(words) != 2:
            raise InputError(file, place, f"has {len(words)} columns, not 2", "write `folder,distance_m`")
        try:
            distance = float(words[1].replace("_", "?"))  # float() itself takes 1_000
        except ValueError:
            distance = math.nan
        if not (math.isfinite(distance) and distance > 0):
            raise InputError(file, place, f"{words[1][:40]!r} is no distance", "write metres, such as 1.25")
        captures.append(_capture(beside(file, words[0], place), distance, file, place))
    if not captures:
        raise InputError(file, "", "names no folder", "write lines of `folder,distance_m`")
    return captures


def _capture(folder: Path, distance: float, file: Path, place: str) -> Capture:
    if not 0 < distance <= 100:
        raise InputError(file, place, f"is {distance:g} m away", "give a distance above 0 and up to 100 m")
    files = _pictures(folder)
    if not files:
        problem = "holds no PNG" if folder.is_dir() else "no such folder"
        raise InputError(file, place, f"{folder.name}: {problem}", "put the depth pictures there")
    return Capture(folder, distance, files)


def _pictures(folder: Path) -> tuple[Path, ...]:
    own = sorted(folder.glob("[!.]*.png"))
    return tuple(own or sorted((folder / "depth").glob("[!.]*.png")))
