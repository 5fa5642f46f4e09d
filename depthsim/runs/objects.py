"""The objects of a run: instances.yaml, what their numbers in instance/ mean, and objects/NAME.txt, where they were."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.moving import poses, tracks
from depthsim.raycast import Caster
from depthsim.runs import layout
from depthsim.scene import Scene
from depthsim.trajectory.poses import Trajectory
from depthsim.trajectory.tum import tum_text
from depthsim.yamlfile import read_model


class RunInstance(BaseModel):
    """One object of a run. id: its number in instance/, from 1. poses: the TUM file of one that moves."""

    model_config = ConfigDict(extra="allow", frozen=True)

    id: int = Field(ge=1, le=65535)
    name: str
    tags: tuple[str, ...] = ()
    poses: str | None = None


class _File(BaseModel):
    instances: list[RunInstance]


def object_files(scene: Scene, stamps: NDArray[np.float64]) -> dict[str, str]:
    """The texts of instances.yaml and of objects/NAME.txt for frames at ``stamps`` [s], by their names in the run."""
    files: dict[str, str] = {}
    for mover, (position, turn) in zip(scene.movers, tracks(scene.movers, stamps), strict=True):
        files[f"{layout.OBJECTS}/{mover.name}.txt"] = tum_text(Trajectory(stamps, position, turn, mover.name))
    moving = {mover.name for mover in scene.movers}
    entries: list[dict[str, Any]] = []
    first = 0
    for number, instance in enumerate(scene.objects, start=1):
        used = np.unique(scene.face_tags[first : first + instance.faces])
        entry: dict[str, Any] = {"id": number, "name": instance.name, "tags": [scene.tags[tag] for tag in used]}
        if instance.name in moving:
            entry["poses"] = f"{layout.OBJECTS}/{instance.name}.txt"
        entries.append(entry)
        first += instance.faces
    text = yaml.safe_dump({"instances": entries}, sort_keys=False, allow_unicode=True, default_flow_style=None)
    return {layout.INSTANCES: text, **files}


def read_instances(path: Path) -> dict[int, RunInstance]:
    """The objects of a run folder by their numbers; none without an instances.yaml."""
    file = path / layout.INSTANCES
    if not file.exists():
        return {}
    found: dict[int, RunInstance] = {}
    for number, entry in enumerate(read_model(_File, file, "an instances.yaml").instances):
        if entry.id in found or entry.name in [one.name for one in found.values()]:
            problem = f"{entry.name}, number {entry.id}, has the name or the number of another"
            raise InputError(file, f"instances.{number}", problem, "give each its own")
        found[entry.id] = entry
    return found


def object_remarks(scene: Scene, stamps: NDArray[np.float64], caster: Caster) -> list[str]:
    """What is to be known of the objects that move: those held at an end of their path, outside, or inside a wall."""
    remarks = []
    alone = caster.standing()
    low, high = _bounds(scene)
    places = poses(scene.movers, stamps)
    for number, mover in enumerate(scene.movers):
        held = mover.held(stamps)
        if held > 1e-3:
            remarks.append(f"{mover.name} stands still for {held:.2f} s, beyond the ends of its path")
        own = scene.vertices[slice(*mover.vertices)]
        middle = np.append((own.min(axis=0) + own.max(axis=0)) / 2, 1.0)
        centres = (places[:, number] @ middle)[:, :3]
        outside = int(np.count_nonzero(((centres < low) | (centres > high)).any(axis=1)))
        if outside:
            remarks.append(f"{mover.name} is outside the scene in {outside} of {len(stamps)} frames")
        elif _is_inside(alone, centres[0]):
            remarks.append(f"{mover.name} begins inside a wall or another object")
    return remarks


def _bounds(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    standing = scene.vertices[: scene.standing[0]]
    return standing.min(axis=0), standing.max(axis=0)


def _is_inside(caster: Caster, place: NDArray[np.float64]) -> bool:
    """Whether most of what is seen from ``place`` is seen from behind."""
    keys = {"width": 16, "height": 16, "fx": 8, "fy": 8, "cx": 7.5, "cy": 7.5, "baseline": 0.05}
    eye = Camera.model_validate(keys)
    ahead = np.eye(4)
    ahead[:3, 3] = place
    behind = ahead.copy()
    behind[:3, :3] = np.diag([1.0, -1.0, -1.0])
    met = caster.cast(eye, np.stack([ahead, behind]), threads=1)
    rays = np.stack([*eye.rays, np.ones(eye.shape, np.float32)], axis=-1)
    along = np.stack([rays, rays @ behind[:3, :3].T.astype(np.float32)])
    toward = np.sum(met.normals(caster.scene) * along, axis=-1)[met.hit]
    return bool(toward.size and np.mean(toward > 0) > 0.5)
