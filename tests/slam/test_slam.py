"""Systems run on runs, and their estimates are scored rightly."""

import csv
from pathlib import Path

import numpy as np
import pytest
from recordings import make_room_run, path_of
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.odometry import SYSTEMS, estimate, score
from depthsim.odometry.results import read_rows
from depthsim.odometry.sweep import faster, noise_of, sweep
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.png import decode_png
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import Trajectory, load_trajectory


@pytest.fixture(scope="module")
def room(tmp_path_factory) -> Run:
    return make_room_run(tmp_path_factory.mktemp("slam") / "room")


def moved(path: Trajectory, by: np.ndarray) -> Trajectory:
    return Trajectory.of_matrices(path.stamps, by @ path.matrices(), "moved")


def long_path() -> Trajectory:
    t = np.linspace(0, 10, 101)
    zero = np.zeros_like(t)
    return Trajectory(
        t, np.stack([t, np.sin(t), 0.2 * t**2], axis=1), np.stack([zero, zero, np.sin(t), np.cos(t)], axis=1)
    )


def test_a_rigid_motion_of_the_whole_is_no_error():
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec([0.4, -1.0, 0.2]).as_matrix()
    motion[:3, 3] = [5, -2, 1]
    found = score(long_path(), moved(long_path(), motion))
    assert found.matched == 101
    assert max(found.ate, found.rpe, found.rpe_deg, found.drift) < 1e-6
    steps = np.linalg.norm(np.diff(long_path().positions, axis=0), axis=1)
    assert found.path == pytest.approx(steps.sum())


def test_drift_and_errors_are_what_was_put_in():
    truth = long_path()
    scaled = Trajectory(truth.stamps, 1.02 * truth.positions, truth.quaternions, "scaled")
    found = score(truth, scaled)
    assert found.drift == pytest.approx(0.02, rel=0.08)  # 2 % of every metre; chords are a little shorter than the way
    centred = truth.positions - truth.positions.mean(axis=0)
    assert found.ate == pytest.approx(0.02 * np.sqrt((centred**2).sum(axis=1).mean()), rel=0.02)
    jitter = np.random.default_rng(0).normal(0, 0.01, truth.positions.shape)
    found = score(truth, Trajectory(truth.stamps, truth.positions + jitter, truth.quaternions, "jitter"))
    assert found.ate == pytest.approx(0.01 * np.sqrt(3), rel=0.1)
    assert found.rpe == pytest.approx(0.01 * np.sqrt(6), rel=0.1)


@pytest.mark.parametrize("scale", [0.0, 0.15, 0.5, 1.02, 2.0])
def test_drift_is_per_metre_of_the_true_path(scale):
    """On a straight line with poses every 25 cm each metre of the truth is off by |scale - 1| m, exactly."""
    t = np.arange(41) / 4
    zero = np.zeros_like(t)
    still = np.stack([zero, zero, zero, zero + 1], axis=1)
    line, curve = Trajectory(t, np.stack([t, zero, zero], axis=1), still), long_path()
    found = score(line, Trajectory(t, scale * line.positions, still, "scaled"))
    assert found.drift == pytest.approx(abs(scale - 1), abs=1e-9)
    found = score(curve, Trajectory(curve.stamps, scale * curve.positions, curve.quaternions, "scaled"))
    assert found.drift == pytest.approx(0.99 * abs(scale - 1), rel=0.02), "chords are a little shorter than the way"


def test_a_part_is_scored_and_strangers_are_refused():
    truth = long_path()
    assert score(truth, truth.head(20)).matched == 20
    assert np.isnan(score(path_of(4), path_of(4)).drift), "shorter than a metre"
    with pytest.raises(InputError, match="fewer than three stamps in common"):
        score(truth, path_of())
    straight = Trajectory(truth.stamps, truth.positions * [1, 0, 0], truth.quaternions, "line")
    assert score(straight, straight).ate < 1e-9


@pytest.fixture(scope="module")
def drift(tmp_path_factory) -> Run:
    """The mine's rough rock, which every system holds on to."""
    folder, scene, camera = tmp_path_factory.mktemp("slam") / "drift", load_scene("tunnel"), preset("d435", 424, 240)
    generate(scene, load_trajectory(None, scene, 30, 21), camera, load_profile("clean"), folder)
    return Run.open(folder)


