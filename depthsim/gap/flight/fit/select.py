"""Which effects the logs speak for: forward selection, exchange, and the effects that would do as well.

An effect is taken in when it makes the held-out residuals smaller than chance does. Then each one that was taken is put
to the test again: is it needed beside the others, would another do better in its place, and which do as well? Gusts are
no candidate; they stand where a changing wind says more than any candidate and more than anything learned that lasts.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.config import FlightConfig
from depthsim.gap.flight.data.axes import axes_of, state_of
from depthsim.gap.flight.data.evidence import Problem
from depthsim.gap.flight.effect import Candidate, family_of
from depthsim.gap.flight.effects.rotors import EACH, UNEVEN, RotorThrustDifference, logged_shares
from depthsim.gap.flight.fit.optimize import Fit, empty_fit, extended, refitted
from depthsim.gap.flight.fit.series import Series, wind_series
from depthsim.gap.flight.where.correction import learn, learn_time
from depthsim.gap.resampling import paired

_MOTION = ("acceleration", "angular_rate", "thrust")
"""Axes on which the vehicle's answer to a gust shows."""
_LIKE_WIND = ("wind", "sensor")
"""Families whose effects may have been misattributed: it was the mean of the gusts."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Selection:
    """A fit, and for each of its candidates the effects that would do as well in its place.

    start: the fit without any effect, on what was measured. gusts: the wind's series, where it gusts; the fit is then
    on what was measured less its force. alternatives: for each candidate, fits with another one there.
    """

    start: Fit
    fit: Fit
    gusts: Series | None
    alternatives: tuple[dict[str, Fit], ...]


def select(
    problem: Problem, bank: Sequence[Candidate], gusts: bool = True, say: Progress = lambda _: None
) -> Selection:
    """The effects of the bank that the logs speak for, and gusts if they are asked for.

    A wind that changes can look like anything for a while. So gusts are tried where candidates alone leave something
    that comes and goes, and taken where the two together leave clearly less.
    """
    start, config = empty_fit(problem), problem.config
    fit, series = _search(start, bank, False, say)
    if gusts and significant(learn_time(problem, fit.held_out[:, 0], problem.sigma[0])[0].gains, config):
        other, found = _search(start, bank, True, say)
        gain = float(fit.loss.sum() - other.loss.sum())
        closed = float(start.loss.sum() - other.loss.sum())
        if found is not None and gain > max(config.significance.least_gain, config.select.gusts_share * closed):
            fit, series = other, found
            bank = _windless(bank)
    say("alternatives")
    fit, alternatives = _exchanged(fit, bank, start)
    return Selection(start, fit, series, alternatives)


def _search(start: Fit, bank: Sequence[Candidate], gusts: bool, say: Progress) -> tuple[Fit, Series | None]:
    """Forward selection, with gusts as soon as they say more than any candidate if they are asked for."""
    fit, problem = start, start.problem
    series: Series | None = None
    while len(fit.candidates) < problem.config.select.most_causes:
        say(f"effect {len(fit.candidates) + 1}")
        best = _best(_trials(fit, bank))
        if gusts and series is None:
            found = _gusts(fit, best)
            if found is not None:
                series, calm_fit = found
                bank = _windless(bank)
                calm = replace(problem, measured=problem.measured - series.predicted)
                fit = refitted(calm, calm_fit.candidates, calm_fit.values)
                continue
        if best is None or not _worth(fit, best, start):
            break
        more = _pruned(refitted(fit.problem, best.candidates, best.values), start)
        if fit.loss.sum() - more.loss.sum() < problem.config.significance.least_gain:
            break
        fit = more
    return fit, series


def _windless(bank: Sequence[Candidate]) -> list[Candidate]:
    """Without the constant wind, which is the mean of the gusts."""
    return [candidate for candidate in bank if family_of(candidate.effect) != "wind"]


def significant(gains: Floats, config: FlightConfig) -> bool:
    """Whether gains of the held-out loss by block (B,) are more than chance.

    Either most blocks have their part in it, or it is large even without the two blocks that gain most: an effect such
    as the ground's is there for moments only.
    """
    least, total = config.significance.least_gain, float(gains.sum())
    most = float(np.sort(gains)[-2:].sum())
    sure = paired(gains, 0 * gains).t > config.significance.least_t
    return total > least and (sure or total - most > 3 * least)


def _gusts(fit: Fit, best: Fit | None) -> tuple[Series, Fit] | None:
    """A wind that changes, if that is what the residual of a fit is, and the fit that it stands beside.

    A sensor's constant error may have been the mean of the wind: it is left out where that does as
    well, and must be found again.
    """
    problem, limit = fit.problem, fit.problem.config.select
    with_all = wind_series(problem, fit.residual, fit.settings)
    if with_all is None or not significant(with_all.gains, problem.config) or not _seen_by_velocities(fit, with_all):
        return None
    left = float(with_all.gains.sum())
    if best is not None and float((fit.loss - best.loss).sum()) > limit.candidate * left:
        return None
    residual = fit.residual[:, 0]
    free, _ = learn_time(problem, residual, problem.sigma[0])
    if not significant(free.gains, problem.config):
        return None
    state = state_of(problem, fit.settings)
    lasting = max(
        learn(problem, residual, axis, state, problem.sigma[0]).gains.sum()
        / (limit.lasting_motion if axis.name in _MOTION else limit.lasting)
        for axis in axes_of(state, problem.config)
    )
    calm = residual - with_all.predicted[:, 0]
    closed = float((((residual**2) - calm**2) * problem.weights[0]).sum())
    if lasting > free.gains.sum() or closed < limit.like_wind * float(free.gains.sum()):
        return None
    kept = [
        pair for pair in zip(fit.candidates, fit.values, strict=True) if family_of(pair[0].effect) not in _LIKE_WIND
    ]
    if len(kept) < len(fit.candidates):
        without_them = refitted(problem, [candidate for candidate, _ in kept], tuple(values for _, values in kept))
        series = wind_series(problem, without_them.residual, without_them.settings)
        most = fit.loss.sum() - left + problem.config.significance.least_gain
        if series is not None and without_them.loss.sum() - series.gains.sum() < most:
            return series, without_them
    return with_all, fit


def _seen_by_velocities(fit: Fit, series: Series) -> bool:
    """Whether velocities, where there are two channels, show a wind's force too; a sensor's error they do not."""
    if fit.residual.shape[1] < 2:
        return True
    force, residual, weights = series.predicted[:, 1], fit.residual[:, 1], fit.problem.weights[1]
    shown = float((force**2 * weights).sum())
    gain = float(((residual**2 - (residual - force) ** 2) * weights).sum())
    return gain > 0 or shown < fit.problem.config.select.velocities_show


def _trials(fit: Fit, bank: Sequence[Candidate]) -> list[Fit]:
    return [extended(fit, candidate) for candidate in bank if candidate.effect not in fit.effects]


def _best(trials: Sequence[Fit]) -> Fit | None:
    """The one with the least loss; of its effect the first candidate that is not worse."""
    if not trials:
        return None
    best = min(trials, key=lambda trial: trial.loss.sum())
    own = [trial for trial in trials if trial.effects[-1] == best.effects[-1]]
    margin = best.problem.config.select.tie_gain
    return next(trial for trial in own if trial.loss.sum() - best.loss.sum() < margin)


def _clearly(worse: Fit, better: Fit) -> bool:
    """Whether ``better`` is better by more than chance."""
    difference = paired(worse.loss, better.loss)
    limit = better.problem.config.select
    return difference.mean * len(worse.loss) > limit.tie_gain and difference.t > limit.tie_t


def _worth(before: Fit, after: Fit, start: Fit) -> bool:
    squares = [fit.squares[:, 0].sum() for fit in (start, before, after)]
    noise = len(start.residual) * float((start.problem.sigma[0] ** 2).sum())
    power = max(float(squares[0]) - noise, 0.0)
    config = start.problem.config
    large = bool(squares[1] - squares[2] > config.select.least_share * power)
    return significant(before.loss - after.loss, config) and large


def _pruned(fit: Fit, start: Fit) -> Fit:
    """Without the candidates that are no longer needed beside the others."""
    while len(fit.candidates) > 1:
        smaller = [without(fit, index) for index in range(len(fit.candidates))]
        weakest = min(smaller, key=lambda one: one.loss.sum())
        if _worth(weakest, fit, start):
            return fit
        fit = weakest
    return fit


def without(fit: Fit, index: int) -> Fit:
    """The fit with one candidate less."""
    candidates = (*fit.candidates[:index], *fit.candidates[index + 1 :])
    return refitted(fit.problem, candidates, (*fit.values[:index], *fit.values[index + 1 :]))


def _exchanged(fit: Fit, bank: Sequence[Candidate], start: Fit) -> tuple[Fit, tuple[dict[str, Fit], ...]]:
    """With better effects in place of some, and what does as well for each."""
    found: list[dict[str, Fit]] = []
    for _ in range(3):
        found = []
        better: Fit | None = None
        for index in range(len(fit.candidates)):
            others = without(fit, index)
            trials = _by_effect(_trials(others, bank))
            own = trials.pop(fit.effects[index], None)
            for trial in trials.values():
                if _clearly(fit, trial) and (better is None or trial.loss.sum() < better.loss.sum()):
                    better = trial
            alike = {name: trial for name, trial in trials.items() if _alike(trial, own or fit, others)}
            uneven = alike.get(RotorThrustDifference.id)
            scales = family_of(fit.effects[index]) == "scale"
            if uneven is not None and scales and uneven.candidates[-1].name == EACH:
                del alike[RotorThrustDifference.id]  # any scale of all rotors is one of each
            if better is None and uneven is not None and _explains_commands(uneven) and scales:
                better = uneven
            if better is None and fit.candidates[index].name == EACH:
                # Rotors are distinguished only where their own scales say more than one scale for all.
                better = next((other for name, other in alike.items() if family_of(name) == "scale"), None)
            if _explains_commands(fit, index):
                alike = {name: trial for name, trial in alike.items() if family_of(name) != "scale"}
            found.append(alike)
        if better is None:
            break
        fit = _pruned(refitted(fit.problem, better.candidates, better.values), start)
    return fit, tuple(found)


def _explains_commands(fit: Fit, index: int = -1) -> bool:
    """Whether rotors as uneven as the log's thrusts speak of also explain the force; a common scale does not.

    Rotors that push as the log says, and others that do not, are together between the weakest and the strongest.
    """
    candidate = fit.candidates[index]
    shares = logged_shares(fit.problem.records) if candidate.name == UNEVEN else None
    if shares is None:
        return False
    margin = fit.problem.config.select.uneven_rotors * (max(shares) - min(shares))
    return min(shares) - margin < fit.values[index][0] < max(shares) + margin


def _by_effect(trials: Sequence[Fit]) -> dict[str, Fit]:
    names = dict.fromkeys(trial.effects[-1] for trial in trials)
    found = {name: _best([trial for trial in trials if trial.effects[-1] == name]) for name in names}
    return {name: trial for name, trial in found.items() if trial is not None}


def _alike(other: Fit, selected: Fit, others: Fit) -> bool:
    """Whether the other is indistinguishable from the selected on the data held out."""
    problem, limit = selected.problem, selected.problem.config.select
    difference = paired(other.loss, selected.loss)
    gain = difference.mean * len(other.loss)
    whole = float(others.loss.sum() - selected.loss.sum())
    expected = problem.worth * problem.measured.size
    left = max(float(selected.loss.sum()) - expected, limit.noise_uncertainty * expected)
    if gain < max(limit.tie_gain, min(limit.tie_share * whole, left)):
        return True
    unsure = max(limit.unsure_gain, min(limit.unsure_share * whole, limit.unsure_left * left))
    return difference.t < limit.tie_t and gain < unsure
