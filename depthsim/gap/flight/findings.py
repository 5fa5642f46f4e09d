"""A flight that was diagnosed, with all that a report needs."""

from dataclasses import dataclass

from depthsim.flight.table import Floats
from depthsim.flight.vehicle import Vehicle
from depthsim.gap.config import FlightConfig
from depthsim.gap.diagnosis import Diagnosis
from depthsim.gap.flight.data.axes import State, axes_of, state_of
from depthsim.gap.flight.data.evidence import Problem
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.fit.select import Selection, significant
from depthsim.gap.flight.where.correction import Learned, learn, learn_time


@dataclass(frozen=True)
class Findings:
    """All that a report is made from.

    before, after: (n, A) residuals of the first channel [m/s²], held out. noise: (A,) [m/s²]. learned: of the gap and
    of what is left, by axis.
    """

    diagnosis: Diagnosis
    vehicle: Vehicle
    problem: Problem
    selection: Selection
    before: Floats
    after: Floats
    noise: Floats
    state: State
    learned: tuple[Learned, ...]
    left: tuple[Learned, ...]


def learn_all(problem: Problem, residual: Floats, s: Settings, noise: Floats) -> list[Learned]:
    """On every axis, the one that closes most first."""
    state = state_of(problem, s)
    found = [learn(problem, residual, axis, state, noise) for axis in axes_of(state, problem.config)]
    found.append(learn_time(problem, residual, noise)[0])
    return sorted(found, key=lambda one: -one.rank)


def power(residual: Floats, noise: Floats) -> float:
    """Mean square above the noise, of all axes together [(m/s²)²]."""
    return max(float((residual**2).mean(axis=0).sum() - (noise**2).sum()), 0.0)


def stands_out(one: Learned, residual_power: float, noise: Floats, config: FlightConfig) -> bool:
    """Whether what is learned on an axis is a gap, before causes are added as after: more than chance, and not faint.

    residual_power: of what it was learned on, above the noise [(m/s²)²].
    """
    least = config.significance.faint**2 * float((noise**2).sum())
    return significant(one.gains, config) and one.closed * residual_power > least
