"""Whether what was found is what happened, or only the nearest name in the bank."""

from collections.abc import Sequence

import numpy as np

from depthsim.flight.constants import GRAVITY
from depthsim.flight.table import Floats
from depthsim.gap.flight.effect import family_of, flight_effect
from depthsim.gap.flight.findings import Findings, learn_all
from depthsim.gap.flight.fit.optimize import empty_fit, refitted
from depthsim.gap.flight.fit.select import Selection, significant, without
from depthsim.gap.flight.where.correction import Learned


def sound(found: Findings, again: bool = False) -> tuple[int, ...]:
    """The candidates that are what happened, not only nearest to it in the bank.

    again: for those that were sound beside others which were not: what these leave behind does not speak against them,
    unless it is as large as they are.

    A wrong name closes much of a gap, and leaves what can be learned on the axes on which its own force lies. A
    residual that is small over a larger cause, itself sound, may be that one's, which has another formula. And an error
    of the accelerometer is none where velocities show the same force.
    """
    fit, limit_of = found.selection.fit, found.problem.config.significance
    signals = [without(fit, index).held_out[:, 0] - fit.held_out[:, 0] for index in range(len(fit.candidates))]
    powers = [float((signal**2).sum()) for signal in signals]
    limits = [
        limit_of.nearest_beside if again else flight_effect(effect).most_left or limit_of.nearest
        for effect in fit.effects
    ]
    lefts = [_left(found, signal, limit) for signal, limit in zip(signals, limits, strict=True)]
    for index, (candidate, values) in enumerate(zip(fit.candidates, fit.values, strict=True)):
        lefts[index] = np.inf if candidate.at_bound(values) else lefts[index]
    largest = max(
        (power for power, left, limit in zip(powers, lefts, limits, strict=True) if left <= limit), default=0.0
    )
    kept = []
    for index, (signal, power, left, limit) in enumerate(zip(signals, powers, lefts, limits, strict=True)):
        small = left <= limit or left * power <= limit * largest
        if small and not _against_velocities(found, signal, sensor=family_of(fit.effects[index]) == "sensor"):
            kept.append(index)
    return tuple(kept)


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
    fit, problem = found.selection.fit, found.problem
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
