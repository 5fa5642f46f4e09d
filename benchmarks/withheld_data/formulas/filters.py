"""Smoothing of the finished picture: holes stay holes."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


def _shifts(picture: Floats, reach: int) -> tuple[Floats, list[tuple[int, int]]]:
    """(N, height, width) the picture shifted by up to ``reach`` each way, and the shifts; 0 comes in at the border."""
    height, width = picture.shape
    wide = np.pad(picture, reach)
    steps = [(v, u) for v in range(-reach, reach + 1) for u in range(-reach, reach + 1)]
    return np.array([wide[reach + v :, reach + u :][:height, :width] for v, u in steps]), steps


class _Filter(Formula):
    """amount is the weight of the smoothed picture, the rest that of the raw one."""

    statistic = "neighbours"
    span = (0.02, 1.0)

    def smoothed(self, take: Take, z: Floats) -> Floats:
        """(height, width) smoothed depth [m]; arbitrary where there is none."""
        raise NotImplementedError

    def finish(self, take: Take) -> None:
        """Blend."""
        z = take.z
        take.z = np.where(z > 0, z + self.amount * (self.smoothed(take, z) - z), 0)


class Bilateral(_Filter):
    """Weights by distance and by difference of disparity (Tomasi and Manduchi 1998)."""

    effect = "spatial_filter"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.reach, self.width = int(rng.integers(1, 3)), float(rng.uniform(0.9, 2.0))
        self.tolerance = float(rng.uniform(0.5, 1.2))

    def smoothed(self, take: Take, z: Floats) -> Floats:
        """By disparity."""
        film, d = take.film, take.film.inverse(z)
        # As wide as five times the typical noise where that is larger than the tolerance.
        noise = np.median((take.sigma * d * d / film.camera.focal_baseline)[d > 0]) if (d > 0).any() else 0
        scale = max(self.tolerance, 5 * noise)
        near, steps = _shifts(d, self.reach)
        far = np.array([np.exp(-(v * v + u * u) / (2 * self.width**2)) for v, u in steps])[:, None, None]
        weight = far * np.exp(-0.5 * ((near - d) / scale) ** 2) * (near > 0)
        total = weight.sum(axis=0)
        return film.inverse(np.where(total > 0, (weight * near).sum(axis=0) / np.maximum(total, 1e-12), d))


class Median(_Filter):
    """The median of the returns in 3x3 pixels."""

    effect = "spatial_filter"

    def smoothed(self, take: Take, z: Floats) -> Floats:
        """By depth; of an even number the lower one."""
        near, _ = _shifts(z, 1)
        ranked = np.sort(np.where(near > 0, near, np.inf), axis=0)
        count = (near > 0).sum(axis=0)
        middle = np.take_along_axis(ranked, np.maximum((count - 1) // 2, 0)[None], axis=0)[0]
        return np.where(np.isfinite(middle), middle, z)


class SigmaMean(_Filter):
    """The mean of the neighbours that lie within a relative distance in depth (Lee 1983)."""

    effect = "spatial_filter"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.reach, self.tolerance = int(rng.integers(1, 4)), float(rng.uniform(0.06, 0.15))

    def smoothed(self, take: Take, z: Floats) -> Floats:
        """A plain mean."""
        near, _ = _shifts(z, self.reach)
        like = (np.abs(near - z) < np.maximum(self.tolerance * z, 3 * take.sigma)) & (near > 0)
        return (near * like).sum(axis=0) / np.maximum(like.sum(axis=0), 1)


class DomainTransform(_Filter):
    """Gastal and Oliveira's recursive filter (2011), in disparity: columns and then rows, there and back."""

    effect = "spatial_filter"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.rounds, self.edge = int(rng.integers(1, 3)), float(rng.uniform(0.8, 2.0))

    def smoothed(self, take: Take, z: Floats) -> Floats:
        """Each round half as wide as the one before, as published; holes are edges, and stay as they are."""
        film = take.film
        d = film.inverse(z)
        noise = np.median((take.sigma * d * d / film.camera.focal_baseline)[d > 0]) if (d > 0).any() else 0
        whole, smooth = max(self.edge, 3 * noise), d
        for number in range(self.rounds):
            feedback = np.exp(-np.sqrt(2) * 2**number / 3)
            for axis in (0, 1):
                smooth = self._passed(smooth, d, feedback, whole, axis)
        return film.inverse(smooth)

    def _passed(self, smooth: Floats, d: Floats, feedback: float, whole: float, axis: int) -> Floats:
        """Along one axis, where the distance of neighbours is 1 and what they differ by, in ``whole``."""
        x, guide = np.moveaxis(smooth, axis, 0).copy(), np.moveaxis(d, axis, 0)
        apart = 1 + 3 * np.abs(np.diff(guide, axis=0)) / whole
        weight = np.where((guide[1:] > 0) & (guide[:-1] > 0), feedback**apart, 0)
        for n in range(1, len(x)):
            x[n] += weight[n - 1] * (x[n - 1] - x[n])
        for n in range(len(x) - 2, -1, -1):
            x[n] += weight[n] * (x[n + 1] - x[n])
        return np.moveaxis(x, 0, axis)


class Blur(_Filter):
    """A Gaussian over the depths that there are, whatever lies beside them: edges are blurred, too."""

    effect = "spatial_filter"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.width = float(rng.uniform(0.5, 1.2))

    def smoothed(self, take: Take, z: Floats) -> Floats:
        """By depth."""
        some = ndimage.gaussian_filter((z > 0).astype(np.float64), self.width)
        return np.where(z > 0, ndimage.gaussian_filter(z, self.width) / np.maximum(some, 1e-12), z)
