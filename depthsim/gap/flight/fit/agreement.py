"""Whether what was found is what happened, or only the nearest name in the bank."""

from collections.abc import Collection, Sequence

import numpy as np

from depthsim.flight.constants import GRAVITY
from depthsim.flight.table import Floats
from depthsim.gap.flight.effect import family_of, flight_effect
from depthsim.gap.flight.findings import Findings, learn_all, power
from depthsim.gap.flight.fit.intervals import unidentified
from depthsim.gap.flight.fit.optimize import Fit, empty_fit, refitted
from depthsim.gap.flight.fit.select import Selection, significant, without
from depthsim.gap.flight.where.correction import Learned


def objections(found: Findings, trusted: Collection[str] = ()) -> dict[int, str]:
    """Why causes are none, by their number among the candidates; empty where all act where the gap lies.

    trusted: effects that were sound beside others which were not: what these leave behind does not speak against them,
    unless it is as large as they are.

    A wrong name closes much of a gap, and leaves what can be learned on the axes on which its own force lies. A
    residual that is small over a larger cause, itself sound, may be that one's, which has another formula. And an error
    of the accelerometer is none where velocities show the same force.
    """
    fit, limit_of = found.selection.fit, found.problem.config.significance
    fewer = [without(fit, index) for index in range(len(fit.candidates))]
    rows = fit.problem.reported_rows
    signals = [(one.held_out - fit.held_out)[:, 0] for one in fewer]
    powers = [float((signal**2).sum()) for signal in signals]
    limits = [
        limit_of.nearest_beside if effect in trusted else flight_effect(effect).most_left or limit_of.nearest
        for effect in fit.effects
    ]
    lefts = [_left(found, signal[rows], limit) for signal, limit in zip(signals, limits, strict=True)]
    bounded = [one.at_bound(values) for one, values in zip(fit.candidates, fit.values, strict=True)]
    sound = [left <= limit and not end for left, limit, end in zip(lefts, limits, bounded, strict=True)]
    largest = max((power for power, good in zip(powers, sound, strict=True) if good), default=0.0)
    nothing = unidentified(fit)
    wrong = {}
    for index, effect in enumerate(fit.effects):
        left, limit, power = lefts[index], limits[index], powers[index]
        if nothing[index]:
            wrong[index] = "is as well not there, by the intervals of all its parameters"
        elif bounded[index]:
            wrong[index] = "its fit ends at a bound of what is physical"
        elif left > limit and left * power > limit * largest:
            share = f" {left:.0%} of what it closes" if left < 1 else " more than it closes"
            wrong[index] = f"leaves{share} on the axes on which it acts"
        elif _against_velocities(found, signals[index], sensor=family_of(effect) == "sensor"):
            shown = "show the same force" if family_of(effect) == "sensor" else "do not show its force"
            wrong[index] = f"velocities {shown}"
        elif why := _elsewhere(found, effect, fewer[index], alone=len(fit.candidates) == 1):
            wrong[index] = why
    return wrong


def blows(found: Findings) -> bool:
    """Whether a wind in time leaves little that could be learned, as what varies so freely must."""
    whole = power(found.before, found.noise)
    most = max((one.closed for one in found.left if significant(one.gains, found.problem.config)), default=0.0)
    return most * power(found.after, found.noise) <= found.problem.config.significance.left_by_wind * whole


def _elsewhere(found: Findings, effect: str, before: Fit, *, alone: bool) -> str | None:
    """Why an effect does not act where the gap lies that all other causes leave; None if it does.

    The gap must lie on one of its axes, about as much as on any, and it must take most of that away.
    """
    limit = found.problem.config.significance
    residual = before.held_out[before.problem.reported_rows, 0]
    whole = power(residual, found.noise)
    if alone and found.selection.gusts is None:
        learned = list(found.learned)
    else:
        learned = learn_all(found.problem, residual, before.settings, found.noise)
    there = [one for one in learned if significant(one.gains, found.problem.config)]
    if not there or power(found.after, found.noise) < limit.left_of_all * whole:
        return None
    axes = flight_effect(effect).axes
    # In time whatever is smooth can be learned, so that it counts for less.
    counts = {one.axis: one.closed * (limit.also_in_time if one.axis == "time" else 1.0) for one in there}
    most = max(counts.values())
    own = [one for one in there if one.axis in axes and counts[one.axis] > limit.also * most]
    if not own:
        acts, lies = _axis_words(axes), _axis_words([there[0].axis])
        return f"acts along {acts}, and the gap lies along {lies}"
    first = max(own, key=lambda one: counts[one.axis])
    left = next((one for one in found.left if one.axis == first.axis), None)
    share = left.closed * power(found.after, found.noise) / (first.closed * whole) if left is not None else 0.0
    return f"leaves {share:.0%} of what changes along {_axis_words([first.axis])}" if share > limit.left_along else None


