"""A second source of flights for the withheld benchmark: inverse dynamics, with several formulas for every effect.

The vehicle follows its path exactly, and attitude and thrust are what that takes in the air that there is. So there is
no controller and no integrator, and no loop through which an effect could colour the motion otherwise than by its
force. Each effect is written in the ways in which it is met in papers and on real vehicles, most of which the bank
lacks: a drag that grows with the power 1.8 of the speed, a wind that grows with height, a bias that wanders, motors
behind a dead time, a thrust that is off by some newtons instead of per cents.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from depthsim.flight.log import FlightLog
from depthsim.flight.vehicle import Vehicle

Floats = NDArray[np.float64]
Rng = np.random.Generator

RATE, INNER, SECONDS = 100.0, 400.0, 45.0
GRAVITY = np.array([0.0, 0.0, 9.80665])
MASS, RADIUS, ARM, TORQUE = 0.9, 0.1, 0.16, 0.013
INERTIA = np.array([0.009, 0.0095, 0.016])
_SIGNS = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * ARM / np.sqrt(2)
_MIX = np.stack([np.ones(4), _SIGNS[:, 1], -_SIGNS[:, 0], TORQUE * np.array([1, -1, 1, -1])])


@dataclass
class World:
    """What is there beside the vehicle file; all of it neutral.

    air: adds a force in the body [N] from the velocity through the air in the body (n, 3), the thrust (n,) and the
    height (n,). wind: (n, 3) [m/s] from time and place. lift: factor on the thrust by height. recorded: what the log
    calls thrust (n, 4), from what the rotors make. sensor: what the accelerometer reads, from time and force.
    late: seconds that imu, thrust or poses are late by, from
    time. variant: which formula of its effect it is.
    """

    mass: float = MASS
    air: list[Callable[[Floats, Floats, Floats], Floats]] = field(default_factory=list)
    wind: Callable[[Floats, Floats], Floats] | None = None
    lift: Callable[[Floats], Floats] | None = None
    recorded: Callable[[Floats, Floats], Floats] | None = None
    uneven: Floats | None = None
    sensor: Callable[[Floats, Floats], Floats] | None = None
    late: dict[str, Callable[[Floats], Floats]] = field(default_factory=dict)
    variant: int = 0


def path(rng: Rng, kind: str, t: Floats) -> tuple[Floats, str]:
    """(n, 3) places, and what was flown in words."""
    speed, phase = float(rng.uniform(2, 15)), rng.uniform(0, 2 * np.pi)
    if kind == "hops":
        return _hops(rng, t), "hops"
    hard = rng.uniform(2, 6)
    size = max(speed**2 / hard, 1.0)
    progress = np.cumsum(np.clip(t / 4, 0, 1) ** 2 * (3 - 2 * np.clip(t / 4, 0, 1))) / INNER
    climb = rng.uniform(0.2, 0.5) * min(size, 3.0)
    if kind == "circle":
        u = speed / size * progress
        flat = size * np.stack([np.cos(u + phase), np.sin(u + phase)], axis=1)
    elif kind == "lemniscate":
        u = speed / (1.5 * size) * progress
        scale = 1.3 * size / (1 + np.sin(u + phase) ** 2)
        flat = np.stack([scale * np.cos(u + phase), scale * np.sin(u + phase) * np.cos(u + phase)], axis=1)
    else:
        u = speed / size * progress
        flat = size * np.sin(u)[:, None] * np.array([np.cos(phase), np.sin(phase)])
    z = 1.2 * climb + 0.4 + climb * np.sin(rng.uniform(0.5, 0.8) * u + phase)
    return np.column_stack([flat, z]), f"{kind} {speed:.0f} m/s"


def _hops(rng: Rng, t: Floats) -> Floats:
    stops = np.cumsum(rng.uniform(1.8, 3.0, 40))
    places = np.column_stack([np.cumsum(rng.normal(0, 0.7, (41, 2)), axis=0), rng.uniform(0.1, 1.1, 41)])
    held = places[np.searchsorted(stops, t)]
    return np.asarray(gaussian_filter1d(held, 0.3 * INNER, axis=0, mode="nearest"))


def heading(rng: Rng, t: Floats, velocity: Floats | None) -> Floats:
    """(n,) [rad]: fixed, turning, or along the path where it never goes back on itself."""
    kind = rng.integers(2 if velocity is None else 3)
    if kind == 0:
        return np.full(len(t), rng.uniform(-3, 3))
    if kind == 1:
        return np.asarray(rng.uniform(-3, 3) + 0.6 * np.sin(rng.uniform(0.2, 0.5) * t) + rng.uniform(-0.3, 0.3) * t)
    assert velocity is not None
    slow = gaussian_filter1d(velocity[:, :2], 0.4 * INNER, axis=0)
    return np.unwrap(np.arctan2(slow[:, 1], slow[:, 0] + 0.3))


def fly(rng: Rng, kind: str, base: Callable[[Floats, Floats], Floats], world: World) -> tuple[FlightLog, str]:
    """A log of 45 s, and the path in words. base: the drag in the vehicle file [N], from velocity and thrust."""
    t = np.arange(round((SECONDS + 2) * INNER)) / INNER
    place, words = path(rng, kind, t)
    velocity = np.gradient(place, 1 / INNER, axis=0)
    push = world.mass * (np.gradient(velocity, 1 / INNER, axis=0) + GRAVITY)
    yaw = heading(rng, t, velocity if kind in ("circle", "lemniscate") else None)
    wind = np.zeros_like(place) if world.wind is None else world.wind(t, place)
    turn, air_force = _attitude(push, yaw), np.zeros_like(place)
    for _ in range(6):
        lifted = np.linalg.norm(push - turn.apply(air_force), axis=1)
        air = turn.apply(velocity - wind, inverse=True)
        air_force = base(air, lifted) + sum((force(air, lifted, place[:, 2]) for force in world.air), np.zeros(3))
        turn = _attitude(push - turn.apply(air_force), yaw)
    force = turn.apply(push, inverse=True)
    lifted = force[:, 2] - air_force[:, 2]
    spin = turn.as_matrix()
    rates = _rates(turn)
    moments = INERTIA * np.gradient(gaussian_filter1d(rates, 4, axis=0), 1 / INNER, axis=0)
    moments += np.cross(rates, INERTIA * rates)
    total = lifted if world.lift is None else lifted / world.lift(place[:, 2])
    thrusts = np.linalg.solve(_MIX, np.vstack([total, moments.T])).T
    logged = thrusts if world.uneven is None else thrusts / world.uneven
    logged = logged if world.recorded is None else world.recorded(t, logged)
    force = force / world.mass
    force = force if world.sensor is None else world.sensor(t, force)
    columns = {
        "place": place, "velocity": velocity, "spin": spin.reshape(-1, 9), "rates": rates, "thrust": logged,
        "imu": force,
    }  # fmt: skip
    return _log(rng, t, columns, world), words


def _log(rng: Rng, t: Floats, columns: dict[str, Floats], world: World) -> FlightLog:
    out = np.arange(round(SECONDS * RATE)) / RATE
    taken = {}
    for name, column in columns.items():
        late = world.late.get({"imu": "imu", "thrust": "thrust"}.get(name, "poses"), np.zeros_like)
        at = out + 1.0 - late(out)
        taken[name] = np.stack([np.interp(at, t, one) for one in column.T], axis=1)
    n = len(out)
    size = rng.uniform(0.3, 1.5)
    turn = Rotation.from_matrix(taken["spin"].reshape(-1, 3, 3))
    turn = turn * Rotation.from_rotvec(rng.normal(0, 0.002 * size, (n, 3)))
    thrusts = taken["thrust"] + rng.normal(0, 0.01 * size, (n, 4))
    return FlightLog(
        t=out,
        position=taken["place"] + rng.normal(0, 0.004 * size, (n, 3)),
        velocity=taken["velocity"] + rng.normal(0, 0.015 * size, (n, 3)),
        quaternion=turn.as_quat(),
        rates=taken["rates"] + rng.normal(0, 0.01 * size, (n, 3)),
        rotor_thrusts=thrusts,
        specific_force=taken["imu"] + rng.normal(0, 0.15 * size, (n, 3)),
        source="inverse",
    )


def _attitude(up: Floats, yaw: Floats) -> Rotation:
    z = up / np.linalg.norm(up, axis=1, keepdims=True)
    along = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=1)
    y = np.cross(z, along)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=2))


def _rates(turn: Rotation) -> Floats:
    steps = (turn[:-2].inv() * turn[2:]).as_rotvec() * INNER / 2
    return np.vstack([steps[:1], steps, steps[-1:]])


# The drag that the vehicle file knows, in the file's words and as a force.
BASES: tuple[tuple[dict[str, object], Callable[[Floats, Floats], Floats]], ...] = (
    ({"law": "linear", "D": [0.25, 0.25, 0.0]}, lambda v, _: -0.25 * v * np.array([1, 1, 0])),
    ({"law": "linear", "D": [0.3, 0.2, 0.15]}, lambda v, _: -v * np.array([0.3, 0.2, 0.15])),
    (
        {"law": "rotor_sqrt", "c_d1": 0.045},
        lambda v, thrust: -0.045 * 2 * np.sqrt(thrust)[:, None] * v * np.array([1, 1, 0]),
    ),
)


def vehicle(drag: dict[str, object]) -> Vehicle:
    """The vehicle file of all these flights."""
    rotors = {
        "count": 4, "arm": ARM, "radius": RADIUS, "motor_time_constant": 0.025, "torque_ratio": TORQUE,
        "max_thrust": 15,
    }  # fmt: skip
    keys = {"name": "inverse", "mass": MASS, "inertia": INERTIA.tolist(), "rotors": rotors, "drag": drag}
    return Vehicle.model_validate(keys)


def _one_of(r: Rng, *worlds: Callable[[], World]) -> World:
    which = int(r.integers(len(worlds)))
    world = worlds[which]()
    world.variant = which
    return world


def _level(v: Floats) -> Floats:
    return v * np.array([1.0, 1.0, 0.0])


def _size(v: Floats) -> Floats:
    return np.linalg.norm(v, axis=1, keepdims=True)


def _air(force: Callable[[Floats, Floats, Floats], Floats]) -> World:
    return World(air=[force])


def rotor_drag(r: Rng, k: float) -> World:
    """By the rotors' thrust, linear and uneven, in proportion to thrust, and levelling off at speed."""
    d = 0.22 * k
    return _one_of(
        r,
        lambda: _air(lambda v, thrust, _: -d / 3 * np.sqrt(thrust)[:, None] * _level(v)),
        lambda: _air(lambda v, *_: -v * np.array([d, 0.65 * d, 0])),
        lambda: _air(lambda v, thrust, _: -d / 9 * thrust[:, None] * _level(v)),
        lambda: _air(lambda v, *_: -d * _level(v) / np.sqrt(1 + (_size(v) / 25) ** 2)),
    )


