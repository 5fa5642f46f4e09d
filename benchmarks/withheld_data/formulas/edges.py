"""Depth edges: mixed depths, and foreground that grows."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Floats, Formula, Mask, Rng, Take


def _span(d: Floats, size: int) -> tuple[Floats, Floats]:
    """The least and the greatest disparity within a window; nothing hit counts as the pixel's own."""
    far = np.where(d > 0, d, np.inf)
    near = np.where(d > 0, d, -np.inf)
    return ndimage.minimum_filter(far, size), ndimage.maximum_filter(near, size)


class BetaMix(Formula):
    """Pixels within two of an edge take a depth between both sides, by a beta weight, linear in depth."""

    effect = "flying_pixels"
    statistic = "spurious"
    span = (1e-3, 1.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.a, self.b = float(rng.uniform(0.6, 2.0)), float(rng.uniform(0.6, 2.0))
        self.step = float(rng.uniform(0.6, 1.5))

    def mix(self, take: Take) -> None:
        """amount: share of the pixels in the band."""
        d = take.disparity
        low, high = _span(d, 5)
        rng = take.rng("fly")
        mixed = (high - low > self.step) & (d > 0) & (rng.random(d.shape) < self.amount)
        with np.errstate(invalid="ignore"):
            other = take.film.inverse(np.where(high - d > d - low, high, np.maximum(low, 0)))
        weight = rng.beta(self.a, self.b, d.shape)
        take.z = np.where(mixed & np.isfinite(other) & (other > 0), (1 - weight) * take.z + weight * other, take.z)


class WideCell(Formula):
    """A pixel at an edge averages the depth over a cell wider than its own, in runs along the row."""

    effect = "flying_pixels"
    statistic = "spurious"
    span = (1e-3, 1.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.step, self.run = float(rng.uniform(0.6, 1.5)), int(rng.integers(1, 4))

    def mix(self, take: Take) -> None:
        """amount: share of the edge's runs that are averaged; 3x3, by depth."""
        d, there = take.disparity, (take.z > 0).astype(np.float64)
        low, high = _span(d, 3)
        mean = ndimage.uniform_filter(take.z, 3) / np.maximum(ndimage.uniform_filter(there, 3), 1e-9)
        height, width = d.shape
        turn = np.repeat(take.rng("fly").random((height, width // self.run + 1)), self.run, axis=1)[:, :width]
        mixed = (high - low > self.step) & (d > 0) & (turn < self.amount)
        take.z = np.where(mixed, mean, take.z)


class Supersampled(Formula):
    """At an edge some pixels mix their surface with those that a few rays beside it meet, by random shares."""

    effect = "flying_pixels"
    statistic = "spurious"
    span = (1e-3, 1.0)

    def mix(self, take: Take) -> None:
        """amount: share of the pixels at the edge; the other ray is up to 1.5 px away."""
        film, rng = take.film, take.rng("fly")
        angle, reach = rng.uniform(0, 2 * np.pi, take.z.shape), rng.uniform(0.5, 1.5, take.z.shape)
        shift = np.stack([np.cos(angle) * reach / film.camera.fx, np.sin(angle) * reach / film.camera.fy])
        rays = (take.directions + shift).astype(np.float32)
        poses = take.poses[None] if take.poses.ndim == 3 else take.poses
        other = film.world.caster.cast(film.camera, poses, rays=rays, threads=2).depth.reshape(take.z.shape)
        edge = np.abs(film.inverse(other.astype(np.float64)) - take.disparity) > 0.8
        mixed = edge & (take.z > 0) & (other > 0) & (rng.random(take.z.shape) < self.amount)
        weight = rng.random(take.z.shape)
        take.z = np.where(mixed, (1 - weight) * take.z + weight * other, take.z)


def _between(radius: float, take: Take, key: str) -> Mask:
    """Where the larger of the two whole radii about ``radius`` holds: patches of a smooth field."""
    field = ndimage.gaussian_filter(take.rng(key).standard_normal(take.z.shape), 3.0)
    return field < np.quantile(field, radius - np.floor(radius))


class DiscDilation(Formula):
    """The nearest disparity within a disc, where it is nearer by more than a step."""

    effect = "edge_fattening"
    statistic = "spurious"
    span = (0.05, 6.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.step = float(rng.uniform(0.7, 1.5))

    def window(self, radius: int) -> Mask:
        """Odd by odd."""
        y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
        return x * x + y * y <= (radius + 0.3) ** 2

    def mix(self, take: Take) -> None:
        """amount: the radius [px]."""
        d = take.disparity
        whole = int(np.floor(self.amount))
        near = [ndimage.maximum_filter(d, footprint=self.window(r)) for r in (whole, whole + 1)]
        grown = np.where(_between(self.amount, take, "grow"), near[1], near[0])
        take.z = np.where((grown > d + self.step) & (d > 0), take.film.inverse(grown), take.z)


class RowDilation(DiscDilation):
    """As a matching window along the row does: twice as far sideways as up and down."""

    effect = "edge_fattening"

    def window(self, radius: int) -> Mask:
        """Wider than high."""
        return np.ones((2 * (radius // 2) + 1, 2 * radius + 1), bool)


class WindowVote(Formula):
    """The foreground wins where it has a fair part of the matching window: an upper quantile of the disparities."""

    effect = "edge_fattening"
    statistic = "spurious"
    span = (1.05, 12.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.share, self.step = float(rng.uniform(0.12, 0.3)), float(rng.uniform(0.7, 1.5))

    def mix(self, take: Take) -> None:
        """amount: width of the window [px]."""
        d = take.disparity
        lower = int((self.amount - 1) // 2)
        sizes = 2 * lower + 1, 2 * lower + 3
        voted = [ndimage.percentile_filter(d, 100 * (1 - self.share), size) if size > 1 else d for size in sizes]
        grown = np.where(_between((self.amount - 1) / 2, take, "vote"), voted[1], voted[0])
        take.z = np.where((grown > d + self.step) & (d > 0), take.film.inverse(grown), take.z)
