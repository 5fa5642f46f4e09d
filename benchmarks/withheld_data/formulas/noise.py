"""How large the noise is."""

from typing import Any

import numpy as np

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take
from benchmarks.withheld_data.formulas.seen import draw_tag, of_tag


class OtherMaterial(Formula):
    """One material's m is not what the simulator has; the law is the paper's."""

    effect = "material_noise"
    statistic = "ratio_m"
    span = (0.1, 0.5)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.tag = draw_tag(rng, film, 0.1)
        self.sign = float(rng.choice([-1, 1]))
        self.assumed = film.base.m.get(self.tag, 0.0)

    @property
    def m(self) -> float:
        """As it really is [1/m]."""
        return self.assumed * (1 + self.sign * self.amount)

    def growth(self, x: Floats) -> Floats:
        """Noise over its floor at m·d = x."""
        return np.exp(np.minimum(x, 40.0))

    def spread(self, take: Take) -> None:
        """amount: relative error of m."""
        mine = of_tag(take, self.tag)
        z = take.geometry.depth[mine].astype(np.float64)
        take.sigma[mine] = 0.005 * self.growth(self.m * z)

    def known(self) -> dict[str, Any]:
        """The value for the material."""
        return {"m": {self.tag: self.m}}


class SeriesMaterial(OtherMaterial):
    """The same with the exponential cut off after the fourth power: less growth at long range."""

    effect = "material_noise"

    def growth(self, x: Floats) -> Floats:
        """1 + x + x²/2 + x³/6 + x⁴/24."""
        return 1 + x * (1 + x / 2 * (1 + x / 3 * (1 + x / 4)))

    def known(self) -> dict[str, Any]:
        """None: beyond m·d = 1 the law with the same m has more noise."""
        return {}


