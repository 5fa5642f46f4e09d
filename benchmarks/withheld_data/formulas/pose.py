"""When and from where a frame is taken."""

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


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
    """Rows in groups, read one group after another; the stamp is near the first, the middle or the last one's."""

    effect = "rolling_shutter"
    span = (2e-3, 0.08)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.group = int(rng.choice([1, 4, 8]))
        self.middle = float(rng.choice([0.0, 0.5, 1.0]) + rng.uniform(-0.05, 0.05))

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

    def turn(self) -> Floats:
        """Degrees about y, then x, then z."""
        x, y, z = self._share * self.amount
        return Rotation.from_euler("YXZ", [y, x, z], degrees=True).as_matrix()

    def mount(self) -> Floats:
        """Turned, and where it was."""
        mount = np.eye(4)
        mount[:3, :3] = self.turn()
        return mount

    def known(self) -> dict[str, float]:
        """The rotation vector [deg]."""
        x, y, z = np.degrees(Rotation.from_matrix(self.turn()).as_rotvec())
        return {"x": float(x), "y": float(y), "z": float(z)}


class OneAxis(TurnedMount):
    """A turn about one of the camera's axes alone."""

    effect = "extrinsic_rotation"

    def __init__(self, rng: Rng, film: Film) -> None:
        self._share = np.eye(3)[rng.integers(3)] * rng.choice([-1, 1])


class ShiftedMount(Formula):
    """A lever arm that was measured wrongly, in any direction."""

    effect = "extrinsic_translation"
    span = (1e-3, 0.4)

    def __init__(self, rng: Rng, film: Film) -> None:
        axis = rng.normal(size=3)
        self._share = axis / np.linalg.norm(axis)

    def mount(self) -> Floats:
        """Metres along the camera's x, y and z."""
        mount = np.eye(4)
        mount[:3, 3] = self._share * self.amount
        return mount

    def known(self) -> dict[str, float]:
        """The shift."""
        x, y, z = map(float, self.mount()[:3, 3])
        return {"x": x, "y": y, "z": z}


class OtherImager(ShiftedMount):
    """The poses are those of another imager of the same device, to the side and a little ahead or behind."""

    effect = "extrinsic_translation"

    def __init__(self, rng: Rng, film: Film) -> None:
        self._share = np.array([rng.choice([-1, 1]), 0.0, rng.uniform(-0.3, 0.3)])
