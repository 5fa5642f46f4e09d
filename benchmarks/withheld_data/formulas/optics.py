"""Where a pixel's ray goes."""

import numpy as np

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


class _Radial(Formula):
    """amount is how far the ray of the farthest corner is bent, as a share of its radius."""

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))
        self._corner = float(np.hypot(*film.calibrated).max())


class Division(_Radial):
    """r / (1 + λ r²), the division model (Fitzgibbon 2001)."""

    effect = "lens_distortion"
    span = (5e-4, 0.08)

    def rays(self, take: Take, rays: Floats) -> Floats:
        """λ such that the corner moves by the amount."""
        r2 = np.sum(rays**2, axis=0)
        share = self.sign * self.amount
        lam = -share / (1 + share) / self._corner**2
        return rays / (1 + lam * r2)


class FieldOfView(_Radial):
    """atan(2 r tan(ω/2)) / (2 tan(ω/2)), the FOV model (Devernay and Faugeras 2001), or its inverse."""

    effect = "lens_distortion"
    span = (5e-4, 0.08)

    def rays(self, take: Take, rays: Floats) -> Floats:
        """ω such that the corner moves by about the amount: atan(x)/x = 1 - x²/3."""
        r = np.maximum(np.hypot(*rays), 1e-9)
        k = np.sqrt(3 * self.amount) / self._corner
        bent = np.arctan(k * r) / k if self.sign < 0 else np.tan(k * r) / k
        return rays * (bent / r)


class Decentred(_Radial):
    """Brown's model with k1, k2 of opposite signs and a tangential part."""

    effect = "lens_distortion"
    span = (5e-4, 0.08)

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.second, self.tangential = float(rng.uniform(-0.4, 0.2)), float(rng.uniform(-0.15, 0.15))

    def rays(self, take: Take, rays: Floats) -> Floats:
        """All coefficients in shares of the amount at the corner."""
        x, y = rays / self._corner
        r2 = x * x + y * y
        a = self.sign * self.amount / (1 + self.second)
        radial = 1 + a * (r2 + self.second * r2 * r2)
        p = a * self.tangential
        return np.stack([x * radial + 2 * p * x * y, y * radial + p * (r2 + 2 * y * y)]) * self._corner


class _Calibrated(Formula):
    """Another pinhole than the file's. amount: how far the farthest corner's ray is off, as a share of its radius."""

    span = (5e-4, 0.1)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))
        self._corner = float(np.hypot(*film.calibrated).max())


class Zoomed(_Calibrated):
    """The calibration is of another mode: the picture is zoomed about a point off its middle, and bent a little."""

    effect = "intrinsics"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.x, self.y, self.bend = (float(rng.uniform(-reach, reach)) for reach in (0.3, 0.3, 0.15))

    def rays(self, take: Take, rays: Floats) -> Floats:
        """The point in shares of the corner's radius, the bend in shares of the zoom."""
        away = rays / self._corner - np.array([self.x, self.y])[:, None, None]
        zoom = self.sign * self.amount * (1 + self.bend * np.sum(away**2, axis=0))
        return rays + zoom * away * self._corner


class Anamorphic(_Calibrated):
    """Pixels that are not square, and axes that are not at right angles: fx alone is off, with some skew."""

    effect = "intrinsics"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.skew = float(rng.uniform(-0.2, 0.2))

    def rays(self, take: Take, rays: Floats) -> Floats:
        """x alone, by the amount, and by a share of it times y."""
        x, y = rays
        return np.stack([x + self.sign * self.amount * (x + self.skew * y), y])


class LaplaceJitter(Formula):
    """Rays jitter by a Laplace law, wider in x than in y."""

    effect = "lateral_noise"
    span = (0.05, 4.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.flat = float(rng.uniform(0.6, 1.0))

    def rays(self, take: Take, rays: Floats) -> Floats:
        """amount: std in x [px]."""
        camera = take.film.camera
        shift = take.rng("jitter").laplace(size=rays.shape) * self.amount / np.sqrt(2)
        return rays + shift * np.array([1 / camera.fx, self.flat / camera.fy])[:, None, None]


class DiscJitter(Formula):
    """Rays go through a random point of a disc about the pixel."""

    effect = "lateral_noise"
    span = (0.1, 6.0)

    def rays(self, take: Take, rays: Floats) -> Floats:
        """amount: radius [px]."""
        rng = take.rng("jitter")
        r = self.amount * np.sqrt(rng.random(rays.shape[1:]))
        angle = rng.uniform(0, 2 * np.pi, rays.shape[1:])
        camera = take.film.camera
        return rays + np.stack([r * np.cos(angle) / camera.fx, r * np.sin(angle) / camera.fy])


class PixelBeside(Formula):
    """Some pixels show what one beside them sees, any of eight."""

    effect = "lateral_noise"
    span = (0.01, 1.0)

    def rays(self, take: Take, rays: Floats) -> Floats:
        """amount: their share."""
        rng, camera = take.rng("jitter"), take.film.camera
        some = rng.random(rays.shape[1:]) < self.amount
        steps = rng.integers(-1, 2, rays.shape) * some
        return rays + steps / np.array([camera.fx, camera.fy])[:, None, None]
