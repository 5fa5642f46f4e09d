"""From a path and a vehicle to a flight: its log, the camera's poses, and what the IMU reads."""

import math
from dataclasses import dataclass
from pathlib import Path as File

import numpy as np

from depthsim.errors import InputError
from depthsim.flight.contact import Contact, first_contact
from depthsim.flight.controller import FORCE, P, V
from depthsim.flight.dynamics import BODY, Motion, simulate
from depthsim.flight.fleet import make_fleet
from depthsim.flight.imu import imu_samples
from depthsim.flight.log import FlightLog, write_flight
from depthsim.flight.paths import Path
from depthsim.flight.pathspec import resolve_path
from depthsim.flight.profile import Floats
from depthsim.flight.reference import Reference, make_reference
from depthsim.flight.table import write_table
from depthsim.flight.vehicle import Vehicle, load_vehicle
from depthsim.flight.wind import Wind, make_air
from depthsim.flight.windfile import resolve_wind
from depthsim.runs.storing import make_folder, write_whole
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.trajectory.poses import Trajectory
from depthsim.trajectory.rotation import multiply, rotation_matrices, view_rotations
from depthsim.trajectory.tum import tum_text

STEP = 1e-3
"""[s] of the integration."""
LOG_EVERY = 5
"""Steps to a row of flight.csv and groundtruth.txt: 200 Hz."""
LONGEST = 3600.0
"""[s]"""
LOST = 50.0
"""[m] Further from its path a flight is not the one that was asked for."""
FILES = ("flight.csv", "imu.csv", "vehicle.yaml", "groundtruth.txt")


@dataclass(frozen=True)
class Flight:
    """A flown path.

    log: 200 Hz, as in flight.csv. camera: the poses of the optical frame at the same stamps. imu: columns of imu.csv.
    error: (N,) distance from the path at all steps [m]. contact: the first with the scene, if there was one.
    """

    vehicle: Vehicle
    log: FlightLog
    camera: Trajectory
    imu: dict[str, Floats]
    error: Floats
    contact: Contact | None = None

    def write(self, out: str | File, *, poses: bool = True) -> None:
        """Write flight.csv, imu.csv and vehicle.yaml to the folder ``out``, and groundtruth.txt if ``poses``."""
        out = File(out)
        refuse_run(out, poses)
        make_folder(out)
        write_flight(self.log, out / "flight.csv")
        write_table(self.imu, out / "imu.csv")
        write_whole(out / "vehicle.yaml", self.vehicle.to_yaml().encode())
        if poses:
            write_whole(out / "groundtruth.txt", tum_text(self.camera).encode())


def refuse_run(out: File, poses: bool = True) -> None:
    """Raise :class:`InputError` where the poses of a recorded run in ``out`` would be written over."""
    if poses and (out / "depth.txt").exists():
        raise InputError(out, "", "holds a recorded run, with poses of its own", "give another `out`")


def fly(
    path: str | File | Path,
    vehicle: str | File | Vehicle = "f450",
    *,
    speed: float | None = None,
    wind: str | File | Wind | None = None,
    feedforward: bool = True,
    scene: str | File | Scene | None = None,
    ground: float | None = None,
    seed: int = 0,
    gyro_rate: int = 200,
    name: str = "flight",
) -> Flight:
    """Fly a path once: ``fly("lemniscate:size=20/10,center=0/0/3", "f450", wind="3/0/0")``.

    path: a shape in one line, a .yaml file, or an object. vehicle: a name, a vehicle.yaml, or an object. speed: the
    greatest [m/s], in place of the path's; a path that is an object has its own. wind: that of the vehicle if not
    given. feedforward: whether the controller knows of the drag. scene: what the flight must not touch. ground: the
    height of level ground [m] for the ground effect; 0 if not given where the vehicle has one. The same seed gives the
    same flight. ``name`` is what errors call it. Raises :class:`InputError` for a path that the vehicle cannot fly.
    """
    path, vehicle = resolve_path(path, speed), load_vehicle(vehicle)
    scene = None if scene is None else load_scene(scene)
    if path.duration > LONGEST:
        raise InputError(name, "", f"takes {path.duration:.0f} s", f"shorten it to {LONGEST:.0f} s")
    reference = make_reference(path, vehicle, STEP, feedforward=feedforward)
    _check_feasible(reference, vehicle, name)
    wind = vehicle.wind if wind is None else resolve_wind(wind)
    if ground is None and vehicle.ground_effect is not None:
        ground = 0.0
    air = make_air(wind, [seed], ground=-math.inf if ground is None else ground, **_conditions(reference, wind))
    motion = simulate(
        make_fleet([vehicle]),
        air,
        reference.start[None],
        step=STEP,
        steps=len(reference.rows) - 1,
        references=reference.rows[None],
    )
    states = motion.states[0]
    error = np.linalg.norm(states[:, :3] - reference.rows[:, P : P + 3], axis=1)
    if not error.max() < LOST:
        lost = STEP * int(np.argmax(~(error < LOST)))
        raise InputError(name, f"{lost:.2f} s", f"{vehicle.name} is {LOST:g} m off the path", "lower speed or wind")
    log = _log(motion, vehicle, name)
    contact = first_contact(scene, log.t, states[::LOG_EVERY, :3], vehicle.radius) if scene is not None else None
    camera, imu = _ride(motion, vehicle, gyro_rate, seed, name)
    return Flight(vehicle, log, camera, imu, error, contact)


