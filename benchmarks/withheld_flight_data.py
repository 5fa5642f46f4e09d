"""Flights for the withheld benchmark: a multirotor, a controller and an integrator of their own.

Nothing here calls the flight model or the diagnosis: the forces are written down anew, most of them by other formulas
than the bank's, so that the diagnosis is not asked about data from its own formulas (the inverse crime).

Semi-implicit Euler at 1 kHz, rotations by their exponential; a cascade of P and PD loops flies the path. The log is at
100 Hz with noise on every channel.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from depthsim.flight.log import FlightLog

Floats = NDArray[np.float64]

G = 9.80665
DT = 1e-3
EVERY = 10
SECONDS = 45.0
MASS, ARM, RADIUS, TORQUE = 1.2, 0.2, 0.12, 0.016
INERTIA = np.array([0.015, 0.016, 0.028])
BASE_DRAG = 0.28
"""[N/(m/s)] along body x and y; what the vehicle file has too, unless drag is what is withheld."""
MOTOR_LAG = 0.03
PATHS = ("circle", "lemniscate", "shuttle", "hops", "hover")

# Places of the truth's numbers in the kernel's array.
(
    _MASS, _DRAG_X, _DRAG_Y, _DRAG_OMEGA, _DRAG_THRUST, _QUAD_X, _QUAD_Y, _QUAD_Z, _QUAD_ALL, _CLIMB, _CLIMB_THRUST,
    _GROUND_CB, _GROUND_EXP, _GROUND_HEIGHT, _LAG, _LAG_ORDER, _EQ12, _SIZE,
) = range(18)  # fmt: skip


@dataclass(frozen=True)
class Truth:
    """What the world does that the vehicle file may not know of; neutral by default.

    numbers: of the kernel, by name. wind: (M, 3) the air's velocity each 10 ms [m/s]. rotors: of the thrust that each
    makes over what the log says. bias: of the accelerometer [m/s²]. tilt: rotation vector of the accelerometer [rad].
    late: seconds that the accelerometer's (``imu``) or the thrust's (``thrust``) samples are late by.
    """

    numbers: dict[str, float] = field(default_factory=dict)
    wind: Floats | None = None
    rotors: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tilt: tuple[float, float, float] = (0.0, 0.0, 0.0)
    late: dict[str, float] = field(default_factory=dict)
    logs_command: bool = False
    extra: str = ""

    def plus(self, other: "Truth") -> "Truth":
        """Both at once."""
        wind = self.wind if other.wind is None else other.wind if self.wind is None else self.wind + other.wind
        return Truth(
            {**self.numbers, **other.numbers},
            wind,
            tuple(a * b for a, b in zip(self.rotors, other.rotors, strict=True)),
            tuple(a + b for a, b in zip(self.bias, other.bias, strict=True)),
            tuple(a + b for a, b in zip(self.tilt, other.tilt, strict=True)),
            {**self.late, **other.late},
            self.logs_command or other.logs_command,
        )


@dataclass(frozen=True)
class Path:
    """What is flown. kind: of PATHS. speed: the greatest [m/s]. size [m], height [m], climb: vertical amplitude [m]."""

    kind: str
    speed: float
    size: float
    height: float
    climb: float
    turning: bool
    phase: float

    def points(self, t: Floats) -> Floats:
        """(N, 3) places."""
        if self.kind == "hops":
            return self._hops(t)
        if self.kind == "hover":  # it keeps its place, and goes to look at another one now and then
            places = np.sin(0.11 * t[:, None] + [self.phase, 2 * self.phase, 3 * self.phase])
            return np.asarray([0.0, 0.0, self.height] + self.size * places**3)
        ramp = np.minimum(t / 3.0, 1.0)
        eased = np.cumsum(ramp * ramp * (3 - 2 * ramp)) * (t[1] - t[0])
        a, s, up = self.size, self.phase, self.climb
        if self.kind == "circle":
            u = self.speed / a * eased
            xy = np.stack([a * np.cos(u + s), a * np.sin(u + s)], axis=1)
        elif self.kind == "lemniscate":
            u = self.speed / (1.42 * a) * eased
            xy = np.stack([a * np.sin(u + s), 0.5 * a * np.sin(2 * (u + s))], axis=1)
        else:
            u = self.speed / a * eased
            along = a * np.sin(u + s)
            xy = np.stack([along * np.cos(s), along * np.sin(s)], axis=1)
        z = self.height + up * np.sin(0.73 * u + 2 * s)
        return np.column_stack([xy, z])

    def _hops(self, t: Floats) -> Floats:
        """From place to place, low, with rests in between; each hop goes up and down again."""
        rng = np.random.default_rng(int(self.phase * 1e6))
        hop = 2.6
        count = int(t[-1] / hop) + 2
        stops = np.cumsum(rng.uniform(-1, 1, (count, 2)) * self.size * 0.3, axis=0)
        stops -= stops.mean(axis=0)
        lows = self.height + rng.uniform(0, 0.5, count) * self.climb
        index = np.minimum((t / hop).astype(int), count - 2)
        share = np.clip((t / hop - index) / 0.8, 0, 1)
        ease = share**3 * (10 - 15 * share + 6 * share**2)
        xy = stops[index] + (stops[index + 1] - stops[index]) * ease[:, None]
        z = lows[index] + (lows[index + 1] - lows[index]) * ease + self.climb * (16 * (share * (1 - share)) ** 2)
        return np.column_stack([xy, z])


@dataclass(frozen=True)
class Noise:
    """Standard deviations of a sample [m/s², rad/s, m/s, m, rad]; that of the thrust is relative."""

    accelerometer: float = 0.1
    gyroscope: float = 0.005
    velocity: float = 0.01
    place: float = 0.003
    attitude: float = 0.002
    thrust: float = 0.005


def random_path(rng: np.random.Generator, kind: str, low: bool = False) -> Path:
    """A path that the vehicle can fly, 2 to 15 m/s."""
    speed = float(rng.uniform(2, 15))
    turning, phase = bool(rng.random() < 0.4), float(rng.uniform(0.05, 6.2))
    if kind == "hops":
        return Path(kind, 3.0, float(rng.uniform(2, 6)), float(rng.uniform(0.12, 0.2)), 0.9, turning, phase)
    if kind == "hover":
        return Path(kind, 0.2, float(rng.uniform(0.1, 0.6)), float(rng.uniform(1.5, 3.0)), 0.0, turning, phase)
    size = speed**2 / float(rng.uniform(2.0, 5.0)) + 1.0
    if kind == "lemniscate":
        size *= 1.3
    climb = float(rng.uniform(0.3, 1.2)) * min(size / 4, 2.0)
    return Path(kind, speed, size, climb + (0.3 if low else 3.0), climb, turning, phase)


def flight(path: Path, truth: Truth, noise: Noise, seed: int, name: str = "withheld") -> FlightLog:
    """Fly, and log as the sensors see it."""
    steps = round(SECONDS / DT)
    t = np.arange(steps + 200) * DT
    points = path.points(t)
    velocity = np.gradient(points, DT, axis=0)
    acceleration = np.gradient(velocity, DT, axis=0)
    heading = np.zeros(len(t))
    if path.turning:
        heading = 0.35 * t + 0.5 * np.sin(0.9 * t + path.phase)
    numbers = np.zeros(_SIZE)
    numbers[[_MASS, _DRAG_X, _DRAG_Y, _LAG, _LAG_ORDER]] = MASS, BASE_DRAG, BASE_DRAG, MOTOR_LAG, 1
    for key, value in truth.numbers.items():
        numbers[globals()[f"_{key.upper()}"]] = value
    wind = np.zeros((2, 3)) if truth.wind is None else truth.wind
    out = _fly(points, velocity, acceleration, heading, numbers, wind, np.array(truth.rotors), INERTIA, steps)
    return _as_logged(out, truth, noise, seed, name)


def _as_logged(out: Floats, truth: Truth, noise: Noise, seed: int, name: str) -> FlightLog:
    rng = np.random.default_rng([seed, 77])
    n = len(out)
    t = np.round(np.arange(n) * DT * EVERY, 6)
    place, v, q, w = out[:, 0:3], out[:, 3:6], out[:, 6:10], out[:, 10:13]
    thrusts = out[:, 20:24] if truth.logs_command else out[:, 13:17]
    force = out[:, 17:20]
    turn = _exp(np.array(truth.tilt))
    force = force @ turn.T + np.array(truth.bias)
    force, w = _late(t, force, truth.late.get("imu", 0.0)), _late(t, w, truth.late.get("imu", 0.0))
    thrusts = _late(t, thrusts, truth.late.get("thrust", 0.0))
    small = rng.normal(size=(n, 3)) * noise.attitude / 2
    q = _product(q, np.column_stack([small, np.ones(n)]))
    log = FlightLog(
        t=t,
        velocity=v + noise.velocity * rng.normal(size=v.shape),
        quaternion=q / np.linalg.norm(q, axis=1, keepdims=True),
        rates=w + noise.gyroscope * rng.normal(size=w.shape),
        position=place + noise.place * rng.normal(size=place.shape),
        rotor_thrusts=thrusts * (1 + noise.thrust * rng.normal(size=thrusts.shape)),
        specific_force=force + noise.accelerometer * rng.normal(size=force.shape),
        source=name,
    )
    return log.select(slice(50, None))


def with_columns(log: FlightLog, kind: str) -> FlightLog:
    """The log as some other recorder would have it: ``total`` thrust only, or ``no_imu``."""
    if kind == "total":
        assert log.rotor_thrusts is not None
        return replace(log, thrust=log.rotor_thrusts.sum(axis=1), rotor_thrusts=None)
    if kind == "no_imu":
        return replace(log, specific_force=None)
    return log


def _late(t: Floats, values: Floats, seconds: float) -> Floats:
    return values if not seconds else np.stack([np.interp(t - seconds, t, column) for column in values.T], axis=1)


def _product(a: Floats, b: Floats) -> Floats:
    av, aw, bv, bw = a[:, :3], a[:, 3:], b[:, :3], b[:, 3:]
    return np.hstack([aw * bv + bw * av + np.cross(av, bv), aw * bw - (av * bv).sum(axis=1, keepdims=True)])


@njit(cache=True)
def _exp(r):
    angle = np.sqrt(r[0] ** 2 + r[1] ** 2 + r[2] ** 2)
    k = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    if angle < 1e-9:
        return np.eye(3) + k
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * (k @ k)


@njit(cache=True)
def _quaternion(m):
    """Shepperd 1978, by the largest of the four."""
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    q = np.empty(4)
    best = np.argmax(np.array([m[0, 0], m[1, 1], m[2, 2], trace]))
    if best == 3:
        q[:] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1 + trace
    else:
        i, j, k = best, (best + 1) % 3, (best + 2) % 3
        q[i] = 1 + 2 * m[i, i] - trace
        q[j], q[k], q[3] = m[j, i] + m[i, j], m[k, i] + m[i, k], m[k, j] - m[j, k]
    return q / np.sqrt((q**2).sum())


@njit(cache=True)
def _fly(points, velocity, acceleration, heading, c, wind, made, inertia, steps):
    places = ARM * np.sqrt(0.5) * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    spin = np.array([1.0, -1.0, 1.0, -1.0])
    mix = np.empty((4, 4))
    for i in range(4):
        mix[0, i], mix[1, i], mix[2, i], mix[3, i] = 1.0, places[i, 1], -places[i, 0], spin[i] * TORQUE
    unmix = np.linalg.inv(mix)
    mass = c[_MASS]
    p, v = points[0].copy(), velocity[0].copy()
    r, w = np.eye(3), np.zeros(3)
    thrust = np.full(4, MASS * G / 4)
    middle = thrust.copy()
    out = np.empty((steps // EVERY, 24))
    integral = np.zeros(3)
    for n in range(steps):
        # The controller knows the nominal mass and nothing of the air.
        error = points[n] - p
        integral += 0.6 * error * DT
        want = acceleration[n] + 6.0 * error + 3.6 * (velocity[n] - v) + integral
        want[2] += G
        z = want / np.sqrt((want**2).sum())
        c_yaw, s_yaw = np.cos(heading[n]), np.sin(heading[n])
        y = np.empty(3)
        y[0], y[1], y[2] = -z[2] * s_yaw, z[2] * c_yaw, z[0] * s_yaw - z[1] * c_yaw
        y /= np.sqrt((y**2).sum())
        x = np.array([y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]])
        d = np.empty((3, 3))
        d[:, 0], d[:, 1], d[:, 2] = x, y, z
        e = r.T @ d
        off = 0.5 * np.array([e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1]])
        rate = 9.0 * off
        rate[2] *= 0.5
        moment = inertia * (22.0 * (rate - w))
        moment[2] *= 0.4
        lift = MASS * (want[0] * r[0, 2] + want[1] * r[1, 2] + want[2] * r[2, 2])
        command = unmix @ np.array([max(lift, 1.0), moment[0], moment[1], moment[2]])
        command = np.minimum(np.maximum(command, 0.05), 12.0)

        lag = c[_LAG]
        if c[_LAG_ORDER] == 2:
            middle += DT / (0.5 * lag) * (command - middle)
            thrust += DT / (0.5 * lag) * (middle - thrust)
        else:
            thrust += DT / lag * (command - thrust)
        real = thrust * made

        index = min(n // 10, len(wind) - 1)
        air = r.T @ (v - wind[index])
        force = np.zeros(3)
        force[0] -= c[_DRAG_X] * air[0]
        force[1] -= c[_DRAG_Y] * air[1]
        if c[_DRAG_OMEGA] > 0 or c[_DRAG_THRUST] > 0 or c[_EQ12] > 0:
            for i in range(4):
                vx, vy = air[0] - w[2] * places[i, 1], air[1] + w[2] * places[i, 0]
                omega = np.sqrt(max(real[i], 0.0) / 1.0e-5)
                force[0] -= (c[_DRAG_OMEGA] * omega + c[_DRAG_THRUST] * real[i]) * vx
                force[1] -= (c[_DRAG_OMEGA] * omega + c[_DRAG_THRUST] * real[i]) * vy
                force[0] += c[_EQ12] * real[i] * w[2] * places[i, 1]
                force[1] -= c[_EQ12] * real[i] * w[2] * places[i, 0]
        speed = np.sqrt((air**2).sum())
        force[0] -= c[_QUAD_X] * abs(air[0]) * air[0] + c[_QUAD_ALL] * speed * air[0]
        force[1] -= c[_QUAD_Y] * abs(air[1]) * air[1] + c[_QUAD_ALL] * speed * air[1]
        force[2] -= c[_QUAD_Z] * abs(air[2]) * air[2] + c[_QUAD_ALL] * speed * air[2]
        force[2] -= c[_CLIMB] * air[2]
        total = real.sum()
        force[2] -= c[_CLIMB_THRUST] * total * air[2]
        lifted = 1.0
        height = max(p[2], 0.4 * RADIUS)
        if c[_GROUND_CB] > 0:
            lifted = 1.0 / (1.0 - c[_GROUND_CB] * (RADIUS / (4.0 * height)) ** 2)
        lifted += c[_GROUND_EXP] * np.exp(-height / max(c[_GROUND_HEIGHT], 1e-3))
        force[2] += total * lifted

        if n % EVERY == 0:
            row = out[n // EVERY]
            row[0:3], row[3:6], row[6:10], row[10:13] = p, v, _quaternion(r), w
            row[13:17], row[17:20], row[20:24] = thrust, force / mass, command

        turning = mix @ real
        w += DT * (turning[1:] - np.cross(w, inertia * w)) / inertia
        r = r @ _exp(w * DT)
        push = r @ force / mass
        push[2] -= G
        v += DT * push
        p += DT * v
    return out
