"""What is said of a wind with a course in time: its mean, its strength, and the time over which it stays alike.

They are those of the wind of these flights. Of gusts that stay alike for much of a flight it has seen too few to say
for how long, and of those that are over between two knots too little: that time is then left out, and a vehicle.yaml
has it from the height.
"""

from typing import Any

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.diagnosis import rounded
from depthsim.gap.flight.data.evidence import Problem
from depthsim.gap.flight.fit.series import KNOTS, Series

_FASTEST = 2
"""Knots that gusts must stay alike for."""
_ENOUGH = 10
"""Times that a correlation time must go into the longest flight."""


def gust_parameters(problem: Problem, series: Series, seed: int = 0) -> tuple[dict[str, Any], dict[str, Any]]:
    """The keys of a vehicle.yaml's gusts, and their 95 % intervals, by drawing what the course leaves anew."""
    found, draws = _figures(series.knots), _figures(series.draws(problem, seed))
    low, high = np.percentile(draws, [2.5, 97.5], axis=0)
    # Noise makes a course rougher, and so do draws of noise: they are about their own mean, and not about the truth.
    shift = found - draws.mean(axis=0)
    least = np.array([0.0, 0.0, 0.0, KNOTS / 2])  # of what is between two knots nothing is known
    low, high = np.minimum(low + shift, found - least), np.maximum(high + shift, found + least)
    low[2:] = np.maximum(low[2:], 0.0)
    base = problem.base.wind[:2]
    velocity, lowest, highest = ([*(one[:2] + base).tolist(), 0.0] for one in (found, low, high))
    parameters: dict[str, Any] = {"velocity": velocity, "intensity": float(found[2])}
    intervals: dict[str, Any] = {
        "velocity": list(zip(lowest, highest, strict=True)),
        "intensity": (float(low[2]), float(high[2])),
    }
    longest = max(float(np.ptp(time)) for time, _ in series.course)
    if low[3] > _FASTEST * KNOTS and _ENOUGH * high[3] < longest:
        parameters["correlation_time"] = float(found[3])
        intervals["correlation_time"] = (float(low[3]), float(high[3]))
    return rounded(parameters), rounded(intervals)


def _figures(knots: Floats) -> Floats:
    """(..., 4) mean along x and y, standard deviation [m/s] and correlation time [s] of courses (..., k, 2)."""
    mean = knots.mean(axis=-2)
    calm, count = knots - mean[..., None, :], knots.shape[-2]
    powers = np.abs(np.fft.rfft(calm, 2 * count, axis=-2)) ** 2
    alike = np.fft.irfft(powers, axis=-2)[..., :count, :].sum(axis=-1)
    alike = alike / np.maximum(alike[..., :1], 1e-12) - 1 / np.e
    alike[..., -1] = -1.0
    after = np.argmax(alike < 0, axis=-1)[..., None]
    above, below = (np.take_along_axis(alike, at, axis=-1)[..., 0] for at in (np.maximum(after - 1, 0), after))
    time = KNOTS * (after[..., 0] - below / np.minimum(below - above, -1e-12))
    spread = np.sqrt(calm.var(axis=-2).mean(axis=-1))
    return np.concatenate([mean, spread[..., None], time[..., None]], axis=-1)
