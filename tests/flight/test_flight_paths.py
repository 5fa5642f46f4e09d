"""Reference paths and what flatness makes of them."""

from pathlib import Path as File

import numpy as np
import pytest
from flights import random_quaternion, vehicle
from scipy.spatial.transform import Rotation

from depthsim.errors import InputError
from depthsim.flight.constants import GRAVITY
from depthsim.flight.controller import FORCE, RATES, SPIN, P, V
from depthsim.flight.dynamics import simulate
from depthsim.flight.fleet import make_fleet
from depthsim.flight.minimum_snap import MinimumSnap
from depthsim.flight.paths import Circle, Hover, Lemniscate, Path, Shuttle
from depthsim.flight.pathspec import parse_path, resolve_path
from depthsim.flight.reference import make_reference, quaternion_of
from depthsim.flight.wind import make_air

POINTS = ((0, 0, 1), (6, 3, 2), (10, -2, 3), (3, -5, 1.5), (0, -1, 2))
PATHS: dict[str, Path] = {
    "circle": Circle(radius=5, speed=4, laps=1.5),
    "lemniscate": Lemniscate(size=(20, 10), speed=6),
    "shuttle": Shuttle(speed=10),
    "minimum_snap": MinimumSnap(points=POINTS, speed=5),
    "hover": Hover(position=(1, 2, 3), time=4),
}
paths = pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)


@paths
def test_derivatives_are_those_of_the_position(path: Path) -> None:
    h = 1e-3
    t = np.linspace(0.2, path.duration - 0.2, 400) if path.duration > 0.5 else np.array([0.2])
    # Minimum snap has kinks in the seventh derivative, and profiles in the fourth: too small to be seen here.
    flat, ahead, behind = (path.flat(t + shift) for shift in (0, h, -h))
    for order in range(4):
        slope = (ahead[order] - behind[order]) / (2 * h)
        scale = 1 + np.abs(flat[order + 1]).max()
        np.testing.assert_allclose(slope, flat[order + 1], atol=2e-4 * scale, err_msg=str(order))


@paths
def test_rest_at_both_ends_and_beyond(path: Path) -> None:
    ends = path.flat(np.array([-1.0, 0.0, path.duration, path.duration + 1]))
    assert np.abs(ends[1:4]).max() < 1e-6
    np.testing.assert_allclose(ends[0, [0, 2]], ends[0, [1, 3]], atol=1e-9)


@paths
def test_the_greatest_speed_is_the_one_given(path: Path) -> None:
    speeds = np.linalg.norm(path.flat(np.linspace(0, path.duration, 20001))[1], axis=1)
    assert speeds.max() == pytest.approx(getattr(path, "speed", 0.0), rel=1e-6)


def test_shapes_are_where_they_should_be() -> None:
    t = np.linspace(0, 60, 5001)
    circle = PATHS["circle"].flat(t)[0]
    np.testing.assert_allclose(np.linalg.norm(circle - [0, 0, 2], axis=1), 5, rtol=1e-12)
    x, y, z = PATHS["lemniscate"].flat(t)[0].T
    np.testing.assert_allclose((y / 5) ** 2, 4 * (x / 10) ** 2 * (1 - (x / 10) ** 2), atol=1e-9)
    assert (z == 2).all()
    shuttle = PATHS["shuttle"]
    out = shuttle.flat(np.array([0, shuttle.duration / 2, shuttle.duration]))[0]
    np.testing.assert_allclose(out, [[0, 0, 2], [80, 0, 2], [0, 0, 2]], atol=1e-9)
    snap = PATHS["minimum_snap"]
    places = snap.flat(np.linspace(0, snap.duration, 40001))[0]
    for point in POINTS:
        assert np.linalg.norm(places - point, axis=1).min() < 1e-3


def test_minimum_snap_is_the_least_of_its_neighbours() -> None:
    """Any bump that keeps way-points and rest adds to the integral of the squared snap."""
    path = MinimumSnap(points=POINTS, speed=5)
    t = np.linspace(0, path.duration, 20001)
    snap, knots = path.flat(t)[4], np.unique(path._spline.t)
    at = [float(t[np.argmin(np.linalg.norm(path.flat(t)[0] - point, axis=1))]) for point in POINTS]
    bump = np.polynomial.Polynomial.fromroots([*[0.0] * 4, *at[1:-1], *[path.duration] * 4])
    scale = np.abs(bump(t)).max()
    cross = np.trapezoid(snap * (bump.deriv(4)(t) / scale)[:, None], t, axis=0)
    own = np.sqrt(np.trapezoid(snap**2, t, axis=0) * np.trapezoid((bump.deriv(4)(t) / scale) ** 2, t))
    assert len(knots) >= 2 and np.abs(cross / own).max() < 2e-3


