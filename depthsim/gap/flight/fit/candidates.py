"""The bank of the flight: each effect as one or more formulas, each a change of the model's settings.

The name of an effect says what happens physically; its formulas say it in several ways, since nobody knows which one a
real vehicle follows. Formulas with fewer parameters come first, and go first where two do equally well.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from depthsim.flight.drag import THRUST_DIFFERENCE
from depthsim.flight.ground_effect import GroundEffect
from depthsim.gap.flight.data.records import ACCELEROMETER, Records
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.fit.candidate import Formula, Parameter, Values
from depthsim.gap.flight.fit.candidates_air import body_drag, rotor_drag, vertical_damping, wind_formulas

EFFECTS = (
    "rotor_drag",
    "body_drag_quadratic",
    "constant_wind",
    "gusting_wind",
    "thrust_scale",
    "thrust_lag",
    "ground_effect",
    "vertical_damping",
    "mass",
    "imu_bias",
    "imu_misalignment",
    "log_time_offset",
    "rotor_thrust_difference",
)
UNEVEN, EACH = "rotors uneven as logged", "each rotor"
_EVEN = 0.01
"""Of the mean thrust: rotors that differ by less are alike."""
_REACH = 8.0
"""Rotor radii: above this no ground effect was ever measured (Sanchez-Cuevas 2017: below 5)."""
_SEEN = 0.02
"""Of the samples at least are that low."""
_KNOTS = 10.0
"""[s] between knots of a bias that wanders."""
_MOST_KNOTS = 45
"""Numbers of such a bias in all; with more logs it costs more than it tells."""


def bank(records: Records, base: Settings, radius: float, without: Sequence[str] = ()) -> list[Formula]:
    """The formulas that these logs can be asked about; gusts are no formula and stand in series.py.

    radius: of a rotor [m].
    """
    imu = records.channels[0] == ACCELEROMETER
    thrust = 2 in records.axes
    scaled = thrust and records.thrust_from != "the thrust map"
    height = all(part.log.position is not None for part in records.parts)
    found = [*rotor_drag(base), *body_drag(base), *wind_formulas(records, base)]
    if scaled:
        found.append(Formula("thrust_scale", "scale", (Parameter("scale", "", 1.0, 0.01, 0.3, 3.0),), _scale))
        mass = Parameter("mass", "kg", base.mass, 0.01 * base.mass, 0.3 * base.mass, 3 * base.mass)
        found.extend(_thrust_formulas(records, base))
        found.append(Formula("mass", "mass", (mass,), lambda s, v: replace(s, mass=v[0]), linear=False))
    if thrust:
        lag = Parameter("time_constant", "s", 0.03, 0.003, 1e-3, 0.5)
        found.append(Formula("thrust_lag", "first order", (lag,), _lag, linear=False))
        late = Parameter("dead_time", "s", 0.03, 0.003, 1e-3, 0.3)
        found.append(Formula("thrust_lag", "dead time", (late,), _dead, linear=False))
        dead = Parameter("dead_share", "", 0.3, 0.1, 0.0, 1.0, shape=True)
        found.append(Formula("thrust_lag", "first order and dead time", (lag, dead), _lag_and_dead, linear=False))
        found.extend(vertical_damping(base))
    if thrust and height and _low(records, radius):
        found.extend(_ground(radius))
    if imu:
        found.extend(_bias(base))
        turn = tuple(Parameter(axis, "rad", 0.0, 0.01, -0.5, 0.5) for axis in "xyz")
        apply = lambda s, v: replace(s, rotation=(v[0], v[1], v[2]))  # noqa: E731
        found.append(Formula("imu_misalignment", "small rotation", turn, apply))
        found.append(_offset("accelerometer"))
        if thrust:
            found.append(_offset("recorder"))
    if thrust:
        found.append(_offset("thrust"))
    if records.rotor_by_rotor:
        found.extend(_difference(records, base))
    return [formula for formula in found if formula.effect not in without]


def _bias(base: Settings) -> list[Formula]:
    """Constant, drifting in a straight line, and wandering between knots."""

    def formula(name: str, knots: int) -> Formula:
        names = [f"{axis}{file or ''} {knot}" for file in range(base.files) for knot in range(knots) for axis in "xyz"]
        parameters = tuple(Parameter(name, "m/s²", 0.0, 0.1) for name in names)
        return Formula("imu_bias", name, parameters, lambda s, v: replace(s, bias=tuple(v)))

    found = [formula("constant", 1), formula("straight line in time", 2)]
    knots = max(round(max(base.seconds) / _KNOTS) + 1, 3)
    if 3 * knots * base.files <= _MOST_KNOTS:
        found.append(formula("wandering", knots))
    return found


def _thrust_formulas(records: Records, base: Settings) -> list[Formula]:
    """Thrust that is off by newtons instead of in proportion, and thrust that fades as the battery empties."""
    rotor = float(np.mean([part.thrusts[part.rows].mean() for part in records.parts]))
    offset = Parameter("offset", "N", base.offset, 0.01 * rotor, -0.7 * rotor, 0.7 * rotor)
    scale, loss = Parameter("scale", "", 1.0, 0.01, 0.3, 3.0), Parameter("loss", "1/s", 0.0, 1e-3, -0.01, 0.01)

    def fading(s: Settings, v: Values) -> Settings:
        return replace(_scale(s, v), fade=s.fade + v[1] / v[0])

    return [
        Formula("thrust_scale", "offset", (offset,), lambda s, v: replace(s, offset=v[0])),
        Formula("thrust_scale", "scale and offset", (scale, offset), lambda s, v: replace(_scale(s, v), offset=v[1])),
        Formula("thrust_scale", "fading", (scale, loss), fading),
    ]


def _law_of(base: Settings, slot: str) -> tuple[float, float, float]:
    return base.laws[slot][1] if slot in base.laws else (0.0, 0.0, 0.0)


def _scale(s: Settings, v: Values) -> Settings:
    return replace(s, scales=tuple(scale * v[0] for scale in s.scales))


def _lag(s: Settings, v: Values) -> Settings:
    return replace(s, lag=max(v[0], 0.0))


def _dead(s: Settings, v: Values) -> Settings:
    return replace(s, delays={**s.delays, "thrust": s.delays.get("thrust", 0.0) + v[0]})


def _lag_and_dead(s: Settings, v: Values) -> Settings:
    """Lags of higher order begin like a dead time; it is a share of the time constant at most as long."""
    return replace(_lag(s, v), delays={**s.delays, "thrust": s.delays.get("thrust", 0.0) + v[0] * v[1]})


def _low(records: Records, radius: float) -> bool:
    """Whether a log goes where there may be a ground effect; from above it a constant force would pass for one."""
    places = [part.log.position[part.rows, 2] for part in records.parts if part.log.position is not None]
    return min(float(np.quantile(place, _SEEN)) for place in places) < _REACH * radius


def _ground(radius: float) -> list[Formula]:
    def bennett(s: Settings, v: Values) -> Settings:
        return replace(s, ground=GroundEffect(law="cheeseman_bennett", strength=v[0], height=0.3))

    def exponential(s: Settings, v: Values) -> Settings:
        return replace(s, ground=GroundEffect(law="exponential", strength=v[0], height=max(v[1], 1e-3)))

    strength = Parameter("strength", "", 1.0, 0.3, 0.0, 20.0)
    height = Parameter("height", "m", 2 * radius, 0.1 * radius, 0.25 * radius, 0.75 * _REACH * radius)
    decay = (Parameter("strength", "", 0.1, 0.02, 0.0, 3.0), height)
    return [
        Formula("ground_effect", "cheeseman_bennett", (strength,), bennett, linear=False),
        Formula("ground_effect", "exponential", decay, exponential, linear=False),
    ]


def _offset(late: str) -> Formula:
    def apply(s: Settings, v: Values) -> Settings:
        return replace(s, delays={**s.delays, late: v[0]})

    parameter = Parameter("seconds", "s", 0.0, 0.01, -0.5, 0.5)
    return Formula("log_time_offset", f"{late} late", (parameter,), apply, linear=False)


def _difference(records: Records, base: Settings) -> list[Formula]:
    def turning(s: Settings, v: Values) -> Settings:
        return s.with_law("difference", (THRUST_DIFFERENCE, (v[0], 0.0, 0.0)))

    found = [Formula("rotor_thrust_difference", "thrust_difference", (Parameter("c", "s/m", 0.0, 0.02),), turning)]
    logged = logged_shares(records)
    if logged is not None:

        def each(s: Settings, v: Values) -> Settings:
            return replace(s, scales=tuple(scale * v[0] / one for scale, one in zip(s.scales, logged, strict=True)))

        found.append(Formula("rotor_thrust_difference", UNEVEN, (Parameter("level", "", 1.0, 0.01, 0.3, 3.0),), each))

    def own(s: Settings, v: Values) -> Settings:
        return replace(s, scales=tuple(scale * one for scale, one in zip(s.scales, v, strict=True)))

    rotors = tuple(Parameter(f"rotor {n}", "", 1.0, 0.01, 0.3, 3.0) for n in range(1, len(base.scales) + 1))
    return [*found, Formula("rotor_thrust_difference", EACH, rotors, own)]


def logged_shares(records: Records) -> list[float] | None:
    """The thrust that the log has of each rotor over the mean one's; None where all are alike.

    Over a flight that does not tumble the moments add up to nothing, so rotors on a circle push alike on average. Where
    the log has them differ for good, they are made otherwise than the log believes, in inverse proportion; how much
    they push together, moments do not say.
    """
    found = []
    for part in records.parts:
        thrusts = part.thrusts[part.rows]
        shares = thrusts / thrusts.mean(axis=1, keepdims=True)
        pieces = np.array_split(shares, max(round(part.seconds / 2.5), 3))
        found.append(np.array([piece.mean(axis=0) for piece in pieces]))
    blocks = np.concatenate(found)
    mean = blocks.mean(axis=0)
    error = blocks.std(axis=0, ddof=1) / np.sqrt(len(blocks))
    sure = (np.abs(mean - 1) > 4 * error + _EVEN).any()
    return mean.tolist() if sure else None
