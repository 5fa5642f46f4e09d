"""The axes along which a gap is cut, and what could be learned of it on each.

For every axis there is a scalar that says where a sample lies on it, and columns of a linear correction: whatever force
depends on this axis alone, smoothly and without a thought of physics, is about a sum of these columns.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthsim.flight.constants import GRAVITY
from depthsim.flight.fit.motion import low_pass
from depthsim.flight.table import Floats
from depthsim.gap.config import FlightConfig
from depthsim.gap.flight.data.evidence import Problem
from depthsim.gap.flight.data.records import ACCELEROMETER, Record
from depthsim.gap.flight.data.simulate import Settings

_SLOW = 2.0
"""[Hz] what is learned on is smoothed a little more than the force."""


@dataclass(frozen=True)
class State:
    """What the samples (n,) of all records have beside their force, smoothed.

    velocity: (n, 3) through the air in the body [m/s]. ground: (n, 3) over ground, world. thrust: (n,) over weight.
    slope: (n,) its derivative [1/s]. acceleration, jerk: (n, 3) in the body [m/s², m/s³], by the velocities, or by the
    model where the gap is measured on these.
    rates, spins: (n, 3) [rad/s, rad/s²]. rotations: (n, 3, 3). place: (n, 3) or None. time: (n,) [s].
    """

    velocity: Floats
    ground: Floats
    thrust: Floats
    slope: Floats
    acceleration: Floats
    jerk: Floats
    rates: Floats
    spins: Floats
    rotations: Floats
    place: Floats | None
    time: Floats


@dataclass(frozen=True)
class Axis:
    """An axis. simple: how readily it is named, of two that close as much; unit and words are for people.

    reach: the force [m/s²] up to which what varies on it could make a force vary; where a vehicle hardly moves, what
    moves it is no answer to how it moves.
    """

    name: str
    unit: str
    simple: float
    value: Callable[[State], Floats]
    columns: Callable[[State], Floats]
    reach: Callable[[State], float] = lambda _: np.inf


def state_of(problem: Problem, s: Settings) -> State:
    """The state of all samples under a model."""
    parts = [_part(problem, record, s) for record in problem.records.parts]
    joined: dict[str, Any] = {}
    for name in State.__dataclass_fields__:
        values = [getattr(part, name) for part in parts]
        joined[name] = None if any(value is None for value in values) else np.concatenate(values)
    return State(**joined)


def _part(problem: Problem, record: Record, s: Settings) -> State:
    step = 1 / record.rate

    def slow(columns: Floats) -> Floats:
        return low_pass(columns, record.rate, _SLOW)

    rotations, rows = record.rotations, record.rows
    wind = np.broadcast_to(s.wind_along(record), record.velocity.shape)
    wind = np.einsum("nji,nj->ni", rotations, wind)
    weight = problem.model.vehicle.weight
    thrust = slow(record.thrusts.sum(axis=1) / weight)
    if record.channels[0] == ACCELEROMETER:  # velocities, which are not what the gap is measured on
        moved = slow(np.einsum("nji,nj->ni", rotations, np.gradient(record.log.velocity, step, axis=0)))
    else:
        moved = slow(problem.model.force(record, s)) - slow(GRAVITY * rotations[:, 2])
    rates = slow(record.log.rates)
    return State(
        velocity=slow(record.velocity - wind)[rows],
        ground=slow(record.log.velocity)[rows],
        thrust=thrust[rows],
        slope=np.gradient(thrust, step)[rows],
        acceleration=moved[rows],
        jerk=np.gradient(moved, step, axis=0)[rows],
        rates=rates[rows],
        spins=np.gradient(rates, step, axis=0)[rows],
        rotations=rotations[rows],
        place=slow(record.log.position)[rows] if record.log.position is not None else None,
        time=record.log.t[rows],
    )


def _on(features: Floats, *along: int) -> Floats:
    """(n, 3, k · len(along)): each feature (n, k) as a force along some axes of the body."""
    n, k = features.shape
    out = np.zeros((n, 3, k * len(along)))
    for number, axis in enumerate(along):
        out[:, axis, k * number : k * (number + 1)] = features
    return out


def _speed(state: State) -> Floats:
    v = state.velocity
    size = np.linalg.norm(v, axis=1, keepdims=True)
    each = [_on(np.stack([v[:, a], v[:, a] * np.abs(v[:, a]), v[:, a] * size[:, 0]], axis=1), a) for a in range(3)]
    lifted = np.hstack([size, np.linalg.norm(v[:, :2], axis=1, keepdims=True) ** 2])
    return np.concatenate([*each, _on(lifted, 2)], axis=2)


def _direction(state: State) -> Floats:
    heading = np.arctan2(state.ground[:, 1], state.ground[:, 0])
    waves = np.stack([f(k * heading) for k in (1, 2) for f in (np.cos, np.sin)], axis=1)
    world = np.swapaxes(state.rotations, 1, 2)[:, :, :2]
    return np.concatenate([world, _on(waves, 0, 1, 2)], axis=2)


def _thrust(state: State) -> Floats:
    t = state.thrust - 1
    bend = np.gradient(state.slope) / max(float(np.median(np.diff(state.time))), 1e-6)
    up = np.stack([np.ones_like(t), t, t**2, state.slope, np.clip(bend, -1e3, 1e3)], axis=1)
    return np.concatenate([_on(up, 2), _on(up[:, :2], 0, 1)], axis=2)


def _acceleration(state: State) -> Floats:
    return _on(np.hstack([state.acceleration, state.jerk]), 0, 1, 2)


def _rates(state: State) -> Floats:
    w = state.rates
    products = np.stack([w[:, 0] * w[:, 1], w[:, 1] * w[:, 2], w[:, 2] * w[:, 0], *(w**2).T], axis=1)
    return _on(np.hstack([w, state.spins, products]), 0, 1, 2)


def _altitude(state: State) -> Floats:
    assert state.place is not None
    z = state.place[:, 2]
    knots = np.quantile(z, np.linspace(0, 1, 7))
    knots = np.unique(np.round(knots, 6))
    if len(knots) < 3:
        return _on(np.ones((len(z), 1)), 2)
    hats = np.stack([np.interp(z, knots, row) for row in np.eye(len(knots))], axis=1)
    return _on(hats, 2)


def _place(state: State) -> Floats:
    assert state.place is not None
    xy = state.place[:, :2]
    low, high = np.quantile(xy, 0.02, axis=0), np.quantile(xy, 0.98, axis=0)
    width = np.maximum((high - low) / 3, 0.2)
    centres = [np.linspace(a, b, 4) for a, b in zip(low, high, strict=True)]
    bumps = np.stack(
        [np.exp(-0.5 * (((xy - (x, y)) / width) ** 2).sum(axis=1)) for x in centres[0] for y in centres[1]], axis=1
    )
    world = np.swapaxes(state.rotations, 1, 2)
    return np.concatenate([world[:, :, [axis]] * bumps[:, None, :] for axis in range(3)], axis=2)


def _spread(columns: Floats) -> float:
    """Of a vector (n, 3) about its mean."""
    return float(np.sqrt(columns.var(axis=0).sum()))


def _constant(state: State) -> Floats:
    return _on(np.ones((len(state.time), 1)), 0, 1, 2)


def _bearing(state: State) -> Floats:
    return np.asarray(np.degrees(np.arctan2(state.ground[:, 1], state.ground[:, 0])))


_MOST_DRAG, _MOST_LEVER, _MOST_FIELD = 2.0, 3.0, 1.0
"""[1/s], [m/s], [1/s²] of force over mass for each m/s of speed, rad/s of turning and m of place: some times what any
vehicle has (drag 0.1 to 0.6; a clock 0.1 s late, 1)."""

AXES = (
    Axis("axis", "", 0.0, lambda s: np.zeros(len(s.time)), _constant),
    Axis(
        "speed",
        "m/s",
        0.02,
        lambda s: np.linalg.norm(s.velocity, axis=1),
        _speed,
        lambda s: _MOST_DRAG * _spread(s.ground),
    ),
    Axis("thrust", "of the weight", 0.02, lambda s: s.thrust, _thrust, lambda s: GRAVITY * float(s.thrust.std())),
    Axis("altitude", "m", 0.02, lambda s: s.place[:, 2] if s.place is not None else s.time, _altitude),
    Axis(
        "acceleration",
        "m/s²",
        0.05,
        lambda s: np.linalg.norm(s.acceleration, axis=1),
        _acceleration,
        lambda s: _spread(s.acceleration),
    ),
    Axis(
        "angular_rate",
        "rad/s",
        0.08,
        lambda s: np.linalg.norm(s.rates, axis=1),
        _rates,
        lambda s: _MOST_LEVER * _spread(s.rates),
    ),
    Axis("airspeed_direction", "deg", 0.05, _bearing, _direction, lambda s: _MOST_DRAG * _spread(s.ground)),
    Axis(
        "place",
        "m",
        0.15,
        lambda s: s.place[:, 0] if s.place is not None else s.time,
        _place,
        lambda s: _MOST_FIELD * _spread(s.place) if s.place is not None else 0.0,
    ),
)
"""All but time, which is learned by interpolation (series.py)."""


def axes_of(state: State, config: FlightConfig) -> list[Axis]:
    """Those that the logs have: without places there are two less, and a hover lies on hardly any."""
    low, high = np.percentile(state.velocity, (5, 95), axis=0)
    if (high - low).max() < config.data.hover:
        return [axis for axis in AXES if axis.name in ("axis", "thrust")]
    return [axis for axis in AXES if state.place is not None or axis.name not in ("altitude", "place")]