def test_headings() -> None:
    t = np.linspace(0, PATHS["circle"].duration, 101)
    flat = PATHS["circle"].flat(t)
    yaw = PATHS["circle"].heading(flat)
    assert yaw[-1] - yaw[0] == pytest.approx(3 * np.pi, abs=1e-4)
    fixed = Circle(radius=5, speed=4, yaw=30)
    np.testing.assert_allclose(fixed.heading(flat), np.radians(30))
    inward = Circle(radius=5, speed=4, look_at=(0, 0, 1)).heading(flat)
    np.testing.assert_allclose(np.cos(inward), -flat[0, :, 0] / 5, atol=1e-12)
    shuttle = Shuttle(speed=5, direction=90)
    np.testing.assert_allclose(shuttle.heading(shuttle.flat(np.linspace(0, 40, 101))), np.pi / 2)
    up = MinimumSnap(points=((0, 0, 0), (0, 0, 5)), speed=2)
    assert (up.heading(up.flat(np.linspace(0, 3, 11))) == 0).all()


@pytest.mark.parametrize("seed", range(5))
def test_quaternion_of_a_matrix(seed: int) -> None:
    q = random_quaternion(np.random.default_rng(seed))
    q = q if q[3] >= 0 else -q
    np.testing.assert_allclose(quaternion_of(Rotation.from_quat(q).as_matrix()), q, atol=1e-12)


LAWS = [
    {"law": "none"},
    {"law": "linear", "D": [0.4, 0.15, 0.2]},
    {"law": "airsim_quadratic", "area": [0.05, 0.09, 0.2]},
    {"law": "rotor_linear", "c_d1": 0.05},
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law["law"])
def test_flatness_with_drag_is_newtons_law(law: dict) -> None:
    """Thrust along the reference's z, drag and gravity make the reference's acceleration, and its rates turn it."""
    craft, path = vehicle(drag=law), PATHS["minimum_snap"]
    reference = make_reference(path, craft)
    rows = reference.rows[500:-500:50]
    flat = path.flat(np.arange(len(reference.rows)) * 1e-3)[:, 500:-500:50]
    force = rows[:, FORCE : FORCE + 3]
    z = force / np.linalg.norm(force, axis=1, keepdims=True)
    c, s = rows[:, 9], rows[:, 10]
    x = np.cross(np.stack([-s, c, 0 * c], axis=1), z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    rotation = np.stack([x, np.cross(z, x), z], axis=2)
    v = np.einsum("nji,nj->ni", rotation, flat[1])
    thrusts = np.repeat(craft.mass * np.linalg.norm(force, axis=1)[:, None] / 4, 4, axis=1)
    drag = np.einsum("nij,nj->ni", rotation, craft.drag.force(craft, v, 0 * v, thrusts))
    total = force + drag / craft.mass - [0, 0, GRAVITY]
    np.testing.assert_allclose(total, flat[2], atol=1e-11)


def test_reference_rates_turn_the_reference() -> None:
    craft = vehicle()
    reference = make_reference(PATHS["lemniscate"], craft)
    rates, spin = reference.rows[:, RATES : RATES + 3], reference.rows[:, SPIN : SPIN + 3]
    off = np.abs((rates[2:] - rates[:-2]) / 2e-3 - spin[1:-1])
    assert np.quantile(off, 0.999) < 1e-4 and off.max() < 2e-3  # the greatest are where start and stop begin and end
    turned = Rotation.from_quat(reference.start[6:10])
    for rate in 0.5 * (rates[1:] + rates[:-1]):
        turned = turned * Rotation.from_rotvec(rate * 1e-3)
    z = reference.rows[-1, FORCE : FORCE + 3]
    np.testing.assert_allclose(turned.as_matrix()[:, 2], z / np.linalg.norm(z), atol=1e-5)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law["law"])