class NoisierMaterial(Formula):
    """One material has the same noise several times over, at any range."""

    effect = "material_noise"
    statistic = "spread"
    span = (0.02, 6.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.tag = draw_tag(rng, film, 0.1)

    def spread(self, take: Take) -> None:
        """amount: by how much more."""
        take.sigma[of_tag(take, self.tag)] *= 1 + self.amount


class SquareOfRange(Formula):
    """In place of the base noise: std = s z² / f·b, in depth."""

    effect = "disparity_noise"
    statistic = "spread"
    span = (5e-3, 1.5)

    def spread(self, take: Take) -> None:
        """amount: s [px]."""
        z = take.geometry.depth.astype(np.float64)
        take.sigma = self.amount * z * z / take.film.camera.focal_baseline

    def known(self) -> dict[str, float]:
        """Its std in disparity."""
        return {"sigma": self.amount}


class TriangularMatch(SquareOfRange):
    """In place of the base noise: the mean of two match errors, each uniform in disparity (a triangular law)."""

    effect = "disparity_noise"

    def field(self, take: Take, white: Floats) -> Floats:
        """Variance 1: each uniform over ±sqrt(3/2)."""
        return take.rng("match").uniform(-1, 1, (2, *white.shape)).sum(axis=0) * np.sqrt(1.5)


class BesideBase(Formula):
    """Beside the base noise: a match error of constant disparity, added in quadrature."""

    effect = "disparity_noise"
    statistic = "spread"
    span = (1e-3, 1.5)

    def spread(self, take: Take) -> None:
        """amount: std [px]."""
        z = take.geometry.depth.astype(np.float64)
        take.sigma = np.hypot(take.sigma, self.amount * z * z / take.film.camera.focal_baseline)


class NguyenHyperbola(Formula):
    """θ² / (π/2 - θ)², in depth, over the root of z (Nguyen 2012, Eq. 4), to 82°."""

    effect = "incidence_noise"
    statistic = "spread"
    span = (1e-6, 0.3)

    def spread(self, take: Take) -> None:
        """amount: std at 45° and 1 m [m]."""
        angle = np.minimum(take.angle, np.radians(82))
        z = np.maximum(take.geometry.depth, 0.05)
        take.sigma = np.hypot(take.sigma, self.amount * (angle / (np.pi / 2 - angle)) ** 2 * z**0.5)


class SecantSquared(Formula):
    """1 / cos²θ - 1, in disparity, to 82°."""

    effect = "incidence_noise"
    statistic = "spread"
    span = (1e-5, 1.0)

    def spread(self, take: Take) -> None:
        """amount: std at 45° [px]."""
        more = 1 / np.maximum(take.geometry.cosine, 0.14) ** 2 - 1
        z = take.geometry.depth.astype(np.float64)
        take.sigma = np.hypot(take.sigma, self.amount * more * z * z / take.film.camera.focal_baseline)


class GrazingFactor(Formula):
    """The noise that is there, times 1 + g where the ray grazes, by a soft step of the angle."""

    effect = "incidence_noise"
    statistic = "spread"
    span = (1e-2, 30.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.middle, self.width = float(rng.uniform(50, 66)), float(rng.uniform(4, 9))

    def spread(self, take: Take) -> None:
        """amount: g."""
        step = 1 / (1 + np.exp(-(np.degrees(take.angle) - self.middle) / self.width))
        take.sigma = take.sigma * (1 + self.amount * step)


class CosinePower(Formula):
    """The noise that is there, over a power of cos α, α the angle off the axis: less light, less signal."""

    effect = "vignetting_noise"
    statistic = "spread"
    span = (0.05, 12.0)

    def spread(self, take: Take) -> None:
        """amount: the power."""
        take.sigma = take.sigma * (1 + np.sum(take.film.calibrated**2, axis=0)) ** (self.amount / 2)


class CornerRamp(Formula):
    """From a radius on, a noise of the disparity that grows in a straight line to the corners."""

    effect = "vignetting_noise"
    statistic = "spread"
    span = (1e-3, 2.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.start = float(rng.uniform(0.2, 0.45))

    def spread(self, take: Take) -> None:
        """amount: std in the corner [px]."""
        r = np.hypot(*take.film.calibrated)
        ramp = np.maximum(r / r.max() - self.start, 0) / (1 - self.start)
        z = take.geometry.depth.astype(np.float64)
        take.sigma = np.hypot(take.sigma, self.amount * ramp * z * z / take.film.camera.focal_baseline)


def image_flow(take: Take) -> Floats:
    """(height, width) how fast each pixel's surface moves over the image [px/s] (Longuet-Higgins and Prazdny 1980)."""
    velocity, turn = take.film.route.rates(take.stamp)
    x, y = take.film.calibrated
    z = np.maximum(take.geometry.depth.astype(np.float64), 0.1)
    point = np.stack([x, y, np.ones_like(x)])
    moved = -velocity[:, None, None] / z - np.cross(turn, point, axisb=0, axisc=0)
    return take.film.camera.fx * np.hypot(moved[0] - x * moved[2], moved[1] - y * moved[2])


class BlurredByFlow(Formula):
    """A noise of the disparity in proportion to the blur over the exposure, pixel by pixel."""

    effect = "motion_noise"
    statistic = "spread"
    span = (1e-4, 3.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.exposure = float(rng.uniform(0.004, 0.02))

    def spread(self, take: Take) -> None:
        """amount: std per pixel of blur [px]."""
        z = take.geometry.depth.astype(np.float64)
        blur = np.where(take.hit, image_flow(take) * self.exposure, 0)
        take.sigma = np.hypot(take.sigma, self.amount * blur * z * z / take.film.camera.focal_baseline)


class LouderWithSpeed(Formula):
    """The noise that is there, times sqrt(1 + (speed / b)²): all over the picture by how fast the camera goes."""

    effect = "motion_noise"
    statistic = "spread"
    span = (1e-3, 1.0)

    def spread(self, take: Take) -> None:
        """amount: 1 / b [s/px]. The speed is that past what is 2 m away [px/s]."""
        velocity, turn = take.film.route.rates(take.stamp)
        speed = take.film.camera.fx * (np.linalg.norm(turn) + np.linalg.norm(velocity) / 2)
        take.sigma = take.sigma * np.hypot(1, self.amount * speed)
