"""From what a user names, to the poses of the frames."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from depthsim.errors import InputError
from depthsim.trajectory.motion import Motion
from depthsim.trajectory.poses import Trajectory, frame_count, wanted_frames
from depthsim.trajectory.spec import SHAPES, parse_spec
from depthsim.trajectory.tum import read_tum
from depthsim.yamlfile import read_mapping

if TYPE_CHECKING:
    from depthsim.scene import Scene


def load_trajectory(
    choice: str | Path | Trajectory | None,
    scene: "str | Path | Scene | None" = None,
    rate: float | None = None,
    frames: int | None = None,
) -> Trajectory:
    """The poses of the frames to make.

    choice: poses, which are used one by one unless a rate is given; the name of one of the scene's trajectories; the
    path of a TUM file (.txt, .tum) or of a specification (.yaml, .yml); a shape in one line,
    `circle:radius=2,speed=1,center=0/0/1,look_at=0/0/0`; or None for the scene's first.
    scene: as :func:`~depthsim.scenefile.load_scene` takes it; only the name of a trajectory and None need one.
    rate: frames a second [Hz]. Without it a TUM file is used pose by pose; a shape needs it.
    frames: the first so many frames; all of them if None.

    A shape starts at 0 s and its stamps are k / rate. A TUM file keeps its stamps, or starts at its first one.
    """
    if isinstance(choice, Trajectory):
        return make_trajectory(choice, rate, frames)
    known = None
    if scene is not None:
        from depthsim.scenefile.load import load_scene  # here, because the objects of a scene have trajectories, too

        known = load_scene(scene)
    spec, file, place = _find(choice, known)
    return make_trajectory(spec, rate, frames, str(file), place)


def make_trajectory(
    spec: Motion | Trajectory,
    rate: float | None = None,
    frames: int | None = None,
    file: str = "trajectory",
    place: str = "",
) -> Trajectory:
    """The frames of a motion or of recorded poses; see :func:`load_trajectory`."""
    if isinstance(spec, Trajectory):
        return spec.head(frames) if rate is None else spec.sampled(rate, frames)
    if rate is None:
        raise InputError(file, place, "a shape has no frames of its own", "give a frame rate")
    name = ": ".join(filter(None, (file, place)))
    try:
        count = wanted_frames(frames, frame_count(spec.total_time, rate, name), name)
        return spec.sample(np.arange(count) / rate, name)
    except ValueError as error:
        problem, _, fix = str(error).partition("; ")
        raise InputError(file, place, problem, fix) from None


def _find(choice: str | Path | None, scene: "Scene | None") -> tuple[Motion | Trajectory, Path, str]:
    """The specification, the file it is in, and the place there."""
    known = scene.trajectories if scene else {}
    home = Path(scene.source or scene.name) if scene else Path("trajectory")
    if choice is None:
        if not known:
            raise InputError(home, "", "comes without a trajectory", f"name one: {_forms()}")
        choice = next(iter(known))
    if isinstance(choice, str) and choice in known:
        place = f"trajectories.{choice}"
        return parse_spec(known[choice], home, place), home, place
    path = Path(choice)
    if path.suffix.lower() in (".txt", ".tum"):
        return read_tum(path), path, ""
    if path.suffix.lower() in (".yaml", ".yml"):
        return parse_spec(read_mapping(path, "a trajectory specification"), path), path, ""
    shape, colon, keys = str(choice).partition(":")
    if colon and shape in SHAPES:
        return parse_spec({"shape": shape, **inline_keys(keys, path)}, path), path, ""
    names = f"one of the scene's ({', '.join(known)}), " if known else ""
    raise InputError(str(choice), "", "is no trajectory", f"give {names}{_forms()}")


def _forms() -> str:
    return f"a TUM .txt file, a .yaml file, or a shape such as circle:radius=2,speed=1 ({', '.join(SHAPES)})"


def inline_keys(text: str, path: Path) -> dict[str, Any]:
    """`key=value` pairs between commas. A point is x/y/z; several are separated by semicolons."""
    spec: dict[str, Any] = {}
    for pair in filter(None, text.split(",")):
        key, equals, value = pair.partition("=")
        if not equals or key in spec:
            problem = "is given twice" if key in spec else "is not key=value"
            raise InputError(path, pair, problem, "write it as circle:radius=2,speed=1,center=0/0/1")
        points = [[_word(part) for part in point.split("/")] for point in value.split(";")]
        spec[key] = points if ";" in value else points[0] if "/" in value else points[0][0]
    return spec


def _word(text: str) -> float | bool | str:
    try:
        return {"true": True, "false": False}[text] if text in ("true", "false") else float(text)
    except ValueError:
        return text