def test_feedforward_alone_flies_the_path(law: dict) -> None:
    """Without motor lag the reference is the flight: what is left is that commands are held over a step."""
    craft = vehicle(drag=law, rotors={"motor_time_constant": 0})
    path = Lemniscate(size=(20, 10), speed=6)

    def worst(step: float) -> float:
        reference = make_reference(path, craft, step)
        motion = simulate(
            make_fleet([craft]), make_air(None), reference.start[None], step=step, steps=len(reference.rows) - 1,
            references=reference.rows[None],
        )  # fmt: skip
        return float(np.abs(motion.states[0, :, :6] - reference.rows[:, P : V + 3]).max())

    errors = worst(2e-3), worst(1e-3)
    assert errors[1] < 2e-4
    assert errors[0] / errors[1] > 1.8  # it goes to zero with the step


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law["law"])
def test_on_the_reference_the_controller_asks_for_the_reference(law: dict) -> None:
    """In a state on the path, one very short step changes velocity and rates as the path does."""
    craft = vehicle(drag=law, rotors={"motor_time_constant": 0})
    reference = make_reference(PATHS["lemniscate"], craft)
    flat = PATHS["lemniscate"].flat(np.arange(len(reference.rows)) * 1e-3)
    for index in (3000, 7000, 12000):
        row, step = reference.rows[index], 1e-6
        z = row[FORCE : FORCE + 3] / np.linalg.norm(row[FORCE : FORCE + 3])
        x = np.cross([-row[10], row[9], 0], z)
        x /= np.linalg.norm(x)
        start = np.concatenate([row[:6], quaternion_of(np.stack([x, np.cross(z, x), z], 1)), row[RATES:SPIN], 4 * [0]])
        motion = simulate(
            make_fleet([craft]), make_air(None), start[None], step=step, steps=1,
            references=reference.rows[None, index : index + 2],
        )  # fmt: skip
        change = (motion.states[0, 1] - motion.states[0, 0]) / step
        np.testing.assert_allclose(change[3:6], flat[2, index], atol=2e-5)
        np.testing.assert_allclose(change[10:13], row[SPIN : SPIN + 3], atol=2e-5)


def test_feedforward_for_drag_makes_the_error_smaller() -> None:
    craft, path = vehicle(), Lemniscate(size=(40, 20), speed=10)
    errors = []
    for feedforward in (True, False):
        reference = make_reference(path, craft, feedforward=feedforward)
        motion = simulate(
            make_fleet([craft]), make_air(None), reference.start[None], step=1e-3, steps=len(reference.rows) - 1,
            references=reference.rows[None],
        )  # fmt: skip
        errors.append(np.sqrt(np.mean((motion.states[0, :, :3] - reference.rows[:, :3]) ** 2)))
    assert errors[1] > 3 * errors[0]


def test_what_a_user_may_name(tmp_path: File) -> None:
    named = resolve_path("lemniscate:size=20/10,center=0/0/2,laps=2", 3)
    assert named == Lemniscate(size=(20, 10), center=(0, 0, 2), laps=2, speed=3)
    assert resolve_path("minimum_snap:points=0/0/1;4/0/2;4/4/1,speed=2").speed == 2  # type: ignore[attr-defined]
    (tmp_path / "p.yaml").write_text("{shape: circle, radius: 3, speed: 1}")
    assert resolve_path(str(tmp_path / "p.yaml"), 2.5) == Circle(radius=3, speed=2.5)
    assert resolve_path("hover").duration == 10
    assert resolve_path("shuttle", 5) == Shuttle(speed=5)


@pytest.mark.parametrize(
    ("choice", "speed", "reported"),
    [
        ("spiral:radius=2", 1.0, "is no flight path"),
        ("circle:radius=2", None, "has no speed"),
        ("circle:radius=2", -1.0, "speed: input should be greater than 0"),
        ("circle:radius=2", float("nan"), "finite number"),
        ("circle:radius=-2", 1.0, "radius: input should be greater than 0"),
        ("circle:laps=2", 1.0, "radius: field required"),
        ("circle:radius=2,colour=3", 1.0, "colour"),
        ("circle:radius=2,radius=3", 1.0, "given twice"),
        ("circle:radius=2,yaw=north", 1.0, "yaw"),
        ("circle:radius=2,yaw=3,look_at=0/0/0", 1.0, "look_at is given together with yaw"),
        ("circle:radius=2", 30.0, "too short to reach 30 m/s"),
        ("shuttle:length=5", 20.0, "too short to reach 20 m/s"),
        ("minimum_snap:points=0/0/0", 1.0, "points"),
        ("minimum_snap:points=0/0/0;0/0/0", 1.0, "points 0 and 1 are the same"),
        ("minimum_snap:points=0/0;1/1", 1.0, "points"),
        ("hover:time=0", None, "time: input should be greater than 0"),
        ("gone.yaml", 1.0, "no such file"),
    ],
)
def test_broken_paths(choice: str, speed: float | None, reported: str) -> None:
    with pytest.raises(InputError) as caught:
        resolve_path(choice, speed)
    assert reported in str(caught.value) and "\n" not in str(caught.value)


def test_a_path_must_be_a_mapping_with_a_shape() -> None:
    for value, reported in ((3, "is not a mapping"), ({}, "has no shape"), ({"shape": 4}, "shape is 4")):
        with pytest.raises(InputError, match=reported):
            parse_path(value, File("flight.yaml"), "path")
