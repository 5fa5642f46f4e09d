"""A reference path as a user names it."""

from pathlib import Path as File
from typing import Any

from depthsim.errors import InputError
from depthsim.flight.minimum_snap import MinimumSnap
from depthsim.flight.paths import Circle, Hover, Lemniscate, Path, Shuttle
from depthsim.trajectory.resolve import inline_keys
from depthsim.yamlfile import read_mapping, validate

PATHS: dict[str, type[Path]] = {
    "circle": Circle,
    "lemniscate": Lemniscate,
    "shuttle": Shuttle,
    "minimum_snap": MinimumSnap,
    "hover": Hover,
}
_FORMS = f"a .yaml file, or a shape such as circle:radius=5,laps=2 ({', '.join(PATHS)})"


def resolve_path(choice: str | File | Path, speed: float | None = None) -> Path:
    """A path: a shape in one line, `lemniscate:size=20/10,center=0/0/2`, or the path of a YAML file with its keys.

    One that is made already stays as it is.

    speed: [m/s], in place of the one written there. Way-points are separated by semicolons. Raises
    :class:`InputError`.
    """
    if isinstance(choice, Path):
        return choice
    file, choice = File(choice), str(choice)
    if file.suffix.lower() in (".yaml", ".yml"):
        return parse_path(read_mapping(file, "a flight path"), file, speed=speed)
    shape, _, keys = choice.partition(":")
    if shape not in PATHS:
        raise InputError(choice, "", "is no flight path", f"give {_FORMS}")
    return parse_path({"shape": shape, **inline_keys(keys, file)}, file, speed=speed)


def parse_path(value: Any, file: File, place: str = "", speed: float | None = None) -> Path:
    """The path that a mapping describes; ``file`` and ``place`` say where it is written."""
    if not isinstance(value, dict):
        raise InputError(file, place, "is not a mapping", "write {shape: circle, radius: 5, speed: 3}")
    shape = value.get("shape")
    if not isinstance(shape, str) or shape not in PATHS:
        problem = f"shape is {shape!r}" if "shape" in value else "has no shape"
        raise InputError(file, place, problem, f"the shapes are {', '.join(PATHS)}")
    if PATHS[shape] is not Hover:
        value = {**value, **({} if speed is None else {"speed": speed})}
        if "speed" not in value:
            raise InputError(file, place, "has no speed", "give `speed`, or the key speed [m/s]")
    return validate(PATHS[shape], value, file, place)
