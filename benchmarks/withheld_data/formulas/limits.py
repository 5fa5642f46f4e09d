"""Nearest and farthest range, and the band at the left border."""

import numpy as np

from benchmarks.withheld_data.film import Film, Floats, Formula, Mask, Rng, Take
from benchmarks.withheld_data.formulas.seen import ranges


class SoftNear(Formula):
    """Nothing nearer than a limit that is soft over a centimetre or two."""

    effect = "min_range"
    statistic = "holes"
    span = (1e-3, 0.4)

    def __init__(self, rng: Rng, film: Film) -> None:
        self._of = ranges(film)
        self.soft = float(rng.uniform(0.002, 0.015))

    @property
    def depth(self) -> float:
        """amount is the share of the scene that lies nearer; this is the range [m]."""
        return float(np.interp(self.amount, np.linspace(0, 1, 1001), self._of))

    def plausible(self) -> bool:
        """Cameras see nothing nearer than a limit of decimetres."""
        return self.depth < 1.3

    def lose(self, take: Take) -> Mask:
        """A logistic step of true range."""
        x = (take.geometry.depth - self.depth) / self.soft
        return take.rng("near").random(take.z.shape) > 1 / (1 + np.exp(-np.clip(x, -50, 50)))

    def known(self) -> dict[str, float]:
        """The limit."""
        return {"depth": self.depth}

    def parameters(self) -> dict[str, float]:
        """With the limit."""
        return {**super().parameters(), "depth": self.depth}


class WidestDisparity(SoftNear):
    """The search ends at a disparity; what is measured beyond it is a hole, noise and all."""

    effect = "min_range"

    def lose(self, take: Take) -> Mask:
        """On what is measured."""
        return (take.z < self.depth) & (take.z > 0)


class SoftFar(SoftNear):
    """Nothing farther than a limit that is soft over a few centimetres."""

    effect = "max_range"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.soft = float(rng.uniform(0.01, 0.05))

    @property
    def depth(self) -> float:
        """amount is the share of the scene that lies farther; this is the range [m]."""
        return float(np.interp(1 - self.amount, np.linspace(0, 1, 1001), self._of))

    def plausible(self) -> bool:
        """And nothing farther than one of metres."""
        return self.depth > 1.2

    def lose(self, take: Take) -> Mask:
        """A logistic step of true range."""
        x = (self.depth - take.geometry.depth) / self.soft
        return take.rng("far").random(take.z.shape) > 1 / (1 + np.exp(-np.clip(x, -50, 50)))


class LeastDisparity(SoftFar):
    """What is measured to have less than a least disparity is a hole, noise and all."""

    effect = "max_range"

    def lose(self, take: Take) -> Mask:
        """On what is measured."""
        return take.z > self.depth


class NoisyBand(Formula):
    """Columns left of the measured disparity and a margin that wanders from row to row."""

    effect = "invalid_band"
    statistic = "holes"
    span = (0.097, 0.13)

    def __init__(self, rng: Rng, film: Film) -> None:
        # Small ones come as often as large ones; in pixels of this resolution.
        self.margin = float(10 * rng.random() ** 2 * film.camera.width / 424)

    def limit(self, take: Take) -> Floats:
        """(height, width) the last column without depth: disparity and margin."""
        wander = np.cumsum(take.rng("band").normal(0, 0.3, take.film.camera.height))
        return take.disparity + self.margin + np.clip(wander - wander.mean(), -2, 2)[:, None]

    def lose(self, take: Take) -> Mask:
        """amount: less 0.1, the share of the columns by which the band is wider still, or narrower."""
        wider = (self.amount - 0.1) * take.film.camera.width
        return take.film.u < self.limit(take) + wider


class StraightBand(NoisyBand):
    """Columns left of the row's median disparity and a margin: a straight border a row."""

    effect = "invalid_band"

    def limit(self, take: Take) -> Floats:
        """The median over the left quarter of the row."""
        left = take.clean_disparity[:, : max(8, take.film.camera.width // 4)]
        return np.median(left, axis=1, keepdims=True) + self.margin