def body_drag(r: Rng, k: float) -> World:
    """Along the wind, face by face, with the power 1.8, and with an area that depends on the direction."""
    c = 0.02 * k
    return _one_of(
        r,
        lambda: _air(lambda v, *_: -c * _size(v) * v),
        lambda: _air(lambda v, *_: -c * np.abs(v) * v * np.array([1.0, 1.4, 2.5])),
        lambda: _air(lambda v, *_: -1.4 * c * _size(v) ** 0.8 * v),
        lambda: _air(lambda v, *_: -c * (1 + 1.5 * np.abs(v[:, 2:]) / (_size(v) + 0.1)) * _size(v) * v),
    )


def _direction(r: Rng) -> Floats:
    angle = r.uniform(0, 2 * np.pi)
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def constant_wind(r: Rng, k: float) -> World:
    """The same everywhere, sheared in a straight line, and by the power 1/7 of the height."""
    w = 2.5 * k * _direction(r)
    return _one_of(
        r,
        lambda: World(wind=lambda t, p: np.tile(w, (len(t), 1))),
        lambda: World(wind=lambda t, p: w * (0.6 + 0.1 * p[:, 2:])),
        lambda: World(wind=lambda t, p: w * (np.maximum(p[:, 2:], 0.05) / 2) ** (1 / 7)),
    )


