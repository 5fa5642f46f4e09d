"""Recordings with more poses than frames: what lies between two frames is taken from them, everywhere.

The camera nods by 10 degrees at 1 Hz while it moves along a line; frames come at 10 Hz, poses at 200 Hz. Straight from
frame to frame the nod is off by up to 0.49 degrees, as much as a default `extrinsic_rotation`.
"""

from collections.abc import Callable
from pathlib import Path
from shutil import copy, copytree

import numpy as np
import pytest
from recordings import write_room
from scipy.spatial.transform import Rotation
from shapes import look_at
from typer.testing import CliRunner

from depthsim.camera import Camera
from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.exporting import export
from depthsim.gap import investigate
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.importing import import_recording
from depthsim.materials import load_materials
from depthsim.odometry.results import read_rows
from depthsim.odometry.sweep import faster
from depthsim.raycast import Caster
from depthsim.runs import Run, RunWriter
from depthsim.runs.generate import generate
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.scenefile.save import save_scene
from depthsim.sensor import Effect, Sensor, effect_ids, load_profile
from depthsim.sensor.effects.rolling_shutter import RollingShutter
from depthsim.sensor.motion import Motion
from depthsim.trajectory import Trajectory, write_tum
from qa.trees import tree

CAMERA = Camera(name="small", width=80, height=60, fx=45, fy=45, cx=39.5, cy=29.5, baseline=0.05, rate=10)
FRAMES, START = 24, 1_700_000_000.0
STAMPS = np.round(START + 0.03 + np.arange(FRAMES) / 10, 6)
DENSE = np.round(START - 1.0 + np.arange(900) / 200, 6)
"""From a second before the first frame to a second after the last."""
LATE, READOUT = 0.03, 0.03
Turn = Callable[[np.ndarray], np.ndarray]


def poses_at(stamps: np.ndarray) -> np.ndarray:
    """(N, 4, 4) the true poses."""
    t = np.asarray(stamps) - START
    poses = np.tile(look_at((-1.2, 0.0, 1.2), (2.0, 0.0, 0.9)), (len(t), 1, 1))
    nod = np.radians(10) * np.sin(2 * np.pi * t)[:, None] * (1.0, 0.0, 0.0)
    poses[:, :3, :3] @= Rotation.from_rotvec(nod).as_matrix()
    poses[:, 1, 3] += 0.2 * np.sin(2 * np.pi * 0.4 * t)
    return poses


def path_of(stamps: np.ndarray) -> Trajectory:
    poses = poses_at(stamps)
    return Trajectory(stamps, poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3]).as_quat())


def degrees_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(Rotation.from_matrix(np.swapaxes(a[:, :3, :3], 1, 2) @ b[:, :3, :3]).magnitude())


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return load_scene(write_room(tmp_path_factory.mktemp("room") / "room.obj"))


def record(folder: Path, room: Scene, effects: tuple[Effect, ...] = (), late: float = 0.0) -> Path:
    """A recording of the sensor with ``effects`` whose frames are taken ``late`` [s] after their stamps."""
    sensor = Sensor(Caster(room), CAMERA, effects)
    with RunWriter(folder, CAMERA, path_of(STAMPS), {"made_by": "a camera", "tags": list(room.tags)}) as writer:
        for index, pose in enumerate(poses_at(STAMPS + late)):
            writer.write_frame(index, {"depth": sensor.measure(pose, index=index, seed=91, threads=1).depth_raw})
        save_scene(room, folder)
        writer.finish()
    write_tum(path_of(DENSE), folder / "groundtruth.txt")
    return folder


@pytest.fixture(scope="module")
def late(tmp_path_factory: pytest.TempPathFactory, room: Scene) -> Path:
    """Frames without noise that are late."""
    return record(tmp_path_factory.mktemp("dense") / "late", room, late=LATE)


def profile_of(folder: Path, effects: str) -> str:
    file = folder / "profile.yaml"
    file.write_text(f"effects: [{effects}]")
    return str(file)


def depthsim(*words: str | Path) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def same_depth(a: Run, b: Run) -> float:
    """The share of pixels that differ by no more than 2 mm; edges are where it fails."""
    pictures = [(a.depth_raw(i).astype(int), b.depth_raw(i).astype(int)) for i in range(len(a))]
    return float(np.mean([np.abs(x - y) <= 2 for x, y in pictures]))


@pytest.mark.parametrize("offset", [-0.3, -0.05, 0.013, 0.05, 0.5])
def test_between_frames_the_camera_is_where_its_poses_say(late: Path, room: Scene, offset: float) -> None:
    motion = Evidence(Run.open(late), room, load_materials(), ()).motion
    found = motion.at(STAMPS + offset)
    wanted = poses_at(STAMPS + offset)
    assert degrees_between(found, wanted).max() < 0.003
    assert np.abs(found[:, :3, 3] - wanted[:, :3, 3]).max() < 1e-4
    speeds = np.array([np.linalg.norm(motion.velocity(stamp), axis=1) for stamp in STAMPS + offset])
    turning = np.radians(10) * 2 * np.pi * np.abs(np.cos(2 * np.pi * (STAMPS + offset - START)))
    np.testing.assert_allclose(speeds[:, 1], turning, atol=0.02)


