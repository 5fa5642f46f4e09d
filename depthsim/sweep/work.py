"""One run of a sweep, made by :func:`depthsim.runs.generate.generate` in a target."""

import errno
import hashlib
import os
import shutil
import socket
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from depthsim.errors import InputError
from depthsim.materials import Materials
from depthsim.raycast import Caster
from depthsim.runs import layout
from depthsim.runs.generate import generate
from depthsim.runs.png import decode_png
from depthsim.runs.storing import LOCK, FolderLock, make_folder, sha256, write_whole
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.scenefile.save import MOTION, mesh_names, scene_text
from depthsim.sweep.plan import Plan
from depthsim.sweep.target import Target, Workplace, link
from depthsim.sweep.vary import frames_of, swapped_scene, swaps_of, varied_materials, varied_path, varied_profile
from depthsim.trajectory import make_trajectory
from depthsim.yamlfile import read_mapping

SCENES_HELD = 4
"""How many scenes a worker keeps. They come one after another, so that even one is built once a worker."""
_TAGGINGS_HELD = 16
_FATAL = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM, errno.ENODEV}
"""What no other run would fare better with: the target is full, or may not be written."""
_LOCK_WAIT = 20.0
"""[s] How long a run's folder may stay locked: a worker whose driver was killed ends within a frame."""


@dataclass
class _Held:
    """A scene in a worker's memory, with the taggings of its faces that were asked for."""

    scene: Scene
    caster: Caster
    tagged: OrderedDict[tuple[tuple[str, str], ...], Caster] = field(default_factory=OrderedDict)

    def with_tags(self, swaps: Mapping[str, str]) -> Caster:
        key = tuple(sorted(swaps.items()))
        if not key:
            return self.caster
        if key not in self.tagged:
            self.tagged[key] = self.caster.retagged(swapped_scene(self.scene, swaps))
            if len(self.tagged) > _TAGGINGS_HELD:
                self.tagged.popitem(last=False)
        self.tagged.move_to_end(key)
        return self.tagged[key]


class Maker:
    """Makes runs of a plan; the scenes that it needed last stay in memory with their acceleration structures.

    built: how many acceleration structures it has built.
    """

    def __init__(self, plan: Plan, target: Target) -> None:
        self._plan, self._target = plan, target
        self._materials = Materials.model_validate(plan.materials)
        self._held: OrderedDict[int, _Held] = OrderedDict()
        self.built = 0

    def make(
        self,
        index: int,
        *,
        expect: str | None = None,
        frames: int | None = None,
        progress: Callable[[int, int], None] = lambda done, total: None,
    ) -> dict[str, Any]:
        """Make what is missing of run ``index``; what it is now, as plain values for the manifest.

        expect: the run's sha256 as it was; what is damaged or gone since is found and made again.
        frames: at most so many, in place of the plan's.
        """
        begin, plan = time.monotonic(), self._plan
        run = plan.run(index)
        planned = plan.scenes[run.scene]
        materials = varied_materials(self._materials, run.values)
        profile = varied_profile(plan.profiles[run.profile], run.values)
        camera = profile.camera
        assert camera is not None  # a plan's profiles have theirs
        spec = varied_path(planned.trajectories[run.trajectory], run.values)
        count = frames_of(spec, camera.rate, plan.frames if frames is None else frames)
        trajectory = make_trajectory(spec, camera.rate, count, planned.trajectories[run.trajectory].name)
        with self._target.workplace(run.path) as place:
            _wait_for_lock(place.folder)
            swaps = swaps_of(planned.tags, run.values)
            caster = self._scene(run.scene).with_tags(swaps)

            def show(done: int, total: int) -> None:
                place.push()
                progress(done, total)

            write = partial(
                generate, caster.scene, trajectory, camera, profile, place.folder, materials=materials,
                seed=run.noise_seed, streams=plan.streams, threads=1, caster=caster, progress=show,
                save=partial(self._save, place=place, folder=planned.folder, swaps=swaps),
            )  # fmt: skip
            sound = expect is None or remove_damaged(place.folder, plan.streams, expect)
            made = write(overwrite=not sound)
            sha256, size = digest_of(place.folder, plan.streams)
            if expect is not None and sound and sha256 != expect:  # sound pictures, but not those that were made
                made = write(overwrite=True)
                sha256, size = digest_of(place.folder, plan.streams)
        return {
            "run": index, "state": "whole", "frames": made.frames, "made": made.made, "bytes": size, "sha256": sha256,
            "seconds": round(time.monotonic() - begin, 6), "built": self.built,
            "worker": f"{socket.gethostname()}:{os.getpid()}",
        }  # fmt: skip

    def _scene(self, number: int) -> _Held:
        if number not in self._held:
            planned = self._plan.scenes[number]
            scene = load_scene(self._target.scene_folder(planned.folder) / "scene.yaml", materials=self._materials)
            if scene.digest != planned.digest or scene.tags != planned.tags:
                problem = "has changed since the sweep was begun"
                raise InputError(f"{self._target.url}/{planned.folder}", "", problem, "put it back, or begin anew")
            self._held[number] = _Held(scene, Caster(scene))
            self.built += 1
            if len(self._held) > SCENES_HELD:
                self._held.popitem(last=False)
        self._held.move_to_end(number)
        return self._held[number]

    def _save(self, scene: Scene, out: Path, *, place: Workplace, folder: str, swaps: Mapping[str, str]) -> None:
        """The scene of a run: the sweep's own meshes under a second name, and a scene file with the draw's tags."""
        if not self._plan.with_scene:
            return
        for name in mesh_names(scene):
            if not (out / name).is_file():
                make_folder((out / name).parent)
                link(self._target.scene_folder(folder) / name, out / name)
        text = scene_text(scene, {"tags": dict(swaps)} if swaps else {})
        write_whole(out / "scene.yaml", text.encode())


