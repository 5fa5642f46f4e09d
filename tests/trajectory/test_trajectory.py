"""Trajectories: interpolation, TUM files, made motions, and what a user may name."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthsim.errors import InputError
from depthsim.scene import Scene
from depthsim.trajectory import (
    SHAPES,
    Trajectory,
    load_trajectory,
    make_trajectory,
    parse_spec,
    read_tum,
    tum_text,
    write_tum,
)
from depthsim.trajectory.motion import Motion
from depthsim.trajectory.rotation import rotation_matrices, slerp, view_rotations

FLOOR = Path(__file__).parents[2] / "../shared/data/d435_floor/groundtruth.txt"
HERE = Path("scene.yaml")

quick = settings(max_examples=60)
units = st.integers(0, 2**32 - 1).map(lambda seed: np.random.default_rng(seed).normal(size=(5, 4)))
quaternions = units.map(lambda q: q / np.linalg.norm(q, axis=1, keepdims=True))
points = arrays(np.float64, (3,), elements=st.floats(-50, 50))


def motion(**spec: object) -> Motion:
    made = parse_spec(spec, HERE)
    assert isinstance(made, Motion)
    return made


def axes(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x, y, z = np.moveaxis(trajectory.matrices()[:, :3, :3], -1, 0)
    return x, y, z


def some(count: int = 5, seed: int = 0) -> Trajectory:
    rng = np.random.default_rng(seed)
    turned = rng.normal(size=(count, 4))
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return Trajectory(1.3e9 + np.cumsum(rng.uniform(0.01, 1, count)), rng.normal(size=(count, 3)), turned)


# Rotations


@given(quaternions, quaternions, st.floats(0, 1))
@quick
def test_rotations_agree_with_scipy(a: np.ndarray, b: np.ndarray, share: float) -> None:
    rotation = pytest.importorskip("scipy.spatial.transform")
    assert np.allclose(rotation_matrices(a), rotation.Rotation.from_quat(a).as_matrix(), atol=1e-14)
    mixed = slerp(a, b, np.full(5, share))
    for one, other, found in zip(a, b, mixed, strict=True):
        between = rotation.Slerp([0, 1], rotation.Rotation.from_quat([one, other]))(share)
        assert np.allclose(rotation_matrices(found[None])[0], between.as_matrix(), atol=1e-9)


@given(quaternions, quaternions)
@quick
def test_slerp_has_its_ends_and_unit_norm(a: np.ndarray, b: np.ndarray) -> None:
    shares = np.linspace(0, 1, 5)
    assert np.allclose(np.linalg.norm(slerp(a, b, shares), axis=1), 1, atol=1e-15)
    assert np.allclose(slerp(a, b, np.zeros(5)), a, atol=1e-15)
    assert np.allclose(rotation_matrices(slerp(a, b, np.ones(5))), rotation_matrices(b), atol=1e-14)
    assert np.allclose(slerp(a, -b, shares), slerp(a, b, shares), atol=1e-15)


def test_slerp_of_nearly_equal_rotations() -> None:
    a = np.array([[0.0, 0, 0, 1]])
    for angle in (0.0, 1e-300, 1e-12, 1e-7):
        b = np.array([[np.sin(angle), 0, 0, np.cos(angle)]])
        assert slerp(a, b, np.array([0.25]))[0, 0] == pytest.approx(angle / 4, rel=1e-9)


@given(points, st.floats(-90, 90))
@quick
def test_views_are_level(direction: np.ndarray, pitch: float) -> None:
    assume(np.linalg.norm(direction) > 1e-3)
    x, y, z = np.moveaxis(rotation_matrices(view_rotations(direction[None], np.radians(pitch))), -1, 0)
    assert abs(x[0, 2]) < 1e-14
    assert y[0, 2] <= 1e-14
    elevation = np.degrees(np.arctan2(direction[2], np.hypot(direction[0], direction[1])))
    assert z[0, 2] == pytest.approx(np.sin(np.radians(np.clip(elevation + pitch, -90, 90))), abs=1e-12)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_straight_up_and_down_are_stable(up: float) -> None:
    rng = np.random.default_rng(0)
    directions = np.array([0, 0, up]) + np.column_stack([rng.normal(size=(9, 2)) * 1e-13, np.zeros(9)])
    x, y, z = np.moveaxis(rotation_matrices(view_rotations(directions)), -1, 0)
    assert np.allclose(x, [1, 0, 0], atol=1e-11)
    assert np.allclose(y, [0, up, 0], atol=1e-11)
    assert np.allclose(z, [0, 0, up], atol=1e-11)


# Poses in time


def test_existing_stamps_have_their_pose_to_the_bit() -> None:
    trajectory = some()
    again = trajectory.at(trajectory.stamps)
    for key in ("stamps", "positions", "quaternions"):
        assert getattr(again, key).tobytes() == getattr(trajectory, key).tobytes()
    assert trajectory.at(trajectory.stamps[3]).quaternions[0].tobytes() == trajectory.quaternions[3].tobytes()


@given(st.integers(0, 1000), st.floats(0, 1))
@quick
def test_interpolation_is_continuous_and_unit(seed: int, share: float) -> None:
    trajectory = some(6, seed)
    time = trajectory.stamps[0] + share * trajectory.duration
    near = trajectory.at([time - 1e-6, time, time + 1e-6])
    speeds = np.linalg.norm(np.diff(trajectory.positions, axis=0), axis=1) / np.diff(trajectory.stamps)
    assert np.linalg.norm(np.diff(near.positions, axis=0), axis=1).max() <= 1.5e-6 * speeds.max() + 1e-12
    assert np.abs(np.diff(near.matrices(), axis=0)).max() < 1e-3
    assert np.allclose(np.linalg.norm(near.quaternions, axis=1), 1, atol=1e-15)


def test_halfway_between_two_poses() -> None:
    half = np.sqrt(0.5)
    trajectory = Trajectory(np.array([0.0, 2]), np.array([[0.0, 0, 0], [2, 4, 6]]), [[0, 0, 0, 1], [0, 0, half, half]])
    middle = trajectory.at(1)
    assert np.allclose(middle.positions, [[1, 2, 3]])
    assert np.allclose(middle.quaternions, [[0, 0, np.sin(np.pi / 8), np.cos(np.pi / 8)]])
    assert len(middle) == 1
    assert middle.duration == 0


def test_stamps_just_outside_are_the_ends() -> None:
    trajectory = some()
    first, last = trajectory.stamps[[0, -1]]
    snapped = trajectory.at([first - 4e-6, last + 4e-6])
    assert np.array_equal(snapped.positions, trajectory.positions[[0, -1]])
    for stamp in (first - 1e-5, last + 1e-5):
        with pytest.raises(InputError, match=rf"stamp {stamp:.6f} s.*runs from {first:.6f} to {last:.6f} s"):
            trajectory.at([first, stamp] if stamp > first else [stamp])
    with pytest.raises(InputError, match="outside"):
        trajectory.at([np.nan])


def test_one_pose_is_a_trajectory() -> None:
    one = some(1)
    assert len(one) == 1
    assert one.at(one.stamps).positions.tobytes() == one.positions.tobytes()
    assert len(one.sampled(30)) == 1
    with pytest.raises(InputError, match="has 1 frames, not 2"):
        one.sampled(30, frames=2)


def test_sampling_in_time() -> None:
    trajectory = Trajectory([2.0, 3.0], [[0, 0, 0], [1, 0, 0]], [[0, 0, 0, 1]] * 2)
    sampled = trajectory.sampled(3)
    assert sampled.stamps.tolist() == [2, 2 + 1 / 3, 2 + 2 / 3, 3]
    assert np.allclose(sampled.positions[:, 0], sampled.stamps - 2)
    assert len(trajectory.sampled(3, frames=2)) == 2
    assert len(trajectory.head()) == 2
    assert trajectory.head(1).stamps.tolist() == [2.0]


def test_matrices_take_the_camera_to_the_world() -> None:
    matrices = some().matrices()
    assert matrices.dtype == np.float64
    assert np.allclose(matrices[:, :3, :3] @ matrices[:, :3, :3].transpose(0, 2, 1), np.eye(3), atol=1e-14)
    assert np.array_equal(matrices[:, :3, 3], some().positions)
    assert np.array_equal(matrices[:, 3], np.tile([0, 0, 0, 1], (5, 1)))


@pytest.mark.parametrize(
    ("stamps", "positions", "turned", "words"),
    [
        ([], np.zeros((0, 3)), np.zeros((0, 4)), "the arrays are (0,), (0, 3), (0, 4)"),
        ([0, 1], np.zeros((1, 3)), np.ones((2, 4)) / 2, "the arrays are (2,), (1, 3), (2, 4)"),
        ([0, np.inf], np.zeros((2, 3)), np.ones((2, 4)) / 2, "pose 1: the stamp is not finite"),
        ([0, 1], [[0, 0, 0], [0, np.nan, 0]], np.ones((2, 4)) / 2, "pose 1: the position is not finite"),
        ([0, 0], np.zeros((2, 3)), np.ones((2, 4)) / 2, "pose 1: the stamp is not after the one before"),
        ([0], np.zeros((1, 3)), [[0, 0, 0, 0]], "pose 0: the quaternion has length 0; give unit quaternions"),
        ([0], np.zeros((1, 3)), [[0, 0, 0, 1.02]], "pose 0: the quaternion has length 1.02"),
    ],
)
def test_arrays_that_are_no_trajectory(stamps: list, positions: list, turned: list, words: str) -> None:
    with pytest.raises(InputError) as error:
        Trajectory(stamps, positions, turned)
    assert words in str(error.value)


def test_the_arrays_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        some().positions[0, 0] = 1


# TUM files


@given(st.integers(0, 10**6), st.sampled_from([0.0, 1e-7, 1.3e9]), st.integers(-12, 9))
@quick
def test_tum_round_trip_is_exact(tmp_path_factory: pytest.TempPathFactory, seed: int, start: float, size: int) -> None:
    rng = np.random.default_rng(seed)
    source = some(4, seed)
    stamps = start + np.cumsum(rng.uniform(1e-3, 1, 4))
    trajectory = Trajectory(stamps, rng.normal(size=(4, 3)) * 10.0**size, source.quaternions)
    path = tmp_path_factory.mktemp("tum") / "poses.txt"
    write_tum(trajectory, path)
    again = read_tum(path)
    for key in ("stamps", "positions", "quaternions"):
        assert getattr(again, key).tobytes() == getattr(trajectory, key).tobytes()
    assert tum_text(again) == path.read_text()


def test_stamps_have_six_decimals_or_more() -> None:
    trajectory = Trajectory([0.0, 0.1, 1 / 3, 1e9], np.zeros((4, 3)), [[0, 0, 0, 1]] * 4)
    stamps = [line.split()[0] for line in tum_text(trajectory).splitlines()]
    assert stamps == ["#", "0.000000", "0.100000", "0.3333333333333333", "1000000000.000000"]


def test_evo_reads_what_is_written(tmp_path: Path) -> None:
    file_interface = pytest.importorskip("evo.tools.file_interface")
    trajectory = make_trajectory(motion(shape="lemniscate", center=[0, 0, 1], size=[4, 2], speed=1.5), rate=30)
    write_tum(trajectory, tmp_path / "groundtruth.txt")
    theirs = file_interface.read_tum_trajectory_file(str(tmp_path / "groundtruth.txt"))
    assert theirs.check()[0]
    assert np.array_equal(theirs.timestamps, trajectory.stamps)
    assert np.array_equal(theirs.positions_xyz, trajectory.positions)
    assert np.allclose(theirs.poses_se3, trajectory.matrices(), atol=1e-14)


def test_the_poses_of_a_real_run() -> None:
    if not FLOOR.exists():
        pytest.skip("needs ../shared/data/d435_floor")
    trajectory = read_tum(FLOOR)
    assert len(trajectory) == 120
    assert trajectory.duration == pytest.approx(11.9)
    # The camera is 0.6 m above the floor and looks at it.
    assert np.allclose(trajectory.positions[:, 2], 0.63, atol=0.1)
    assert (axes(trajectory)[2][:, 2] < 0).all()
    assert np.allclose(trajectory.sampled(20).matrices()[::2], trajectory.matrices(), atol=1e-12)


def test_comments_and_rounded_quaternions(tmp_path: Path) -> None:
    path = tmp_path / "poses.txt"
    path.write_text("# a comment\n\n  # another\n0\t1 2 3  0 0 0 1.005 \r\n1e0 1 2 3 0 0 0 -1\n")
    trajectory = read_tum(path)
    assert trajectory.stamps.tolist() == [0, 1]
    assert trajectory.quaternions.tolist() == [[0, 0, 0, 1], [0, 0, 0, -1]]
    assert trajectory.name == str(path)


POSE = "0.0 0 0 0 0 0 0 1\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "poses.txt: holds no pose; write lines of `timestamp tx ty tz qx qy qz qw`"),
        ("# only a comment\n", "poses.txt: holds no pose"),
        (POSE + "1.0 0 0 0 0 0 1\n", "poses.txt: line 2: has 7 columns, not 8; write `timestamp tx"),
        ("0,0,0,0,0,0,0,1\n", "line 1: has 1 columns, not 8; separate the columns by spaces, not commas"),
        ("0, 0, 0, 0, 0, 0, 0, 1\n", "line 1: timestamp is '0,', not a number"),
        (POSE + "1.0 0 zero 0 0 0 0 1\n", "line 2: ty is 'zero', not a number; write a number"),
        ("1_0 0 0 0 0 0 0 1\n", "line 1: timestamp is '1_0', not a number"),
        ("# c\n\n0.0 0 nan 0 0 0 0 1\n", "line 3: ty is nan; write a finite number, or drop the line"),
        ("inf 0 0 0 0 0 0 1\n", "line 1: timestamp is inf"),
        ("0.0 0 0 0 0 0 0 0\n", "line 1: the quaternion has length 0; write a unit quaternion"),
        ("0.0 0 0 0 1 0 0 1\n", "line 1: the quaternion has length 1.414"),
        (POSE + POSE, "line 2: stamp 0.000000 comes twice; sort the lines, each stamp once"),
        ("5 0 0 0 0 0 0 1\n" + POSE, "line 2: stamp 0.000000 is before the one above, 5.000000"),
    ],
)
def test_broken_tum_files(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "poses.txt"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_tum(path)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_unreadable_tum_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file; give the path of a TUM trajectory"):
        read_tum(tmp_path / "none.txt")
    (tmp_path / "poses.txt").write_bytes(b"\xff\xfe0 0\n")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        read_tum(tmp_path / "poses.txt")


# Shapes

CORNERS = [[0, 0, 1], [3, 0, 1], [3, 2, 2], [0, 2, 1.5]]
MOVING: dict[str, dict[str, object]] = {
    "circle": {"shape": "circle", "center": [1, 2, 3], "radius": 2.0, "laps": 1.5},
    "line": {"shape": "line", "start": [0, 0, 1], "end": [3, 4, 1]},
    "lemniscate": {"shape": "lemniscate", "center": [0, 0, 1], "size": [6, 2], "laps": 2},
    "waypoints": {"shape": "waypoints", "points": CORNERS},
    "closed": {"shape": "waypoints", "points": CORNERS, "closed": True},
}


@pytest.mark.parametrize("name", MOVING)
@pytest.mark.parametrize("speed", [0.05, 1.5])
def test_speed_is_constant_and_right(name: str, speed: float) -> None:
    made = motion(**MOVING[name], speed=speed)
    stamps = np.linspace(0, made.total_time, 4001)
    steps = np.linalg.norm(np.diff(made.sample(stamps).positions, axis=0), axis=1)
    assert np.allclose(steps / np.diff(stamps), speed, rtol=1e-3)


@pytest.mark.parametrize("name", MOVING)
def test_the_tangent_is_the_direction_of_travel(name: str) -> None:
    made = motion(**MOVING[name], speed=1.0)
    stamps = np.linspace(0.1, made.total_time - 0.1, 50)
    ahead, behind = made.sample(stamps + 1e-4).positions, made.sample(stamps - 1e-4).positions
    travel = (ahead - behind) / np.linalg.norm(ahead - behind, axis=1, keepdims=True)
    x, y, z = axes(made.sample(stamps))
    assert np.allclose(z, travel, atol=1e-5)
    assert np.allclose(x[:, 2], 0, atol=1e-14)
    assert (y[:, 2] < 0).all()


@given(st.sampled_from(sorted(MOVING)), points, st.booleans())
@quick
def test_look_at_looks(name: str, target: np.ndarray, ease: bool) -> None:
    blind = motion(**MOVING[name], speed=1.0, ease=ease)
    stamps = np.linspace(0, blind.total_time, 40)
    assume(np.linalg.norm(blind.sample(stamps).positions - target, axis=1).min() > 1e-3)
    trajectory = motion(**MOVING[name], speed=1.0, look_at=target.tolist(), ease=ease).sample(stamps)
    x, y, z = axes(trajectory)
    offset = target - trajectory.positions
    assert np.abs(np.cross(z, offset)).max() < 1e-9
    assert (np.sum(z * offset, axis=1) > 0).all()
    assert np.abs(x[:, 2]).max() < 1e-9
    assert (y[:, 2] < 1e-9).all()


@pytest.mark.parametrize("name", MOVING)
def test_rotations_are_continuous(name: str) -> None:
    made = motion(**MOVING[name], speed=1.0, pitch=-20)
    trajectory = make_trajectory(made, rate=200)
    steps = np.sum(trajectory.quaternions[1:] * trajectory.quaternions[:-1], axis=1)
    assert steps.min() > 0.99


def test_circle_headings() -> None:
    around = {"shape": "circle", "center": [1, 2, 3], "radius": 2, "speed": 1}
    stamps = np.linspace(0, 12, 30)
    for heading, sign in (("outward", 1), ("inward", -1)):
        trajectory = motion(**around, heading=heading).sample(stamps)
        out = (trajectory.positions - [1, 2, 3]) / 2
        assert np.allclose(np.linalg.norm(out, axis=1), 1)
        assert np.allclose(axes(trajectory)[2], sign * out, atol=1e-12)
    down = motion(**around, heading="inward", pitch=-90).sample(stamps)
    assert np.allclose(axes(down)[2], [0, 0, -1], atol=1e-12)
    # Straight down, and still turned with the heading: the upper edge of the image is towards the centre.
    assert np.allclose(-axes(down)[1], -(down.positions - [1, 2, 3]) / 2, atol=1e-12)
    assert np.allclose(motion(**around).sample(np.zeros(1)).positions, [[3, 2, 3]])


def test_there_and_back() -> None:
    made = motion(shape="line", start=[0, 0, 1], end=[2, 0, 1], speed=0.5, there_and_back=True)
    trajectory = make_trajectory(made, rate=10)
    assert len(trajectory) == 81
    assert np.allclose(trajectory.positions, trajectory.positions[::-1])
    assert np.allclose(trajectory.positions[40], [2, 0, 1])
    assert np.allclose(axes(trajectory)[2], [1, 0, 0])


def test_lemniscate_fills_its_size() -> None:
    trajectory = make_trajectory(motion(shape="lemniscate", center=[1, 2, 3], size=[6, 2], speed=1), rate=500)
    assert np.allclose(np.ptp(trajectory.positions, axis=0), [6, 2, 0], atol=1e-4)
    assert np.allclose(trajectory.positions[0], [1, 2, 3])


def test_hover_stays() -> None:
    trajectory = make_trajectory(motion(shape="hover", position=[1, 0, 2], look_at=[1, 0, 0], duration=5.0), rate=30)
    assert len(trajectory) == 151
    assert np.unique(trajectory.matrices(), axis=0).shape == (1, 4, 4)
    assert np.allclose(trajectory.matrices()[0, :3, :3], np.diag([1, -1, -1]))


@given(st.lists(st.tuples(*[st.floats(-5, 5)] * 3), min_size=3, max_size=7), st.booleans())
@settings(max_examples=25)
def test_the_path_passes_through_the_points(path: list[tuple[float, float, float]], closed: bool) -> None:
    looped = np.array([*path, path[0]])
    assume(np.linalg.norm(np.diff(looped, axis=0), axis=1).min() > 0.1)
    made = motion(shape="waypoints", points=list(path), speed=1, closed=closed, look_at=[0, 0, 100])
    stamps = np.linspace(0, made.total_time, 5001)
    positions = made.sample(stamps).positions
    step = made.total_time / 5000
    for point in path:
        assert np.linalg.norm(positions - point, axis=1).min() <= step
    assert np.linalg.norm(positions[0] - path[0]) < 1e-6
    assert np.linalg.norm(positions[-1] - path[0 if closed else -1]) < 1e-6


def test_the_path_is_exact_at_the_points_and_c2() -> None:
    made = motion(shape="waypoints", points=CORNERS, speed=1, closed=True)
    spline, knots = made._position, made._knots  # type: ignore[attr-defined]
    assert np.abs(spline(knots[:-1]) - CORNERS).max() < 1e-6
    for order in (0, 1, 2):
        assert np.allclose(spline(knots[1:-1] - 1e-9, order), spline(knots[1:-1] + 1e-9, order), atol=1e-6)
        assert np.allclose(spline(knots[0], order), spline(knots[-1], order), atol=1e-6)
    arcs = made._curve._arc[:: len(made._curve._arc) // 4]  # type: ignore[attr-defined]
    assert np.abs(made.sample(arcs[:4]).positions - CORNERS).max() < 1e-6


def test_two_points_make_a_straight_line() -> None:
    straight = make_trajectory(motion(shape="waypoints", points=[[0, 0, 0], [4, 3, 0]], speed=1), rate=30)
    line = make_trajectory(motion(shape="line", start=[0, 0, 0], end=[4, 3, 0], speed=1), rate=30)
    assert np.allclose(straight.matrices(), line.matrices(), atol=1e-12)


def test_look_at_may_move_with_the_points() -> None:
    targets = [[1, 1, 0], [2, 1, 0], [2, 1, 1], [1, 1, 1]]
    made = motion(shape="waypoints", points=CORNERS, look_at=targets, speed=1)
    arcs = made._curve._arc[::64]  # type: ignore[attr-defined]
    trajectory = made.sample(arcs)
    offset = np.array(targets) - trajectory.positions
    assert np.abs(np.cross(axes(trajectory)[2], offset)).max() < 1e-6


@pytest.mark.parametrize("length", [10.0, 0.3])
def test_ease_starts_and_stops_smoothly(length: float) -> None:
    made = motion(shape="line", start=[0, 0, 0], end=[length, 0, 0], speed=1, ease=True)
    assert made.total_time == pytest.approx(11 if length == 10 else 0.6)
    stamps = np.linspace(0, made.total_time, 10001)
    x = made.sample(stamps).positions[:, 0]
    speeds = np.diff(x) / np.diff(stamps)
    assert x[0] == 0
    assert x[-1] == pytest.approx(length)
    assert (speeds >= -1e-9).all()
    assert speeds.max() == pytest.approx(1, rel=1e-3)
    assert speeds[[0, -1]] == pytest.approx([0, 0], abs=1e-5)
    assert np.abs(np.diff(speeds)).max() < 2e-3


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        (None, "is not a mapping; write {shape: circle, ...} or {file: poses.txt}"),
        ([], "is not a mapping"),
        ({}, "has no shape; the shapes are waypoints, circle, line, lemniscate, hover"),
        ({"shape": "square"}, "shape is 'square'; the shapes are"),
        ({"shape": ["circle"]}, "shape is ['circle']; the shapes are"),
        ({**MOVING["circle"], "speed": 0}, "t.speed: input should be greater than 0 (it is 0)"),
        ({**MOVING["circle"]}, "t.speed: field required; the keys are speed, ease, look_at"),
        ({**MOVING["circle"], "speed": 1, "radius": -1}, "t.radius: input should be greater than 0"),
        ({**MOVING["circle"], "speed": 1, "raduis": 1}, "t.raduis: extra inputs are not permitted"),
        ({**MOVING["circle"], "speed": 1, "center": [0, 0]}, "t.center.2: field required"),
        ({**MOVING["circle"], "speed": 1, "center": [0, 0, 1e9]}, "t.center.2: input should be less than or equal"),
        ({**MOVING["circle"], "speed": 1, "heading": "north"}, "t.heading: input should be 'tangent', 'outward' or"),
        ({**MOVING["line"], "speed": 1, "heading": "outward"}, "t.heading: input should be 'tangent'"),
        ({**MOVING["line"], "speed": float("nan")}, "t.speed: input should be a finite number"),
        ({**MOVING["line"], "speed": 1, "end": [0, 0, 1]}, "start and end are the same point: use shape hover"),
        ({**MOVING["line"], "speed": 1, "look_at": [0, 0, 0], "pitch": 5}, "look_at is given together with heading"),
        ({**MOVING["line"], "speed": 1, "look_at": [[0, 0, 0]] * 2}, "look_at holds 2 points: give 1"),
        ({**MOVING["line"], "speed": 1, "pitch": -91}, "t.pitch: input should be greater than or equal to -90"),
        ({**MOVING["lemniscate"], "speed": 1, "size": [1, 0]}, "t.size.1: input should be greater than 0"),
        ({**MOVING["closed"], "speed": 1, "look_at": [[0, 0, 0]] * 3}, "look_at holds 3 points: give 1 or 4"),
        ({"shape": "waypoints", "speed": 1, "points": [[0, 0, 0]]}, "points holds 1: give 2 or more"),
        ({"shape": "waypoints", "speed": 1, "points": CORNERS[:2], "closed": True}, "points holds 2: give 3 or more"),
        (
            {"shape": "waypoints", "speed": 1, "points": [[0, 0, 0], [1, 1, 1], [1, 1, 1]]},
            "points 1 and 2 are the same",
        ),
        (
            {"shape": "waypoints", "speed": 1, "points": [*CORNERS, CORNERS[0]], "closed": True},
            "points 4 and 0 are the same; closed joins the last to the first by itself",
        ),
        ({"shape": "hover", "position": [0, 0, 1], "look_at": [0, 0, 1], "duration": 1}, "are the same point"),
        ({"file": 3}, "t.file: input should be a valid string"),
        ({"file": "poses.txt", "speed": 1}, "t.speed: extra inputs are not permitted"),
        ({"file": "../poses.txt"}, "t.file: '../poses.txt' leaves the folder of this file"),
        ({"file": "/etc/passwd"}, "t.file: '/etc/passwd' leaves the folder"),
        ({"file": "none.txt"}, "none.txt: no such file"),
    ],
)
def test_broken_specifications(spec: object, words: str) -> None:
    with pytest.raises(InputError) as error:
        parse_spec(spec, HERE, "t")
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ({"points": [[0, 0, 0], [1, 0, 0], [0, 0, 0]]}, "the path turns back on the spot near point 1; add way-points"),
        ({"points": [[0, 0, 0], [2, 0, 0]], "look_at": [1, 0, 0]}, "at the point it looks at at 1.000 s; move look_at"),
    ],
)
def test_motions_without_a_view(spec: dict, words: str) -> None:
    made = motion(shape="waypoints", speed=1, **spec)
    with pytest.raises(InputError) as error:
        make_trajectory(made, 30, None, "scene.yaml", "trajectories.bad")
    assert str(error.value).startswith("scene.yaml: trajectories.bad: ")
    assert words in str(error.value)


def test_turning_back_is_fine_with_a_point_to_look_at() -> None:
    made = motion(shape="waypoints", points=[[0, 0, 0], [1, 0, 0], [0, 0, 0]], speed=1, look_at=[0, 0, 5])
    assert np.allclose(make_trajectory(made, 30).positions[[0, -1]], 0, atol=0.05)


# What a user may name


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    write_tum(some(), tmp_path / "poses.txt")
    trajectories: dict[str, dict[str, object]] = {
        "around": {**MOVING["circle"], "speed": 1},
        "recorded": {"file": "poses.txt"},
    }
    face = (np.zeros((3, 3)), np.zeros((1, 3), np.uint32), np.zeros(1, np.uint8))
    return Scene("office", *face, ("cement",), trajectories, tmp_path / "office.yaml")


def test_names_and_the_default(scene: Scene) -> None:
    default = load_trajectory(None, scene, rate=30)
    assert default.stamps.tobytes() == (np.arange(len(default)) / 30).tobytes()
    assert np.array_equal(default.positions, load_trajectory("around", scene, 30).positions)
    assert len(load_trajectory("around", scene, 30, frames=7)) == 7
    assert np.array_equal(load_trajectory("recorded", scene).positions, some().positions)
    assert len(load_trajectory("recorded", scene, frames=2)) == 2
    sampled = load_trajectory("recorded", scene, rate=30)
    assert np.allclose(np.diff(sampled.stamps), 1 / 30, atol=1e-6)
    assert sampled.stamps[0] == some().stamps[0]


def test_files_and_lines(tmp_path: Path, scene: Scene) -> None:
    (tmp_path / "fly.yaml").write_text(yaml.safe_dump({**MOVING["waypoints"], "speed": 1}))
    (tmp_path / "seen.yml").write_text("file: poses.txt\n")
    flown = load_trajectory(tmp_path / "fly.yaml", None, 30)
    inline = "waypoints:points=0/0/1;3/0/1;3/2/2;0/2/1.5,speed=1"
    assert np.array_equal(load_trajectory(inline, None, 30).matrices(), flown.matrices())
    assert len(load_trajectory(str(tmp_path / "seen.yml"))) == 5
    assert len(load_trajectory(str(tmp_path / "poses.txt"), scene)) == 5
    around = load_trajectory("circle:radius=2,speed=1,center=0/0/1,look_at=0/0/0", rate=10)
    assert np.allclose(np.linalg.norm(around.positions, axis=1), np.sqrt(5))
    back = load_trajectory("line:start=0/0/0,end=-1/0/0,speed=1,there_and_back=true,heading=tangent", rate=10)
    assert len(back) == 21


def test_the_same_call_gives_the_same_bytes(scene: Scene) -> None:
    texts = {tum_text(load_trajectory("around", scene, 30)) for _ in range(2)}
    assert len(texts) == 1


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ("nowhere", "nowhere: is no trajectory; give one of the scene's (around, recorded), a TUM .txt file"),
        ("triangle:side=3", "triangle:side=3: is no trajectory"),
        ("none.txt", "none.txt: no such file; give the path of a TUM trajectory"),
        ("none.yaml", "none.yaml: no such file; give the path of a trajectory specification"),
        ("circle:radius", "radius: is not key=value"),
        ("circle:radius=1,radius=2", "radius=2: is given twice"),
        ("circle:radius=big,speed=1,center=0/0/1", "radius: input should be a valid number"),
        ("circle:radius=1,speed=1,center=0/0/nan", "center.2: input should be a finite number"),
        ("circle:radius=2,speed=1e-9,center=0/0/1", "frames at 30 Hz; shorten it to a million frames"),
        ("hover:position=0/0/1,look_at=0/0/0,duration=1e300", "shorten it to a million frames"),
    ],
)
def test_broken_choices(scene: Scene, choice: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        load_trajectory(choice, scene, rate=30)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_broken_rates_and_counts(scene: Scene) -> None:
    with pytest.raises(InputError, match=r"trajectories.around: a shape has no frames of its own; give a frame rate"):
        load_trajectory("around", scene)
    for rate in (0, -1, np.nan, np.inf):
        for choice in ("around", "recorded"):
            with pytest.raises(InputError, match="not a positive number of Hz"):
                load_trajectory(choice, scene, rate=rate)
    for frames in (0, -3, 10**9):
        with pytest.raises(InputError, match=r"frames, not .*; ask for 1 to"):
            load_trajectory("around", scene, 30, frames)
    with pytest.raises(InputError, match=r"has 5 frames, not 6; ask for 1 to 5 frames"):
        load_trajectory("recorded", scene, frames=6)


def test_no_scene_and_no_choice() -> None:
    with pytest.raises(InputError, match=r"comes without a trajectory; name one: a TUM .txt file"):
        load_trajectory(None)


def test_every_shape_is_tried_here() -> None:
    assert {str(spec["shape"]) for spec in MOVING.values()} | {"hover"} == set(SHAPES)
