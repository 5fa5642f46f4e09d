"""A wind as a user names it: numbers, a kind with its keys, or a file."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from depthsim.errors import InputError
from depthsim.flight.table import read_table
from depthsim.flight.wind import AnyWind, GriddedWind, Wind, WindField
from depthsim.trajectory.resolve import inline_keys
from depthsim.yamlfile import beside, read_mapping, validate

_COLUMNS = ("x", "y", "z", "wx", "wy", "wz")
_FORMS = "3/0/0, gusts:velocity=6/0/0, shear:velocity=8/0/0, or a .yaml or .csv file"


class _Holder(BaseModel):
    wind: AnyWind


def resolve_wind(choice: str | Path | Wind) -> Wind:
    """A wind: `3/0/0` [m/s], `gusts:velocity=6/0/0`, `shear:velocity=8/0/0,height=10`, a .yaml, or a .csv grid.

    One that is made already stays as it is.
    """
    if isinstance(choice, Wind):
        return choice
    path, choice = Path(choice), str(choice)
    if path.suffix.lower() == ".csv":
        read_grid(path)
        return GriddedWind(file=str(path))
    if path.suffix.lower() in (".yaml", ".yml"):
        return parse_wind(read_mapping(path, "a wind"), path)
    kind, colon, keys = choice.partition(":")
    spec: dict[str, Any] = {"kind": kind, **inline_keys(keys, path)} if colon else _velocity(choice)
    if spec.get("kind") == "field":
        raise InputError(choice, "", "names a file in one line", f"give the file itself: {_FORMS}")
    return validate(_Holder, {"wind": spec}, path).wind


def parse_wind(value: Any, file: Path, place: str = "") -> Wind:
    """The wind that a mapping in a YAML file describes; a grid's file lies in the folder of that file."""
    wind = validate(_Holder, {"wind": value}, file, place).wind
    if isinstance(wind, GriddedWind):
        grid = beside(file, wind.file, ".".join(filter(None, (place, "file"))))
        read_grid(grid)
        return GriddedWind(file=str(grid))
    return wind


def read_grid(path: Path) -> WindField:
    """A regular grid of velocities from a CSV file. Raises :class:`InputError`."""
    table = read_table(path, "a grid of wind velocities", lambda name: name in _COLUMNS)
    missing = [name for name in _COLUMNS if name not in table.columns]
    if missing:
        raise InputError(path, "header", f"has no column {' '.join(missing)}", f"name the columns {','.join(_COLUMNS)}")
    places, velocity = table.stack(_COLUMNS[:3]), table.stack(_COLUMNS[3:])
    if not len(places):
        raise InputError(path, "", "has no places under its header", "give every place of a regular grid once")
    axes = [np.unique(places[:, axis]) for axis in range(3)]
    shape = tuple(len(axis) for axis in axes)
    if len(places) != math.prod(shape) or len(np.unique(places, axis=0)) != len(places):
        problem = f"has {len(places)} places, not {' x '.join(map(str, shape))}"
        raise InputError(path, "", problem, "give every place of a regular grid once")
    spacing = []
    for name, axis in zip("xyz", axes, strict=True):
        steps = np.diff(axis) if len(axis) > 1 else np.ones(1)
        if np.ptp(steps) > 1e-6 * steps.max():
            raise InputError(
                path, name, f"goes in steps of {steps.min():.4g} to {steps.max():.4g} m", "use equal steps"
            )
        spacing.append(float(steps.mean()))
    index = tuple(np.searchsorted(axis, places[:, number]) for number, axis in enumerate(axes))
    grid = np.empty((*shape, 3))
    grid[index] = velocity
    return WindField(grid, np.array([axis[0] for axis in axes]), np.array(spacing))


def _velocity(choice: str) -> dict[str, Any]:
    try:
        parts = [float(part) for part in choice.split("/")]
    except ValueError:
        parts = []
    if len(parts) != 3:
        raise InputError(choice, "", "is no wind", f"give {_FORMS}")
    return {"kind": "constant", "velocity": parts}
