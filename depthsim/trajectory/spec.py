"""Trajectory specifications, as in the `trajectories:` of a scene file or a trajectory's own YAML file."""

from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from depthsim.errors import InputError
from depthsim.trajectory.motion import Motion
from depthsim.trajectory.poses import Trajectory
from depthsim.trajectory.shapes import Circle, Hover, Lemniscate, Line
from depthsim.trajectory.tum import read_tum
from depthsim.trajectory.waypoints import Waypoints
from depthsim.yamlfile import beside, validate

SHAPES: dict[str, type[Motion]] = {
    "waypoints": Waypoints,
    "circle": Circle,
    "line": Line,
    "lemniscate": Lemniscate,
    "hover": Hover,
}


class _Recorded(BaseModel):
    """A TUM file in the folder of the file that names it."""

    model_config = ConfigDict(extra="forbid")

    file: str


def parse_spec(value: Any, file: Path, place: str = "") -> Motion | Trajectory:
    """A specification as the motion it describes, or as the poses of the TUM file that it names.

    file: where the specification is written; ``{file: NAME}`` is looked for in its folder, and must stay there.
    place: where in that file, for errors.
    """
    if not isinstance(value, dict):
        raise InputError(file, place, "is not a mapping", "write {shape: circle, ...} or {file: poses.txt}")
    if "file" in value:
        recorded = validate(_Recorded, value, file, place)
        return read_tum(beside(file, recorded.file, ".".join(filter(None, (place, "file")))))
    shape = value.get("shape")
    if not isinstance(shape, str) or shape not in SHAPES:
        problem = f"shape is {shape!r}" if "shape" in value else "has no shape"
        raise InputError(file, place, problem, f"the shapes are {', '.join(SHAPES)}")
    return validate(SHAPES[shape], value, file, place)
