"""A trajectory: stamped poses of the camera."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from depthsim.errors import InputError
from depthsim.trajectory.rotation import Floats, rotation_matrices, slerp

TOLERANCE = 5e-6
"""[s] A stamp this far outside a trajectory is taken as its end: text files round stamps to microseconds."""
GAP = 0.15
"""[s] Poses farther apart than this leave a gap. What is interpolated there is a guess: across it a nod of 10 degrees
at 1 Hz is off by up to 1.1 degrees. Poses at 10 Hz with their jitter have none, but one that is missing makes one."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Stamped poses of the optical frame (x right, y down, z forward), camera to world.

    stamps: (N,) float64 [s], strictly increasing, N at least 1.
    positions: (N, 3) float64 [m], world frame.
    quaternions: (N, 4) float64, x y z w, unit; what is within 1 % of it was rounded and is normalised.
    name: what errors call it, such as the file it was read from.

    The arrays are copied and read-only. Raises :class:`InputError` where they do not fit.
    """

    stamps: Floats
    positions: Floats
    quaternions: Floats
    name: str = "trajectory"

    def __post_init__(self) -> None:
        arrays = [np.array(item, dtype=np.float64) for item in (self.stamps, self.positions, self.quaternions)]
        stamps, positions, quaternions = arrays
        count = len(stamps) if stamps.ndim == 1 else 0
        if count == 0 or positions.shape != (count, 3) or quaternions.shape != (count, 4):
            shapes = ", ".join(str(array.shape) for array in arrays)
            raise InputError(self.name, "", f"the arrays are {shapes}", "give (N,) stamps, (N, 3) and (N, 4), N > 0")
        for what, array in zip(("stamp", "position", "quaternion"), arrays, strict=True):
            bad = np.flatnonzero(~np.isfinite(array.reshape(count, -1)).all(axis=1))
            if bad.size:
                raise InputError(self.name, f"pose {bad[0]}", f"the {what} is not finite", "give finite numbers")
        late = np.flatnonzero(np.diff(stamps) <= 0)
        if late.size:
            raise InputError(
                self.name, f"pose {late[0] + 1}", "the stamp is not after the one before", "sort the poses"
            )
        norms = np.linalg.norm(quaternions, axis=1)
        bad = np.flatnonzero(np.abs(norms - 1) > 1e-2)
        if bad.size:
            problem = f"the quaternion has length {norms[bad[0]]:.6g}"
            raise InputError(self.name, f"pose {bad[0]}", problem, "give unit quaternions x y z w")
        # What is unit to rounding stays as it is to the last bit, so that a file that is read and written is the same.
        off = np.abs(norms - 1) > 1e-12
        quaternions[off] /= norms[off, None]
        for key, array in zip(("stamps", "positions", "quaternions"), arrays, strict=True):
            array.flags.writeable = False
            object.__setattr__(self, key, array)

    @classmethod
    def of_matrices(cls, stamps: Floats, poses: Floats, name: str) -> "Trajectory":
        """(N, 4, 4) poses as a trajectory; a rotation that is off by rounding becomes the nearest one."""
        from scipy.spatial.transform import Rotation

        return cls(stamps, poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3]).as_quat(), name)

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def duration(self) -> float:
        """From the first stamp to the last [s]."""
        return float(self.stamps[-1] - self.stamps[0])

    def matrices(self) -> Floats:
        """(N, 4, 4) float64: camera to world."""
        poses = np.zeros((len(self), 4, 4))
        poses[:, :3, :3] = rotation_matrices(self.quaternions)
        poses[:, :3, 3] = self.positions
        poses[:, 3, 3] = 1
        return poses

    def at(self, stamps: ArrayLike) -> "Trajectory":
        """The poses at ``stamps`` [s]: linear in position, slerp in rotation, and exact where a stamp has a pose.

        Raises :class:`InputError` for a stamp more than 5 µs outside the trajectory.
        """
        wanted = np.atleast_1d(np.array(stamps, dtype=np.float64))
        first, last = self.stamps[0], self.stamps[-1]
        outside = np.flatnonzero(~((wanted >= first - TOLERANCE) & (wanted <= last + TOLERANCE)))
        if outside.size:
            problem = f"is outside the trajectory, which runs from {first:.6f} to {last:.6f} s"
            raise InputError(self.name, f"stamp {wanted[outside[0]]:.6f} s", problem, "ask for stamps inside it")
        time = np.clip(wanted, first, last)
        after = np.minimum(np.searchsorted(self.stamps, time), len(self) - 1)
        exact = self.stamps[after] == time
        before = np.where(exact, after, after - 1)
        share = np.zeros_like(time)
        np.divide(time - self.stamps[before], self.stamps[after] - self.stamps[before], out=share, where=~exact)
        positions = self.positions[before] + share[:, None] * (self.positions[after] - self.positions[before])
        quaternions = slerp(self.quaternions[before], self.quaternions[after], share)
        positions[exact], quaternions[exact] = self.positions[after[exact]], self.quaternions[after[exact]]
        return Trajectory(wanted, positions, quaternions, self.name)

    def beside(self, pose: Floats) -> "Trajectory":
        """The poses of what stands at ``pose`` (4, 4) in the camera's frame and moves with it."""
        return Trajectory.of_matrices(self.stamps, self.matrices() @ pose, self.name)

    def gaps(self, stamps: ArrayLike) -> Floats:
        """(N,) for each stamp inside the trajectory the length [s] of the gap that it lies in; 0 where it lies in none.

        A gap is longer than :data:`GAP`; a stamp that has a pose lies in none.
        """
        wanted = np.atleast_1d(np.array(stamps, dtype=np.float64))
        after = np.minimum(np.searchsorted(self.stamps, wanted), len(self) - 1)
        before = np.maximum(after - 1, 0)
        lengths = self.stamps[after] - self.stamps[before]
        nearest = np.minimum(np.abs(self.stamps[after] - wanted), np.abs(wanted - self.stamps[before]))
        return np.where((lengths > GAP) & (nearest > TOLERANCE), lengths, 0.0)

    def sampled(self, rate: float, frames: int | None = None) -> "Trajectory":
        """The poses at the first stamp + k / ``rate`` [Hz], to the last stamp or for ``frames`` frames."""
        available = frame_count(self.duration + TOLERANCE, rate, self.name)
        count = wanted_frames(frames, available, self.name)
        return self.at(self.stamps[0] + np.arange(count) / rate)

    def head(self, frames: int | None = None) -> "Trajectory":
        """The first ``frames`` poses as they are, or all of them."""
        count = wanted_frames(frames, len(self), self.name)
        return Trajectory(self.stamps[:count], self.positions[:count], self.quaternions[:count], self.name)


def frame_count(duration: float, rate: float, name: str) -> int:
    """How many frames at ``rate`` [Hz] fit in ``duration`` [s], both ends included; at most a million."""
    if not (math.isfinite(rate) and rate > 0):
        raise InputError(name, "rate", f"is {rate}, not a positive number of Hz", "give frames per second, such as 30")
    frames = duration * rate
    if frames > 1e6:
        raise InputError(name, "", f"makes {frames:.3g} frames at {rate:g} Hz", "shorten it to a million frames")
    return math.floor(frames + 1e-9) + 1


def wanted_frames(frames: int | None, available: int, name: str) -> int:
    """``frames``, or all that are available; asking for more, or for none, is an error."""
    if frames is None:
        return available
    if not 1 <= frames <= available:
        raise InputError(name, "", f"has {available} frames, not {frames}", f"ask for 1 to {available} frames")
    return frames
