"""The thrust map: from motor commands and battery, or rotor speeds, to thrust over mass.

A log without a force sensor shows thrust only through the accelerometer, so thrust over mass is what can be found; the
thrust itself needs the mass from elsewhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthsim.errors import InputError
from depthsim.flight.fit.motion import Motion, low_pass
from depthsim.flight.fit.sums import DRAWS, Sums
from depthsim.flight.log import FlightLog
from depthsim.flight.table import Floats

_FULL = 65535
_BATTERY_CUTOFF = 0.3
"""[Hz]; the gauge's own noise and lag would otherwise enter the map. On NanoBench this takes 15 % off its error."""
_BATTERY_POWERS = (0.0, 0.25, 0.5, 0.75, 1.0)
_ROUNDS = 30


@dataclass(frozen=True)
class Input:
    """What the map starts from: rotor speeds [rad/s], or pwm / 65535 · (battery / reference)^power."""

    kind: str
    reference: float = 1.0
    power: float = 0.0

    @property
    def formula(self) -> str:
        """In words."""
        if self.kind == "speed":
            return "speed [rad/s]"
        battery = f" · (battery / {self.reference:.2f} V)^{self.power:g}" if self.power else ""
        return f"pwm / {_FULL}{battery}"

    def of(self, log: FlightLog) -> Floats:
        """(N, K) of each rotor."""
        columns = log.rotor_columns("omega" if self.kind == "speed" else "pwm")
        assert columns is not None
        if self.kind == "speed":
            return columns
        if not self.power:
            return columns / _FULL
        battery = low_pass(log.extras["battery"], (len(log) - 1) / log.duration, _BATTERY_CUTOFF)
        return columns / _FULL * (battery[:, None] / self.reference) ** self.power


@dataclass(frozen=True)
class ThrustMap:
    """Thrust of a rotor over the mass = s Σ_p coefficients[p] · inputᵖ [m/s²], p from ``powers``.

    scales: (flights,) s of each flight, mean 1: battery, propellers and the accelerometer's own scale. hover: the mean
    input in the air. error, scaled_error: RMSE of the specific force along z [m/s²] on flights that the map was not
    fitted on, with s = 1 and with their own s; None from one flight.
    """

    input: Input
    powers: tuple[int, ...]
    coefficients: Floats
    ci95: tuple[Floats, Floats]
    scales: Floats
    hover: float
    error: float | None
    scaled_error: float | None

    def specific_thrusts(self, log: FlightLog) -> Floats:
        """(N, K) thrust of each rotor over the mass [m/s²], at scale 1."""
        inputs = self.input.of(log)
        return np.stack([inputs**power for power in self.powers], axis=-1) @ self.coefficients

    def scale_of(self, motion: Motion) -> float:
        """s of any flight."""
        total = motion.smooth(self.specific_thrusts(motion.log).sum(axis=1))
        return float(total @ motion.force[:, 2] / (total @ total))

    def curve(self, mass: float) -> tuple[str, float, tuple[float, ...]]:
        """Input, full scale and coefficients [N] of vehicle.yaml's thrust curve, at the reference battery."""
        values = dict(zip(self.powers, (mass * self.coefficients).tolist(), strict=True))
        full = 1.0 if self.input.kind == "speed" else float(_FULL)
        return self.input.kind, full, tuple(values.get(power, 0.0) for power in range(max(self.powers) + 1))


def fit_thrust_map(motions: Sequence[Motion]) -> ThrustMap | None:
    """The map of some flights, or None where they have no motor input.

    Thrust grows with the square of a rotor's speed, and with a straight and a square part of a motor's command. How
    much of the battery's voltage arrives is a power of it, 0 to 1: the one that does best on unseen flights, whose own
    scales are not known; 1 from a single flight. Drag along z is left out: it is far below the map's error.
    """
    inputs = _inputs(motions)
    if not inputs:
        return None
    powers = (2,) if inputs[0].kind == "speed" else (1, 2)
    tried = [(given, _blocks(motions, given, powers)) for given in inputs]
    errors = [_unseen(blocks) if len(motions) > 1 else (None, None) for _, blocks in tried]
    best = min(range(len(tried)), key=lambda index: errors[index][0] or 0.0)
    given, blocks = tried[best]
    coefficients, scales = _solve(Sums.stacked([flight.total() for flight in blocks]))
    half = _spread(blocks)
    hover = float(np.mean([given.of(motion.log)[motion.airborne].mean() for motion in motions]))
    interval = (coefficients - half, coefficients + half)
    return ThrustMap(given, powers, coefficients, interval, scales, hover, *errors[best])


