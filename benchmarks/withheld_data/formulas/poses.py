"""Recorded poses that are off, each frame's by its own."""

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng
from benchmarks.withheld_data.route import AROUND

_RATE = 30.0
"""[Hz] at which the system that gives the poses works."""


def _between(film: Film, times: Floats, values: Floats) -> Floats:
    """(N, k) values at ``_RATE`` from ``AROUND`` before the first frame on, linear in between."""
    at = (np.asarray(times) - film.stamps[0] + AROUND) * _RATE
    return np.stack([np.interp(at, np.arange(len(values)), part) for part in values.T], axis=1)


def _ticks(film: Film) -> int:
    return int(np.ceil((film.stamps[-1] - film.stamps[0] + 2 * AROUND) * _RATE)) + 1


class PulledWalk(Formula):
    """Steps of one size to either side with a pull back, in all six directions: a tracker that is lost and corrected.

    amount: standard deviation of a turn [deg]; lever: of a shift over that of a turn [m/rad].
    """

    effect = "pose_noise"
    span = (5e-3, 6.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.memory, self.lever = float(rng.choice([0.0, 0.1, 0.5])), float(rng.uniform(0.2, 1.0))
        keep = float(np.exp(-1 / (_RATE * self.memory))) if self.memory else 0.0
        steps = rng.choice([-1.0, 1.0], (_ticks(film) + 60, 6))
        walk = np.zeros_like(steps)
        for k in range(1, len(steps)):
            walk[k] = keep * walk[k - 1] + np.sqrt(1 - keep**2) * steps[k]
        self._walk = walk[60:] * rng.uniform(0.6, 1.4, 6)

    def off(self, film: Film, times: Floats) -> Floats:
        """A turn and a shift."""
        six = np.radians(self.amount) * _between(film, times, self._walk)
        poses = np.tile(np.eye(4), (len(six), 1, 1))
        poses[:, :3, :3] = Rotation.from_rotvec(six[:, :3]).as_matrix()
        poses[:, :3, 3] = self.lever * six[:, 3:]
        return poses


class JointSteps(Formula):
    """An arm with a camera whose joints, which turn as it moves, are read in steps, and shake.

    amount: the step of a joint [deg].
    """

    effect = "pose_noise"
    span = (0.01, 15.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.joints, self.shake = int(rng.integers(3, 6)), float(rng.uniform(0.1, 0.4))
        self._axis = rng.normal(size=(self.joints, 3))
        self._axis /= np.linalg.norm(self._axis, axis=1, keepdims=True)
        self._place = rng.normal(0, 0.3, (self.joints, 3))
        poses = film.route.at(film.stamps[0] - AROUND + np.arange(_ticks(film)) / _RATE)
        turns = Rotation.from_matrix(poses[0, :3, :3].T @ poses[:, :3, :3]).as_rotvec()
        moved = np.hstack([turns, poses[:, :3, 3] - poses[0, :3, 3]])
        self._angles = moved @ rng.normal(size=(6, self.joints)) + rng.uniform(0, 2 * np.pi, self.joints)
        self._shaken = self.shake * rng.uniform(-1, 1, self._angles.shape)

    def off(self, film: Film, times: Floats) -> Floats:
        """One joint after another."""
        turned = _between(film, times, self._angles) / np.radians(self.amount)
        steps = turned - np.round(turned) + _between(film, times, self._shaken)
        poses = np.tile(np.eye(4), (len(steps), 1, 1))
        for axis, place, angle in zip(self._axis, self._place, np.radians(self.amount) * steps.T, strict=True):
            one = np.tile(np.eye(4), (len(angle), 1, 1))
            one[:, :3, :3] = Rotation.from_rotvec(angle[:, None] * axis).as_matrix()
            one[:, :3, 3] = place - one[:, :3, :3] @ place
            poses = poses @ one
        return poses