def gusting_wind(r: Rng, k: float) -> World:
    """Smoothed noise of two lengths, single gusts of 1 - cos, and sines beside a mean wind."""

    def noise(t: Floats, _: Floats) -> Floats:
        raw = np.random.default_rng(seed).normal(size=(len(t), 3))
        smooth = gaussian_filter1d(raw, length * INNER, axis=0)
        return np.asarray(1.5 * k * smooth / smooth.std() * np.array([1, 1, 0]))

    def single(t: Floats, _: Floats) -> Floats:
        own = np.random.default_rng(seed)
        wind = np.zeros((len(t), 3))
        for start in np.cumsum(own.uniform(2, 6, 20)):
            wide = own.uniform(1.5, 4)
            inside = np.clip((t - start) / wide, 0, 1)
            wind += 2 * k * own.uniform(0.6, 1.4) * _direction(own) * (0.5 - 0.5 * np.cos(2 * np.pi * inside))[:, None]
        return wind

    def sines(t: Floats, _: Floats) -> Floats:
        own = np.random.default_rng(seed)
        wind = np.zeros((len(t), 3)) + 1.0 * k * _direction(own)
        for f in own.uniform(0.04, 0.4, 5):
            wind += 0.9 * k * np.sin(2 * np.pi * f * t + own.uniform(0, 6))[:, None] * _direction(own)
        return wind

    seed, length = int(r.integers(2**31)), r.uniform(0.5, 1.5)
    return _one_of(r, lambda: World(wind=noise), lambda: World(wind=single), lambda: World(wind=sines))


