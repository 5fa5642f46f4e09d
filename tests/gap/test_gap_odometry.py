"""What a gap costs odometry and mapping: nothing of a recording that stands, and the drift of one that moves."""

import errno
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from scipy.stats import t as student

from depthsim.draws import Seed
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.tasks import odometry
from depthsim.gap.depth.tasks.figures import ODOMETRY
from depthsim.gap.depth.tasks.odometry import odometry_tasks, one_more
from depthsim.gap.diagnosis import Task
from depthsim.odometry import Estimate
from depthsim.odometry.worker import kept_to_the_end
from depthsim.presets import preset
from depthsim.reconstruction.reconstruct import fuse, is_fused
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import Effect
from depthsim.trajectory import Trajectory, load_trajectory

NOISY = "effects: [{disparity_noise: {sigma: 0.3}}]"
_KEPT: list[TemporaryDirectory[str]] = []


@cache
def moving() -> tuple[Path, tuple[Effect, ...]]:
    """A run of 20 frames that go 2 m through the office, by a sensor with much noise, and that sensor."""
    kept = TemporaryDirectory(prefix="depthsim_way_")
    _KEPT.append(kept)
    folder = Path(kept.name)
    (folder / "truth.yaml").write_text(NOISY)
    profile = load_profile(folder / "truth.yaml")
    scene, camera = load_scene("office"), preset("d435", 160, 120).model_copy(update={"rate": 10.0})
    generate(scene, load_trajectory("tour", scene, 10.0, 20), camera, profile, folder / "run", streams=("depth",))
    return folder / "run", profile.effects


def evidence(threads: int = 1) -> Evidence:
    return load_evidence(moving()[0], None, "clean", threads=threads)[0]


def test_the_drift_is_that_of_the_sensor_and_the_same_on_any_number_of_threads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("evo")
    monkeypatch.setattr(odometry, "RUNS", 3)
    tasks = odometry_tasks(evidence(), [evidence().base, moving()[1]])
    by_name = {task.name: task for task in tasks}
    assert list(by_name) == ["drift_open3d", "ate_open3d", "surface_error"]
    for task in tasks:
        assert task.recording and task.before and task.after and not task.reason
        assert task.recording > 2 * task.before, "the simulator before has no noise"
        low, high = task.ci95["after_off"]
        assert low <= 0 <= high, f"{task}: the very sensor predicts it"
        assert task.ci95["before_off"][1] < 0
    again = odometry_tasks(evidence(2), [evidence().base])
    assert [(task.recording, task.before) for task in again] == [(task.recording, task.before) for task in tasks]
    assert all(task.after == task.before for task in again), "without causes"


def test_any_system_can_be_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("evo")
    measured = {"drift_kiss_icp": 2.0, "ate_kiss_icp": 3.0}
    monkeypatch.setattr(odometry._Workers, "figures", lambda self: dict.fromkeys(self._given, measured))
    tasks = odometry_tasks(evidence(), [evidence().base], ("kiss_icp",))
    assert [(task.name, task.recording) for task in tasks] == [*measured.items(), ("surface_error", None)]
    assert tasks[-1].reason and not tasks[-1].ci95


def test_what_stands_or_is_short_has_no_drift(monkeypatch: pytest.MonkeyPatch) -> None:
    looked = evidence()
    monkeypatch.setattr(odometry, "LEAST", 21)
    assert odometry_tasks(looked, [looked.base]) == ()
    monkeypatch.undo()
    still = looked.run.trajectory
    object.__setattr__(looked.run, "trajectory", Trajectory(still.stamps, 0 * still.positions, still.quaternions))
    assert odometry_tasks(looked, [looked.base]) == ()


def full(*_: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("fault", ["missing", "broken", "full"])
def test_what_cannot_be_run_is_said_and_ends_nothing(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    looked = evidence()  # before a disk is full: the run may not be there yet
    if fault == "missing":
        monkeypatch.setattr(odometry, "find_spec", lambda name: None)
    elif fault == "full":
        monkeypatch.setattr(odometry.RunWriter, "write_frame", full)
    else:
        monkeypatch.setattr(odometry.sys, "executable", "false")
        monkeypatch.setattr(odometry, "RUNS", 1)
    tasks: tuple[Task, ...] = odometry_tasks(looked, [looked.base])
    assert len(tasks) == 3 and all(task.recording is None and task.name in ODOMETRY for task in tasks)
    assert all(("`slam` is not installed" if fault == "missing" else "could not be run") in t.reason for t in tasks)


def test_one_more_run_lies_in_its_interval_as_often_as_it_says() -> None:
    runs = np.exp(np.random.default_rng(5).normal(1, 0.4, (2000, 6)))
    inside = 0
    for *known, new in runs:
        middle, low, high = one_more(known)
        inside += low <= new <= high
        assert low < middle < high
    assert inside / len(runs) == pytest.approx(0.95, abs=0.015)
    middle, low, high = one_more([1.0, np.e**2])
    half = student.ppf(0.975, 1) * np.sqrt(2) * np.sqrt(1.5)
    assert (middle, low, high) == pytest.approx((np.e, np.e ** (1 - half), np.e ** (1 + half)))


def test_where_a_track_is_lost_the_last_pose_stays() -> None:
    run = Run.open(moving()[0])
    way = run.trajectory
    lost = Trajectory(way.stamps[:5], way.positions[:5], way.quaternions[:5])
    kept = kept_to_the_end(Estimate("any", lost, len(way), 0.0), run)
    assert np.array_equal(kept.stamps, way.stamps)
    assert np.array_equal(kept.positions[5:], np.repeat(way.positions[4:5], len(way) - 5, axis=0))
    whole = Trajectory(way.stamps[::3], way.positions[::3], way.quaternions[::3])
    assert kept_to_the_end(Estimate("any", whole, len(whole), 0.0), run) is whole


def test_a_fused_scene_is_known_by_its_name(tmp_path: Path) -> None:
    pytest.importorskip("evo")
    run = Run.open(moving()[0])
    assert is_fused(fuse(run, run.poses, 0.05, 4.0, 2, "cement")) and not is_fused(load_scene("office"))
    assert Seed("odometry") != Seed("tasks")