def test_a_recording_begins_with_its_first_frame_not_with_its_poses(late: Path, room: Scene) -> None:
    """`thermal_drift` counts from there."""
    assert Evidence(Run.open(late), room, load_materials(), ()).motion.start == STAMPS[0]
    assert Motion.along(path_of(STAMPS[:1]), path_of(DENSE)).at(STAMPS[:1] + 0.1)[0] == pytest.approx(
        poses_at(STAMPS[:1] + 0.1)[0], abs=1e-4
    )


def test_one_pose_stands_still() -> None:
    one = path_of(STAMPS[:1])
    for motion in (Motion.along(one), Motion.along(one, one)):
        np.testing.assert_array_equal(motion.at(STAMPS + 3.0), np.tile(one.matrices(), (FRAMES, 1, 1)))


def test_like_is_taken_at_the_times_of_the_recording(late: Path, tmp_path: Path) -> None:
    sensor = profile_of(tmp_path, f"time_offset: {{offset: {LATE}}}")
    depthsim("generate", "--like", late, "--sensor", sensor, "--out", tmp_path / "made")
    assert same_depth(Run.open(late), Run.open(tmp_path / "made")) > 0.995
    depthsim("generate", "--like", late, "--sensor", "clean", "--out", tmp_path / "not_late")
    assert same_depth(Run.open(late), Run.open(tmp_path / "not_late")) < 0.5


def test_the_rows_of_a_run_like_it_are_each_at_their_own_time(late: Path, room: Scene, tmp_path: Path) -> None:
    sensor = profile_of(tmp_path, f"rolling_shutter: {{readout: {READOUT}}}")
    depthsim("generate", "--like", late, "--sensor", sensor, "--out", tmp_path / "made")
    made, caster, shares = Run.open(tmp_path / "made"), Caster(room), []
    for index, stamp in enumerate(STAMPS):
        rows = poses_at(stamp + READOUT * ((np.arange(CAMERA.height) + 0.5) / CAMERA.height - 0.5))
        wanted = caster.cast(CAMERA, rows[None])[0].depth
        shares.append((np.abs(made.depth(index) - wanted) < 0.002).mean())
    assert np.mean(shares) > 0.995


def test_a_run_like_it_has_its_poses_and_another_like_that_the_same_bytes(late: Path, tmp_path: Path) -> None:
    sensor = profile_of(tmp_path, f"time_offset: {{offset: {LATE}}}, motion_noise, thermal_drift")
    words = ("generate", "--sensor", sensor, "--seed", "5")
    depthsim(*words, "--like", late, "--out", tmp_path / "made")
    assert (tmp_path / "made" / "groundtruth.txt").read_bytes() == (late / "groundtruth.txt").read_bytes()
    made = Run.open(tmp_path / "made")
    np.testing.assert_array_equal(made.poses, Run.open(late).poses)
    depthsim(*words, "--like", tmp_path / "made", "--out", tmp_path / "again")
    assert tree(tmp_path / "again") == tree(tmp_path / "made")
    depthsim(*words, "--like", late, "--frames", "5", "--out", tmp_path / "head")
    head = Run.open(tmp_path / "head")
    assert len(head) == 5
    assert all((head.depth_raw(i) == made.depth_raw(i)).all() for i in range(5)), "the last one, too"
    # The same command finds nothing left to do, and another recording's poses are refused.
    assert "0 made now" in depthsim(*words, "--like", late, "--out", tmp_path / "made")
    other = Path(copytree(late, tmp_path / "other"))
    write_tum(path_of(DENSE[::2]), other / "groundtruth.txt")
    done = CliRunner().invoke(app, [*words, "--like", str(other), "--out", str(tmp_path / "made")])
    assert isinstance(done.exception, InputError) or done.exit_code == 2


def test_a_run_like_one_without_more_poses_is_as_it_was(late: Path, tmp_path: Path) -> None:
    plain = Path(copytree(late, tmp_path / "plain"))
    write_tum(path_of(STAMPS), plain / "groundtruth.txt")
    depthsim("generate", "--like", plain, "--frames", "4", "--only-depth", "--out", tmp_path / "made")
    write_tum(path_of(STAMPS[:4]), tmp_path / "wanted.txt")
    assert (tmp_path / "made" / "groundtruth.txt").read_bytes() == (tmp_path / "wanted.txt").read_bytes()


