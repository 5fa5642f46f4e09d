"""Effects that move the camera: stamps that are off, rows one after another, a turned mount."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapes import MATERIALS, Array, as_scene, camera, look_at, soup, wall

from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.effects.extrinsics import ExtrinsicRotation, TimeOffset
from depthsim.sensor.effects.rolling_shutter import RollingShutter
from depthsim.sensor.motion import Motion
from depthsim.sensor.sensor import Measurement
from depthsim.trajectory import Trajectory

CAMERA = camera(80, 60, 100)
DISTANCE, SPEED = 4.0, 1.5
WALL = Caster(as_scene(wall(DISTANCE)))
STAMPS = np.arange(11) / 10 + 100.0
STAMP = float(STAMPS[5])
ROWS = (np.arange(60) + 0.5) / 60 - 0.5


def towards_the_wall() -> Motion:
    """At the origin at STAMP, at SPEED along the optical axis."""
    positions = np.zeros((11, 3))
    positions[:, 2] = SPEED * (STAMPS - STAMP)
    return Motion.along(Trajectory(STAMPS, positions, np.tile([0.0, 0, 0, 1], (11, 1))))


def measure(*effects: Effect, motion: Motion | None = None, **keys: Any) -> Measurement:
    sensor = Sensor(WALL, CAMERA, effects, MATERIALS)
    return sensor.measure(np.eye(4), stamp=STAMP, motion=motion or towards_the_wall(), **keys)


@pytest.mark.parametrize("offset", [-0.3, -0.01, 0.004, 0.2, 0.5])
def test_a_late_picture_is_taken_from_where_the_camera_is_then(offset: float) -> None:
    measured = measure(TimeOffset(offset=offset))
    assert np.abs(measured.depth - (DISTANCE - SPEED * offset)).max() < 1e-5
    # What the camera believes in stays as it is.
    assert np.abs(measured.clean.depth - DISTANCE).max() < 1e-5


@pytest.mark.parametrize("readout", [0.001, 0.011, 0.1, -0.03])
def test_every_row_is_taken_at_its_own_time(readout: float) -> None:
    measured = measure(RollingShutter(readout=readout))
    assert np.abs(measured.depth - (DISTANCE - SPEED * readout * ROWS)[:, None]).max() < 1e-5
    assert abs(measured.depth.mean() - DISTANCE) < 1e-5


@pytest.mark.parametrize(("stamped", "row"), [(0.0, 0), (0.5, None), (1.0, -1)])
def test_the_stamp_is_of_the_first_the_middle_or_the_last_row(stamped: float, row: int | None) -> None:
    depth = measure(RollingShutter(readout=0.1, stamped=stamped)).depth
    off = (depth.mean() if row is None else depth[row].mean()) - DISTANCE
    assert abs(off) < SPEED * 0.1 / len(depth)  # a row


def test_offset_and_shutter_add() -> None:
    measured = measure(RollingShutter(readout=0.05), TimeOffset(offset=0.1))
    assert np.abs(measured.depth - (DISTANCE - SPEED * (0.1 + 0.05 * ROWS))[:, None]).max() < 1e-5


@pytest.mark.parametrize("effect", [TimeOffset(offset=0.3), RollingShutter(readout=0.1)])
def test_a_camera_that_stands_sees_the_same_at_any_time(effect: Effect) -> None:
    still = measure(effect, motion=Motion.still(np.eye(4)))
    assert still.depth.tobytes() == measure(motion=Motion.still(np.eye(4))).depth.tobytes()


def plane_depth(turn: Array) -> Array:
    """(H, W) depth of the wall in a camera at the origin that is turned by ``turn``."""
    x, y = CAMERA.rays.astype(np.float64)
    world = np.einsum("ij,jhw->ihw", turn, np.stack([x, y, np.ones_like(x)]))
    return DISTANCE / world[2]


@pytest.mark.parametrize("angles", [(5, 0, 0), (0, -7, 0), (0, 0, 30), (1, 2, 3), (-20, 10, 45), (1e-4, 0, 0)])
def test_a_turned_mount(angles: tuple[float, float, float]) -> None:
    x, y, z = angles
    measured = measure(ExtrinsicRotation(x=x, y=y, z=z))
    turn = Rotation.from_rotvec(np.radians(angles)).as_matrix()
    assert np.abs(measured.depth / plane_depth(turn) - 1).max() < 2e-6


def test_the_mount_turns_about_the_cameras_own_axes_in_every_pose_and_row() -> None:
    caster = Caster(as_scene(soup(np.random.default_rng(3), 400)))
    poses = np.stack([look_at((3, 0.02 * i, 1), (0, 0.3, 0)) for i in range(11)])
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec(np.radians([2, -3, 4])).as_matrix()
    mount = ExtrinsicRotation(x=2, y=-3, z=4)
    sensor = Sensor(caster, CAMERA, [mount, RollingShutter(readout=0.08), TimeOffset(offset=0.02)], MATERIALS)
    motion = Motion.along(Trajectory(STAMPS, poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3]).as_quat()))
    measured = sensor.measure(poses[5], stamp=STAMP, motion=motion)
    rows = motion.at(STAMP + 0.02 + 0.08 * ROWS) @ turn
    expected = caster.cast(CAMERA, rows[None])[0].depth
    same = np.abs(measured.depth - expected) < 1e-4
    assert (expected > 0).mean() > 0.2
    assert same.mean() > 0.995  # but for rays at the rim of a triangle
