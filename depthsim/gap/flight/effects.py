"""The bank of the flight: each effect as one or more formulas, each a change of the model's settings.

The name of an effect says what happens physically; its formulas say it in several ways, since nobody knows which one a
real vehicle follows. Formulas with fewer parameters come first, and go first where two do equally well.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from depthsim.flight.constants import AIR_DENSITY
from depthsim.flight.drag import BODY_QUADRATIC, LINEAR, QUADRATIC, ROTOR_SQRT, THRUST_DIFFERENCE
from depthsim.flight.ground_effect import GroundEffect
from depthsim.gap.flight.model import Settings
from depthsim.gap.flight.record import ACCELEROMETER, Records

Values = Sequence[float]


@dataclass(frozen=True)
class Parameter:
    """A number that a formula has. start: where a fit begins. step: for derivatives. low, high: what makes sense."""

    name: str
    unit: str
    start: float
    step: float
    low: float = -np.inf
    high: float = np.inf


@dataclass(frozen=True)
class Formula:
    """One way to write an effect.

    apply: the settings with these values of the parameters. linear: whether the force is linear in them.
    """

    effect: str
    name: str
    parameters: tuple[Parameter, ...]
    apply: Callable[[Settings, Values], Settings]
    linear: bool = True

    @property
    def starts(self) -> list[float]:
        """Where a fit begins."""
        return [parameter.start for parameter in self.parameters]


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
_DRAG = "N s/m"
UNEVEN = "rotors uneven"
_EVEN = 0.01
"""Of the mean thrust: rotors that differ by less are alike."""
_HALF_RHO = 0.5 * AIR_DENSITY


def bank(records: Records, base: Settings, without: Sequence[str] = ()) -> list[Formula]:
    """The formulas that these logs can be asked about; gusts are no formula and stand in gusts.py."""
    imu = records.channels[0] == ACCELEROMETER
    thrust = 2 in records.axes
    scaled = thrust and records.thrust_from != "the thrust map"
    height = all(part.log.position is not None for part in records.parts)
    found = [*_rotor_drag(base), *_body_drag(base)]
    found.append(Formula("constant_wind", "level", _named(("x", "y"), "m/s", 0.0, 0.2), _wind))
    if scaled:
        found.append(Formula("thrust_scale", "scale", (Parameter("scale", "", 1.0, 0.01, 0.3, 3.0),), _scale))
        mass = Parameter("mass", "kg", base.mass, 0.01 * base.mass, 0.3 * base.mass, 3 * base.mass)
        found.append(Formula("mass", "mass", (mass,), lambda s, v: replace(s, mass=v[0]), linear=False))
    if thrust:
        lag = Parameter("time_constant", "s", 0.03, 0.003, 1e-3, 0.5)
        found.append(Formula("thrust_lag", "first order", (lag,), _lag, linear=False))
        dead = Parameter("dead_share", "", 0.3, 0.1, 0.0, 1.0)
        found.append(Formula("thrust_lag", "first order and dead time", (lag, dead), _lag_and_dead, linear=False))
        vertical = (Parameter("D_z", _DRAG, _law_of(base, "vertical")[2], 0.05, low=0.0),)
        found.append(Formula("vertical_damping", "linear", vertical, _vertical))
    if thrust and height:
        found.extend(_ground())
    if imu:
        count = 3 * base.files
        names = [f"{axis}{number or ''}" for number in range(base.files) for axis in "xyz"]
        bias = tuple(Parameter(name, "m/s²", 0.0, 0.1) for name in names)
        found.append(Formula("imu_bias", "constant", bias[:count], lambda s, v: replace(s, bias=tuple(v))))
        turn = tuple(Parameter(axis, "rad", 0.0, 0.01, -0.5, 0.5) for axis in "xyz")
        apply = lambda s, v: replace(s, rotation=(v[0], v[1], v[2]))  # noqa: E731
        found.append(Formula("imu_misalignment", "small rotation", turn, apply))
        found.append(_offset("accelerometer"))
        if thrust:
            found.append(_offset("recorder"))
    if thrust:
        found.append(_offset("thrust"))
    if records.rotor_by_rotor:
        found.extend(_difference(records))
    return [formula for formula in found if formula.effect not in without]


def _named(names: Sequence[str], unit: str, start: float, step: float) -> tuple[Parameter, ...]:
    return tuple(Parameter(name, unit, start, step) for name in names)


def _law_of(base: Settings, slot: str) -> tuple[float, float, float]:
    return base.laws[slot][1] if slot in base.laws else (0.0, 0.0, 0.0)


def _rotor_drag(base: Settings) -> list[Formula]:
    code, now = base.laws.get("rotor", (ROTOR_SQRT, (0.0, 0.0, 0.0)))
    strength = float(np.sqrt(len(base.scales) * base.mass * 9.8))
    if code == LINEAR:
        lateral = 0.5 * (now[0] + now[1])
        rotor = lateral / strength
    else:
        rotor = now[0]
        lateral = rotor * strength
    along = (now[0], now[1]) if code == LINEAR else (lateral, lateral)
    c, d = 0.02 * 4 / strength, 0.05

    def sqrt(s: Settings, v: Values) -> Settings:
        return s.with_law("rotor", (ROTOR_SQRT, (v[0], 0.0, 0.0)))

    def both(s: Settings, v: Values) -> Settings:
        return s.with_law("rotor", (LINEAR, (v[0], v[0], 0.0)))

    def each(s: Settings, v: Values) -> Settings:
        return s.with_law("rotor", (LINEAR, (v[0], v[1], 0.0)))

    apart = tuple(Parameter(f"D_{name}", _DRAG, start, d, low=0.0) for name, start in zip("xy", along, strict=True))
    return [
        Formula("rotor_drag", "rotor_sqrt", (Parameter("c_d1", "√N s/m", rotor, c, low=0.0),), sqrt),
        Formula("rotor_drag", "linear", (Parameter("D", _DRAG, lateral, d, low=0.0),), both),
        Formula("rotor_drag", "linear, x and y", apart, each),
    ]


def _body_drag(base: Settings) -> list[Formula]:
    _, now = base.laws.get("body", (BODY_QUADRATIC, (0.0, 0.0, 0.0)))
    a = [value / _HALF_RHO for value in now]
    mean = sum(a) / 3

    def formula(name: str, code: int, starts: Sequence[float], places: tuple[int, int, int]) -> Formula:
        names = {1: ("A",), 2: ("A_xy", "A_z"), 3: ("A_x", "A_y", "A_z")}[len(starts)]

        def apply(s: Settings, v: Values) -> Settings:
            c = tuple(_HALF_RHO * v[place] for place in places)
            return s.with_law("body", (code, (c[0], c[1], c[2])))

        parameters = tuple(
            Parameter(each, "m²", start, 0.01, low=0.0) for each, start in zip(names, starts, strict=True)
        )
        return Formula("body_drag_quadratic", name, parameters, apply)

    level = 0.5 * (a[0] + a[1])
    return [
        formula("round body", BODY_QUADRATIC, [mean], (0, 0, 0)),
        formula("round body, z apart", BODY_QUADRATIC, [level, a[2]], (0, 0, 1)),
        formula("box", QUADRATIC, [level, a[2]], (0, 0, 1)),
        formula("box, each axis", QUADRATIC, a, (0, 1, 2)),
        formula("round body, each axis", BODY_QUADRATIC, a, (0, 1, 2)),
    ]


def _wind(s: Settings, v: Values) -> Settings:
    return replace(s, wind=(s.wind[0] + v[0], s.wind[1] + v[1], s.wind[2]))


def _scale(s: Settings, v: Values) -> Settings:
    return replace(s, scales=tuple(scale * v[0] for scale in s.scales))


def _lag(s: Settings, v: Values) -> Settings:
    return replace(s, lag=max(v[0], 0.0))


def _lag_and_dead(s: Settings, v: Values) -> Settings:
    """Lags of higher order begin like a dead time; it is a share of the time constant at most as long."""
    return replace(_lag(s, v), delays={**s.delays, "thrust": s.delays.get("thrust", 0.0) + v[0] * v[1]})


def _vertical(s: Settings, v: Values) -> Settings:
    return s.with_law("vertical", (LINEAR, (0.0, 0.0, v[0])))


def _ground() -> list[Formula]:
    def bennett(s: Settings, v: Values) -> Settings:
        return replace(s, ground=GroundEffect(law="cheeseman_bennett", strength=v[0], height=0.3))

    def exponential(s: Settings, v: Values) -> Settings:
        return replace(s, ground=GroundEffect(law="exponential", strength=v[0], height=max(v[1], 1e-3)))

    strength = Parameter("strength", "", 1.0, 0.3, 0.0, 20.0)
    decay = (Parameter("strength", "", 0.1, 0.02, 0.0, 3.0), Parameter("height", "m", 0.3, 0.02, 0.03, 3.0))
    return [
        Formula("ground_effect", "cheeseman_bennett", (strength,), bennett, linear=False),
        Formula("ground_effect", "exponential", decay, exponential, linear=False),
    ]


def _offset(late: str) -> Formula:
    def apply(s: Settings, v: Values) -> Settings:
        return replace(s, delays={**s.delays, late: v[0]})

    parameter = Parameter("seconds", "s", 0.0, 0.01, -0.5, 0.5)
    return Formula("log_time_offset", f"{late} late", (parameter,), apply, linear=False)


def _difference(records: Records) -> list[Formula]:
    def turning(s: Settings, v: Values) -> Settings:
        return s.with_law("difference", (THRUST_DIFFERENCE, (v[0], 0.0, 0.0)))

    found = [Formula("rotor_thrust_difference", "thrust_difference", (Parameter("c", "s/m", 0.0, 0.02),), turning)]
    pattern = _uneven(records)
    if pattern is not None:

        def each(s: Settings, v: Values) -> Settings:
            return replace(s, scales=tuple(one * (1 + v[0] * p) for one, p in zip(s.scales, pattern, strict=True)))

        share = Parameter("share", "", 0.0, 0.1, -2.0, 3.0)
        found.append(Formula("rotor_thrust_difference", UNEVEN, (share,), each))
    return found


def _uneven(records: Records) -> list[float] | None:
    """How much more or less each rotor would have to push than the log says, for a flight that does not tumble.

    Over a flight the moments add up to nothing, so rotors on a circle push alike on average. Where the log has one of
    them differ for good, that one is made otherwise than the log believes; most of the others are right.
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
    sure = (np.abs(mean - np.median(mean)) > 4 * error + _EVEN).any()
    if not sure:
        return None
    scales = 1 / mean
    return (scales / np.median(scales) - 1).tolist()