@pytest.fixture(scope="module")
def bank() -> tuple[str, ...]:
    """What is left out: the effects that have nothing to do with when and where a frame was taken."""
    looked_at = {"time_offset", "rolling_shutter", "extrinsic_rotation", "pose_noise", "motion_noise"}
    return tuple(name for name in effect_ids() if name not in looked_at)


def test_a_time_offset_is_found_and_measured(room: Scene, bank: tuple[str, ...], tmp_path: Path) -> None:
    paper = load_profile("paper").effects
    found = investigate(
        record(tmp_path / "run", room, tuple(paper), 0.02), sensor="paper", without=bank, tasks=False
    ).diagnosis
    assert [cause.effect for cause in found.causes] == ["time_offset"]
    assert found.causes[0].parameters["offset"] == pytest.approx(0.02, abs=5e-4)
    assert found.causes[0].closed_fraction > 0.97


def test_a_rolling_shutter_along_dense_poses_is_found(room: Scene, bank: tuple[str, ...], tmp_path: Path) -> None:
    effects = (*load_profile("paper").effects, RollingShutter(readout=READOUT))
    profile = load_profile("paper").model_copy(update={"effects": effects})
    generate(room, path_of(STAMPS), CAMERA, profile, tmp_path / "run", truth=path_of(DENSE), seed=17, threads=1)
    found = investigate(tmp_path / "run", sensor="paper", without=bank, tasks=False).diagnosis
    assert [cause.effect for cause in found.causes] == ["rolling_shutter"]
    assert found.causes[0].parameters["readout"] == pytest.approx(READOUT, abs=2e-3)


@pytest.mark.parametrize("form", ["open3d", "ply"])
def test_exports_keep_all_poses(late: Path, tmp_path: Path, form: str) -> None:
    run = Run.open(late)
    export(run, form, tmp_path / "out")
    assert (tmp_path / "out" / "groundtruth.txt").read_bytes() == (late / "groundtruth.txt").read_bytes()
    per_frame = (tmp_path / "out" / {"open3d": "trajectory.log", "ply": "poses.txt"}[form]).read_text().splitlines()
    assert len(per_frame) == {"open3d": 5 * FRAMES, "ply": FRAMES}[form]


@pytest.mark.parametrize("way", ["ros2", "open3d", "as it is"])
def test_poses_come_back_as_dense_as_they_went(late: Path, tmp_path: Path, way: str) -> None:
    if way != "as it is":
        pytest.importorskip("rosbags")
        export(Run.open(late), way, tmp_path / "out")
    import_recording(late if way == "as it is" else tmp_path / "out", tmp_path / "back")
    back = Run.open(tmp_path / "back")
    np.testing.assert_allclose(back.truth.stamps, DENSE, atol=1e-6, rtol=0)
    np.testing.assert_allclose(back.poses, Run.open(late).poses, atol=1e-6)


def test_a_slower_run_of_a_sweep_goes_along_all_poses(late: Path) -> None:
    run = Run.open(late)
    slow, dense = faster(run, 0.25)
    assert dense is not None and len(slow) == 4 * (FRAMES - 1) + 1
    at = STAMPS[0] + (slow.stamps - STAMPS[0]) / 4
    assert degrees_between(slow.matrices(), poses_at(at)).max() < 0.003
    assert faster(run, 1.0) == (run.trajectory, run.truth)


def test_an_estimate_by_other_pictures_is_scored_against_the_nearest_pose(late: Path, tmp_path: Path) -> None:
    """Of a system that stamps its poses by colour images, 40 ms off the depth."""
    pytest.importorskip("evo")
    write_tum(path_of(STAMPS + 0.04), tmp_path / "other.txt")
    words = ("slam", late, "--out", tmp_path / "slam", "--estimate")
    depthsim(*words, tmp_path / "other.txt")
    write_tum(path_of(STAMPS), tmp_path / "same.txt")
    depthsim(*words, tmp_path / "same.txt")
    rows = {row["system"]: row for row in read_rows(tmp_path / "slam" / "results.csv")}
    assert rows["other"]["tracked"] == rows["same"]["tracked"] == str(FRAMES)
    assert float(rows["same"]["ate_m"]) < 1e-6 and float(rows["other"]["ate_m"]) < 1e-6


def test_the_viewer_moves_along_all_poses(late: Path) -> None:
    pytest.importorskip("viser")
    from viewer.opening import open_stage

    found = open_stage(late).motion.at(STAMPS + 0.05)
    assert degrees_between(found, poses_at(STAMPS + 0.05)).max() < 0.003


def with_gaps(late: Path, folder: Path) -> Path:
    """The recording without its poses from 1.0 to 1.58 s and from 1.9 to 2.0 s; six frames lie in the first gap."""
    run = Path(copytree(late, folder))
    t = DENSE - START
    kept = DENSE[~(((t > 1.0) & (t < 1.58)) | ((t > 1.9) & (t < 2.0)))]
    write_tum(path_of(kept), run / "groundtruth.txt")
    return run


