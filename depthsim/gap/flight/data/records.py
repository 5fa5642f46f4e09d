"""A flight made ready: what was measured of its specific force, and what a model needs to predict the same.

There are up to two channels. The accelerometer shows the force, its own errors and its own clock; velocities and
attitude show the same force as Rᵀ(dV/dt + g e3), with other errors. The gap is measured on the first that is there; the
second helps to distinguish a force, which both see, from an error of the accelerometer, which one sees.
Both sides go through the same low-pass (``flight.fit.motion``) and are then thinned, since nothing is left above it.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.flight.constants import GRAVITY
from depthsim.flight.fit.design import rotor_thrusts
from depthsim.flight.fit.motion import CUTOFF, Motion, low_pass, motion_of, to_body
from depthsim.flight.fit.thrust import fit_thrust_map
from depthsim.flight.log import FlightLog
from depthsim.flight.table import Floats
from depthsim.flight.vehicle import Vehicle
from depthsim.gap.config import FlightConfig
from depthsim.gap.flight.data.columns import check_units, measured_columns

Need = Literal["accelerometer", "thrust", "newtons", "rotors", "positions"]
"""What an effect may need of a log; newtons: thrust that was not scaled to fit the flight; rotors: each one's."""
ACCELEROMETER, VELOCITIES = "accelerometer", "velocities"
_THINNED = 4
"""Samples kept for each period of the cutoff."""


@dataclass(frozen=True)
class Record:
    """A stretch of a flight on even stamps.

    log: resampled. file: which of the logs given it belongs to. span: that log's first and last stamp [s]. rate [Hz].
    rows: the N samples that are in the air and kept. thrusts: (N_all, K) of the rotors as logged [N].
    velocity: (N_all, 3) over ground, in the body [m/s].
    rotations: (N_all, 3, 3). channels: their names. measured: (C, n, 3) low-passed specific force [m/s²].
    raw: (C, N_all, 3) the same before the low-pass.
    """

    log: FlightLog
    file: int
    span: tuple[float, float]
    rate: float
    rows: NDArray[np.int_]
    thrusts: Floats
    velocity: Floats
    rotations: Floats
    channels: tuple[str, ...]
    measured: Floats
    raw: Floats

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def step(self) -> float:
        """[s] from one kept sample to the next."""
        return float(self.log.t[self.rows[1]] - self.log.t[self.rows[0]])

    @property
    def seconds(self) -> float:
        """[s] in the air."""
        return len(self) * self.step

    @property
    def since(self) -> Floats:
        """(N_all,) [s] from the start of the log."""
        return np.asarray(self.log.t - self.span[0])

    def hats(self, knots: int) -> Floats:
        """(n, knots) shares of values that stand evenly over the log, one of them all along; straight lines between."""
        if knots == 1:
            return np.ones((len(self), 1))
        at = np.linspace(*self.span, knots)
        return np.stack([np.interp(self.log.t[self.rows], at, one) for one in np.eye(knots)], axis=1)

    def smooth(self, columns: Floats) -> Floats:
        """Columns (N_all, ...) low-passed like the force, at the kept rows."""
        return low_pass(columns, self.rate, CUTOFF)[self.rows]


@dataclass(frozen=True)
class Records:
    """All stretches of all logs.

    files: the names of the logs. axes: of the body on which the gap is measured. thrust_from: where the thrust is from.
    rotor_by_rotor: whether the log has each rotor's. notes: what a reader must know of the logs. lacking: what they do
    not have, in words and as effects need it.
    """

    parts: tuple[Record, ...]
    files: tuple[str, ...]
    axes: tuple[int, ...]
    channels: tuple[str, ...]
    thrust_from: str
    rotor_by_rotor: bool
    notes: tuple[str, ...]
    lacking: tuple[tuple[str, frozenset[Need]], ...] = ()
    thrust_curve: tuple[str, float, tuple[float, ...]] | None = None

    def lacks(self, needs: Iterable[Need]) -> bool:
        """Whether the logs lack any of these."""
        return any(not missing.isdisjoint(needs) for _, missing in self.lacking)


