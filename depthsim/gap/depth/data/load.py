"""From what a caller gives to the evidence: the recording, its scene, and the sensor that it is compared with."""

from collections.abc import Sequence
from pathlib import Path

from depthsim.errors import InputError
from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.left_imager import with_left_imager
from depthsim.gap.report.words import RAY_LENGTHS
from depthsim.materials import Materials, load_materials
from depthsim.runs.folder import Run, open_run
from depthsim.runs.pose_reference import with_poses_of_pictures
from depthsim.scene import Scene
from depthsim.scenefile.load import load_scene
from depthsim.sensor.effect import Effect
from depthsim.sensor.profile import Profile, load_profile


def load_evidence(
    run: str | Path | Run,
    scene: str | Path | Scene | None,
    sensor: str | Path | Profile | Sequence[Effect] | None,
    materials: str | Path | Materials | None = None,
    threads: int | None = None,
    config: DepthConfig = DepthConfig(),  # noqa: B008 - frozen
    objects: Sequence[str] = (),
    without_objects: Sequence[str] = (),
) -> tuple[Evidence, Profile]:
    """The recording as it is looked at, and the profile of the simulator; see :func:`depthsim.gap.diagnose`."""
    opened, known = open_run(run).looking_at(objects, without_objects), load_materials(materials)
    profile = _profile(opened, sensor)
    place = _scene(opened, scene, known)
    opened = with_poses_of_pictures(with_left_imager(opened, config.data), place)
    return Evidence(opened, place, known, profile.effects, threads, config=config), profile


def notes_of(evidence: Evidence) -> tuple[str, ...]:
    """What a reader must know besides."""
    looked, whole, notes = sum(map(len, evidence.blocks)), len(evidence.run), []
    if looked < whole:
        notes.append(f"{looked} of {whole} frames were looked at, in {len(evidence.blocks)} blocks")
    if evidence.rows < evidence.camera.height:
        notes.append(
            f"of each frame {evidence.rows} of its {evidence.camera.height} rows were looked at, in bands, other rows "
            "in every block"
        )
    if evidence.run.left_out:
        names = [one.name for number, one in evidence.run.instances.items() if number in evidence.run.left_out]
        notes.append(f"left out, by instance/: {', '.join(names)}")
    if evidence.camera.is_aligned_unsaid:
        notes.append(
            "camera.yaml has the intrinsics of its colour camera, so the depth is aligned to colour: write "
            "`aligned: true` there, or its alignment counts as an error"
        )
    if evidence.has_ray_lengths:
        notes.append(RAY_LENGTHS)
    if evidence.stands_still:
        notes.append("the camera stands still: errors of pose, time and motion cannot be seen")
    return (*notes, *filter(None, (evidence.lags.remark,)), *evidence.run.remarks)


def _profile(run: Run, sensor: str | Path | Profile | Sequence[Effect] | None) -> Profile:
    if sensor is None:
        own = run.path / "sensor.yaml"
        profile = load_profile(own if own.is_file() else "paper")
    else:
        profile = load_profile(sensor)
    if profile.stereo is not None:
        raise InputError(
            profile.name, "camera.sensor", "is active stereo, which has no effects to fit", "give a profile of effects"
        )
    return profile


def _scene(run: Run, scene: str | Path | Scene | None, materials: Materials) -> Scene:
    found = scene if scene is not None else run.scene
    if found is None:
        raise InputError(run.path, "", "holds no scene", "put scene.obj or scene.yaml there, or give `scene`")
    return load_scene(found, materials=materials).started(float(run.stamps[0]))
