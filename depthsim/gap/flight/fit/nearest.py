"""Whether what was found is what happened, or only the nearest name in the bank."""

from collections.abc import Sequence

import numpy as np

from depthsim.flight.constants import GRAVITY
from depthsim.flight.table import Floats
from depthsim.gap.flight.effect import family_of, flight_effect
from depthsim.gap.flight.findings import Flown, learn_all
from depthsim.gap.flight.fit.optimize import empty_fit, refitted
from depthsim.gap.flight.fit.select import Choice, significant, without
from depthsim.gap.flight.where.correction import Learned

_NEAREST = 0.015
"""Power that can still be learned over what a cause closes: above this it may be only the nearest name. Wrong names
leave 0.02 to 0.1 and more in benchmarks/withheld_flight.py, right ones by another formula up to 0.01."""
_BESIDE = 0.3
"""The same beside a rest that is known to be there."""
_ALSO = 0.8
"""A force lies on every axis on which so much of it is learned, relative to the best."""
_LEVEL = 0.01
"""[rad] tilts below this are the attitude's own error."""
_UPWARD = 0.03
"""[m/s²] upwards a tilt hardly matters."""
_SHARED, _LACKING = 0.25, 0.6
"""Of a sensor's error, what velocities may show at most; of a force, what they may lack."""
_STEADY = 0.5
"""Of a cause's RMS, its mean."""
_MAIN = 0.7
"""Of a cause's mean force: velocities speak against it where most of it is."""


def sound(flown: Flown, again: bool = False) -> tuple[int, ...]:
    """The formulas that are what happened, not only nearest to it in the bank.

    again: for those that were sound beside others which were not: what these leave behind does not speak against them,
    unless it is as large as they are.

    A wrong name closes much of a gap, and leaves what can be learned on the axes on which its own force lies. A rest
    that is small over a larger cause, itself sound, may be that one's, which has another formula. And an error of the
    accelerometer is none where velocities show the same force.
    """
    fit = flown.choice.fit
    signals = [without(fit, index).held_out[:, 0] - fit.held_out[:, 0] for index in range(len(fit.formulas))]
    powers = [float((signal**2).sum()) for signal in signals]
    limits = [_BESIDE if again else flight_effect(effect).most_left or _NEAREST for effect in fit.effects]
    rests = [_rest(flown, signal, limit) for signal, limit in zip(signals, limits, strict=True)]
    for index, (formula, values) in enumerate(zip(fit.formulas, fit.values, strict=True)):
        rests[index] = np.inf if formula.astray(values) else rests[index]
    largest = max(
        (power for power, rest, limit in zip(powers, rests, limits, strict=True) if rest <= limit), default=0.0
    )
    kept = []
    for index, (signal, power, rest, limit) in enumerate(zip(signals, powers, rests, limits, strict=True)):
        small = rest <= limit or rest * power <= limit * largest
        if small and not _against_velocities(flown, signal, sensor=family_of(fit.effects[index]) == "sensor"):
            kept.append(index)
    return tuple(kept)


def _rest(flown: Flown, signal: Floats, limit: float) -> float:
    """What can still be learned on the axes of a cause's force, over its power; infinite where it is more than that.

    signal: (n, A) the cause's force over the mass, as the fit has it [m/s²].
    """
    rest = [one for one in flown.left if significant(one.gains)]
    lasting = [one for one in rest if one.axis != "time"]  # in time whatever is smooth can be learned
    along = (signal**2).mean(axis=0)

    def left(ones: Sequence[Learned]) -> float:
        """Along the axes of the body that the signal has."""
        powers = [np.maximum((flown.after**2 - one.rest**2).mean(axis=0), 0) @ along for one in ones]
        return float(max(powers, default=0.0) / (along @ along))

    if left(rest) > 1:
        return np.inf
    if left(lasting) <= limit:
        return left(lasting)
    own = [one for one in learn_all(flown.problem, signal, flown.problem.base, 0 * flown.noise) if one.axis != "time"]
    most = max(one.closed for one in own)
    axes = {one.axis for one in own if one.closed > _ALSO * most}
    return left([one for one in lasting[:2] if one.axis in axes])


def _against_velocities(flown: Flown, signal: Floats, *, sensor: bool) -> bool:
    """Whether velocities say the opposite of a cause: they show a sensor's error too, or not a force.

    What they miss on average, the tilt of the attitude that would hide it included, is then as large as the cause. It
    is asked of causes that are there all the time; the mean of others says little.
    """
    fit, problem = flown.choice.fit, flown.problem
    if fit.residual.shape[1] < 2:
        return False
    missed = fit.held_out[:, 1] + (fit.problem.tilts @ fit.tilts)[:, 1]
    files = np.concatenate([np.full(len(part), part.file) for part in problem.records.parts])
    for file in range(len(problem.records.files)):
        rows = files == file
        seen, left = signal[rows].mean(axis=0), missed[rows].mean(axis=0)
        if np.linalg.norm(seen) < _STEADY * np.sqrt((signal[rows] ** 2).sum(axis=1).mean()):
            continue
        for axes, least in ((slice(0, 2), _LEVEL * GRAVITY), (slice(2, 3), _UPWARD)):
            part = float(np.linalg.norm(seen[axes]))
            along = float(seen[axes] @ left[axes]) / max(part, 1e-9)
            shown = along if sensor else -along
            if (
                shown > least
                and part > _MAIN * np.linalg.norm(seen)
                and shown > (_SHARED if sensor else _LACKING) * part
            ):
                return True
    return False


def only(choice: Choice, kept: tuple[int, ...]) -> Choice:
    """The choice with some of its formulas, fitted again; gusts that acted by a drag that is not kept go too."""
    fit, start = choice.fit, choice.start
    formulas = [fit.formulas[index] for index in kept]
    values = tuple(fit.values[index] for index in kept)
    carried = all(family_of(effect) != "drag" for index, effect in enumerate(fit.effects) if index not in kept)
    gusts = choice.gusts if carried else None
    problem = start.problem if gusts is None else fit.problem
    fewer = refitted(problem, formulas, values) if kept else empty_fit(problem)
    return Choice(start, fewer, gusts, tuple(choice.alternatives[index] for index in kept))
