"""From a SWEEP.yaml to its plan: every file read and checked before anything is made."""

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from depthsim import __version__
from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.materials import Materials, load_materials
from depthsim.presets import preset, resolve_camera
from depthsim.runs.generate import IR_STREAMS
from depthsim.runs.storing import sha256
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.scenefile.locate import SCENE_SUFFIXES, builtin_scenes, find_scene
from depthsim.scenefile.spec import read_scene_file
from depthsim.sensor import Profile, load_profile
from depthsim.sensor.profile import profile_names, profile_path
from depthsim.sweep.check import check_draws
from depthsim.sweep.plan import Plan, PlannedPath, PlannedProfile, PlannedScene
from depthsim.sweep.spec import SceneEntry, SweepFile, read_sweep
from depthsim.trajectory import SHAPES, Trajectory, parse_spec, read_tum
from depthsim.trajectory.motion import Motion
from depthsim.trajectory.resolve import inline_keys
from depthsim.yamlfile import beside, read_mapping

Keep = Callable[[PlannedScene, Scene], None]
_NOT_PLANNED = {"source", "sources", "also", "color"}
"""The keys of a material that no run depends on."""


def resolve_sweep(file: Path, keep: Keep = lambda planned, scene: None) -> Plan:
    """The plan of a SWEEP.yaml. ``keep`` is given each scene in turn, so that no two need to be held at a time.

    Names and paths in the file are those of ``depthsim generate``; a path is looked for in the file's folder and may
    not leave it. Raises :class:`InputError` for the first thing that could not be made.
    """
    sweep = read_sweep(file)
    materials = load_materials(beside(file, sweep.materials, "materials") if sweep.materials else None)
    profiles = tuple(_profile(name, f"profiles.{i}", sweep, file) for i, name in enumerate(sweep.profiles))
    _refuse_twice(file, "profiles", [profile.name for profile in profiles])
    if set(IR_STREAMS) & set(sweep.streams):
        for i, profile in enumerate(profiles):
            if profile.stereo is None:
                problem = f"{profile.name} is a sensor without infrared images"
                raise InputError(file, f"profiles.{i}", problem, "leave out ir_left and ir_right, or that profile")
    entries = [(entry, f"scenes.{i}") for i, given in enumerate(sweep.scenes) for entry in _matches(given, i, file)]
    _refuse_twice(file, "scenes", [entry.scene for entry, _ in entries])
    folders: Counter[str] = Counter()
    scenes = []
    for entry, place in entries:
        scene, planned = _scene(entry, place, sweep, file, materials, folders)
        keep(planned, scene)
        scenes.append(planned)
    plan = Plan(
        depthsim=__version__,
        name=sweep.name or file.stem,
        scenes=tuple(scenes),
        profiles=profiles,
        seeds=sweep.seed_list,
        draws=sweep.draws,
        seed=sweep.seed,
        frames=sweep.frames,
        rate=sweep.rate,
        streams=sweep.streams,
        materials={tag: materials[tag].model_dump(exclude=_NOT_PLANNED, mode="json") for tag in materials.tags},
        with_scene=sweep.with_scene,
        random=sweep.random.paths(),
    )
    check_draws(plan, file)
    return plan


def _refuse_twice(file: Path, place: str, names: list[str]) -> None:
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    if twice is not None:
        raise InputError(file, place, f"names {twice} twice", "leave one of them out")


def _matches(entry: SceneEntry, number: int, file: Path) -> list[SceneEntry]:
    """An entry whose scene is a pattern, as one entry a file."""
    if not set(entry.scene) & set("*?["):
        return [entry]
    beside(file, entry.scene.translate(str.maketrans("*?[]", "____")), f"scenes.{number}")  # refuses .. and /
    found = sorted(path.relative_to(file.parent).as_posix() for path in file.parent.glob(entry.scene))
    if not found:
        raise InputError(file, f"scenes.{number}", f"no file matches {entry.scene}", "correct the pattern")
    return [entry.model_copy(update={"scene": name}) for name in found]