def _axis_words(axes: Sequence[str]) -> str:
    names = [axis.replace("_", " ") if axis != "axis" else "the body's axes" for axis in axes]
    return " or ".join(names)


def _left(found: Findings, signal: Floats, limit: float) -> float:
    """What can still be learned on the axes of a cause's force, over its power; infinite where it is more than that.

    signal: (n, A) the cause's force over the mass, as the fit has it [m/s²].
    """
    learned = [one for one in found.left if significant(one.gains, found.problem.config)]
    lasting = [one for one in learned if one.axis != "time"]  # in time whatever is smooth can be learned
    along = (signal**2).mean(axis=0)

    def share(ones: Sequence[Learned]) -> float:
        """Along the axes of the body that the signal has."""
        powers = [np.maximum((found.after**2 - one.residual**2).mean(axis=0), 0) @ along for one in ones]
        return float(max(powers, default=0.0) / (along @ along))

    if share(learned) > 1:
        return np.inf
    if share(lasting) <= limit:
        return share(lasting)
    own = [one for one in learn_all(found.problem, signal, found.problem.base, 0 * found.noise) if one.axis != "time"]
    most = max(one.closed for one in own)
    axes = {one.axis for one in own if one.closed > found.problem.config.significance.also * most}
    return share([one for one in lasting[:2] if one.axis in axes])


def _against_velocities(found: Findings, signal: Floats, *, sensor: bool) -> bool:
    """Whether velocities say the opposite of a cause: they show a sensor's error too, or not a force.

    What they miss on average, the tilt of the attitude that would hide it included, is then as large as the cause. It
    is asked of causes that are there all the time; the mean of others says little.
    """
    fit, problem = found.selection.fit, found.selection.fit.problem
    limit = problem.config.significance
    if fit.residual.shape[1] < 2:
        return False
    missed = fit.held_out[:, 1] + (fit.problem.tilts @ fit.tilts)[:, 1]
    files = np.concatenate([np.full(len(part), part.file) for part in problem.records.parts])
    for file in range(len(problem.records.files)):
        rows = files == file
        seen, left = signal[rows].mean(axis=0), missed[rows].mean(axis=0)
        if np.linalg.norm(seen) < limit.steady * np.sqrt((signal[rows] ** 2).sum(axis=1).mean()):
            continue
        for axes, least in ((slice(0, 2), limit.least_tilt * GRAVITY), (slice(2, 3), limit.least_upward)):
            part = float(np.linalg.norm(seen[axes]))
            along = float(seen[axes] @ left[axes]) / max(part, 1e-9)
            shown = along if sensor else -along
            if (
                shown > least
                and part > limit.main * np.linalg.norm(seen)
                and shown > (limit.sensor_shared if sensor else limit.force_lacking) * part
            ):
                return True
    return False


def only(selection: Selection, kept: tuple[int, ...]) -> Selection:
    """The selection with some of its candidates, fitted again; gusts that acted by a drag that is not kept go too."""
    fit, start = selection.fit, selection.start
    candidates = [fit.candidates[index] for index in kept]
    values = tuple(fit.values[index] for index in kept)
    carried = all(family_of(effect) != "drag" for index, effect in enumerate(fit.effects) if index not in kept)
    gusts = selection.gusts if carried else None
    problem = start.problem if gusts is None else fit.problem
    fewer = refitted(problem, candidates, values) if kept else empty_fit(problem)
    return Selection(start, fewer, gusts, tuple(selection.alternatives[index] for index in kept))
