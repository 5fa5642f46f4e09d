"""Holes that are filled from the depths about them."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


class _Filled(Formula):
    """amount: how far from a measured pixel holes are filled [px]."""

    effect = ""
    statistic = "filled"
    span = (0.5, 40.0)


class NearestInPicture(_Filled):
    """A hole gets the depth of the pixel that is nearest to it in the picture (by the distance transform)."""

    effect = "hole_filling"

    def finish(self, take: Take) -> None:
        """Any of those that are equally near."""
        away, (v, u) = ndimage.distance_transform_edt(take.z <= 0, return_indices=True)
        if (take.z > 0).any():
            take.z = np.where(away <= self.amount, take.z[v, u], 0)


class RingByRing(_Filled):
    """Holes get the farthest or the nearest of the depths in 3x3 pixels, all at once, and again for those left."""

    effect = "hole_filling"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.farthest = bool(rng.random() < 0.5)

    def finish(self, take: Take) -> None:
        """A ring of pixels at a time, so that no direction is before another."""
        for _ in range(int(self.amount)):
            if (take.z > 0).all():
                break
            take.z = np.where(take.z > 0, take.z, self._about(take.z))

    def _about(self, z: Floats) -> Floats:
        if self.farthest:
            return ndimage.maximum_filter(z, 3, mode="constant")
        nearest = ndimage.minimum_filter(np.where(z > 0, z, np.inf), 3, mode="constant", cval=np.inf)
        return np.where(np.isfinite(nearest), nearest, 0)


class ColumnByColumn(_Filled):
    """Holes get the depth above them, and where there is none that on their right."""

    effect = "hole_filling"

    def finish(self, take: Take) -> None:
        """No farther than the amount either way."""
        for axis in (0, 1):
            z = take.z if axis == 0 else take.z[:, ::-1]
            place = np.arange(z.shape[axis]).reshape((-1, 1) if axis == 0 else (1, -1))
            last = np.maximum.accumulate(np.where(z > 0, place, -1), axis=axis)
            found = np.take_along_axis(z, np.maximum(last, 0), axis=axis)
            z = np.where((last >= 0) & (place - last <= self.amount), found, z)
            take.z = z if axis == 0 else z[:, ::-1]


class MeanAround(_Filled):
    """Holes get the mean of the depths in 3x3 pixels, and again for those left: an inpainting by diffusion."""

    effect = "hole_filling"

    def finish(self, take: Take) -> None:
        """So many times as the amount says."""
        for _ in range(int(self.amount)):
            there = (take.z > 0).astype(np.float64)
            if there.all():
                break
            some = ndimage.uniform_filter(there, 3, mode="constant")
            mean = ndimage.uniform_filter(take.z, 3, mode="constant") / np.maximum(some, 1e-12)
            take.z = np.where(take.z > 0, take.z, np.where(some > 1e-9, mean, 0))