def _inputs(motions: Sequence[Motion]) -> list[Input]:
    """What the map can start from in all of the flights."""
    extras = [motion.log.extras for motion in motions]
    if all("omega1" in extra for extra in extras):
        return [Input("speed")]
    if not all("pwm1" in extra for extra in extras):
        return []
    if not all("battery" in extra and extra["battery"].min() > 0 for extra in extras):
        return [Input("pwm")]
    volts = float(np.mean([motion.log.extras["battery"][motion.airborne].mean() for motion in motions]))
    return [Input("pwm", volts, power) for power in (_BATTERY_POWERS if len(motions) > 1 else (1.0,))]


def _blocks(motions: Sequence[Motion], given: Input, powers: tuple[int, ...]) -> list[Sums]:
    blocks = []
    for motion in motions:
        inputs = given.of(motion.log)
        columns = motion.smooth(np.stack([(inputs**power).sum(axis=1) for power in powers], axis=1))
        if not columns.any():
            fix = "leave the column out, or give a log of a flight"
            raise InputError(motion.log.source, f"{given.kind}1", "is 0 throughout", fix)
        force = motion.force[:, 2:]
        blocks.append(Sums.of_blocks(force, columns[:, None, :], np.ones_like(force), motion.rate))
    return blocks


def _solve(flights: Sums) -> tuple[Floats, Floats]:
    """Coefficients (P,) and scales (flights,) in turns, each by least squares with the other held."""
    matrix, vector = flights.xx[:, 0], flights.xy[:, 0]
    scales, coefficients = np.ones(len(vector)), np.zeros(vector.shape[1])
    for _ in range(_ROUNDS):
        normal = np.tensordot(scales**2, matrix, axes=1)
        coefficients = np.asarray(np.linalg.lstsq(normal, scales @ vector, rcond=None)[0], dtype=np.float64)
        scales = vector @ coefficients / (matrix @ coefficients @ coefficients)
        scales = scales / scales.mean()
    return coefficients, scales


def _unseen(blocks: Sequence[Sums]) -> tuple[float, float]:
    """RMSE over flights left out in turn, at scale 1 and at their own scale."""
    totals = Sums.stacked([flight.total() for flight in blocks])
    squares = np.zeros(2)
    for index in range(len(blocks)):
        coefficients, _ = _solve(totals[np.arange(len(blocks)) != index])
        own = totals[np.array([index])]
        size, along = own.xx[0, 0] @ coefficients @ coefficients, own.xy[0, 0] @ coefficients
        squares += own.yy[0, 0] + np.array([size - 2 * along, -(along**2) / size])
    plain, scaled = np.sqrt(squares / totals.n.sum())
    return float(plain), float(scaled)


def _spread(blocks: Sequence[Sums]) -> Floats:
    """Half of the 95 % intervals: a bootstrap over blocks within flights, or over flights from five on."""
    from scipy.special import stdtrit

    generator = np.random.Generator(np.random.Philox(key=1))
    totals = Sums.stacked([flight.total() for flight in blocks])
    found = []
    for _ in range(DRAWS // 5):
        if len(blocks) >= 5:
            weights = np.bincount(generator.integers(len(blocks), size=len(blocks)), minlength=len(blocks))
            drawn = totals[np.repeat(np.arange(len(blocks)), weights)]
        else:
            parts = [flight.weighted(_draw(generator, len(flight))) for flight in blocks]
            drawn = Sums.stacked(parts)
        found.append(_solve(drawn)[0])
    units = len(blocks) if len(blocks) >= 5 else sum(map(len, blocks)) - len(blocks) + 1
    return np.asarray(stdtrit(units - 1, 0.975) * np.std(found, axis=0, ddof=1) * np.sqrt(units / (units - 1)))


def _draw(generator: np.random.Generator, units: int) -> Floats:
    return generator.multinomial(units, np.full(units, 1 / units)).astype(float)