def test_a_gap_of_the_poses_is_not_bridged_in_silence(
    late: Path, room: Scene, bank: tuple[str, ...], tmp_path: Path
) -> None:
    run = with_gaps(late, tmp_path / "gaps")
    words = (
        "6 of 24 frames lie in gaps of the poses of more than 0.15 s (the longest 0.59 s, at the frame of 1700000001.03"
    )
    assert words in Run.open(run).remarks[0]
    assert Run.open(late).remarks == ()
    assert words in " ".join(depthsim("inspect", run).split())
    assert any(words in note for note in import_recording(run, tmp_path / "back").notes)
    assert any(
        words in note for note in investigate(run, sensor="paper", without=effect_ids(), tasks=False).diagnosis.notes
    )
    assert words in " ".join(depthsim("generate", "--like", run, "--out", tmp_path / "made").split())


def test_what_a_gap_is() -> None:
    path = path_of(START + np.array([0.0, 0.1, 0.2, 0.36, 0.4, 1.0]))
    at = START + np.array([0.0, 0.05, 0.2, 0.2000001, 0.28, 0.36, 0.38, 0.9, 1.0])
    np.testing.assert_allclose(path.gaps(at), [0, 0, 0, 0, 0.16, 0, 0, 0.6, 0], atol=1e-6)
    assert path_of(STAMPS[:1]).gaps(STAMPS[:1]).tolist() == [0.0]
    assert path_of(STAMPS).gaps(STAMPS).max() == 0


@pytest.mark.parametrize(
    ("damage", "problem"),
    [
        (lambda lines: [*lines[:3], lines[5], lines[4], *lines[6:]], r"line 5: stamp .* is before the one above"),
        (lambda lines: [*lines[:4], lines[3], *lines[4:]], r"line 5: stamp .* comes twice"),
        (lambda lines: lines[300:], r"depth.txt: line 2: stamp .* is outside groundtruth.txt"),
        (lambda lines: lines[:500], r"depth.txt: line \d+: stamp .* is outside groundtruth.txt"),
    ],
)
def test_damaged_dense_poses(
    late: Path, tmp_path: Path, damage: Callable[[list[str]], list[str]], problem: str
) -> None:
    run = Path(copytree(late, tmp_path / "run"))
    lines = (run / "groundtruth.txt").read_text().splitlines()
    (run / "groundtruth.txt").write_text("\n".join(damage(lines)) + "\n")
    with pytest.raises(InputError, match=problem):
        Run.open(run)


def test_dense_poses_that_do_not_hold_the_frames_are_refused_before_anything_is_written(
    room: Scene, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="is outside the trajectory"):
        generate(room, path_of(STAMPS), CAMERA, load_profile("clean"), tmp_path / "run", truth=path_of(DENSE[:300]))
    assert not (tmp_path / "run").exists()


XYZ = Path(__file__).resolve().parents[2] / "shared" / "data" / "rgbd_dataset_freiburg1_xyz"


def test_a_real_recording_with_motion_capture(tmp_path: Path) -> None:
    """A Kinect moved by hand: 100 Hz poses with stamps of a clock of its own."""
    if not XYZ.is_dir():
        pytest.skip("shared/data/rgbd_dataset_freiburg1_xyz is not beside the repository")
    source = tmp_path / XYZ.name
    (source / "depth").mkdir(parents=True)
    lines = [line for line in (XYZ / "depth.txt").read_text().splitlines() if line[0] != "#"][:12]
    (source / "depth.txt").write_text("\n".join(lines) + "\n")
    for line in lines:
        copy(XYZ / line.split()[1], source / line.split()[1])
    copy(XYZ / "groundtruth.txt", source / "groundtruth.txt")
    depthsim("import", source, "--out", tmp_path / "run")
    depthsim("reconstruct", tmp_path / "run", "--out", tmp_path / "fused", "--voxel", "0.05")
    run = Run.open(tmp_path / "fused")
    assert len(run) == 12 and len(run.truth) > 10 * 12 and run.remarks == ()
    # Between frames 0.1 s apart the hand moves otherwise than straight: each frame against its neighbours.
    straight = run.trajectory.at(np.concatenate([run.stamps[:1], run.stamps[2::2]])).at(run.stamps[1:-1:2]).matrices()
    assert degrees_between(straight, run.poses[1:-1:2]).max() > 0.3
    reported = investigate(run, without=effect_ids(), tasks=False).diagnosis
    times = [cut.interval for cut in reported.where if cut.axis == "time"]
    assert all(interval is not None and 0 <= interval[0] < interval[1] < 3 for interval in times)
    assert "e+09" not in reported.to_json() and "130503" not in reported.to_json()
