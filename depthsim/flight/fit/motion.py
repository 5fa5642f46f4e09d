"""What a log says about force: the specific force of a flight in the air, low-passed, and the state beside it."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from depthsim.errors import InputError
from depthsim.flight.constants import GRAVITY
from depthsim.flight.log import FlightLog
from depthsim.flight.table import Floats

CUTOFF = 4.0
"""[Hz] of the low-pass that both sides of the comparison go through; above it are vibration and measuring noise."""
_ORDER = 2
_AWAY = 0.25
"""[m] from where a log begins or ends; until then the vehicle may stand on the ground."""
_HOVER = 1.0
"""[m] from its first place, on average: what stays nearer keeps its place."""
_MARGIN = 1.0
"""[s] cut off on each side of the flight: the ground's effect, and the ends of the low-pass."""
_LONGEST_GAP = 0.5
_LEAST_AIRBORNE = 3.0


@dataclass(frozen=True)
class Motion:
    """One flight on even stamps.

    log: the whole log, resampled. airborne: its rows in the air, less a margin. rate [Hz]. cutoff [Hz].
    whole_force: (N, 3) low-passed specific force in the body [m/s²]. measured: whether it is an accelerometer's; else
    it is Rᵀ(dv/dt + g e3), from differentiated velocities.
    """

    log: FlightLog
    airborne: slice
    rate: float
    cutoff: float
    whole_force: Floats
    measured: bool

    def __len__(self) -> int:
        return len(self.force)

    @property
    def force(self) -> Floats:
        """(n, 3) low-passed specific force over the airborne rows [m/s²]."""
        return self.whole_force[self.airborne]

    @property
    def velocity(self) -> Floats:
        """(N, 3) velocity in the body [m/s] of the whole log."""
        return to_body(self.log, self.log.velocity)

    def smooth(self, columns: Floats) -> Floats:
        """Columns (N, ...) over the whole log, low-passed like the force and cut to the airborne rows."""
        return low_pass(columns, self.rate, self.cutoff)[self.airborne]


def motion_of(log: FlightLog, cutoff: float = CUTOFF, from_velocity: bool = False) -> Motion:
    """Prepare a log; ``from_velocity`` leaves its accelerometer aside.

    Raises :class:`InputError` for gaps, for too few samples a second, and where too little of the log is in the air.
    """
    even, rate = _resample(log)
    if rate < 5 * cutoff:
        fix = f"give a log of {5 * cutoff:.0f} Hz or more, or a lower `cutoff`"
        raise InputError(log.source, "t", f"has {rate:.3g} samples a second, too few for {cutoff:g} Hz", fix)
    airborne = _airborne(even, rate)
    if airborne.stop - airborne.start < _LEAST_AIRBORNE * rate:
        seconds = max(airborne.stop - airborne.start, 0) / rate
        fix = f"give a flight of {_LEAST_AIRBORNE + 2 * _MARGIN:g} s or more"
        raise InputError(log.source, "", f"holds {seconds:.1f} s in the air once both ends are cut", fix)
    measured = even.specific_force is not None and not from_velocity
    if measured:
        assert even.specific_force is not None
        force = even.specific_force
        length = float(np.median(np.linalg.norm(force[airborne], axis=1)))
        if not 3 < length < 100:
            problem = f"the specific force is {length:.3g} m/s² at the median, where a flight has about 9.8"
            raise InputError(log.source, "ax ay az", problem, "write m/s² in the body, gravity's reaction included")
    else:
        force = to_body(even, np.gradient(even.velocity, even.t, axis=0) + np.array([0, 0, GRAVITY]))
    return Motion(even, airborne, rate, cutoff, low_pass(force, rate, cutoff), measured)


def low_pass(columns: Floats, rate: float, cutoff: float) -> Floats:
    """A Butterworth low-pass of second order, run forwards and backwards so that nothing is shifted in time."""
    from scipy.signal import sosfiltfilt

    return np.asarray(sosfiltfilt(_sections(rate, cutoff), columns, axis=0))


@lru_cache(maxsize=64)
def _sections(rate: float, cutoff: float) -> Floats:
    """The filter's design takes as long as its run over a minute of flight."""
    from scipy.signal import butter

    return np.asarray(butter(_ORDER, cutoff, fs=rate, output="sos"))


def to_body(log: FlightLog, vectors: Floats) -> Floats:
    """(N, 3) vectors of the world in the body frame."""
    return np.einsum("nji,nj->ni", log.rotations, vectors)


def _resample(log: FlightLog) -> tuple[FlightLog, float]:
    """The log on even stamps at its own median rate [Hz], by linear interpolation; an even log stays as it is."""
    step = float(np.median(np.diff(log.t)))
    gap = int(np.argmax(np.diff(log.t)))
    if log.t[gap + 1] - log.t[gap] > _LONGEST_GAP:
        problem = f"has a gap of {log.t[gap + 1] - log.t[gap]:.2f} s after t {log.t[gap]:.3f}"
        raise InputError(log.source, "t", problem, "give the parts before and after it as logs of their own")
    t = log.t[0] + step * np.arange(int(log.duration / step + 1e-6) + 1)
    q = log.quaternion
    turned = np.sum(q[1:] * q[:-1], axis=1) < 0
    q = np.vstack([q[:1], q[1:] * np.where(np.cumsum(turned) % 2 == 1, -1.0, 1.0)[:, None]])
    q = _interpolate(t, log.t, q)
    q = q / np.linalg.norm(q, axis=1, keepdims=True)

    def even(values: Floats | None) -> Floats | None:
        return None if values is None else _interpolate(t, log.t, values)

    resampled = replace(
        log,
        t=t,
        velocity=_interpolate(t, log.t, log.velocity),
        quaternion=q,
        rates=_interpolate(t, log.t, log.rates),
        position=even(log.position),
        thrust=even(log.thrust),
        rotor_thrusts=even(log.rotor_thrusts),
        specific_force=even(log.specific_force),
        extras={name: _interpolate(t, log.t, column) for name, column in log.extras.items()},
    )
    return resampled, 1 / step


def _interpolate(t: Floats, stamps: Floats, values: Floats) -> Floats:
    flat = values.reshape(len(stamps), -1)
    return np.stack([np.interp(t, stamps, column) for column in flat.T], axis=1).reshape(len(t), *values.shape[1:])


def _airborne(log: FlightLog, rate: float) -> slice:
    """From where the vehicle has left its first place until it comes to its last; a hover is in the air throughout.

    A hover that wanders comes back to its first place: what is near that is on the ground only if the flight is higher.
    """
    margin = round(_MARGIN * rate)
    place = log.position
    if place is None:
        place = np.cumsum(log.velocity, axis=0) / rate
    left = np.linalg.norm(place - place[0], axis=1) > _AWAY
    away = np.linalg.norm(place - place[-1], axis=1) > _AWAY
    if not (left.any() and away.any()):
        return slice(margin, len(log) - margin)
    rises = float(np.quantile(place[:, 2], 0.75) - min(place[0, 2], place[-1, 2])) > _AWAY
    if not rises and float(np.median(np.linalg.norm(place - place[0], axis=1))) < _HOVER:
        return slice(margin, len(log) - margin)
    return slice(int(np.argmax(left)) + margin, len(log) - int(np.argmax(away[::-1])) - margin)