def prepare(logs: Sequence[FlightLog], vehicle: Vehicle, config: FlightConfig) -> Records:
    """Make logs ready. Raises :class:`InputError` for a log that cannot be used at all."""
    notes: list[str] = []
    motions: list[Motion] = []
    files: list[int] = []
    checked = [measured_columns(log) for log in logs]
    logs = [log for log, _ in checked]
    for log in logs:
        check_units(log, vehicle)
    notes.extend(one for _, said in checked for one in said)
    for number, log in enumerate(logs):
        pieces, said = _pieces(log, config)
        notes.extend(said)
        for piece in pieces:
            motions.append(motion_of(piece))
            files.append(number)
    measured = [motion.measured for motion in motions]
    if any(measured) and not all(measured):
        motions = [motion_of(motion.log, from_velocity=True) for motion in motions]
        notes.append("not every log has an accelerometer: the specific force is from velocities in all of them")
    known = all(motion.log.total_thrust is not None for motion in motions)
    mapped = None if known else fit_thrust_map(motions)
    thrusts, thrust_from = rotor_thrusts(motions, vehicle, mapped)
    axes = (0, 1) if thrust_from == "the accelerometer" else (0, 1, 2)
    spans = [(float(log.t[0]), float(log.t[-1])) for log in logs]
    parts = tuple(
        _record(motion, file, spans[file], thrust) for motion, file, thrust in zip(motions, files, thrusts, strict=True)
    )
    notes.extend(_told(logs))
    return Records(
        parts=parts,
        files=tuple(log.source for log in logs),
        axes=axes,
        channels=parts[0].channels,
        thrust_from=thrust_from,
        rotor_by_rotor=thrust_from == "the log, rotor by rotor",
        notes=tuple(notes),
        lacking=tuple(_lacking(logs, parts, thrust_from)),
        thrust_curve=mapped.curve(vehicle.mass) if mapped is not None else None,
    )


def _record(motion: Motion, file: int, span: tuple[float, float], thrusts: Floats) -> Record:
    log, rate = motion.log, motion.rate
    stride = max(1, int(rate / (_THINNED * CUTOFF)))
    rows = np.arange(motion.airborne.start, motion.airborne.stop, stride)
    from_velocity = to_body(log, np.gradient(log.velocity, log.t, axis=0) + np.array([0, 0, GRAVITY]))
    raw, channels = [from_velocity], [VELOCITIES]
    if motion.measured:
        assert log.specific_force is not None
        raw.insert(0, log.specific_force)
        channels.insert(0, ACCELEROMETER)
    stacked = np.stack(raw)
    smooth = low_pass(np.moveaxis(stacked, 0, 1), rate, CUTOFF)[rows]
    velocity = motion.velocity
    if any("velocities" in one for one in log.derived):  # laws that are not linear would make a drag of their noise
        velocity = low_pass(velocity, rate, 2 * CUTOFF if rate > 5 * CUTOFF else CUTOFF)
    return Record(
        log=log,
        file=file,
        span=span,
        rate=rate,
        rows=rows,
        thrusts=np.ascontiguousarray(thrusts),
        velocity=velocity,
        rotations=log.rotations,
        channels=tuple(channels),
        measured=np.ascontiguousarray(np.moveaxis(smooth, 1, 0)),
        raw=stacked,
    )


def _pieces(log: FlightLog, config: FlightConfig) -> tuple[list[FlightLog], list[str]]:
    """The log cut at its gaps."""
    from pathlib import Path

    limit = max(config.data.longest_gap, 5 * float(np.median(np.diff(log.t))))
    cuts = np.flatnonzero(np.diff(log.t) > limit) + 1
    if not len(cuts):
        return [log], []
    edges = [0, *cuts.tolist(), len(log)]
    pieces = [log.select(slice(a, b)) for a, b in pairwise(edges) if b - a > 2]
    kept = [piece for piece in pieces if piece.duration >= config.data.shortest_piece]
    if not kept:
        problem = f"has {len(cuts)} gaps and no stretch of {config.data.shortest_piece:g} s without one"
        raise InputError(log.source, "t", problem, "give a log that is whole for longer")
    left = log.duration - sum(piece.duration for piece in kept)
    name = Path(log.source).name
    said = f"{name}: cut at {len(cuts)} gap{'s' * (len(cuts) > 1)}, {len(kept)} stretches used, {left:.1f} s left out"
    return [replace(piece, source=log.source) for piece in kept], [said]


def _lacking(
    logs: Sequence[FlightLog], parts: Sequence[Record], thrust_from: str
) -> Iterator[tuple[str, frozenset[Need]]]:
    if parts[0].channels[0] == VELOCITIES:
        yield "no accelerometer (ax ay az): the specific force is from velocities", frozenset({"accelerometer"})
    if thrust_from == "the accelerometer":
        yield "no thrust: only the lateral force is diagnosed", frozenset({"thrust", "newtons", "rotors"})
    elif thrust_from == "the thrust map":
        text = "thrust from a map fitted to the motor inputs, with a scale for each flight"
        yield text, frozenset({"newtons", "rotors"})
    elif thrust_from == "the log, in all":
        yield "the thrust of the single rotors is not in the log", frozenset({"rotors"})
    if any(log.position is None for log in logs):
        yield "no positions (px py pz): nothing is looked at along altitude and place", frozenset({"positions"})


def _told(logs: Sequence[FlightLog]) -> list[str]:
    from pathlib import Path

    notes = []
    for log in logs:
        if log.derived:
            notes.append(f"{Path(log.source).name}: {', '.join(log.derived)}")
        if log.left_out:
            notes.append(f"{Path(log.source).name}: columns not used: {', '.join(log.left_out)}")
    return notes
