"""The projector's pattern: dots in semi-random places, the same for every frame."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Draws
from depthsim.stereo.settings import Projector

PITCH = 1 / 1600
"""Between two samples of the pattern, at distance 1: under a third of a pixel at 1280x720."""
_JITTER = 0.8
"""How much of its cell a dot may lie in: dots keep a distance, as on a real D435."""
_UNEVEN = 0.25
"""Standard deviation of the dots' powers, by share."""


@lru_cache(maxsize=4)
def dot_pattern(projector: Projector) -> NDArray[np.float32]:
    """(down, across) float32 radiant intensity [W/sr] on the plane at distance 1; its middle is the projector's axis.

    A dot is a Gaussian in that plane; all of them together have the projector's power.
    """
    half = np.tan(np.radians(projector.field) / 2)
    shape = 2 * np.ceil(half[::-1] / PITCH).astype(int) + 1
    image = np.zeros(shape, np.float32)
    if not projector.dots:
        return image
    across = max(round(float(np.sqrt(projector.dots * half[0] / half[1]))), 1)
    down = max(round(projector.dots / across), 1)
    draws = Draws(projector.pattern, "dot pattern", 0)
    jitter = (draws.uniform((2, down, across)) - 0.5) * _JITTER + 0.5
    strength = np.maximum(1 + _UNEVEN * draws.normal((down, across), stream=1), 0.2)
    x = ((np.arange(across) + jitter[0]) / across * 2 - 1) * half[0]
    y = ((np.arange(down)[:, None] + jitter[1]) / down * 2 - 1) * half[1]
    strength = strength / strength.sum() * projector.power
    width = projector.dot_width * 1e-3
    reach = int(np.ceil(4 * width / PITCH))
    steps = np.arange(-reach, reach + 1)
    for u, v, power in zip(x.ravel(), y.ravel(), strength.ravel(), strict=True):
        column, row = u / PITCH + (shape[1] - 1) / 2, v / PITCH + (shape[0] - 1) / 2
        at_u, at_v = round(column) + steps, round(row) + steps
        bell_u = np.exp(-(((at_u - column) * PITCH / width) ** 2) / 2)
        bell_v = np.exp(-(((at_v - row) * PITCH / width) ** 2) / 2)
        bell_u, at_u = _inside(bell_u, at_u, shape[1])
        bell_v, at_v = _inside(bell_v, at_v, shape[0])
        # A solid angle is smaller off the axis: the cube of its cosine.
        peak = power / (2 * np.pi * width**2) * (1 + u * u + v * v) ** 1.5
        image[at_v[:, None], at_u] += (peak * bell_v[:, None] * bell_u).astype(np.float32)
    image.setflags(write=False)
    return image


def _inside(
    bell: NDArray[np.float64], at: NDArray[np.int64], size: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    keep = (at >= 0) & (at < size)
    return bell[keep], at[keep]
