"""When and from where a frame is taken."""

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


def _rigid(turn: Rotation, shift: Floats | None = None) -> Floats:
    """(4, 4) of a turn and a shift [m]."""
    pose = np.eye(4)
    pose[:3, :3] = turn.as_matrix()
    if shift is not None:
        pose[:3, 3] = shift
    return pose


class JitteredDelay(Formula):
    """A late stamp that jitters by a fifth of the delay from frame to frame."""

    effect = "time_offset"
    span = (1e-3, 0.15)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))
        self.jitter = float(rng.uniform(0.05, 0.2))

    def delay(self, take: Take) -> float:
        """The mean and the jitter."""
        return self.sign * self.amount * (1 + self.jitter * float(take.rng("delay").uniform(-1.7, 1.7)))

    def known(self) -> dict[str, float]:
        """The mean."""
        return {"offset": self.sign * self.amount}


class SkewedClock(Formula):
    """The camera's clock runs at another rate: the delay grows through the run by half of its mean, up and down."""

    effect = "time_offset"
    span = (1e-3, 0.12)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))
        self.skew = float(rng.uniform(-0.3, 0.3))

    def delay(self, take: Take) -> float:
        """Linear in time."""
        share = take.stamp / max(take.film.route.duration, 1e-6) - 0.5
        return self.sign * self.amount * (1 + self.skew * share)

    def known(self) -> dict[str, float]:
        """The mean."""
        return {"offset": self.sign * self.amount}


class RowByRow(Formula):
    """Rows in groups of eight, read one group after another about a moment near the stamp."""

    effect = "rolling_shutter"
    span = (2e-3, 0.08)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.group = int(rng.choice([1, 4, 8]))
        self.middle = float(rng.uniform(0.45, 0.55))

    def delay(self, take: Take) -> Floats:
        """One for each row."""
        height = take.film.camera.height
        row = np.arange(height) // self.group * self.group + (self.group - 1) / 2
        return self.amount * ((row + 0.5) / height - self.middle)

    def known(self) -> dict[str, float]:
        """From the first row to the last."""
        return {"readout": self.amount}


class UnevenReadout(Formula):
    """A readout that slows down from top to bottom; its mean moment is that of the stamp."""

    effect = "rolling_shutter"
    span = (2e-3, 0.08)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.power = float(rng.uniform(0.75, 1.35))

    def delay(self, take: Take) -> Floats:
        """A power of the row's place."""
        height = take.film.camera.height
        share = ((np.arange(height) + 0.5) / height) ** self.power
        return self.amount * (share - share.mean())


class TurnedMount(Formula):
    """Yaw, pitch and roll one after another, as a mount is adjusted by hand."""

    effect = "extrinsic_rotation"
    span = (0.02, 8.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        axis = rng.normal(size=3)
        self._share = axis / np.linalg.norm(axis)

    def _turn(self) -> Rotation:
        """Degrees about y, then x, then z."""
        x, y, z = self._share * self.amount
        return Rotation.from_euler("YXZ", [y, x, z], degrees=True)

    def moved(self, take: Take) -> Floats:
        """The same in every frame."""
        return _rigid(self._turn())

    def known(self) -> dict[str, float]:
        """The rotation vector [deg]."""
        x, y, z = np.degrees(self._turn().as_rotvec())
        return {"x": float(x), "y": float(y), "z": float(z)}


class OneAxis(TurnedMount):
    """A turn about one of the camera's axes alone."""

    effect = "extrinsic_rotation"

    def __init__(self, rng: Rng, film: Film) -> None:
        self._share = np.eye(3)[rng.integers(3)] * rng.choice([-1, 1])


class _PoseError(Formula):
    """The pose of every frame is off by Euler angles and a shift; amount is how far in all [deg]."""

    span = (5e-3, 5.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.metres_per_degree = float(rng.uniform(0.003, 0.03))

    def six(self, take: Take) -> Floats:
        """(6,) angles about z, y and x, and the shift, for an amount of 1."""
        raise NotImplementedError

    def moved(self, take: Take) -> Floats:
        """Degrees about z, then y, then x."""
        six = self.amount * self.six(take)
        return _rigid(Rotation.from_euler("ZYX", six[:3], degrees=True), self.metres_per_degree * six[3:])


class MarkerJitter(_PoseError):
    """Every frame has an error of its own, and now and then a large one: markers that are hidden or mistaken."""

    effect = "pose_noise"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.freedom = float(rng.uniform(2.5, 6))

    def six(self, take: Take) -> Floats:
        """Of a Student law with variance 1."""
        return take.rng("markers").standard_t(self.freedom, 6) * np.sqrt(1 - 2 / self.freedom)


class DriftAndJump(_PoseError):
    """A pose that drifts off evenly, and jumps back to the truth whenever a known place is seen again."""

    effect = "pose_noise"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.every, self.phase = float(rng.uniform(0.6, 2.5)), float(rng.random())

    def six(self, take: Take) -> Floats:
        """Each drift has a way of its own; at its end it is as far off as the amount says in each direction."""
        drift, share = divmod(take.stamp / self.every + self.phase, 1.0)
        return share * take.rng("drift", int(drift)).standard_normal(6)


class SwayingMast(_PoseError):
    """The camera swings on its mount about all axes, at two frequencies that no frame rate divides."""

    effect = "pose_noise"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.frequencies = rng.uniform(0.3, 3.0, 2)

    def six(self, take: Take) -> Floats:
        """Sines with a mean square of 1, at a phase that is drawn anew for each run."""
        rng = take.rng("sway", 0)
        phase, part = rng.uniform(0, 2 * np.pi, (2, 6)), rng.uniform(0, np.pi / 2, 6)
        waves = np.sin(2 * np.pi * self.frequencies[:, None] * take.stamp + phase)
        return np.sqrt(2) * (np.cos(part) * waves[0] + np.sin(part) * waves[1])