def thrust_scale(r: Rng, k: float) -> World:
    """In proportion, by some newtons, growing with the thrust, and falling as a battery does."""
    sign = r.choice([-1, 1])
    e = 0.04 * k * sign
    return _one_of(
        r,
        lambda: World(recorded=lambda t, made: made / (1 + e)),
        lambda: World(recorded=lambda t, made: made - e * MASS * 9.8 / 4),
        lambda: World(recorded=lambda t, made: made / (1 + e * made / 2.2)),
        lambda: World(recorded=lambda t, made: made / (1 - abs(e) * (0.4 + 1.6 * t / SECONDS))[:, None]),
    )


def _ahead(t: Floats, made: Floats, seconds: float) -> Floats:
    return np.stack([np.interp(t + seconds, t, one) for one in made.T], axis=1)


def thrust_lag(r: Rng, k: float) -> World:
    """The log has commands: ahead by a first-order lag, a dead time, both, or two lags in a row."""
    s = 0.03 + 0.03 * k
    slope = lambda made, order=1: np.gradient(made, 1 / INNER, axis=0) if order == 1 else slope(slope(made))  # noqa: E731
    return _one_of(
        r,
        lambda: World(recorded=lambda t, made: made + s * slope(made)),
        lambda: World(recorded=lambda t, made: _ahead(t, made, s)),
        lambda: World(recorded=lambda t, made: _ahead(t, made + 0.6 * s * slope(made), 0.4 * s)),
        lambda: World(recorded=lambda t, made: made + s * slope(made) + (s / 2) ** 2 * slope(made, 2)),
    )


def ground_effect(r: Rng, k: float) -> World:
    """Hayden's fit, a power of the height, an exponential, and a straight line below three radii."""
    a = min(0.25 * k, 0.5)
    return _one_of(
        r,
        lambda: World(
            lift=lambda h: 1 + k * ((0.9926 + 0.03794 * (2 * RADIUS / np.maximum(h, 0.08)) ** 2) ** (2 / 3) - 0.995)
        ),
        lambda: World(lift=lambda h: 1 + a * (0.12 / np.maximum(h, 0.12)) ** 1.5),
        lambda: World(lift=lambda h: 1 + a * np.exp(-np.maximum(h, 0) / 0.2)),
        lambda: World(lift=lambda h: 1 + a * np.clip(1 - h / 0.45, 0, 1)),
    )


