"""The `moves:` and `parent:` of a scene file's meshes: which of them move, and along what."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from depthsim.errors import InputError
from depthsim.moving import NAME
from depthsim.trajectory.motion import Motion, Point
from depthsim.trajectory.poses import Trajectory, frame_count
from depthsim.trajectory.rotation import OPTICAL_IN_BODY, Floats, multiply
from depthsim.trajectory.spec import SHAPES, parse_spec
from depthsim.trajectory.tum import read_tum
from depthsim.yamlfile import beside, validate

RATE = 250.0
"""[Hz] A shape becomes poses this often, between which an object goes straight: at 10 m/s² that is off by 20 µm."""


class Swing(Motion):
    """Turning to and fro about an axis, as a door does: from the first angle to the second and back, smoothly."""

    shape: Literal["swing"] = "swing"
    position: Point = Field((0.0, 0.0, 0.0), description="of the axis [m]")
    axis: Point = Field((0.0, 0.0, 1.0), description="its direction")
    angles: tuple[FiniteFloat, FiniteFloat] = Field(description="[°]")
    period: FiniteFloat = Field(gt=0, le=1e5, description="there and back [s]")

    @property
    def total_time(self) -> float:
        """Of one period [s]."""
        return self.period

    def sample(self, stamps: Floats, name: str = "trajectory") -> Trajectory:
        """The exact poses at ``stamps`` [s]."""
        length = float(np.linalg.norm(self.axis))
        if length < 1e-9:
            raise ValueError("axis has no length; give its direction, such as [0, 0, 1]")
        first, second = np.radians(self.angles)
        half = (first + (second - first) * (1 - np.cos(2 * np.pi * stamps / self.period)) / 2) / 2
        turned = np.column_stack([np.sin(half)[:, None] * np.divide(self.axis, length), np.cos(half)])
        return Trajectory(stamps, np.tile(self.position, (len(stamps), 1)), turned, name)


class _When(BaseModel):
    """The keys that every kind of motion may have."""

    model_config = ConfigDict(frozen=True)

    begin: FiniteFloat | None = Field(None, description="after the run's first frame [s]")
    stamp: FiniteFloat | None = Field(None, description="the same, as a stamp of the run [s]")
    repeat: bool = False

    @model_validator(mode="after")
    def _one_begin(self) -> "_When":
        if self.begin is not None and self.stamp is not None:
            raise ValueError("begin and stamp are both given: keep one of them")
        return self


@dataclass(frozen=True)
class Moves:
    """A mesh's motion; see :class:`~depthsim.moving.Mover`."""

    path: Trajectory
    begin: float | None
    repeated: bool
    spec: dict[str, Any] = field(default_factory=dict)
    delay: float = 0.0


def read_moves(value: dict[str, Any], file: Path, place: str) -> Moves:
    """The `moves:` of a mesh.

    A shape makes poses of x forward, y left, z up. `file:` is a TUM file of the object's own poses, `run:` a run or
    flight whose body or camera goes before. A shape begins with the run's first frame, `begin` [s] after it, or at
    `stamp` [s]; so does what is recorded, or else its stamps are the run's. Raises :class:`InputError`.
    """
    when = validate(_When, {key: value[key] for key in ("begin", "stamp", "repeat") if key in value}, file, place)
    spec = {key: item for key, item in value.items() if key not in ("begin", "stamp", "repeat")}
    kept = {**spec, **({"repeat": True} if when.repeat else {})}
    delay = when.begin or 0.0
    if "run" in spec:
        path = _of_run(spec, file, place)
    elif (shape := str(spec.get("shape"))) == "swing":
        return Moves(_sampled(validate(Swing, spec, file, place), file, place), when.stamp, True, kept, delay)
    else:
        if "file" not in spec and shape not in SHAPES:
            known = f"give `shape:` ({', '.join((*SHAPES, 'swing'))}), `file:` or `run:`"
            problem = f"shape is {shape[:80]!r}" if "shape" in spec else "says no way to move"
            raise InputError(file, place, problem, known)
        found = parse_spec(spec, file, place)
        if not isinstance(found, Trajectory):
            return Moves(_as_body(_sampled(found, file, place)), when.stamp, when.repeat, kept, delay)
        path = found
    begin = when.stamp if when.stamp is not None or when.begin is not None else float(path.stamps[0])
    return Moves(path, begin, when.repeat, kept, delay)


def _sampled(motion: Motion, file: Path, place: str) -> Trajectory:
    name, end = f"{file}: {place}", motion.total_time
    stamps = np.arange(frame_count(end, RATE, name)) / RATE
    stamps = np.append(stamps, end) if stamps[-1] < end - 1e-6 else stamps
    try:
        return motion.sample(stamps, name)
    except ValueError as error:
        problem, _, fix = str(error).partition("; ")
        raise InputError(file, place, problem, fix) from None


def _as_body(camera: Trajectory) -> Trajectory:
    """Poses of a camera's optical frame as those of x forward, y left, z up."""
    back = OPTICAL_IN_BODY * [-1, -1, -1, 1]
    return Trajectory(camera.stamps, camera.positions, multiply(camera.quaternions, back), camera.name)


class _OfRun(BaseModel):
    model_config = ConfigDict(extra="forbid")

    run: str


def _of_run(spec: dict[str, Any], file: Path, place: str) -> Trajectory:
    """The body of a flight, or else the camera of a run, as x forward, y left, z up."""
    folder = beside(file, validate(_OfRun, spec, file, place).run, f"{place}.run")
    if (folder / "flight.csv").is_file():
        from depthsim.flight.log import read_flight

        log = read_flight(folder / "flight.csv")
        if log.position is None:
            raise InputError(folder / "flight.csv", "header", "has no position", "write the columns px py pz")
        return Trajectory(log.t, log.position, log.quaternion, str(folder / "flight.csv"))
    if not (folder / "groundtruth.txt").is_file():
        problem = f"{folder.name} holds neither flight.csv nor groundtruth.txt"
        raise InputError(file, f"{place}.run", problem, "name the folder of a run or of a flight")
    return _as_body(read_tum(folder / "groundtruth.txt"))


def check_names(names: Sequence[str | None], file: Path) -> None:
    """The names that a scene file gives its meshes are file names, each once."""
    for number, name in enumerate(names):
        if name is None:
            continue
        place = f"meshes.{number}.name"
        if not NAME.fullmatch(name):
            raise InputError(file, place, f"{name[:80]!r} is no name", "write letters, digits, _ and -, at most 64")
        if name in names[:number]:
            raise InputError(file, place, f"{name} is the name of another mesh, too", "give each its own")


def family(names: Sequence[str], parents: Sequence[str | None], moves: Sequence[bool], file: Path) -> list[int | None]:
    """The place of each mesh's nearest ancestor that moves; None where none does.

    Raises :class:`InputError` for a parent that is not there, and for meshes that are their own ancestors.
    """
    for number, parent in enumerate(parents):
        if parent is not None and parent not in names:
            problem = f"there is no mesh {parent[:80]!r}"
            raise InputError(file, f"meshes.{number}.parent", problem, f"the names are {', '.join(names)[:200]}")
    found: list[int | None] = []
    for number in range(len(names)):
        chain, nearest = [number], None
        while (parent := parents[chain[-1]]) is not None:
            at = names.index(parent)
            if at in chain:
                way = " -> ".join(names[k] for k in (*chain, at))
                raise InputError(file, f"meshes.{number}.parent", f"goes round in a circle: {way}", "leave one out")
            chain.append(at)
            nearest = at if nearest is None and moves[at] else nearest
        found.append(nearest)
    return found