@pytest.mark.parametrize("system", sorted(SYSTEMS))
def test_each_system_follows_a_clean_run(drift, system):
    found = estimate(drift, system)
    assert len(found.trajectory) == found.frames == (7 if system == "kiss-icp" else len(drift)), "10 Hz of 30"
    assert score(drift.trajectory, found.trajectory).ate < 0.02
    last = drift.trajectory.positions[np.searchsorted(drift.trajectory.stamps, found.trajectory.stamps[-1] - 1e-6)]
    moved_by = np.linalg.norm(found.trajectory.positions[-1] - found.trajectory.positions[0])
    assert moved_by == pytest.approx(np.linalg.norm(last - drift.trajectory.positions[0]), rel=0.1)


def test_the_command_writes_estimate_plot_and_one_line(room, tmp_path):
    runner, out = CliRunner(), tmp_path / "out"
    for _ in range(2):
        result = runner.invoke(app, ["slam", str(room.path), "--with", "open3d-odometry", "--out", str(out)])
        assert result.exit_code == 0, result.output
    estimate_file = out / "open3d-odometry.txt"
    result = runner.invoke(
        app, ["slam", str(room.path), "--estimate", str(estimate_file), "--out", str(tmp_path / "b")]
    )
    assert result.exit_code == 0, result.output
    one, two = (list(csv.DictReader((folder / "results.csv").open())) for folder in (out, tmp_path / "b"))
    assert len(one) == len(two) == 1, "the second time takes the place of the first"
    for key in ("run", "system", "frames", "tracked", "ate_m", "rpe_m"):
        assert one[0][key] == two[0][key]
    assert decode_png(out / "open3d-odometry.png").ndim == 3


def test_a_recording_without_poses_gets_an_estimate_and_no_score(room, tmp_path):
    import shutil

    bare = Path(shutil.copytree(room.path, tmp_path / "bare"))
    (bare / "groundtruth.txt").unlink()
    result = CliRunner().invoke(app, ["slam", str(bare), "--with", "open3d-odometry"])
    assert result.exit_code == 0 and "not scored" in result.output
    assert len((bare / "slam" / "open3d-odometry.txt").read_text().splitlines()) == len(room) + 1
    result = CliRunner().invoke(app, ["slam", str(bare), "--estimate", str(room.path / "groundtruth.txt")])
    assert isinstance(result.exception, InputError) and "nothing can be scored" in str(result.exception)


def test_a_sweep_shows_that_error_follows_noise(room, tmp_path):
    cases = sweep(room, tmp_path / "out", ["open3d-odometry"], ["clean", "paper"], [1.0, 2.0])
    assert [(case.profile, case.speed, case.frames) for case in cases] == [
        ("clean", 1.0, 20), ("clean", 2.0, 10), ("paper", 1.0, 20), ("paper", 2.0, 10),
    ]  # fmt: skip
    assert cases[0].noise < 1e-3 < cases[2].noise
    assert cases[0].score.ate < cases[2].score.ate
    rows = list(csv.DictReader((tmp_path / "out" / "results.csv").open()))
    assert [row["run"] for row in rows] == ["clean_1x", "clean_2x", "paper_1x", "paper_2x"]
    assert decode_png(tmp_path / "out" / "sweep.png").shape[1] > 800


@pytest.mark.parametrize("found", [b"\xff\xfe\x00run", b'run,"sys\n', b"run\na\n"])
def test_a_results_file_that_is_none_is_reported_in_one_line(tmp_path, found):
    (tmp_path / "results.csv").write_bytes(found)
    with pytest.raises(InputError, match=r"results\.csv"):
        read_rows(tmp_path / "results.csv")


def test_faster_takes_the_same_way_in_less_time(room):
    twice, dense = faster(room, 2.0)
    assert dense is None
    assert twice.duration == pytest.approx(0.45)
    np.testing.assert_allclose(twice.positions, room.trajectory.positions[::2], atol=1e-6)
    assert faster(room, 1.0) == (room.trajectory, None)
    assert noise_of(room) < 0.5e-3, "half a unit"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--with", "orb"], "is no system; give one of open3d-slam"),
        ([], "does not say which system"),
        (["--with", "kiss-icp", "--estimate", "x.txt"], "give one of them"),
        (["--estimate", "nowhere.txt"], "no such file"),
        (["--sweep", "--speeds", "fast"], "are no numbers"),
    ],
)
def test_faults_are_one_line(room, tmp_path, words, message):
    result = CliRunner().invoke(app, ["slam", str(room.path), *words, "--out", str(tmp_path / "out")])
    assert isinstance(result.exception, InputError)
    assert message in str(result.exception)
    assert not (tmp_path / "out").exists()
