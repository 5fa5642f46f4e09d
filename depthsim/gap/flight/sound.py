"""Whether what was found is what happened, or only the nearest name in the bank."""

from collections.abc import Sequence

import numpy as np

from depthsim.flight.constants import GRAVITY
from depthsim.flight.table import Floats
from depthsim.gap.flight.choice import Choice, significant, without
from depthsim.gap.flight.fit import empty_fit, refitted
from depthsim.gap.flight.flown import Flown, learn_all
from depthsim.gap.flight.learn import Learned

_NEAREST = 0.01
"""Power that can still be learned over what a cause closes: above this it may be only the nearest name."""
_ALSO = 0.8
"""A force lies on every axis on which so much of it is learned, relative to the best."""
_SENSOR = ("imu_bias", "imu_misalignment")
_LEVEL = 0.01
"""[rad] tilts below this are the attitude's own error."""
_UPWARD = 0.03
"""[m/s²] upwards a tilt hardly matters."""
_AS_LARGE = 0.4


def sound(flown: Flown) -> tuple[int, ...]:
    """The formulas that are what happened, not only nearest to it in the bank.

    A wrong name closes much of a gap, and leaves what can be learned on the axes on which its own force lies. And an
    error of the accelerometer is none where velocities show the same force.
    """
    fit, noise = flown.choice.fit, flown.noise
    rest = [one for one in flown.left if significant(one.gains)]
    lasting = [one for one in rest if one.axis != "time"]  # in time whatever is smooth can be learned
    kept = []
    for index in range(len(fit.formulas)):
        signal = without(fit, index).held_out[:, 0] - fit.held_out[:, 0]
        along = (signal**2).mean(axis=0)

        def left(ones: Sequence[Learned], along: Floats = along) -> float:
            """What can still be learned over the signal's power, along the axes of the body that the signal has."""
            powers = [np.maximum((flown.after**2 - one.rest**2).mean(axis=0), 0) @ along for one in ones]
            return float(max(powers, default=0.0) / (along @ along))

        if left(rest) > 1:
            continue
        if left(lasting) > _NEAREST:
            own = [one for one in learn_all(flown.problem, signal, flown.problem.base, 0 * noise) if one.axis != "time"]
            most = max(one.closed for one in own)
            axes = {one.axis for one in own if one.closed > _ALSO * most}
            if left([one for one in lasting[:2] if one.axis in axes]) > _NEAREST:
                continue
        if not _against_velocities(flown, signal, sensor=fit.effects[index] in _SENSOR):
            kept.append(index)
    return tuple(kept)


def _against_velocities(flown: Flown, signal: Floats, *, sensor: bool) -> bool:
    """Whether velocities say the opposite of a cause: they show a sensor's error too, or not a force.

    What they miss on average, the tilt of the attitude that would hide it included, is then as large as the cause.
    """
    fit, problem = flown.choice.fit, flown.problem
    if fit.residual.shape[1] < 2:
        return False
    missed = fit.held_out[:, 1] + (fit.problem.tilts @ fit.tilts)[:, 1]
    files = np.concatenate([np.full(len(part), part.file) for part in problem.records.parts])
    for file in range(len(problem.records.files)):
        seen, left = signal[files == file].mean(axis=0), missed[files == file].mean(axis=0)
        off = seen - left if sensor else seen + left
        for axes, least in ((slice(0, 2), _LEVEL * GRAVITY), (slice(2, 3), _UPWARD)):
            size = float(np.linalg.norm(left[axes]))
            if size > least and np.linalg.norm(off[axes]) < _AS_LARGE * size:
                return True
    return False


def only(choice: Choice, kept: tuple[int, ...]) -> Choice:
    """The choice with some of its formulas, fitted again."""
    fit = choice.fit
    formulas = [fit.formulas[index] for index in kept]
    values = tuple(fit.values[index] for index in kept)
    problem = fit.problem
    fewer = refitted(problem, formulas, values) if kept else empty_fit(problem)
    return Choice(choice.start, fewer, choice.gusts, tuple(choice.alternatives[index] for index in kept))
