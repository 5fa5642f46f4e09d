"""From flights to drag: every law fitted, with intervals, judged on flights it has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from depthsim.flight.fit.candidates import CANDIDATES, Candidate
from depthsim.flight.fit.craft import craft_of
from depthsim.flight.fit.design import Design, rotor_thrusts
from depthsim.flight.fit.exponent import Exponent, thrust_exponent
from depthsim.flight.fit.judge import Judgement, judge, tied
from depthsim.flight.fit.motion import CUTOFF, Motion, motion_of
from depthsim.flight.fit.sums import Sums, identified, interval95, solve
from depthsim.flight.fit.thrust import ThrustMap, fit_thrust_map
from depthsim.flight.log import FlightLog
from depthsim.flight.nanobench import read_any
from depthsim.flight.table import Floats
from depthsim.flight.vehicle import Vehicle, load_vehicle

_PARTS = 4
"""A flight that is alone is judged by leaving out one of so many parts."""


@dataclass(frozen=True)
class FlightPart:
    """What belongs to one flight alone, under the chosen law.

    source: its file. seconds: in the air. offset: (2,) of the measured lateral specific force against the model
    [m/s²]: the accelerometer's bias and a mounting misalignment together. against_velocity: (2,) of the accelerometer
    against the force that follows from velocities and attitude [m/s²], None without an accelerometer. scale: of the
    thrust, relative to the log's thrust, or to the mean flight where a thrust map was fitted; None without thrust.
    tested: whether it was held out.
    """

    source: str
    seconds: float
    offset: Floats
    against_velocity: Floats | None
    scale: float | None
    tested: bool


@dataclass(frozen=True)
class LawFit:
    """One law: its coefficients (P,), their 95 % intervals, and how it does on unseen flights.

    known: (P,) whether the flights determine it; the others are 0 and have no interval.
    """

    law: Candidate
    values: Floats
    low: Floats
    high: Floats
    known: tuple[bool, ...]
    judgement: Judgement


@dataclass(frozen=True)
class DragFit:
    """All of a fit.

    laws: in the order of CANDIDATES. best: the name of the law to take. ties: the laws indistinguishable
    from it. per_flight: the flights fitted, then those tested. exponent: how drag depends on thrust, None where it
    cannot be asked. speed: (n,) lateral speed [m/s] of the samples of all flights, and residuals: by law, (n, 2)
    [m/s²], offsets removed.
    """

    vehicle: Vehicle
    laws: tuple[LawFit, ...]
    best: str
    ties: tuple[str, ...]
    per_flight: tuple[FlightPart, ...]
    thrust_map: ThrustMap | None
    thrust_from: str
    exponent: Exponent | None
    measured: bool
    cutoff: float
    speed: Floats
    residuals: dict[str, Floats]

    def law(self, name: str) -> LawFit:
        """The fit of a law by its name."""
        return next(fit for fit in self.laws if fit.law.name == name)


def fit_drag(
    logs: Sequence[str | Path | FlightLog],
    vehicle: str | Path | Vehicle | None = None,
    tests: Sequence[str | Path | FlightLog] = (),
    *,
    cutoff: float = CUTOFF,
    from_velocity: bool = False,
) -> DragFit:
    """Fit every drag law to some flights of ``vehicle``, whose mass, rotors and air at rest are taken as given.

    logs, tests: flight.csv files, logs of NanoBench, or logs that are read. vehicle: a name, a vehicle.yaml, or an
    object; without it :func:`~depthsim.flight.fit.craft_of` finds which.

    The lateral specific force, low-passed at ``cutoff`` [Hz] on both sides, is the law's plus an offset of the flight;
    along z it is thrust over mass, times a scale of the flight, plus the law's. ``tests`` are flights to judge on; by
    default the flights take turns. Raises :class:`InputError` where a log does not do.
    """
    flights = [read_any(log) for log in (*logs, *tests)]
    craft = load_vehicle(vehicle) if vehicle is not None else craft_of(flights).vehicle
    motions = [motion_of(log, cutoff, from_velocity) for log in flights]
    if len({motion.measured for motion in motions}) > 1:  # one kind of residual for all
        motions = [motion_of(log, cutoff, from_velocity=True) for log in flights]
    train = motions[: len(logs)]
    mapped = None if all(motion.log.total_thrust is not None for motion in motions) else fit_thrust_map(train)
    thrusts, thrust_from = rotor_thrusts(motions, craft, mapped)
    scaled = thrust_from != "the accelerometer"
    designs = [Design.of(motion, craft, thrust, scaled) for motion, thrust in zip(motions, thrusts, strict=True)]
    fits = tuple(_fit(candidate, designs, len(logs)) for candidate in CANDIDATES)
    lowest = min(fits, key=lambda fit: fit.judgement.removed.mean)
    ties = [fit.law.name for fit in fits if fit is lowest or tied(fit.judgement, lowest.judgement)]
    best = next(fit for fit in fits if fit.law.name in ties)
    parts, residuals = _parts(designs, fits, best, len(logs), mapped)
    return DragFit(
        vehicle=craft,
        laws=fits,
        best=best.law.name,
        ties=tuple(name for name in ties if name != best.law.name),
        per_flight=parts,
        thrust_map=mapped,
        thrust_from=thrust_from,
        exponent=thrust_exponent(train, thrusts[: len(logs)], craft.mass),
        measured=all(motion.measured for motion in motions),
        cutoff=cutoff,
        speed=np.concatenate(
            [np.linalg.norm(design.motion.smooth(design.motion.velocity)[:, :2], axis=1) for design in designs]
        ),
        residuals=residuals,
    )


def _fit(law: Candidate, designs: Sequence[Design], count: int) -> LawFit:
    axes = designs[0].y.shape[1]
    known = tuple(_moves(designs[:count], law, index, axes) for index in range(len(law.names)))
    sums = [design.sums(law.name, known) for design in designs]
    train = sums[:count]
    values, low, high = np.zeros(len(known)), np.full(len(known), np.nan), np.full(len(known), np.nan)
    chosen = np.array(known, dtype=bool)
    if chosen.any():
        values[chosen] = solve(Sums.stacked([flight.total() for flight in train]))
        low[chosen], high[chosen] = interval95(train)
    units = train
    if count == 1 and len(sums) == 1:
        units = [
            train[0][part[0] : part[-1] + 1] for part in np.array_split(np.arange(len(train[0])), _PARTS) if part.size
        ]
    return LawFit(law, values, low, high, known, judge(units, sums[count:]))


def _moves(designs: Sequence[Design], law: Candidate, index: int, axes: int) -> bool:
    """Whether the flights move along the axis of a coefficient at all."""
    along = law.along[index]
    if along is not None and along >= axes:
        return False
    only = np.arange(len(law.names)) == index
    return identified(Sums.stacked([design.sums(law.name, tuple(only.tolist())).total() for design in designs]))


def _parts(
    designs: Sequence[Design], fits: Sequence[LawFit], best: LawFit, count: int, mapped: ThrustMap | None
) -> tuple[tuple[FlightPart, ...], dict[str, Floats]]:
    parts = []
    residuals: dict[str, list[Floats]] = {fit.law.name: [] for fit in fits}
    for number, design in enumerate(designs):
        for fit in fits:
            rest = design.y - design.x[fit.law.name] @ fit.values
            nuisance = (design.z * rest).sum(axis=0) / (design.z**2).sum(axis=0)
            residuals[fit.law.name].append((rest - nuisance * design.z)[:, :2])
            if fit is best:
                scale = float(nuisance[2]) if len(nuisance) > 2 else None
                if scale is not None and mapped is not None:
                    scale *= mapped.scale_of(design.motion)
                seconds = len(design.y) / design.motion.rate
                source, against = design.motion.log.source, _against_velocity(design.motion)
                parts.append(FlightPart(source, seconds, nuisance[:2], against, scale, number >= count))
    return tuple(parts), {name: np.concatenate(pieces) for name, pieces in residuals.items()}


def _against_velocity(motion: Motion) -> Floats | None:
    if not motion.measured:
        return None
    other = motion_of(motion.log, motion.cutoff, from_velocity=True)
    return np.asarray((motion.force - other.force)[:, :2].mean(axis=0))
