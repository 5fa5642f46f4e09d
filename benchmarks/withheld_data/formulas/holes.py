"""Holes that come from the surface, its range and its angle."""

from typing import Any

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Floats, Formula, Mask, Rng, Take
from benchmarks.withheld_data.formulas.seen import draw_tag, of_tag, ranges


class Chance(Formula):
    """Holes drawn pixel by pixel by a chance; amount is the chance's size unless the formula says otherwise."""

    statistic = "holes"
    span = (1e-3, 1.0)

    def chance(self, take: Take) -> Floats:
        """(height, width)."""
        raise NotImplementedError

    def lose(self, take: Take) -> Mask:
        """Where a uniform number is below the chance."""
        return (take.rng(self.effect).random(take.z.shape) < self.chance(take)) & take.hit


class MoreHoles(Formula):
    """More pixels without a return than the simulator has, drawn one by one; the rate itself wanders a little."""

    effect = "fill_rate"
    statistic = "holes"
    span = (1e-3, 0.2)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.base = film.base.rate
        self.wander = float(rng.uniform(0, 0.05))

    def lose(self, take: Take) -> Mask:
        """amount: the share besides the base rate."""
        rng = take.rng("more holes")
        share = self.amount * (1 + self.wander * rng.uniform(-1, 1))
        return rng.random(take.z.shape) < share

    def known(self) -> dict[str, float]:
        """Base rate and the holes besides."""
        return {"rate": self.base + self.amount - self.base * self.amount}


class CountedHoles(MoreHoles):
    """As many pixels of every frame are holes, wherever they lie."""

    effect = "fill_rate"

    def lose(self, take: Take) -> Mask:
        """The smallest of as many random numbers."""
        random = take.rng("more holes").random(take.z.shape)
        count = round(self.amount * random.size)
        return random <= np.partition(random.ravel(), count)[count]


class Clumps(MoreHoles):
    """Holes come in clumps of a few pixels, wherever they lie: where a smooth random field is lowest."""

    effect = "fill_rate"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.size = float(rng.uniform(0.4, 1.0))

    def lose(self, take: Take) -> Mask:
        """As many pixels of every frame."""
        field = ndimage.gaussian_filter(take.rng("more holes").standard_normal(take.z.shape), self.size)
        return field <= np.quantile(field, self.amount)


class GrazingLogistic(Chance):
    """A logistic step of the angle of incidence."""

    effect = "incidence_dropout"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.middle, self.width = float(rng.uniform(58, 74)), float(rng.uniform(2, 5))

    def chance(self, take: Take) -> Floats:
        """amount: the chance far beyond the step."""
        return self.amount / (1 + np.exp(-(np.degrees(take.angle) - self.middle) / self.width))


class CosineLoss(Chance):
    """1 - (cos θ)^p: what is not sent back."""

    effect = "incidence_dropout"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.knee = float(rng.uniform(0.25, 0.5))

    def chance(self, take: Take) -> Floats:
        """amount: chance where the ray grazes; the square of how far the cosine is below a knee."""
        return self.amount * np.clip(1 - take.geometry.cosine / self.knee, 0, 1) ** 2


class AngleLimit(Chance):
    """Nothing beyond an angle that is a little different from patch to patch."""

    effect = "incidence_dropout"
    span = (3.0, 45.0)

    def chance(self, take: Take) -> Floats:
        """amount: how far the limit is below 90°."""
        rough = ndimage.zoom(take.rng("limit").uniform(-3, 3, (8, 12)), 64, order=1)
        rough = rough[: take.z.shape[0], : take.z.shape[1]] if take.z.shape[0] <= 512 else 0.0
        return (np.degrees(take.angle) > 90 - self.amount + rough).astype(np.float64)


class RangeLogistic(Chance):
    """A logistic step of range."""

    effect = "range_dropout"

    def __init__(self, rng: Rng, film: Film) -> None:
        far = _far(film)
        self.middle, self.width = float(far * rng.uniform(0.8, 1.05)), float(far * rng.uniform(0.06, 0.14))

    def chance(self, take: Take) -> Floats:
        """amount: the chance far beyond the step."""
        return self.amount / (1 + np.exp(-(take.geometry.depth - self.middle) / self.width))


class LightFallsOff(Chance):
    """Too little light: 1 / (1 + (L / z)⁴)."""

    effect = "range_dropout"
    span = (1e-2, 10.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self._far = _far(film)

    def chance(self, take: Take) -> Floats:
        """amount: the far range over L."""
        z = np.maximum(take.geometry.depth.astype(np.float64), 0.05)
        return 1 / (1 + (self._far / (self.amount * z)) ** 4)


class Rayleigh(Chance):
    """1 - exp(-((z - z0) / L)²) beyond z0."""

    effect = "range_dropout"
    span = (1e-2, 10.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self._far = _far(film)
        self.start = float(self._far * rng.uniform(0.25, 0.6))

    def chance(self, take: Take) -> Floats:
        """amount: the far range over L."""
        beyond = np.maximum(take.geometry.depth - self.start, 0) * self.amount / self._far
        return 1 - np.exp(-(beyond**2))


def _far(film: Film) -> float:
    """The range that 85 % of what is seen does not reach [m]."""
    return float(ranges(film)[850])


class _OneMaterial(Chance):
    def __init__(self, rng: Rng, film: Film) -> None:
        self.tag = draw_tag(rng, film, 0.05)

    def mine(self, take: Take) -> Mask:
        """Its pixels."""
        return of_tag(take, self.tag)


class OneInSo(_OneMaterial):
    """The same chance everywhere on one material."""

    effect = "material_dropout"

    def chance(self, take: Take) -> Floats:
        """amount: the chance."""
        return self.amount * self.mine(take)

    def known(self) -> dict[str, Any]:
        """The rate of the tag."""
        return {"rates": {self.tag: self.amount}}


class PatchyMaterial(_OneMaterial):
    """Holes in patches of some pixels on one material, anew in each frame."""

    effect = "material_dropout"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.patch = float(rng.uniform(1.0, 2.0))

    def lose(self, take: Take) -> Mask:
        """amount: share of the patches; the largest values of a smoothed field."""
        field = ndimage.gaussian_filter(take.rng("patches").standard_normal(take.z.shape), self.patch)
        return (field >= np.quantile(field, 1 - self.amount)) & self.mine(take)


class DarkByRange(_OneMaterial):
    """One material sends back too little light, the less the farther it is."""

    effect = "material_dropout"
    span = (0.01, 30.0)

    def chance(self, take: Take) -> Floats:
        """amount: 1 / the range at which 63 % are holes [1/m]."""
        return (1 - np.exp(-self.amount * take.geometry.depth)) * self.mine(take)


class DarkLogistic(Chance):
    """All dark materials: a logistic step of the logarithm of their reflectance."""

    effect = "material_dropout"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.knee = float(rng.uniform(0.05, 0.12))

    def chance(self, take: Take) -> Floats:
        """amount: the chance on a black body."""
        dark = np.log(take.film.world.property("ir_reflectance") + 1e-4) - np.log(self.knee)
        table = np.where(np.arange(256) < len(take.film.world.scene.tags), 1 / (1 + np.exp(6 * dark)), 0)
        return self.amount * table[take.geometry.tag]
