"""Biases of the disparity that stay where they are in the picture."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


class _Stays(Formula):
    """amount: root mean square of what is added to the disparity [px]."""

    effect = ""
    span = (2e-3, 1.0)
    _shape: Floats

    def bias(self, take: Take) -> None:
        """Never to less than a third of the disparity."""
        d = take.disparity
        take.z = np.where(d > 0, take.film.inverse(np.maximum(d + self.amount * self._shape, d / 3)), 0)


class ColumnPattern(_Stays):
    """Every column has an offset in disparity that stays: a fixed pattern of the readout."""

    effect = "fixed_pattern"

    def __init__(self, rng: Rng, film: Film) -> None:
        self.width = float(rng.uniform(1.5, 6))
        columns = ndimage.gaussian_filter1d(rng.standard_normal(film.camera.width), self.width)
        self._shape = np.broadcast_to(columns / columns.std(), film.camera.shape)


class SumOfWaves(_Stays):
    """Cosines in a few directions, as a bent cover or a warped sheet of the calibration has them."""

    effect = "fixed_pattern"

    def __init__(self, rng: Rng, film: Film) -> None:
        waves = []
        for _ in range(int(rng.integers(3, 7))):
            length, turn = rng.uniform(0.15, 0.5) * film.camera.height, rng.uniform(0, np.pi)
            along = (film.u * np.cos(turn) + film.v * np.sin(turn)) / length
            waves.append(rng.uniform(0.5, 1) * np.cos(2 * np.pi * (along + rng.random())))
        whole = np.sum(waves, axis=0)
        self._shape = whole / np.sqrt((whole**2).mean())


class Bowl(_Stays):
    """A polynomial of the place in the picture, as a calibration leaves that was fitted to too few targets."""

    effect = "fixed_pattern"

    def __init__(self, rng: Rng, film: Film) -> None:
        x, y = (film.u / film.camera.width - 0.5) * 2, (film.v / film.camera.height - 0.5) * 2
        terms = [x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3]
        whole = np.tensordot(rng.standard_normal(len(terms)), np.array(terms), axes=1)
        whole = whole - whole.mean()
        self._shape = whole / whole.std()
