"""Which effects the logs speak for: forward selection, exchange, and the effects that would do as well.

An effect is taken in when it makes the held-out residuals smaller than chance does. Then each one that was taken is put
to the test again: is it needed beside the others, would another do better in its place, and which do as well? A wind
with a course in time is no candidate, as it cannot be predicted from one stretch for another; see wind.py.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.config import FlightConfig
from depthsim.gap.flight.data.evidence import Problem
from depthsim.gap.flight.effect import Candidate, family_of
from depthsim.gap.flight.effects.rotors import EACH, UNEVEN, RotorThrustDifference, logged_shares
from depthsim.gap.flight.effects.wind import ConstantWind
from depthsim.gap.flight.fit.intervals import intervals, unidentified
from depthsim.gap.flight.fit.optimize import Fit, extended, refitted
from depthsim.gap.flight.fit.series import Series
from depthsim.gap.flight.fit.wind import Windy, is_wind, with_wind
from depthsim.gap.flight.where.correction import learn_time
from depthsim.gap.resampling import paired
from depthsim.gap.selection import closes_enough, is_tie, plainest

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


def select(start: Fit, bank: Sequence[Candidate], gusts: bool = True, say: Progress = lambda _: None) -> Selection:
    """The effects of the bank that the logs speak for, and a wind with a course in time if it is asked for.

    start: without any effect.
    """
    fit = _grown(start, bank, start, say)
    windy = _windy(fit, bank, start, say) if gusts else None
    if windy is not None:
        fit, bank = windy.fit, _windless(bank)
    say("alternatives")
    fit, alternatives = _exchanged(fit, bank, start)
    fit = _plainer(_said(fit, bank))
    return Selection(start, fit, windy.series if windy else None, alternatives)


def _grown(fit: Fit, bank: Sequence[Candidate], start: Fit, say: Progress) -> Fit:
    """Forward selection on top of a fit."""
    config = fit.problem.config
    while len(fit.candidates) < config.select.most_causes:
        say(f"effect {len(fit.candidates) + 1}")
        best = _best(_trials(fit, bank))
        if best is None or not _worth(fit, best, start):
            break
        more = _pruned(refitted(fit.problem, best.candidates, best.values), start)
        if fit.loss.sum() - more.loss.sum() < config.significance.least_gain:
            break
        fit = more
    return fit


def _windy(fit: Fit, bank: Sequence[Candidate], start: Fit, say: Progress) -> Windy | None:
    """The fit with a wind that changes in place of the constant one, where the logs speak for that.

    What a constant error of a sensor or other effects have taken up of it may be its own: it is tried beside the
    effects that were found, but for winds and sensors, and beside none, and all others must be found again.
    """
    problem, config = start.problem, start.problem.config
    left = learn_time(problem, fit.held_out[:, 0], problem.sigma[0])[0].gains
    if not significant(left[problem.selecting], config) and not any(
        family_of(effect) in _LIKE_WIND for effect in fit.effects
    ):
        return None
    say("wind in time")
    pairs = list(zip(fit.candidates, fit.values, strict=True))
    kept = [pair for pair in pairs if family_of(pair[0].effect) not in _LIKE_WIND]
    level = ConstantWind.level()
    best: Windy | None = None
    for seed in [[], kept] if kept else [[]]:
        candidates, values = [one for one, _ in seed], tuple(value for _, value in seed)
        steady = refitted(problem, [*candidates, level], (*values, tuple(level.starts)))
        windy = with_wind(problem, candidates, values, problem.steady_course(steady.values[-1]))
        if windy is None:
            continue
        gains = steady.loss - windy.fit.loss
        if not significant(gains, config) or not is_wind(steady, windy):
            continue
        more = _grown(windy.fit, _windless(bank), start, say)
        if more.candidates != windy.fit.candidates:
            again = with_wind(problem, more.candidates, more.values, windy.series.course)
            windy = again if again is not None else windy
        if best is None or float((best.fit.loss - windy.fit.loss).sum()) > config.significance.least_gain:
            best = windy
    if best is None:
        return None
    gain, closed = float((fit.loss - best.fit.loss).sum()), float((start.loss - best.fit.loss).sum())
    replaced = any(family_of(effect) in _LIKE_WIND for effect in fit.effects if effect not in best.fit.effects)
    unsaid = _loss(fit) - _expected(problem)
    enough = replaced or gain > config.select.gusts_share * closed or gain > config.select.further_of_left * unsaid
    return best if significant(fit.loss - best.fit.loss, config) and enough else None


def _windless(bank: Sequence[Candidate]) -> list[Candidate]:
    """Without the constant wind, which is the mean of the gusts."""
    return [candidate for candidate in bank if family_of(candidate.effect) != "wind"]


def significant(gains: Floats, config: FlightConfig) -> bool:
    """Whether gains of the held-out loss by block (B,) are more than chance.

    Either most blocks have their part in it, or it is large even without the block that gains most: an effect such as
    the ground's is there for moments only.
    """
    least, total = config.significance.least_gain, float(gains.sum())
    most = float(gains.max(initial=0.0))
    sure = paired(gains, 0 * gains).t > config.significance.least_t
    return total > least and (sure or total - most > 3 * least)


def _expected(problem: Problem) -> float:
    """The loss of noise alone."""
    return problem.worth * float(problem.counts[problem.selecting].sum()) * problem.sigma.size


def _trials(fit: Fit, bank: Sequence[Candidate]) -> list[Fit]:
    return [extended(fit, candidate) for candidate in bank if candidate.effect not in fit.effects]


def _best(trials: Sequence[Fit]) -> Fit | None:
    """The one with the least loss; of its effect the plainest candidate that is not worse."""
    best = min(trials, key=_loss, default=None)
    own = [trial for trial in trials if best and trial.effects[-1] == best.effects[-1]]
    return plainest(own, _loss, lambda trial: len(trial.values[-1]), best.problem.config.select.tie_gain if best else 0)


def _loss(fit: Fit) -> float:
    return float(fit.loss.sum())


def _clearly(worse: Fit, better: Fit) -> bool:
    """Whether ``better`` is better by more than chance."""
    difference = paired(worse.loss, better.loss)
    limit = better.problem.config.select
    return difference.mean * len(worse.loss) > limit.tie_gain and difference.t > limit.tie_t


def _worth(before: Fit, after: Fit, start: Fit) -> bool:
    """Whether what one cause more closes is more than chance, and enough for a name.

    What is little beside a cause of the same family may be that one's, by another formula than the candidate's.
    """
    problem, config = start.problem, start.problem.config
    noise = float(problem.counts[problem.selecting].sum() * (problem.sigma[0] ** 2).sum())
    whole, left, rest = (float(fit.squares[problem.selecting, 0].sum()) - noise for fit in (start, before, after))
    families = {family_of(effect) for effect in before.effects} - {"other"}
    alike = any(family_of(effect) in families for effect in after.effects if effect not in before.effects)
    faint = config.significance.faint**2 * noise
    enough = closes_enough(left - rest, np.inf if alike else left, whole, faint, config.select)
    return enough and significant(before.loss - after.loss, config)


def _pruned(fit: Fit, start: Fit) -> Fit:
    """Without the candidates that are no longer needed beside the others."""
    while len(fit.candidates) > 1:
        smaller = [without(fit, index) for index in range(len(fit.candidates))]
        weakest = min(smaller, key=_loss)
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
            alone = len(fit.candidates) == 1 and fit.problem is start.problem
            others = start if alone else without(fit, index)
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


def _said(fit: Fit, bank: Sequence[Candidate]) -> Fit:
    """With plainer candidates for effects whose every parameter may be where it changes nothing.

    Two parameters that do the same to a log, as a thrust's scale and offset do in a hover, hide each other.
    """
    for index, hidden in enumerate(unidentified(fit)):
        before, after = slice(None, index), slice(index + 1, None)
        fits = [
            refitted(
                fit.problem,
                (*fit.candidates[before], one, *fit.candidates[after]),
                (*fit.values[before], tuple(one.starts), *fit.values[after]),
            )
            for one in bank
            if hidden and one.effect == fit.effects[index] and len(one.parameters) < len(fit.values[index])
        ]
        fit = min(fits, key=_loss, default=fit)
    return fit


def _plainer(fit: Fit) -> Fit:
    """Without the parameters that the logs do not speak for: they stay where they change nothing."""
    for index in range(len(fit.candidates)):
        place = 0
        while place < len(fit.candidates[index].parameters) and len(fit.candidates[index].parameters) > 1:
            candidate = fit.candidates[index]
            one = candidate.parameters[place]
            low, high = intervals(fit)[index][:, place] if one.spare else (np.inf, -np.inf)
            if low <= one.nothing <= high:
                values = (*fit.values[index][:place], *fit.values[index][place + 1 :])
                fewer = refitted(
                    fit.problem,
                    (*fit.candidates[:index], candidate.holding(place), *fit.candidates[index + 1 :]),
                    (*fit.values[:index], values, *fit.values[index + 1 :]),
                )
                if fewer.loss.sum() - fit.loss.sum() < fit.problem.config.select.tie_gain:
                    fit = fewer
                    continue
            place += 1
    return fit


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
    expected = _expected(problem)
    left = max(float(selected.loss.sum()) - expected, limit.noise_uncertainty * expected)
    margin = max(limit.tie_gain, min(limit.tie_share * whole, left))
    unsure = max(limit.unsure_gain, min(limit.unsure_share * whole, limit.unsure_left * left))
    return is_tie(gain, margin, unsure, lambda: difference.t >= limit.tie_t)
