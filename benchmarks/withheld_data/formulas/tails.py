"""Spurious depths."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Formula, Rng, Take


class StudentShare(Formula):
    """A share of the returns has noise of a Student law with few degrees of freedom, some times as wide."""

    effect = "heavy_tails"
    statistic = "spurious"
    span = (5e-4, 0.5)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.freedom, self.width = float(rng.uniform(1.2, 2.2)), float(rng.uniform(3, 8))

    def tail(self, take: Take) -> None:
        """amount: the share."""
        rng = take.rng("tail")
        odd = (rng.random(take.z.shape) < self.amount) & (take.z > 0)
        noise = rng.standard_t(self.freedom, take.z.shape) * self.width * take.sigma
        take.z = np.where(odd, np.maximum(take.geometry.depth + noise, 0.05), take.z)


class AnyDepth(Formula):
    """A share of the returns lies anywhere in depth."""

    effect = "heavy_tails"
    statistic = "spurious"
    span = (1e-4, 0.2)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.near, self.far = float(rng.uniform(0.2, 0.5)), float(rng.uniform(4, 9))

    def tail(self, take: Take) -> None:
        """amount: the share."""
        rng = take.rng("tail")
        odd = (rng.random(take.z.shape) < self.amount) & (take.z > 0)
        take.z = np.where(odd, rng.uniform(self.near, self.far, take.z.shape), take.z)


class WrongByFactor(Formula):
    """A share of the returns is wrong by a log-normal factor."""

    effect = "heavy_tails"
    statistic = "spurious"
    span = (1e-4, 0.3)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.width = float(rng.uniform(0.25, 0.6))

    def tail(self, take: Take) -> None:
        """amount: the share."""
        rng = take.rng("tail")
        odd = (rng.random(take.z.shape) < self.amount) & (take.z > 0)
        take.z = np.where(odd, take.z * rng.lognormal(0, self.width, take.z.shape), take.z)


class SmallBlobs(Formula):
    """False matches in small patches, each with a disparity of its own."""

    effect = "heavy_tails"
    statistic = "spurious"
    span = (2e-5, 0.1)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.size, self.most = float(rng.uniform(0.6, 1.5)), float(rng.uniform(20, 60))

    def tail(self, take: Take) -> None:
        """amount: patches per pixel."""
        rng = take.rng("tail")
        seeds = rng.random(take.z.shape) < self.amount
        away, where = ndimage.distance_transform_edt(~seeds, return_indices=True)
        wrong = rng.uniform(1, self.most, take.z.shape)[where[0], where[1]]
        odd = (away <= self.size) & (take.z > 0) & seeds.any()
        take.z = np.where(odd, take.film.camera.focal_baseline / wrong, take.z)
