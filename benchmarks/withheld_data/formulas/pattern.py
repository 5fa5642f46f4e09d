"""What is wrong with the disparity at a pixel in every frame alike."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


class _Pattern(Formula):
    """amount: root mean square of the pattern [px]."""

    span = (2e-3, 1.0)
    _pattern: Floats

    def bias(self, take: Take) -> None:
        """Add it to the disparity."""
        d, pattern = take.disparity, self._pattern / np.sqrt(np.mean(self._pattern**2))
        take.z = np.where(d > 0, take.film.inverse(np.maximum(d + self.amount * pattern, d / 3)), 0)


class ColumnPattern(_Pattern):
    """Every column has an offset of its own: the readout's."""

    effect = "fixed_pattern"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.blur = float(rng.uniform(0.5, 6))
        self._pattern = ndimage.gaussian_filter1d(rng.standard_normal(film.camera.width), self.blur)[None]


class Fringes(_Pattern):
    """Waves across the picture, as a cover glass leaves them."""

    effect = "fixed_pattern"

    def __init__(self, rng: Rng, film: Film) -> None:
        count = int(rng.integers(1, 4))
        self.length = rng.uniform(0.15, 0.7, count) * film.camera.width  # [px]
        self.angle = rng.uniform(0, np.pi, count)
        along = np.cos(self.angle)[:, None, None] * film.u + np.sin(self.angle)[:, None, None] * film.v
        phase = rng.uniform(0, 2 * np.pi, count)[:, None, None]
        self._pattern = np.sin(2 * np.pi * along / self.length[:, None, None] + phase).sum(axis=0)


class CoarseTable(_Pattern):
    """A rectification that is kept at the nodes of a coarse grid, each a little wrong, and read by straight lines."""

    effect = "fixed_pattern"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.rows, self.columns = int(rng.integers(3, 8)), int(rng.integers(4, 12))
        nodes = rng.standard_normal((self.rows, self.columns))
        v, u = film.v / (film.camera.height - 1), film.u / (film.camera.width - 1)
        places = [v * (self.rows - 1), u * (self.columns - 1)]
        self._pattern = ndimage.map_coordinates(nodes, places, order=1)