def _scene(
    entry: SceneEntry, place: str, sweep: SweepFile, file: Path, materials: Materials, folders: Counter[str]
) -> tuple[Scene, PlannedScene]:
    path = find_scene(entry.scene if entry.scene in builtin_scenes() else beside(file, entry.scene, place))
    scene = load_scene(path, tags=entry.tags, units=entry.units, up=entry.up, materials=materials)
    if "rgb" not in sweep.streams:
        scene = replace(scene, look=None)
    stem = re.sub(r"[^A-Za-z0-9_-]+", "_", Path(entry.scene).stem).strip("_") or "scene"
    folders[stem] += 1
    folder = f"scenes/{stem}" if folders[stem] == 1 else f"scenes/{stem}.{folders[stem]}"
    wanted = sweep.trajectories if entry.trajectories is None else entry.trajectories
    if wanted is None:
        if not scene.trajectories:
            raise InputError(file, place, f"{entry.scene} comes without a trajectory", "name one under trajectories")
        wanted = (next(iter(scene.trajectories)),)
    at = "trajectories" if entry.trajectories is None else f"{place}.trajectories"
    paths = tuple(_path(choice, scene, file, f"{at}.{i}") for i, choice in enumerate(wanted))
    _refuse_twice(file, at, [path.name for path in paths])
    planned = PlannedScene(
        name=entry.scene,
        folder=folder,
        digest=scene.digest,
        faces=len(scene.faces),
        tags=scene.tags,
        sources=_sources(path),
        trajectories=paths,
    )
    return scene, planned


def _sources(path: Path) -> dict[str, str]:
    """sha256 of the scene's file and of the meshes that it names, by their names."""
    files = {path.name: path}
    if path.suffix.lower() in SCENE_SUFFIXES:
        _, entries = read_scene_file(path)
        files |= {entry.file: path.parent / entry.file for entry in entries if entry.file is not None}
    return {name: sha256(source) for name, source in files.items()}


def _path(choice: str | dict[str, Any], scene: Scene, file: Path, place: str) -> PlannedPath:
    """A trajectory by the scene's own name for it, by file, as a shape in one line, or by its keys."""
    if isinstance(choice, dict):
        name = str(choice.get("name") or f"{choice.get('shape', 'trajectory')}_{place.rpartition('.')[2]}")
        keys = {key: value for key, value in choice.items() if key != "name"}
        return _planned_path(name, parse_spec(keys, file, place))
    if choice in scene.trajectories:
        home = Path(scene.source or scene.name)
        return _planned_path(choice, parse_spec(scene.trajectories[choice], home, f"trajectories.{choice}"))
    suffix = Path(choice).suffix.lower()
    if suffix in (".txt", ".tum"):
        return _planned_path(choice, read_tum(beside(file, choice, place)))
    if suffix in (".yaml", ".yml"):
        there = beside(file, choice, place)
        return _planned_path(choice, parse_spec(read_mapping(there, "a trajectory specification"), there))
    shape, colon, rest = choice.partition(":")
    if colon and shape in SHAPES:
        return _planned_path(choice, parse_spec({"shape": shape, **inline_keys(rest, file)}, file, place))
    names = f"those of {scene.name} are {', '.join(scene.trajectories)}" if scene.trajectories else "it has none"
    raise InputError(file, place, f"{choice!r} is no trajectory of scene {scene.name}", f"{names}; or give a file")


def _planned_path(name: str, spec: Motion | Trajectory) -> PlannedPath:
    if isinstance(spec, Motion):
        return PlannedPath(name=name, shape=spec.model_dump(mode="json", exclude_none=True))
    rows = np.column_stack([spec.stamps, spec.positions, spec.quaternions])
    return PlannedPath(name=name, poses=tuple(map(tuple, rows.tolist())))


def _profile(name: str, place: str, sweep: SweepFile, file: Path) -> PlannedProfile:
    path = name if name in profile_names() else beside(file, name, place)
    profile = load_profile(path)
    stereo: BaseModel | None = profile.stereo
    sources = {f"{name}.yaml" if isinstance(path, str) else name: sha256(profile_path(path))}
    return PlannedProfile(
        name=name,
        sources=sources,
        camera=_camera(profile, sweep, file).model_dump(mode="json"),
        effects=tuple((effect.id, effect.model_dump(mode="json")) for effect in profile.effects),
        stereo=None if stereo is None else stereo.model_dump(mode="json"),
    )


def _camera(profile: Profile, sweep: SweepFile, file: Path) -> Camera:
    camera = profile.camera or preset("d435")
    if sweep.camera is not None:
        camera = resolve_camera(sweep.camera, file)
    if sweep.resolution is not None:
        known = preset(camera.name, *sweep.resolution)
        camera = known.aligned_to_color() if camera.aligned else known
    return camera if sweep.rate is None else camera.model_copy(update={"rate": sweep.rate})