def run_files(folder: Path, streams: tuple[str, ...]) -> list[Path]:
    """The files of a run that depend on nothing but its plan, sorted; not the mesh, which is the sweep's."""
    names = (
        layout.RECORD,
        layout.CAMERA,
        layout.GROUND_TRUTH,
        layout.INSTANCES,
        "scene.yaml",
        *map(layout.list_name, layout.LISTED),
    )
    files = [folder / name for name in names if (folder / name).is_file()]
    poses = (path for path in (folder / layout.OBJECTS).glob("[!.]*.txt") if not path.name.endswith(MOTION))
    return sorted([*files, *poses, *(path for stream in streams for path in (folder / stream).glob("[!.]*.png"))])


def digest_of(folder: Path, streams: tuple[str, ...]) -> tuple[str, int]:
    """sha256 of a run, and its size [bytes]: that of the lines that ``sha256sum`` prints of :func:`run_files`."""
    digest, size = hashlib.sha256(), 0
    for path in run_files(folder, streams):
        digest.update(f"{sha256(path)}  {path.relative_to(folder).as_posix()}\n".encode())
        size += path.stat().st_size
    return digest.hexdigest(), size


def remove_damaged(folder: Path, streams: tuple[str, ...], expect: str) -> bool:
    """Take away the pictures of a run that fail their checksums, if the run is not as ``expect`` says.

    False where no picture is damaged and the run yet differs: then nothing of it can be trusted.
    """
    if digest_of(folder, streams)[0] == expect:
        return True
    damaged = [path for path in run_files(folder, streams) if path.suffix == ".png" and not _is_sound(path)]
    for path in damaged:
        path.unlink()
    try:
        read_mapping(folder / layout.RECORD, "a run.yaml")
    except InputError:  # then the writer would not take the folder for a run
        shutil.rmtree(folder, ignore_errors=True)
        return False
    return bool(damaged)


def _is_sound(path: Path) -> bool:
    try:
        decode_png(path)
    except InputError:
        return False
    return True


def _wait_for_lock(folder: Path) -> None:
    """Wait for a worker that has lost its driver to let go of a run's folder."""
    until = time.monotonic() + _LOCK_WAIT
    while (folder / LOCK).exists():
        try:
            FolderLock(folder).release()
            return
        except InputError:
            if time.monotonic() > until:
                raise
            time.sleep(0.05)


def is_fatal(error: BaseException) -> bool:
    """Whether an error is one of the target, so that the other runs need not be tried."""
    seen: BaseException | None = error
    while seen is not None:
        if isinstance(seen, OSError) and seen.errno in _FATAL:
            return True
        seen = seen.__cause__ or seen.__context__
    return False
