"""From a scene, a trajectory and a sensor to a run on disk."""

import logging
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim import __version__
from depthsim.camera import Camera
from depthsim.coloring import color_image
from depthsim.errors import InputError
from depthsim.materials import Materials, load_materials
from depthsim.parallel import core_count
from depthsim.presets import load_camera
from depthsim.raycast import Caster
from depthsim.runs.objects import object_files, object_remarks
from depthsim.runs.writer import RunWriter
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.scenefile.save import save_scene
from depthsim.sensor import Effect, Profile, Sensor, load_profile
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import measuring_camera, stored_camera
from depthsim.sensor.sensor import Measurement, check_tags
from depthsim.trajectory import Trajectory, load_trajectory
from depthsim.units import to_depth_raw

_log = logging.getLogger(__name__)
STREAMS = ("depth", "clean", "material", "rgb", "normal", "instance", "ir_left", "ir_right")
"""What can be written of a frame; `normal` and `ir_*` only where they are asked for, `ir_*` only of active stereo;
`instance` where it is asked for, or where objects move and nothing is said."""
IR_STREAMS = STREAMS[6:]
DEFAULT_STREAMS: tuple[str, ...] = STREAMS[:4]


@dataclass(frozen=True)
class Generated:
    """What :func:`generate` did: the run's folder, its frames in all, and how many of them were made now."""

    path: Path
    frames: int
    made: int


def generate(
    scene: str | Path | Scene,
    trajectory: str | Path | Trajectory | None = None,
    camera: str | Path | Camera | None = None,
    profile: str | Path | Profile | Sequence[Effect] = "paper",
    out: str | Path = "run",
    *,
    frames: int | None = None,
    truth: Trajectory | None = None,
    materials: str | Path | Materials | None = None,
    seed: int = 0,
    streams: tuple[str, ...] | None = None,
    threads: int | None = None,
    overwrite: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
    caster: Caster | None = None,
    save: Callable[[Scene, Path], None] = save_scene,
) -> Generated:
    """Write the run of ``profile`` along ``trajectory`` to the folder ``out``.

        generate("office", "tour", camera="d435", profile="paper", out="run", frames=60)

    scene, camera, profile, materials: as :class:`~depthsim.sensor.Sensor` takes them; the run's camera.yaml has the
    camera of the stored pictures, another one where effects decimate them or align them to colour. trajectory: as
    :func:`~depthsim.trajectory.load_trajectory` takes it, at the camera's rate; the scene's first by default. Poses
    that are given are the frames'. frames: the first so many.

    A run that was broken off is finished by the same call, in the same bytes. Frames are made side by side, one a
    thread, and each depends on nothing but its number, so the bytes do not depend on ``threads`` either.

    truth: all poses on the way, where more are known than those of the frames: groundtruth.txt has them, and effects of
    time and motion go along them. Without it the camera goes straight from frame to frame.
    streams: which pictures to write, from :data:`STREAMS`; depth is always among them. :data:`DEFAULT_STREAMS` if None,
    and `instance` where objects move. Where they do, or with `instance`, the run says what objects there are
    (instances.yaml) and where they were at each frame (objects/NAME.txt); what is odd about their paths is logged.
    progress: called with the frames that are done and the frames in all.
    caster: of ``scene``, where there is one already. save: puts the scene into the folder in its own way.
    Raises :class:`InputError` for anything that cannot be read, and for a folder that holds something else.
    """
    out, materials, profile = Path(out), load_materials(materials), load_profile(profile)
    scene = load_scene(scene, materials=materials)
    check_tags(scene, profile.effects, materials)  # before a folder is there
    if streams is None:
        streams = (*DEFAULT_STREAMS, *(("instance",) if scene.movers else ()))
    if profile.stereo is None and set(IR_STREAMS) & set(streams):
        raise InputError(profile.name, "", "is a sensor without infrared images", "give one of active stereo")
    camera = load_camera(camera or profile.camera or "d435")
    stored = stored_camera(camera, profile.effects)
    if stored.shape != measuring_camera(camera, profile.effects).shape and set(IR_STREAMS) & set(streams):
        fix = "leave out `ir`, or the effects that resize the depth"
        raise InputError(camera.name, "", "stores depth pictures of another size than the infrared ones", fix)
    if scene.look is not None and "rgb" not in streams and profile.stereo is None:
        scene = replace(scene, look=None)  # so that textures need not be there
    rate = None if isinstance(trajectory, Trajectory) else camera.rate
    path = load_trajectory(trajectory, scene, rate, frames)
    scene = scene.started(float(np.round(path.stamps[0], 6)))
    record = _describe(scene, profile, materials, seed)
    texts = {}
    if scene.movers or "instance" in streams:
        texts = object_files(scene, np.round(path.stamps, 6) + 0.0)
    with RunWriter(out, stored, path, record, streams, truth=truth, texts=texts, overwrite=overwrite) as writer:
        missing, total = writer.missing(), len(path)
        progress(total - len(missing), total)
        if missing:
            save(scene, out)
            if scene.movers:
                caster = caster.retagged(scene) if caster else Caster(scene)
                for remark in object_remarks(scene, writer.trajectory.stamps, caster):
                    _log.info("%s: %s", out, remark)
            sensor = Sensor(caster or scene, camera, profile, materials)
            maker = FrameMaker(
                sensor, writer.trajectory, seed, streams, writer.truth
            )  # whose stamps are those of the files
            _write_frames(maker, writer, missing, total, threads or core_count(), progress)
        writer.finish()
    return Generated(out, total, len(missing))


