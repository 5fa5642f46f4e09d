"""Errors that are locked to the pixel: the same in frames far apart, whatever the camera looks at."""

from collections.abc import Iterable
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

_LEAST = 100
"""Pixels that two frames share, with fewer of which nothing is said."""


def locked_share(signs: Iterable[NDArray[np.int8]]) -> float:
    """How errors of a pixel go together from frame to frame: the mean product of their signs over the frames' means.

    signs: (rows, columns) of frames far apart in time, as for :func:`~depthsim.gap.depth.data.waves.strongest_wave`.
    0 for noise that is drawn anew, or of fewer than two frames; 1 where every error stays on its side.
    """
    products = []
    for one, other in combinations(signs, 2):
        both = (one != 0) & (other != 0)
        if both.sum() >= _LEAST:
            a, b = one[both].astype(np.float64), other[both].astype(np.float64)
            products.append(float((a * b).mean() - a.mean() * b.mean()))
    return float(np.mean(products)) if products else 0.0
