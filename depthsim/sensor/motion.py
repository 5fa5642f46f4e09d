"""Where the camera is at any time, for the effects that ask: stamps that are off, rows one after another, motion."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthsim.trajectory import Trajectory
from depthsim.trajectory.rotation import rotation_matrices, slerp

_AT_ONCE, _KEPT = 3, 256
"""So few moments are a frame's own, whose poses many sensors ask for; so many of them are kept."""


class Motion:
    """The camera's pose as a function of time: a trajectory that goes on beyond its ends as it came and left.

    pose: (4, 4) of the first moment, camera to world. start: when the first frame is taken [s]; 0 for a camera that
    stands. frames: the poses of the run's frames, by number.
    """

    def __init__(
        self,
        trajectory: Trajectory | None,
        pose: NDArray[np.float64],
        start: float = 0.0,
        frames: Trajectory | None = None,
    ) -> None:
        self._trajectory, self._pose, self._frames = trajectory, pose, frames
        self.start = start
        self._moments: dict[bytes, NDArray[np.float64]] = {}

    @classmethod
    def along(cls, frames: Trajectory, truth: Trajectory | None = None) -> "Motion":
        """A camera that goes along the poses of its ``frames``; one pose stands still.

        truth: all that is known of its way, where that is more than the poses of the frames: it is gone along instead.
        """
        known = truth or frames
        return cls(known if len(known) > 1 else None, known.head(1).matrices()[0], float(frames.stamps[0]), frames)

    @classmethod
    def still(cls, pose: NDArray[np.float64]) -> "Motion":
        """A camera that stands at ``pose``, (4, 4) camera to world."""
        return cls(None, np.asarray(pose, np.float64))

    def at(self, stamps: ArrayLike) -> NDArray[np.float64]:
        """(N, 4, 4) poses, camera to world, at ``stamps`` [s]: linear and slerp between the trajectory's poses.

        Beyond the ends the velocities of the first and the last interval go on.
        """
        wanted = np.atleast_1d(np.asarray(stamps, np.float64))
        if len(wanted) > _AT_ONCE:
            return self._at(wanted)
        key = wanted.tobytes()
        found = self._moments.get(key)
        if found is None:
            if len(self._moments) >= _KEPT:
                self._moments.clear()
            found = self._moments[key] = self._at(wanted)
        return found.copy()

    def _at(self, wanted: NDArray[np.float64]) -> NDArray[np.float64]:
        known = self._trajectory
        poses = np.repeat(self._pose[None], len(wanted), axis=0)
        if known is None:
            return poses
        after = np.clip(np.searchsorted(known.stamps, wanted, side="right"), 1, len(known) - 1)
        before = after - 1
        share = (wanted - known.stamps[before]) / (known.stamps[after] - known.stamps[before])
        step = known.positions[after] - known.positions[before]
        poses[:, :3, 3] = known.positions[before] + share[:, None] * step
        poses[:, :3, :3] = rotation_matrices(slerp(known.quaternions[before], known.quaternions[after], share))
        return poses

    @cached_property
    def _poses(self) -> NDArray[np.float64]:
        return np.empty((0, 4, 4)) if self._frames is None else self._frames.matrices()

    def frame(self, index: int, stamp: float, back: int, rate: float) -> tuple[float, NDArray[np.float64]]:
        """Stamp [s] and pose (4, 4) of the frame that is ``back`` before the one of number ``index`` at ``stamp``.

        Those of the run's frames, where that is one of them; otherwise frames come at ``rate`` [Hz].
        """
        known = self._frames
        if known is not None and index < len(known) and known.stamps[index] == stamp:
            return float(known.stamps[index - back]), self._poses[index - back]
        return stamp - back / rate, self.at(stamp - back / rate)[0]

    def velocity(self, stamp: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(3,) linear [m/s] and (3,) angular [rad/s] velocity at ``stamp``, in the camera's own axes."""
        return velocity_of(self.at, stamp)


def velocity_of(
    at: Callable[[ArrayLike], NDArray[np.float64]], stamp: float, step: float = 5e-3
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """:meth:`Motion.velocity` of what has the poses ``at``, by the difference over two ``step``s [s]."""
    first, middle, last = at([stamp - step, stamp, stamp + step])
    linear = middle[:3, :3].T @ (last[:3, 3] - first[:3, 3]) / (2 * step)
    turn = first[:3, :3].T @ last[:3, :3] / (4 * step)
    return linear, np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