def vertical_damping(r: Rng, k: float) -> World:
    """Linear, with the rotors' thrust, with the square, and stronger up than down."""
    d = 0.4 * k
    up = np.array([0.0, 0.0, 1.0])
    return _one_of(
        r,
        lambda: _air(lambda v, *_: -d * v * up),
        lambda: _air(lambda v, thrust, _: -d / 9 * thrust[:, None] * v * up),
        lambda: _air(lambda v, *_: -0.5 * d * np.abs(v[:, 2:]) ** 0.5 * v * up),
        lambda: _air(lambda v, *_: -d * np.where(v[:, 2:] > 0, 1.3, 0.7) * v * up),
    )


def mass(r: Rng, k: float) -> World:
    """More, or less."""
    return World(mass=MASS * (1 + 0.05 * k * r.choice([-1, 1])))


def imu_bias(r: Rng, k: float) -> World:
    """Constant, a ramp, a random walk, and one that converges as the sensor warms up."""
    way = r.normal(size=3)
    way *= 0.2 * k / np.linalg.norm(way)
    seed = int(r.integers(2**31))

    def walk(t: Floats, f: Floats) -> Floats:
        own = np.random.default_rng(seed)
        steps = np.cumsum(own.normal(size=(len(t), 3)), axis=0) / np.sqrt(len(t))
        return np.asarray(f + way + 0.6 * np.linalg.norm(way) * steps)

    return _one_of(
        r,
        lambda: World(sensor=lambda t, f: f + way),
        lambda: World(sensor=lambda t, f: f + way * (0.3 + 1.4 * t / SECONDS)[:, None]),
        lambda: World(sensor=walk),
        lambda: World(sensor=lambda t, f: f + way * (1.5 - np.exp(-t / 12))[:, None]),
    )


def imu_misalignment(r: Rng, k: float) -> World:
    """Turned about any axis, or tilted only."""
    way = r.normal(size=3) * ([1, 1, 1] if r.random() < 0.5 else [1, 1, 0])
    turn = Rotation.from_rotvec(0.03 * k * way / np.linalg.norm(way))
    return World(sensor=lambda t, f: np.asarray(turn.apply(f)))


def log_time_offset(r: Rng, k: float) -> World:
    """Accelerometer late or early, thrust late, poses late, and a clock that runs slow."""
    s = 0.03 * k * r.choice([-1, 1])
    return _one_of(
        r,
        lambda: World(late={"imu": lambda t: np.full_like(t, s)}),
        lambda: World(late={"thrust": lambda t: np.full_like(t, -abs(s))}),
        lambda: World(late={"poses": lambda t: np.full_like(t, s)}),
        lambda: World(late={"imu": lambda t: s * (0.5 + t / SECONDS)}),
    )


def rotor_thrust_difference(r: Rng, k: float) -> World:
    """One rotor weak, two across weak, or each its own."""
    one = np.ones(4)
    kind = r.integers(3)
    if kind == 0:
        one[r.integers(4)] -= 0.08 * k
    elif kind == 1:
        one[r.integers(2) :: 2] -= 0.06 * k
    else:
        one += 0.06 * k * r.uniform(-1, 1, 4)
    return World(uneven=one, variant=int(kind))


EFFECTS: dict[str, Callable[[Rng, float], World]] = {
    "rotor_drag": rotor_drag,
    "body_drag_quadratic": body_drag,
    "constant_wind": constant_wind,
    "gusting_wind": gusting_wind,
    "thrust_scale": thrust_scale,
    "thrust_lag": thrust_lag,
    "ground_effect": ground_effect,
    "vertical_damping": vertical_damping,
    "mass": mass,
    "imu_bias": imu_bias,
    "imu_misalignment": imu_misalignment,
    "log_time_offset": log_time_offset,
    "rotor_thrust_difference": rotor_thrust_difference,
}
"""Of each effect what makes its world, from a generator and a strength (1 is medium)."""
