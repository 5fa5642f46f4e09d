"""From what a user names to what the viewer shows: a scene, a run, or the report of a diagnosis."""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from depthsim.errors import InputError
from depthsim.materials import Materials, load_materials
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory
from viewer.report import is_report, load_report, load_shares, locate
from viewer.stage import Stage

SceneLoader = Callable[[str | Path], Scene]


def is_recorded(what: str | Path) -> bool:
    """Whether ``what`` is the folder of a run or of a report, whole or broken, and not a scene."""
    folder = Path(what)
    return any(os.path.isfile(folder / name) for name in ("depth.txt", "run.yaml", "diagnosis.json"))


def open_stage(
    what: str | Path,
    *,
    trajectory: str | None = None,
    sensor: str | None = None,
    materials: Materials | None = None,
    scene_loader: SceneLoader | None = None,
) -> Stage:
    """Open a scene, the folder of a run, or the folder of a report.

    trajectory: for a scene, as in `depthsim generate`. sensor: the profile that the simulation begins with: `paper`,
    or for a report the one that was diagnosed. scene_loader: reads a scene, with its tags and units.
    Raises :class:`~depthsim.errors.InputError`.
    """
    known = materials or load_materials()
    load = scene_loader or (lambda where: load_scene(where, materials=known))
    folder = Path(what)
    if is_report(folder):
        return _open_report(folder, known, load)
    if is_recorded(what):
        return _open_run(folder, sensor or "paper", known, load)
    scene, profile = load(what), load_profile(sensor or "paper")
    camera = profile.camera or preset("d435")
    path = load_trajectory(trajectory, scene, camera.rate)
    return Stage(folder.name or str(what), known, path, camera, profile, scene.started(float(path.stamps[0])))


def _open_run(folder: Path, sensor: str, known: Materials, load: SceneLoader, scene: Path | None = None) -> Stage:
    run = Run.open(folder)
    where = scene or run.scene
    return Stage(
        folder.resolve().name,
        known,
        run.trajectory,
        run.camera,
        load_profile(sensor),
        load(where).started(float(run.stamps[0])) if where else None,
        run,
    )


def _open_report(folder: Path, known: Materials, load: SceneLoader) -> Stage:
    report, origin = load_report(folder)
    recording = locate(folder, origin.run)
    scene = _named_scene(folder, origin.scene)
    stage = _open_run(recording, "paper", known, load, scene)
    if stage.scene is None:
        raise InputError(recording, "", "holds no scene", f"write `scene:` in {folder / 'report.yaml'}")
    report = replace(report, shares=load_shares(folder, len(stage.scene.faces)))
    return replace(stage, name=folder.resolve().name, profile=report.before, report=report)


def _named_scene(folder: Path, name: str | None) -> Path | None:
    """A scene of report.yaml: a file, or the name of one that comes with depthsim."""
    if name is None:
        return None
    return locate(folder, name) if os.path.exists(locate(folder, name)) else Path(name)
