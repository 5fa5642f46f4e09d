"""Systematic errors of the disparity, and its steps."""

import numpy as np

from benchmarks.withheld_data.film import Film, Formula, Rng, Take


class Stretched(Formula):
    """The baseline is not what the calibration says: depth comes out longer or shorter by a share."""

    effect = "baseline_scale"
    span = (5e-4, 0.12)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))

    def bias(self, take: Take) -> None:
        """z (1 + e)."""
        take.z *= 1 + self.sign * self.amount

    def known(self) -> dict[str, float]:
        """Measured over true."""
        return {"scale": 1 + self.sign * self.amount}


class FocalError(Stretched):
    """The focal length of the matcher's Z = f·b / d is off: true depth over 1 + e."""

    effect = "baseline_scale"

    def bias(self, take: Take) -> None:
        """z / (1 + e)."""
        take.z /= 1 + self.sign * self.amount

    def known(self) -> dict[str, float]:
        """Measured over true."""
        return {"scale": 1 / (1 + self.sign * self.amount)}


class QuadraticBias(Formula):
    """z - o z² / f·b: a disparity offset to first order."""

    effect = "disparity_offset"
    span = (2e-3, 1.5)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))

    def bias(self, take: Take) -> None:
        """Depth that would come out negative is kept at half of what it was."""
        share = self.sign * self.amount * take.z / take.film.camera.focal_baseline
        take.z *= np.clip(1 - share, 0.5, 2.0)


class ToedIn(Formula):
    """The right imager is turned about y: the offset grows with the column as 1 + x²."""

    effect = "disparity_offset"
    span = (2e-3, 1.5)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))

    def bias(self, take: Take) -> None:
        """f·tan(ε)·(1 + x²)."""
        d = take.disparity
        x = take.directions[0]
        moved = d + self.sign * self.amount * (1 + x * x)
        take.z = np.where(d > 0, take.film.inverse(np.maximum(moved, d / 3)), 0)


class ConstantOffset(Formula):
    """Every disparity is off by the same, as after a knock."""

    effect = "disparity_offset"
    span = (2e-3, 1.5)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))

    def bias(self, take: Take) -> None:
        """z f·b / (f·b + o z)."""
        fb = take.film.camera.focal_baseline
        take.z = take.z * fb / np.maximum(fb + self.sign * self.amount * take.z, fb / 3)

    def known(self) -> dict[str, float]:
        """Measured minus true."""
        return {"offset": self.sign * self.amount}


class Sawtooth(Formula):
    """A bias that rises and falls in straight lines over the fraction of the disparity."""

    effect = "subpixel_bias"
    span = (2e-3, 0.45)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.phase, self.peak = float(rng.uniform(0, 1)), float(rng.uniform(0.3, 0.7))

    def bias(self, take: Take) -> None:
        """amount: its height [px]; it passes through 0 at the ends and falls to minus the amount."""
        d = take.disparity
        x = (d - self.phase) % 1.0
        up = np.interp(x, [0, self.peak / 2, (1 + self.peak) / 2, 1], [0, 1, -1, 0])
        take.z = np.where(d > 0, take.film.inverse(np.maximum(d - self.amount * up, 0.05)), 0)


class PixelLocking(Formula):
    """Fractions are drawn to a whole number by a power: |2x|^g for x in -1/2 to 1/2."""

    effect = "subpixel_bias"
    span = (0.01, 3.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.phase = float(rng.choice([0.0, 0.5, rng.uniform(0, 1)]))

    def bias(self, take: Take) -> None:
        """g = 1 + amount."""
        d = take.disparity
        whole = np.round(d - self.phase)
        x = 2 * (d - self.phase - whole)
        locked = whole + self.phase + 0.5 * np.sign(x) * np.abs(x) ** (1 + self.amount)
        take.z = np.where(d > 0, take.film.inverse(np.maximum(locked, 0.05)), 0)


class ShiftedSteps(Formula):
    """Rounded down to a grid of steps whose origin lies anywhere, and read at the middle of the step."""

    effect = "disparity_quantization"
    span = (2e-3, 2.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.phase = float(rng.random())

    def steps(self, take: Take) -> None:
        """amount: the step [px]."""
        d = take.disparity
        down = (np.floor(d / self.amount + self.phase) + 0.5 - self.phase) * self.amount
        take.z = np.where(d > 0, take.film.inverse(np.maximum(down, 0)), 0)

    def known(self) -> dict[str, float]:
        """The step."""
        return {"step": self.amount}


class UnevenSteps(Formula):
    """Steps that are in turn wider and narrower than their mean, as those of a coarse interpolator."""

    effect = "disparity_quantization"
    span = (2e-3, 2.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.uneven = float(rng.uniform(0.05, 0.25))

    def steps(self, take: Take) -> None:
        """amount: the mean step [px]."""
        d = take.disparity
        pair, rest = np.divmod(d / self.amount, 2.0)
        cut = 1 + self.uneven
        level = np.where(rest < cut, cut / 2, (2 + cut) / 2)
        take.z = np.where(d > 0, take.film.inverse((2 * pair + level) * self.amount), 0)


class LinearWarming(Formula):
    """Depth grows or shrinks by the same share every second."""

    effect = "thermal_drift"
    span = (1e-3, 0.2)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))

    def level(self, share: float) -> float:
        """0 at the first frame, 1 at the last."""
        return share

    def bias(self, take: Take) -> None:
        """amount: at the end of the run."""
        share = take.stamp / take.film.route.duration
        take.z *= 1 + self.sign * self.amount * self.level(share)


class LateWarming(LinearWarming):
    """Nothing until the projector goes on; then a rise that levels off as a hyperbola does."""

    effect = "thermal_drift"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.start, self.half = float(rng.uniform(0.05, 0.3)), float(rng.uniform(0.15, 0.6))

    def level(self, share: float) -> float:
        """x / (x + half)."""
        since = max(share - self.start, 0.0)
        return since / (since + self.half) * (1 + self.half)


class SmoothWarming(LinearWarming):
    """An S-shaped rise, as of a housing that warms after the chip."""

    effect = "thermal_drift"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.middle, self.width = float(rng.uniform(0.3, 0.6)), float(rng.uniform(0.1, 0.25))

    def level(self, share: float) -> float:
        """tanh from 0 at the start to 1 at the end."""
        at = np.tanh((np.array([share, 0.0, 1.0]) - self.middle) / self.width)
        return float((at[0] - at[1]) / (at[2] - at[1]))