def _check_feasible(reference: Reference, vehicle: Vehicle, name: str) -> None:
    most = vehicle.max_thrust * vehicle.rotors.count
    wanted = float(reference.thrust.max())
    if wanted > most:
        problem = f"takes a thrust of {wanted:.3g} N, and {vehicle.name} has {most:.3g} N"
        raise InputError(name, "", problem, "lower the speed, or make the turns wider")
    if reference.rows[:, FORCE + 2].min() <= 0:
        raise InputError(name, "", "has the vehicle upside down", "lower the speed, or make the turns wider")


def _conditions(reference: Reference, wind: Wind | None) -> dict[str, float]:
    """How long, how high and how fast through the air the flight is, for the gusts."""
    mean = np.array(wind.mean if wind else (0, 0, 0))
    airspeed = np.linalg.norm(reference.rows[:, V : V + 3] - mean, axis=1).mean()
    duration = (len(reference.rows) - 1) * reference.step
    return {"duration": duration, "altitude": float(reference.rows[:, P + 2].mean()), "airspeed": float(airspeed)}


def _log(motion: Motion, vehicle: Vehicle, name: str) -> FlightLog:
    states = motion.states[0, ::LOG_EVERY]
    recorder, lag = vehicle.measurement, vehicle.rotors.motor_time_constant
    return FlightLog(
        t=np.round(motion.t[::LOG_EVERY], 9),
        position=states[:, :3],
        velocity=states[:, 3:6],
        quaternion=states[:, 6:10],
        rates=states[:, 10:BODY],
        rotor_thrusts=recorder.of_thrusts(motion.states[0, :, BODY:], lag, STEP)[::LOG_EVERY],
        specific_force=recorder.of_force(motion.specific_force[0], STEP)[::LOG_EVERY],
        source=name,
    )


def _ride(
    motion: Motion, vehicle: Vehicle, gyro_rate: int, seed: int, name: str
) -> tuple[Trajectory, dict[str, Floats]]:
    """The camera's poses and the IMU's readings on a vehicle."""
    mount = vehicle.camera
    states, t = motion.states[0], np.round(motion.t, 9)
    place = np.array(mount.position)
    yaw, pitch = np.radians([mount.yaw, mount.pitch])
    forward = np.array([[np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)]])
    turned = view_rotations(forward)[0]
    rows = states[::LOG_EVERY]
    positions = rows[:, :3] + rotation_matrices(rows[:, 6:10]) @ place
    camera = Trajectory(t[::LOG_EVERY], positions, multiply(rows[:, 6:10], turned), name)
    rates = states[:, 10:BODY]
    spin = np.gradient(rates, STEP, axis=0)
    force = (
        vehicle.measurement.of_force(motion.specific_force[0], STEP)
        + np.cross(spin, place)
        + np.cross(rates, np.cross(rates, place))
    )
    to_sensor = rotation_matrices(turned[None])[0]
    return camera, dict(imu_samples(t, rates @ to_sensor, force @ to_sensor, gyro_rate, seed))
