"""How the noise hangs together between pixels and frames; its size stays."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


def _around(take: Take, margin: int, index: int | None = None) -> Floats:
    """White noise on the image and ``margin`` pixels about it."""
    height, width = take.film.camera.shape
    return take.rng("wide noise", index).standard_normal((height + 2 * margin, width + 2 * margin))


class BoxAverage(Formula):
    """White noise under a box: a sum of neighbours, the last of them with the weight that makes the width exact."""

    effect = "spatial_correlation"
    statistic = "neighbours"
    span = (1.02, 24.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.flat = float(rng.uniform(0.5, 1.0))

    def field(self, take: Take, white: Floats) -> Floats:
        """amount: width of the box [px]."""
        noise = _around(take, 32)
        for axis, size in ((1, self.amount), (0, max(1.0, self.amount * self.flat))):
            whole, rest = int(size), size - int(size)
            weights = np.array([*np.ones(whole), rest])
            noise = ndimage.correlate1d(noise, weights / np.linalg.norm(weights), axis=axis)
        return noise[32:-32, 32:-32]


class CoarseGrid(Formula):
    """White noise on a coarse grid that lies anywhere, read by linear interpolation, brought to variance 1."""

    effect = "spatial_correlation"
    statistic = "neighbours"
    span = (0.02, 1.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.cell = rng.uniform(2.5, 9, 2)

    def field(self, take: Take, white: Floats) -> Floats:
        """amount: share of the variance that lies on the grid."""
        height, width = white.shape
        rng = take.rng("grid")
        v = (np.arange(height) / self.cell[0] + rng.random())[:, None]
        u = np.arange(width) / self.cell[1] + rng.random()
        nodes = rng.standard_normal((int(v.max()) + 3, int(u.max()) + 3))
        total, power = np.zeros(white.shape), np.zeros(white.shape)
        for dv in (0, 1):
            for du in (0, 1):
                weight = np.abs(1 - dv - v % 1) * np.abs(1 - du - u % 1)
                total += weight * nodes[v.astype(int) + dv, u.astype(int) + du]
                power += weight**2
        return np.sqrt(1 - self.amount) * white + np.sqrt(self.amount / power) * total


class Exponential(Formula):
    """A field with a Matérn spectrum, rougher than a bell: (1 + k²)^-(ν + 1)."""

    effect = "spatial_correlation"
    statistic = "neighbours"
    span = (0.05, 10.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.smoothness, self.flat = float(rng.uniform(0.5, 1.5)), float(rng.uniform(0.5, 1.0))

    def field(self, take: Take, white: Floats) -> Floats:
        """amount: length in x [px]."""
        noise = _around(take, 32)
        ky = np.fft.fftfreq(noise.shape[0])[:, None] * 2 * np.pi * self.amount * self.flat
        kx = np.fft.rfftfreq(noise.shape[1])[None] * 2 * np.pi * self.amount
        gain = (1 + kx * kx + ky * ky) ** (-(self.smoothness + 1) / 2)
        both = np.concatenate([gain, gain[:, 1 : (noise.shape[1] + 1) // 2]], axis=1)
        smooth = np.fft.irfft2(np.fft.rfft2(noise) * gain, noise.shape) / np.sqrt(np.mean(both**2))
        return smooth[32:-32, 32:-32]


class FrozenPattern(Formula):
    """A pattern that stays on the image, and fresh noise beside it."""

    effect = "temporal_correlation"
    statistic = "frames"
    span = (0.01, 0.98)

    def field(self, take: Take, white: Floats) -> Floats:
        """amount: share of the variance that stays."""
        frozen = take.rng("frozen", 0).standard_normal(white.shape)
        return np.sqrt(1 - self.amount) * white + np.sqrt(self.amount) * frozen


class RunningMean(Formula):
    """A weighted mean over this and a few earlier frames, brought to variance 1."""

    effect = "temporal_correlation"
    statistic = "frames"
    span = (0.01, 0.999)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.frames = int(rng.integers(3, 9))

    def field(self, take: Take, white: Floats) -> Floats:
        """amount: weight of a frame over that of the one after it."""
        weights = self.amount ** np.arange(self.frames)
        weights /= np.linalg.norm(weights)
        shape = take.film.camera.shape
        draws = [take.rng("running", 1000 + take.index - age).standard_normal(shape) for age in range(self.frames)]
        return np.tensordot(weights, np.array(draws), axes=1)


class HeldPattern(Formula):
    """A pattern that is held for some frames and then drawn anew, and fresh noise beside it."""

    effect = "temporal_correlation"
    statistic = "frames"
    span = (0.01, 1.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.hold = int(rng.integers(5, 12))

    def field(self, take: Take, white: Floats) -> Floats:
        """amount: share of the variance that is held."""
        held = take.rng("held", take.index // self.hold).standard_normal(white.shape)
        return np.sqrt(1 - self.amount) * white + np.sqrt(self.amount) * held
