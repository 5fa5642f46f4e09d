"""Poses that are off: how far, how long, and that a frame needs no other to be made."""

from pathlib import Path

import numpy as np
import pytest
from recordings import ROOM_CAMERA, write_room
from scipy.spatial.transform import Rotation
from shapes import MATERIALS, Array, as_scene, camera, wall

from depthsim.draws import Draws
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import Profile, Sensor
from depthsim.sensor.effects.extrinsics import TimeOffset
from depthsim.sensor.effects.fixed_pattern import FixedPattern
from depthsim.sensor.effects.pose_noise import PoseNoise, correlated
from depthsim.sensor.effects.rolling_shutter import RollingShutter
from depthsim.sensor.motion import Motion
from depthsim.sensor.view import View
from depthsim.trajectory import Trajectory, load_trajectory

CAMERA = camera(64, 48, 50)


def error(effect: PoseNoise, stamp: float, seed: int = 0, index: int = 0, turn: Array | None = None) -> Array:
    """(6,) rotation vector [deg] and translation [m] that a frame's pose is off by, in the camera's axes."""
    pose = np.eye(4)
    pose[:3, :3] = np.eye(3) if turn is None else turn
    view = View(pose, CAMERA.rays, CAMERA, Motion.still(pose), seed, index, stamp)
    effect.bend(view)
    off = np.linalg.inv(pose) @ view.pose
    return np.concatenate([np.degrees(Rotation.from_matrix(off[:3, :3]).as_rotvec()), off[:3, 3]])


def test_the_errors_have_the_deviations_that_were_asked_for_and_are_independent() -> None:
    effect = PoseNoise(rotation=0.3, translation=0.004, correlation_time=0)
    found = np.array([error(effect, 0.1 * n) for n in range(3000)]) / [0.3, 0.3, 0.3, 0.004, 0.004, 0.004]
    covariance = found.T @ found / len(found)
    assert np.abs(covariance - np.eye(6)).max() < 5 * np.sqrt(2 / 3000)
    assert np.abs(found.mean(axis=0)).max() < 5 / np.sqrt(3000)


@pytest.mark.parametrize("time", [0.03, 0.5, 30.0])
def test_they_are_correlated_by_one_over_e_after_the_correlation_time(time: float) -> None:
    stamps = np.array([0, 0.1, 0.5, 1, 2]) * time + 3.7
    made = np.array([[correlated(Draws(seed, "p", 0), t, time, 6) for t in stamps] for seed in range(500)])
    found = np.einsum("nai,nbi->ab", made, made) / (6 * 500)
    wanted = np.exp(-np.abs(stamps[:, None] - stamps) / time)
    assert np.abs(found - wanted).max() < 5 / np.sqrt(3000) + 0.01


def test_a_frame_is_the_same_whatever_its_number_and_others() -> None:
    effect = PoseNoise()
    first = error(effect, 1.25)
    assert np.array_equal(error(effect, 1.25, index=9), first)
    assert not np.allclose(error(effect, 1.25, seed=1), first)
    assert np.abs(error(effect, 1.26) - first).max() < 0.3
    assert np.isfinite(error(effect, -0.5)).all()  # as with stamps that are late by more than the time since the start


def test_the_error_is_in_the_cameras_own_axes() -> None:
    turn = Rotation.from_rotvec([1.0, 2.0, -0.5]).as_matrix()
    assert np.allclose(error(PoseNoise(), 2.0, turn=turn), error(PoseNoise(), 2.0))


def test_rows_and_stamps_of_their_own_are_moved_too() -> None:
    path = Trajectory(np.array([0.0, 2.0]), np.array([[0.0, 0, 0], [0, 0, 1]]), np.tile([0.0, 0, 0, 1], (2, 1)))
    motion = Motion.along(path)
    caster = Caster(as_scene(wall(4.0)))
    noise, others = PoseNoise(rotation=0), [TimeOffset(offset=0.1), RollingShutter(readout=0.05)]

    def depth(*effects: PoseNoise | TimeOffset | RollingShutter) -> Array:
        sensor = Sensor(caster, CAMERA, effects, MATERIALS)
        return sensor.measure(motion.at(1.0)[0], stamp=1.0, motion=motion).depth.astype(float)

    # Along z all that they do is to add.
    shift = error(noise, 1.1)[5]
    assert np.abs(depth(noise, *others) - (depth(*others) - shift)).max() < 2e-6


def test_a_run_keeps_its_poses_and_can_be_made_in_parts(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path / "room.obj"))
    path = load_trajectory(
        "line:start=-1.2/-0.4/1.2,end=-0.8/0.4/1.4,speed=0.8,look_at=2/0/0.9", scene, ROOM_CAMERA.rate, 6
    )
    effects = PoseNoise(rotation=0.5, translation=0.01), FixedPattern(amplitude=0.1)
    for name, profile in (("off", Profile(name="off", effects=effects)), ("clean", Profile(name="clean"))):
        generate(scene, path, ROOM_CAMERA, profile, tmp_path / name, seed=3)
    off, clean = Run.open(tmp_path / "off"), Run.open(tmp_path / "clean")
    assert (off.path / "groundtruth.txt").read_bytes() == (clean.path / "groundtruth.txt").read_bytes()
    assert not np.array_equal(off.depth_raw(4), clean.depth_raw(4))
    sensor = Sensor(scene, ROOM_CAMERA, Profile(name="off", effects=effects))
    alone = sensor.measure(
        path.matrices()[4], index=4, stamp=float(path.stamps[4]), seed=3, motion=Motion.along(path), threads=1
    )
    assert np.array_equal(alone.depth_raw, off.depth_raw(4))