def _describe(scene: Scene, profile: Profile, materials: Materials, seed: int) -> dict[str, Any]:
    """What a run's bytes depend on besides camera and poses, for run.yaml: the same record is the same run."""
    import yaml

    stereo = {} if profile.stereo is None else {"stereo": profile.stereo.model_dump(mode="json")}
    return {
        "depthsim": __version__,
        "scene": scene.name,
        "faces": len(scene.faces),
        "scene_digest": scene.digest,
        "tags": list(scene.tags),
        "materials": {tag: materials[tag].model_dump(exclude=_NO_EFFECT) for tag in scene.tags},
        "profile": {key: value for key, value in yaml.safe_load(profile.to_yaml()).items() if key != "camera"},
        **stereo,
        "seed": seed,
    }


_NO_EFFECT = {"source", "sources", "also", "color"}
"""The keys of a material that no picture depends on."""


class FrameMaker:
    """Makes the pictures of a frame; each thread keeps buffers of its own."""

    def __init__(
        self,
        sensor: Sensor,
        trajectory: Trajectory,
        seed: int,
        streams: tuple[str, ...],
        truth: Trajectory | None = None,
    ) -> None:
        self._sensor, self._seed, self._streams = sensor, seed, streams
        self._stamps, self._poses = trajectory.stamps, trajectory.matrices()
        self._motion = Motion.along(trajectory, truth)
        self._buffers = threading.local()

    def __call__(self, index: int) -> dict[str, NDArray[Any]]:
        """The pictures of frame ``index`` by stream; they are good until this thread makes its next frame."""
        sensor, pose = self._sensor, self._poses[index]
        previous: Measurement | None = getattr(self._buffers, "measurement", None)
        measured = sensor.measure(
            pose,
            index=index,
            stamp=float(self._stamps[index]),
            seed=self._seed,
            motion=self._motion,
            threads=1,
            out=previous,
        )
        self._buffers.measurement = measured
        scene, camera, stamp = sensor.caster.scene, measured.camera, float(self._stamps[index])
        makers: dict[str, Callable[[], NDArray[Any]]] = {
            "depth": lambda: measured.depth_raw,
            "clean": lambda: to_depth_raw(measured.clean.depth, camera),
            "material": lambda: measured.clean.tag,
            "rgb": lambda: color_image(measured.clean, camera, pose, scene, sensor.materials, 1, stamp),
            "normal": lambda: measured.clean.normals(scene, stamp),
            "instance": lambda: scene.instance_of_face[measured.clean.face + 1],
        }
        if measured.left is not None and measured.right is not None:
            left, right = measured.left, measured.right
            makers |= {"ir_left": lambda: left, "ir_right": lambda: right}
        return {stream: makers[stream]() for stream in self._streams}


def _write_frames(
    maker: FrameMaker,
    writer: RunWriter,
    missing: list[int],
    total: int,
    threads: int,
    progress: Callable[[int, int], None],
) -> None:
    def make(index: int) -> None:
        writer.write_frame(index, maker(index))

    done = total - len(missing)
    pool = ThreadPoolExecutor(threads)
    try:
        # In order: `as_completed` locks every job at once, and a Ctrl-C while it does so leaves them locked for good.
        for _ in pool.map(make, missing):
            done += 1
            progress(done, total)
    finally:
        # After a fault or Ctrl-C the frames under way are finished and the others forgotten.
        pool.shutdown(cancel_futures=True)
