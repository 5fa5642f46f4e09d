"""Filters in time: the finished picture is mixed with those before it."""

import numpy as np

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


class _InTime(Formula):
    """What is near what was there before is taken for the same surface."""

    statistic = "frames"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.tolerance = float(rng.uniform(0.05, 0.12))

    def pictures(self, take: Take, before: int) -> list[Floats]:
        """The finished pictures of so many frames before, the oldest first, and of this one."""
        film = take.film
        others = [formula for formula in film.formulas if formula is not self]
        return [*(film.make(i, others).z for i in range(max(take.index - before, 0), take.index)), take.z]

    def alike(self, take: Take, one: Floats, other: Floats) -> np.ndarray:
        """Where both have depth, and these differ by less than a share of it, or than the noise does."""
        near = np.abs(one - other) < np.maximum(self.tolerance * other, 4 * take.sigma)
        return near & (one > 0) & (other > 0)


class RecursiveInDepth(_InTime):
    """z' = z + amount · (z' of the frame before - z), in depth; holes stay holes."""

    effect = "temporal_filter"
    span = (0.01, 0.97)

    def known(self) -> dict[str, float]:
        """The weight of the frame itself."""
        return {"alpha": 1 - self.amount}

    def finish(self, take: Take) -> None:
        """From 40 frames before on."""
        state = np.zeros_like(take.z)
        for z in self.pictures(take, 40):
            mixed = np.where(self.alike(take, state, z), z + self.amount * (state - z), z)
            state = np.where(z > 0, mixed, state)
        take.z = np.where(take.z > 0, state, 0)


class MeanOfFrames(_InTime):
    """The mean disparity of the last frames in part; holes get the last depth if half of these frames have one."""

    effect = "temporal_filter"
    span = (0.02, 1.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.frames = int(rng.integers(3, 7))

    def finish(self, take: Take) -> None:
        """amount: weight of the mean."""
        film, pictures = take.film, self.pictures(take, self.frames - 1)
        like = np.array([self.alike(take, z, take.z) for z in pictures])
        d = np.array([film.inverse(z) for z in pictures])
        mean = film.inverse((d * like).sum(axis=0) / np.maximum(like.sum(axis=0), 1))
        held = np.zeros_like(take.z)
        for z in pictures:
            held = np.where(z > 0, z, held)
        often = np.mean([z > 0 for z in pictures], axis=0) >= 0.5
        smoothed = take.z + self.amount * (mean - take.z)
        take.z = np.where(take.z > 0, smoothed, np.where(often, held, 0))


class MedianOfFrames(_InTime):
    """The median of the last depths that are alike, in part."""

    effect = "temporal_filter"
    span = (0.02, 1.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.frames = int(rng.choice([3, 5]))

    def finish(self, take: Take) -> None:
        """amount: weight of the median."""
        pictures = np.array(self.pictures(take, self.frames - 1))
        like = np.array([self.alike(take, z, take.z) for z in pictures])
        middle = np.nanmedian(np.where(like | (take.z <= 0), pictures, np.nan), axis=0)
        take.z = np.where(take.z > 0, take.z + self.amount * (middle - take.z), 0)
