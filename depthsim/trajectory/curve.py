"""Moving along a curve at a given speed: arc length and its inverse, and the smooth start and stop."""

from collections.abc import Callable

import numpy as np

from depthsim.trajectory.rotation import Floats

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)

EASE_TIME = 1.0
"""[s] The time that an eased start takes, and an eased stop."""


class ArcLength:
    """The arc length along a curve with parameter u, and the parameter at an arc length.

    velocity: (N,) values of u to (N, 3) derivatives of the position.
    grid: (M,) increasing values of u, fine enough that the speed is smooth in between.
    """

    def __init__(self, velocity: Callable[[Floats], Floats], grid: Floats) -> None:
        self._velocity, self._grid = velocity, grid
        self._arc = np.concatenate([[0.0], np.cumsum(self._lengths(grid[:-1], grid[1:]))])

    @property
    def length(self) -> float:
        """Of the whole curve [m]."""
        return float(self._arc[-1])

    def _lengths(self, start: Floats, end: Floats) -> Floats:
        half = (end - start) / 2
        nodes = start[:, None] + half[:, None] * (1 + _NODES)
        speeds = np.linalg.norm(self._velocity(nodes.ravel()), axis=1).reshape(nodes.shape)
        return np.asarray(half * (speeds @ _WEIGHTS))

    def parameter(self, arc: Floats) -> Floats:
        """(N,) arc lengths [m] to (N,) parameters, by Newton's method within an interval of the grid."""
        cell = np.clip(np.searchsorted(self._arc, arc, side="right") - 1, 0, len(self._grid) - 2)
        low, high, rest = self._grid[cell], self._grid[cell + 1], arc - self._arc[cell]
        u = low + (high - low) * rest / (self._arc[cell + 1] - self._arc[cell])
        for _ in range(4):
            speed = np.linalg.norm(self._velocity(u), axis=1)
            u = np.clip(u - (self._lengths(low, u) - rest) / np.maximum(speed, 1e-9), low, high)
        return u


def eased_duration(length: float, speed: float) -> float:
    """How long ``length`` [m] takes with an eased start and stop, at ``speed`` [m/s] in between."""
    return length / speed + min(EASE_TIME, length / speed)


def eased_arc(time: Floats, length: float, speed: float) -> Floats:
    """Arc length at ``time`` [s]: the speed rises as 3x² - 2x³ over a second, and falls likewise at the end.

    Where the curve is too short for both, they take half the time each and meet at full speed.
    """
    ramp = min(EASE_TIME, length / speed)
    to_end = eased_duration(length, speed) - time

    def risen(since: Floats) -> Floats:
        x = np.clip(since / ramp, 0, 1)
        return speed * (ramp * (x**3 - x**4 / 2) + np.maximum(since - ramp, 0))

    return np.where(time < to_end, risen(time), length - risen(to_end))
