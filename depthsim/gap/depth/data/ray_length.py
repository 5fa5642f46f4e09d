"""Depths that are the lengths of the rays, as some simulators and drivers give them, in place of z along the axis."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

_BINS = 16
"""Of as many pixels each, from the middle of the picture outwards."""
_LEAST = 0.05
"""By which the logarithm of the rays' lengths must differ: of a narrower picture nothing is said."""
_OFF = 0.15
"""Of the slope of the depths over the rays' lengths, both as logarithms, and of what is left beside the slope."""

Floats = NDArray[np.float32]


def are_ray_lengths(looked: Iterable[tuple[Floats, Floats, Floats]]) -> bool:
    """Whether depths grow over the scene's towards the corners as the lengths of the rays do.

    looked: of some frames the recorded depth [m], 0 where there is none or the scene is not trusted, the scene's depth
    [m], and the rays at z = 1 (2, rows, columns).
    """
    ratios, lengths = [], []
    for recorded, clean, (x, y) in looked:
        known = (recorded > 0) & (clean > 0)
        ratios.append(np.log(recorded[known] / clean[known]))
        lengths.append(0.5 * np.log1p(x * x + y * y)[known])
    ratio, length = (np.concatenate(values or [np.empty(0, np.float32)]) for values in (ratios, lengths))
    if len(length) < 100 * _BINS:
        return False
    parts = np.array_split(np.argsort(length), _BINS)
    middles, far = (np.array([np.median(values[part]) for part in parts]) for values in (ratio, length))
    span = float(np.ptp(far))
    if span < _LEAST:
        return False
    slope, level = np.polyfit(far, middles, 1)
    left = float(np.sqrt(np.mean(np.square(middles - slope * far - level))))
    return bool(abs(slope - 1) < _OFF and left < _OFF * span)
