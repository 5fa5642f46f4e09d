"""The flight model as the diagnosis sees it: from what a log holds to the specific force that it should show.

Every effect is a change of :class:`Settings`. The forces are those of ``depthsim fly``: the same drag laws, the same
ground effect, the same places of the rotors.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from depthsim.flight.drag import drag_force
from depthsim.flight.ground_effect import GroundEffect
from depthsim.flight.measurement import lagged, shifted, turned
from depthsim.flight.table import Floats
from depthsim.flight.vehicle import Vehicle
from depthsim.gap.flight.data.records import ACCELEROMETER, Record

Law = tuple[int, tuple[float, float, float]]
"""A drag law as the kernel has it."""
Course = tuple[tuple[Floats, Floats], ...]
"""Of each log stamps (k,) [s] and values there (k, D), straight lines between."""


@dataclass(frozen=True)
class Settings:
    """All that the effects change.

    mass [kg]. seconds: (F,) of the logs.
    laws: the forces of the air, by the slot they stand in: ``rotor``, ``body``, ``box``, ``vertical`` or ``face``.
    inflow [s/m]: of the thrust, less for each m/s of climb.
    wind: (3,) [m/s]; with ``shear``, a height [m] and an exponent, it is the wind there, by the power law.
    course: what the wind has more along x and y as time goes by [m/s].
    scales: (K,) thrust of each rotor over what the log says; offset [N] and fade [1/s] come before, as in
    ``measurement``. lag [s] of the thrust behind the log, in ``lag_order`` equal steps. ground: None without one.
    bias: (F, B, 3) of the accelerometer in each log [m/s²], B values evenly over the log's time, straight between.
    rotation: rotation vector of the accelerometer against the body [rad].
    delays [s]: by what lags behind: ``accelerometer``, ``thrust``, or ``recorder`` (both of them behind the poses).
    """

    mass: float
    scales: tuple[float, ...]
    seconds: tuple[float, ...]
    laws: Mapping[str, Law] = field(default_factory=dict)
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shear: tuple[float, float] | None = None
    course: Course = ()
    inflow: float = 0.0
    offset: float = 0.0
    fade: float = 0.0
    lag: float = 0.0
    lag_order: int = 1
    ground: GroundEffect | None = None
    bias: tuple[float, ...] = ()
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    delays: Mapping[str, float] = field(default_factory=dict)

    @property
    def files(self) -> int:
        """How many logs there are."""
        return len(self.seconds)

    def wind_along(self, record: Record) -> Floats:
        """(N_all, 3) or (3,) the wind that a record flies through, in the world [m/s]."""
        wind = np.array(self.wind)
        if self.shear is not None and record.log.position is not None:
            height, exponent = self.shear
            wind = np.asarray((np.maximum(record.log.position[:, 2:], 0) / height) ** exponent * wind)
        if not self.course:
            return wind
        time, knots = self.course[record.file]
        more = [np.interp(record.log.t, time, column) for column in knots.T]
        return wind + np.column_stack([*more, np.zeros(len(record.log.t))])

    def biases(self, file: int) -> Floats:
        """(B, 3) of a log."""
        return np.array(self.bias).reshape(self.files, -1, 3)[file]

    def with_law(self, slot: str, law: Law) -> "Settings":
        """With another law in a slot."""
        return replace(self, laws={**self.laws, slot: law})


@dataclass(frozen=True)
class Model:
    """A vehicle's geometry, and how it is asked for forces."""

    vehicle: Vehicle

    def force(self, record: Record, s: Settings) -> Floats:
        """(N_all, 3) specific force in the body frame [m/s²], unfiltered."""
        thrusts = self.thrusts(record, s)
        out = np.zeros((len(record.velocity), 3))
        air = record.velocity
        if (any(s.wind) or s.course) and (s.laws or s.inflow):
            wind = np.broadcast_to(s.wind_along(record), air.shape)
            air = air - np.einsum("nji,nj->ni", record.rotations, wind)
        for code, parameters in s.laws.values():
            out += drag_force(
                code, np.asarray(parameters), self.vehicle.rotor_positions, air, record.log.rates, thrusts
            )
        if s.inflow:
            out[:, 2] -= s.inflow * thrusts.sum(axis=1) * air[:, 2]
        if s.ground is not None and record.log.position is not None:
            factor = s.ground.factors(self.rotor_heights(record), self.vehicle.rotors.radius)
            out[:, 2] += (thrusts * factor).sum(axis=1)
        else:
            out[:, 2] += thrusts.sum(axis=1)
        return out / s.mass

    def thrusts(self, record: Record, s: Settings) -> Floats:
        """(N_all, K) what the rotors make [N], the ground effect left out."""
        thrusts = record.thrusts
        if s.lag > 0:
            thrusts = lagged(thrusts, s.lag, 1 / record.rate, s.lag_order)
        late = s.delays.get("thrust", 0.0)
        if late:
            thrusts = shifted(thrusts, record.rate, late)
        if s.fade:
            thrusts = thrusts * (1 - s.fade * record.since)[:, None]
        if s.offset:
            thrusts = thrusts + s.offset
        if any(scale != 1.0 for scale in s.scales):
            thrusts = thrusts * np.array(s.scales)
        return thrusts

    def rotor_heights(self, record: Record) -> Floats:
        """(N_all, K) [m] above z = 0."""
        assert record.log.position is not None
        return record.log.position[:, 2:] + record.rotations[:, 2] @ self.vehicle.rotor_positions.T

    def predict(self, record: Record, s: Settings) -> Floats:
        """(C, n, 3) what the channels of a record should show, low-passed [m/s²]."""
        channels = self.unfiltered(record, s)
        alike = len(channels) > 1 and channels[0] is channels[1]
        out = np.moveaxis(record.smooth(np.stack(channels[:1] if alike else channels, axis=1)), 1, 0)
        out = np.concatenate([out, out]) if alike else out.copy()
        if s.bias and record.channels[0] == ACCELEROMETER:
            biases = s.biases(record.file)
            out[0] += record.hats(len(biases)) @ biases
        return out

    def unfiltered(self, record: Record, s: Settings) -> list[Floats]:
        """(N_all, 3) of each channel as it should be before the low-pass; the accelerometer's without its bias."""
        recorder = s.delays.get("recorder", 0.0)
        behind = s.delays.get("accelerometer", 0.0)
        body = self.force(record, s)
        columns = []
        for channel in record.channels:
            force = body
            if channel == ACCELEROMETER:
                force = self._with_recorder(record, s, body, recorder) if recorder else force
                force = shifted(force, record.rate, behind) if behind else force
                force = turned(force, s.rotation) if any(s.rotation) else force
            elif recorder:
                force = self.force(record, replace(s, delays={**s.delays, "thrust": -recorder}))
            columns.append(force)
        return columns

    def _with_recorder(self, record: Record, s: Settings, body: Floats, late: float) -> Floats:
        """The accelerometer's stamps and the thrust's are late alike: what lies between them is the air's force."""
        thrust = np.zeros_like(body)
        thrust[:, 2] = self.thrusts(record, s).sum(axis=1) / s.mass
        return thrust + shifted(body - thrust, record.rate, late)
