"""Flights as a whole: contact with a scene, the IMU, the camera's poses, files, errors and the command line."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from commands import depthsim_here
from flights import vehicle
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from shapes import as_scene, box, quad, soup, sphere

from depthsim.errors import InputError
from depthsim.flight.constants import GRAVITY
from depthsim.flight.contact import first_contact
from depthsim.flight.flying import Flight, fly
from depthsim.flight.imu import ACCEL_RATE, ACCELEROMETER, GYROSCOPE, Channel, imu_samples
from depthsim.flight.log import read_flight
from depthsim.flight.minimum_snap import MinimumSnap
from depthsim.flight.paths import Circle, Hover, Lemniscate, Shuttle
from depthsim.flight.paths import Path as FlightPath
from depthsim.flight.spec import fly_spec, open_ride
from depthsim.flight.vehicle import load_vehicle
from depthsim.flight.wind import ConstantWind, Gusts
from depthsim.trajectory import read_tum

WALL = as_scene(quad((3, -5, -5), (0, 10, 0), (0, 0, 10)))


def straight(speed: float = 2.0, length: float = 5.0) -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0, length / speed, 51)
    return t, np.stack([speed * t, 0 * t, 0 * t], axis=1)


# Contact


def test_contact_with_a_wall_is_at_the_analytic_time_and_place() -> None:
    t, path = straight()
    for radius in (0.0, 0.1, 0.5):
        contact = first_contact(WALL, t, path, radius)
        assert contact is not None and contact.tag == "cement"
        assert contact.time == pytest.approx((3 - radius) / 2, abs=1e-9)
        np.testing.assert_allclose(contact.position, [3 - radius, 0, 0], atol=1e-9)
        np.testing.assert_allclose(contact.point, [3, 0, 0], atol=1e-9)


def test_contact_with_an_edge_and_a_corner() -> None:
    t, path = straight()
    edge = first_contact(as_scene(quad((3, 0.3, -5), (0, 5, 0), (0, 0, 10))), t, path, 0.5)
    assert edge is not None and edge.time == pytest.approx((3 - 0.4) / 2, abs=1e-9)
    corner = first_contact(as_scene(quad((3, 0.2, 0.2), (0, 5, 0), (0, 0, 5))), t, path, 0.5)
    assert corner is not None and corner.time == pytest.approx((3 - np.sqrt(0.25 - 0.08)) / 2, abs=1e-9)


def test_no_contact_beside_behind_or_above() -> None:
    t, path = straight()
    for mesh in (quad((6, -5, -5), (0, 10, 0), (0, 0, 10)), quad((3, 0.6, -5), (0, 5, 0), (0, 0, 10))):
        assert first_contact(as_scene(mesh), t, path, 0.5) is None


def test_a_thin_wall_between_two_samples_is_seen_and_a_start_inside_the_radius_too() -> None:
    t, path = np.array([0.0, 1.0]), np.array([[0.0, 0, 0], [100.0, 0, 0]])
    contact = first_contact(WALL, t, path, 0.0)
    assert contact is not None and contact.time == pytest.approx(0.03, abs=1e-9)
    inside = first_contact(WALL, *straight(), 3.5)
    assert inside is not None and inside.time == 0


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_contact_agrees_with_a_dense_march(seed: int) -> None:
    """Against the distance to densely sampled triangles, at densely sampled times."""
    rng = np.random.default_rng(seed)
    scene = as_scene(soup(rng, 6, spread=1.5))
    t = np.linspace(0, 1, 9)
    path = np.cumsum(rng.normal(0, 0.6, (9, 3)), axis=0) - [3, 0, 0]
    a, b = rng.uniform(size=(2, 4000))
    a, b = np.where(a + b > 1, 1 - a, a), np.where(a + b > 1, 1 - b, b)
    corners = scene.vertices[scene.faces]
    points = (corners[:, 0] + a[:, None, None] * (corners[:, 1] - corners[:, 0])
              + b[:, None, None] * (corners[:, 2] - corners[:, 0])).reshape(-1, 3)  # fmt: skip
    dense = np.linspace(0, 1, 801)
    places = np.stack([np.interp(dense, t, column) for column in path.T], axis=1)
    from scipy.spatial import cKDTree

    gaps = cKDTree(points).query(places)[0]
    radius = 0.25
    contact = first_contact(scene, t, path, radius)
    if contact is None:
        assert gaps.min() > radius - 0.03
    else:
        assert gaps[dense < contact.time - 1e-9].min(initial=9) > radius - 1e-9
        assert np.linalg.norm(contact.point - contact.position) <= radius + 1e-9
        assert cKDTree(points).query(contact.position)[0] < radius + 0.1


def test_a_flight_in_a_room_reports_the_wall_it_meets() -> None:
    room = as_scene(box((-5, -5, 0), (5, 5, 4)))
    craft = vehicle()
    free = fly(Circle(radius=3, speed=2), craft, scene=room)
    assert free.contact is None
    hit = fly(Shuttle(start=(-4, 0, 2), length=20, speed=2), craft, scene=room)
    assert hit.contact is not None
    assert hit.contact.point[0] == pytest.approx(5, abs=1e-6)
    assert "touches cement at" in str(hit.contact)
    x = np.interp(hit.contact.time, hit.log.t, hit.log.position[:, 0])  # type: ignore[index]
    assert x == pytest.approx(5 - craft.radius, abs=1e-3)
    pillar = as_scene(sphere(3, 0.3, (0, -3, 2)))
    assert fly(Circle(radius=3, speed=2), craft, scene=pillar).contact is not None


# The IMU


def test_imu_noise_has_the_datasheets_density() -> None:
    t = np.arange(0, 100.0005, 1e-3)
    still = np.zeros((len(t), 3))
    gyro = GYROSCOPE.measure(still, 400, np.random.default_rng(0))
    # Uniform rounding adds a twelfth of the squared resolution.
    expected = np.sqrt(400 * np.radians(0.014) ** 2 + np.radians(1 / 32.8) ** 2 / 12)
    assert gyro.std() == pytest.approx(expected, rel=0.01)
    accel = ACCELEROMETER.measure(still, 250, np.random.default_rng(0))
    expected = GRAVITY * np.sqrt(250 * 150e-6**2 + 1 / 512**2 / 12)
    assert accel.std() == pytest.approx(expected, rel=0.02)
    assert np.abs(GYROSCOPE.measure(still + 100, 400, np.random.default_rng(0))).max() == np.radians(1000)


def test_imu_bias_walks_as_the_root_of_time() -> None:
    walk = Channel(0, 2e-3, 1e9, 1e-12)
    read = walk.measure(np.zeros((40000, 200)), 400, np.random.default_rng(0))
    for seconds in (1, 25, 100):
        assert read[400 * seconds - 1].std() == pytest.approx(2e-3 * np.sqrt(seconds), rel=0.15)


def test_imu_rates_and_interpolation() -> None:
    t = np.arange(0, 2.0005, 1e-3)
    for rate in (200, 400):
        columns = imu_samples(t, np.zeros((2001, 3)), np.zeros((2001, 3)), rate, 3)
        assert len(columns["t"]) == 2 * rate + 1 and np.diff(columns["t"]) == pytest.approx(1 / rate)
        shared = np.isin(np.round(columns["t"] * ACCEL_RATE, 6) % 1, [0])
        steps = columns["ax"][shared] / ACCELEROMETER.resolution
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    with pytest.raises(ValueError, match="gyroscope"):
        imu_samples(t, np.zeros((2001, 3)), np.zeros((2001, 3)), 100, 3)


def test_a_still_camera_reads_gravity_upwards_in_its_own_frame() -> None:
    """Optical y points down, so what holds the vehicle up is -y (librealsense's d435i.md)."""
    flight = fly(Hover(time=4), vehicle())
    mean = [flight.imu[name].mean() for name in ("ax", "ay", "az", "wx", "wy", "wz")]
    np.testing.assert_allclose(mean, [0, -GRAVITY, 0, 0, 0, 0], atol=5e-3)


# The flight


def moving() -> Flight:
    craft = vehicle(camera={"position": [0.1, 0.05, 0.02], "pitch": -20, "yaw": 10})
    return fly(
        MinimumSnap(points=((0, 0, 2), (5, 3, 3), (8, -2, 2)), speed=5), craft, wind=ConstantWind(velocity=(3, 1, 0))
    )


def test_camera_rides_on_the_mount() -> None:
    flight = moving()
    body, log = Rotation.from_quat(flight.log.quaternion), flight.log
    assert log.position is not None
    np.testing.assert_allclose(flight.camera.positions, log.position + body.apply([0.1, 0.05, 0.02]), atol=1e-12)
    look = body.inv().apply(flight.camera.matrices()[:, :3, 2])
    expected = Rotation.from_euler("ZY", [10, 20], degrees=True).apply([1, 0, 0])
    np.testing.assert_allclose(look, np.tile(expected, (len(look), 1)), atol=1e-12)


def test_log_is_consistent_with_itself() -> None:
    """Velocity is the position's derivative, the specific force the acceleration's, and the rates turn the attitude."""
    log = moving().log
    assert log.position is not None and log.specific_force is not None
    t = log.t[1:-1]
    v = (log.position[2:] - log.position[:-2]) / 0.01
    a = (log.velocity[2:] - log.velocity[:-2]) / 0.01
    np.testing.assert_allclose(v, log.velocity[1:-1], atol=1e-3)
    body = Rotation.from_quat(log.quaternion)
    felt = body[1:-1].inv().apply(a + np.array([0, 0, GRAVITY]))
    assert np.quantile(np.abs(felt - log.specific_force[1:-1]), 0.99) < 0.02
    turn = (body[:-2].inv() * body[2:]).as_rotvec() / 0.01
    assert np.quantile(np.abs(turn - log.rates[1:-1]), 0.99) < 0.02
    assert (np.diff(t) > 0).all()


def test_specific_force_is_thrust_and_drag_over_mass() -> None:
    flight = moving()
    craft, log = flight.vehicle, flight.log
    assert log.rotor_thrusts is not None and log.specific_force is not None
    air = Rotation.from_quat(log.quaternion).inv().apply(log.velocity - [3, 1, 0])
    force = craft.drag.force(craft, air, log.rates, log.rotor_thrusts)
    force[:, 2] += log.rotor_thrusts.sum(axis=1)
    np.testing.assert_allclose(force / craft.mass, log.specific_force, atol=1e-9)


def test_same_seed_same_bytes_and_another_seed_others(tmp_path: Path) -> None:
    path, craft = Hover(time=3), load_vehicle("hummingbird")
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        fly(path, craft, wind=Gusts(velocity=(4, 0, 0)), seed=seed).write(tmp_path / name)
    for file in ("flight.csv", "imu.csv", "groundtruth.txt", "vehicle.yaml"):
        a, b, c = ((tmp_path / name / file).read_bytes() for name in "abc")
        assert a == b
        assert a != c or file == "vehicle.yaml"


def test_files_read_back(tmp_path: Path) -> None:
    flight = moving()
    flight.write(tmp_path)
    log = read_flight(tmp_path / "flight.csv")
    assert log.rotor_thrusts is not None and log.specific_force is not None and not log.derived and not log.left_out
    np.testing.assert_array_equal(log.specific_force, flight.log.specific_force)
    assert len(read_tum(tmp_path / "groundtruth.txt")) == len(flight.camera)
    assert load_vehicle(tmp_path / "vehicle.yaml") == flight.vehicle
    header = (tmp_path / "imu.csv").read_text().splitlines()[0]
    assert header == "t,wx,wy,wz,ax,ay,az"


@pytest.mark.parametrize("name", ["f450", "hummingbird", "racer250", "crazyflie"])
def test_every_preset_flies(name: str) -> None:
    flight = fly(Lemniscate(size=(6, 3), speed=1.5), load_vehicle(name))
    assert np.sqrt(np.mean(flight.error**2)) < 0.03


def test_what_cannot_be_flown_is_reported() -> None:
    cases: list[tuple[FlightPath, str]] = [
        (Circle(radius=5, speed=25, laps=20, acceleration=20), "takes a thrust of"),
        (Hover(time=5000), "takes 5000 s"),
        (MinimumSnap(points=((0, 0, 0), (0, 0, -40), (0, 0, 0)), speed=19.5), "upside down"),
    ]
    for path, reported in cases:
        with pytest.raises(InputError, match=reported):
            fly(path, vehicle())
    sail = vehicle(drag={"law": "linear", "D": [2, 2, 2]})
    with pytest.raises(InputError, match=r"s: f450 is 50 m off the path; lower speed or wind"):
        fly(Hover(time=5), sail, wind=ConstantWind(velocity=(150, 0, 0)))


# Broken files

GOOD = yaml.safe_load(load_vehicle("f450").to_yaml())
BROKEN_VEHICLES = {
    "no mass": ({"mass": None}, "mass"),
    "negative mass": ({"mass": -1}, "mass: input should be greater than 0"),
    "mass not a number": ({"mass": "heavy"}, "mass"),
    "infinite mass": ({"mass": float("inf")}, "mass"),
    "two moments": ({"inertia": [1, 2]}, "inertia"),
    "no such body": ({"inertia": [0.01, 0.01, 0.05]}, "no body has the inertia"),
    "negative moment": ({"inertia": [0.02, -0.02, 0.03]}, "inertia.1"),
    "odd rotors": ({"rotors": {**GOOD["rotors"], "count": 5}}, "rotors.count"),
    "no arm": ({"rotors": {"radius": 0.1, "motor_time_constant": 0.02}}, "rotors.arm: field required"),
    "negative lag": ({"rotors": {**GOOD["rotors"], "motor_time_constant": -1}}, "motor_time_constant"),
    "too weak": ({"rotors": {**GOOD["rotors"], "max_thrust": 3}}, "the rotors cannot lift it"),
    "never down": ({"rotors": {**GOOD["rotors"], "min_thrust": 4}}, "it cannot come down"),
    "unknown law": ({"drag": {"law": "magic"}}, "'magic'"),
    "no law": ({"drag": {"c_d1": 0.05}}, "drag"),
    "no coefficient": ({"drag": {"law": "rotor_sqrt"}}, "drag.rotor_sqrt.c_d1: field required"),
    "negative coefficient": ({"drag": {"law": "rotor_sqrt", "c_d1": -1}}, "c_d1"),
    "two coefficients": ({"drag": {"law": "linear", "D": [1, 2]}}, "D"),
    "unknown key": ({"wings": 2}, "wings"),
    "no list": ({"rotors": 4}, "rotors"),
    "pitch": ({"camera": {"pitch": 120}}, "camera.pitch"),
    "wind": ({"wind": {"kind": "field", "file": "x.csv"}}, "wind"),
    "curve": ({"thrust_curve": {"input": "rpm", "coefficients": [1]}}, "thrust_curve.input"),
}


@pytest.mark.parametrize("case", BROKEN_VEHICLES)
def test_broken_vehicles(case: str, tmp_path: Path) -> None:
    changes, reported = BROKEN_VEHICLES[case]
    keys = {key: value for key, value in {**GOOD, **changes}.items() if value is not None}
    file = tmp_path / "vehicle.yaml"
    file.write_text(yaml.safe_dump(keys))
    with pytest.raises(InputError) as caught:
        load_vehicle(file)
    assert reported in str(caught.value) and str(file) in str(caught.value) and "\n" not in str(caught.value)


BROKEN_SPECS = {
    "{vehicle: f450}": "path: field required",
    "{path: 'circle:radius=2', speed: 1, vehicle: ../f450.yaml}": "leaves the folder",
    "{path: ../circle.yaml, speed: 1}": "leaves the folder",
    "{path: 'circle:radius=2', speed: 1, vehicle: airbus}": "is no vehicle",
    "{path: {shape: circle}, speed: 1}": "path.radius: field required",
    "{path: {shape: circle, radius: 2}}": "has no speed",
    "{path: hover, wind: {kind: gale}}": "gale",
    "{path: hover, imu_rate: 300}": "imu_rate",
    "{path: hover, colour: red}": "colour",
    "[1, 2]": "not a mapping",
}


@pytest.mark.parametrize("text", BROKEN_SPECS)
def test_broken_flights(text: str, tmp_path: Path) -> None:
    (tmp_path / "flight.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        fly_spec(tmp_path / "flight.yaml")
    assert BROKEN_SPECS[text] in str(caught.value) and "\n" not in str(caught.value)


def test_a_ride_needs_a_flight(tmp_path: Path) -> None:
    for choice in (tmp_path / "gone", tmp_path):
        with pytest.raises(InputError):
            open_ride(choice)


# The command line


def depthsim(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "depthsim", *map(str, words)], capture_output=True, text=True, check=False
    )


def test_fly_and_generate_from_the_command_line(tmp_path: Path) -> None:
    flight, run = tmp_path / "flight", tmp_path / "run"
    done = depthsim("fly", "circle:radius=1.2,center=4/4/1.4", "--speed", 1, "--vehicle", "crazyflie", "--out", flight,
                    "--wind", "gusts:velocity=1/0/0", "--seed", 4, "--scene", "office")  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "s on crazyflie, up to" in done.stdout
    done = depthsim_here("generate", "office", "--fly", flight, "--out", run, "--resolution", "424x240", "--frames", 3,
                    "--only-depth", "--camera", "d435")  # fmt: skip
    assert done.returncode == 0, done.stderr
    for name in ("flight.csv", "imu.csv", "vehicle.yaml"):
        assert (run / name).read_bytes() == (flight / name).read_bytes()
    dense, frames = read_tum(flight / "groundtruth.txt"), read_tum(run / "groundtruth.txt")
    np.testing.assert_allclose(frames.positions, dense.at(frames.stamps).positions, atol=1e-12)
    (tmp_path / "spec.yaml").write_text(
        "{path: 'circle:radius=1.2,center=4/4/1.4', speed: 1, vehicle: crazyflie, "
        "wind: 'gusts:velocity=1/0/0', seed: 4}"
    )
    done = depthsim_here("generate", "office", "--fly", tmp_path / "spec.yaml", "--out", tmp_path / "run2",
                         "--frames", 2, "--resolution", "424x240", "--only-depth", "--camera", "d435")  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run2/imu.csv").read_bytes() == (flight / "imu.csv").read_bytes()


def test_faults_at_the_command_line_are_one_line(tmp_path: Path) -> None:
    out = tmp_path / "out"
    for words in (
        ("fly", "circle:radius=2", "--out", out),
        ("fly", "hover", "--vehicle", "airbus", "--out", out),
        ("fly", "hover", "--imu-rate", 100, "--out", out),
        ("generate", "office", "--fly", tmp_path / "gone", "--out", out),
    ):
        done = depthsim_here(*words)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
        assert not out.exists()


def test_a_flight_does_not_write_over_a_runs_poses(tmp_path: Path) -> None:
    (tmp_path / "depth.txt").write_text("")
    done = depthsim_here("fly", "hover:time=1", "--out", tmp_path)
    assert done.returncode == 2 and "holds a recorded run" in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["depth.txt"]
