"""What the logs say of each parameter: its interval, within its bounds, and whether they say anything."""

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.flight.fit.optimize import Fit

_DRAWS = 400
_OF_SAMPLE = 0.1


def intervals(fit: Fit, seed: int = 0) -> list[Floats]:
    """(2, parameters) of each candidate: low and high ends of the 95 % intervals.

    By drawing blocks of time anew, each time with all parameters together and none beyond its bounds. Times are known
    no better than a part of the samples' distance: what a recorder does in between is not in the log.
    """
    draws = fit.draws(_DRAWS, seed)
    between = _OF_SAMPLE / min(part.rate for part in fit.problem.records.parts)
    found = []
    for candidate, values, part in zip(fit.candidates, fit.values, fit.parts(draws), strict=True):
        least = np.array([between if one.unit == "s" else 0.0 for one in candidate.parameters])
        bounds = np.array([(one.low, one.high) for one in candidate.parameters]).reshape(-1, 2)
        low, high = np.percentile(np.array(values) + part, [2.5, 97.5], axis=0)
        low, high = np.minimum(low, values - least), np.maximum(high, values + least)
        found.append(np.clip([low, high], bounds[:, 0], bounds[:, 1]))
    return found


def unidentified(fit: Fit, seed: int = 0) -> tuple[bool, ...]:
    """Of each candidate whether every parameter may as well be where it changes nothing."""
    found = []
    for candidate, (low, high) in zip(fit.candidates, intervals(fit, seed), strict=True):
        nothing = np.array([one.nothing for one in candidate.parameters])
        found.append(bool(((low <= nothing) & (nothing <= high)).all()))
    return tuple(found)
