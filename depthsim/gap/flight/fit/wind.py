"""A wind with a course in time: fitted beside candidates, and whether it is a wind at all.

A wind that changes can look like anything for a while, and anything that varies can be taken for such a wind. It is
one where velocities show its force too, where it closes about all that any force in time could, and where nothing that
lasts says the same: a force that goes with the speed, the place or the turning of a vehicle is no wind, unless the
vehicle hardly moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from depthsim.gap.flight.data.axes import axes_of, state_of
from depthsim.gap.flight.data.evidence import Problem, Values
from depthsim.gap.flight.data.simulate import Course
from depthsim.gap.flight.effect import Candidate
from depthsim.gap.flight.fit.optimize import Fit, refitted
from depthsim.gap.flight.fit.series import Series, wind_series
from depthsim.gap.flight.where.correction import learn, learn_time

_ROUNDS = 2
_OF_WIND = ("place",)
"""A wind may change from place to place as well."""


@dataclass(frozen=True)
class Windy:
    """A fit beside a wind in time. fit: of what was measured less the wind's force, each piece from its neighbours."""

    fit: Fit
    series: Series


def with_wind(problem: Problem, candidates: Sequence[Candidate], values: Values, start: Course = ()) -> Windy | None:
    """Candidates and a wind, fitted in turn. None where no drag carries a wind."""
    found: Windy | None = None
    for _ in range(_ROUNDS if candidates or len(problem.weights) > 1 else 1):
        s = problem.settings(candidates, values)
        plain = problem.predict(s)
        left = problem.measured - plain - (problem.tilts @ found.fit.tilts if found else 0.0)
        series = wind_series(problem, left, s, start)
        if series is None:
            return None
        blown = problem.predict(replace(s, course=series.course)) - plain
        calm = replace(
            problem,
            base=replace(problem.base, course=series.course),
            measured=problem.measured - series.predicted + blown,
        )
        found = Windy(refitted(calm, candidates, values), series)
        values, start = found.fit.values, series.course
    return found


def is_wind(steady: Fit, windy: Windy) -> bool:
    """Whether what varies in time is a wind. steady: the same with a constant wind, if any."""
    problem, limit = steady.problem, steady.problem.config.select
    if not _seen_by_velocities(steady, windy):
        return False
    residual = steady.residual[:, 0]
    free, series = learn_time(problem, residual, problem.sigma[0])
    whole = float(free.gains.sum())
    calm = windy.fit.residual[:, 0]
    closed = float((((residual**2) - calm**2) * problem.weights[0]).sum())
    if closed < limit.like_wind * whole:
        return False
    state = state_of(problem, steady.settings)
    # A drag that was found for the wind to act by may be a wrong one, whose misfit the wind then takes up.
    lasting = limit.lasting if problem.base.laws else limit.lasting_by_found
    force = float((series.predicted[:, 0] ** 2).sum(axis=1).mean() ** 0.5)
    for axis in axes_of(state, problem.config):
        if axis.name in _OF_WIND or axis.reach(state) < force:
            continue
        if learn(problem, residual, axis, state, problem.sigma[0]).gains.sum() > lasting * whole:
            return False
    return True


def _seen_by_velocities(steady: Fit, windy: Windy) -> bool:
    """Whether velocities, where there are two channels, show a wind's force too; a sensor's error they do not."""
    if steady.residual.shape[1] < 2:
        return True
    weights = steady.problem.weights[1]
    before, after = steady.residual[:, 1], windy.fit.residual[:, 1]
    shown = float((((before - after) ** 2) * weights).sum())
    gain = float(((before**2 - after**2) * weights).sum())
    return gain > 0 or shown < steady.problem.config.select.velocities_show
