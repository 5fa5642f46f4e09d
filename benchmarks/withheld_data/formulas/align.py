"""Depth measured by one camera and told as another's, beside it and with a longer lens."""

import numpy as np

from benchmarks.withheld_data.film import Film, Floats, Formula, Mask, Rng, Take


class _Aligned(Formula):
    """amount is by how much the pictures' focal length is longer than that of the camera that measures, as a share.

    x: where the camera of the pictures is, along the other's x [m].
    """

    statistic = "doubled"
    span = (0.05, 1.6)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.x = float(rng.choice([-0.015, 0.059]) + rng.normal(0, 5e-4))

    def known(self) -> dict[str, float]:
        """Both mean the same."""
        return {"x": self.x, "zoom": 1 + self.amount}

    def _beside(self) -> Floats:
        """(4, 4) the camera that measures, in the frame of the pictures."""
        beside = np.eye(4)
        beside[0, 3] = -self.x
        return beside

    def off(self, film: Film, times: Floats) -> Floats | None:
        """The poses told are those of the pictures."""
        return np.broadcast_to(self._beside(), (len(times), 4, 4))

    def rays(self, take: Take, rays: Floats) -> Floats:
        """A wider picture on as many pixels."""
        return rays * (1 + self.amount)

    def spread(self, take: Take) -> None:
        """A noise in disparity is one of the shorter lens."""
        if take.film.base.sigma:
            take.sigma = take.sigma * (1 + self.amount)

    def finish(self, take: Take) -> None:
        """Resample; from here on the picture and its clean geometry are the other camera's."""
        film = take.film
        take.z = self.resampled(take, take.z)
        take.poses, take.directions = take.poses @ np.linalg.inv(self._beside()), film.calibrated
        many = take.poses[None] if take.poses.ndim == 3 else take.poses
        geometry = film.world.caster.cast(film.camera, many, threads=2)
        take.geometry = geometry[0] if take.poses.ndim == 3 else geometry
        take.sigma = film.law(take.geometry.depth.astype(np.float64), take.geometry.tag)
        self.spread(take)

    def resampled(self, take: Take, z: Floats) -> Floats:
        """(height, width) the depth of each pixel of the pictures."""
        raise NotImplementedError

    def _inside(self, film: Film, u: Floats, v: Floats) -> Mask:
        return (u >= 0) & (u < film.camera.width) & (v >= 0) & (v < film.camera.height)


class PointSplat(_Aligned):
    """Every pixel's middle goes to the nearest pixel, the nearest depth stays; gaps are filled from neighbours."""

    effect = "align_to_color"

    def resampled(self, take: Take, z: Floats) -> Floats:
        """As point clouds are rendered."""
        film, camera = take.film, take.film.camera
        safe = np.where(z > 0, z, 1)
        u = np.rint((take.directions[0] - self.x / safe) * camera.fx + camera.cx)
        v = np.rint(take.directions[1] * camera.fy + camera.cy)
        there = (z > 0) & self._inside(film, u, v)
        out = np.full(camera.shape, np.inf)
        np.minimum.at(out, (v[there].astype(int), u[there].astype(int)), z[there])
        for _ in range(int(np.ceil(self.amount))):
            wide = np.pad(out, 1, constant_values=np.inf)
            steps = [(a, b) for a in range(3) for b in range(3)]
            near = np.min([wide[a : a + out.shape[0], b : b + out.shape[1]] for a, b in steps], axis=0)
            out = np.where(np.isfinite(out), out, near)
        return np.where(np.isfinite(out), out, 0)


class Lookup(_Aligned):
    """Every pixel of the picture looks for the depth at which its ray meets what was measured, and takes that."""

    effect = "align_to_color"

    def resampled(self, take: Take, z: Floats) -> Floats:
        """As shaders do it: a fixed point, from the depth at the same place."""
        film, camera = take.film, take.film.camera
        zoom, (x, y) = 1 + self.amount, film.calibrated
        guess = np.full(camera.shape, float(np.median(z[z > 0])) if (z > 0).any() else 1.0)
        found = np.zeros(camera.shape)
        for _ in range(6):
            u = np.rint((x + self.x / guess) / zoom * camera.fx + camera.cx)
            v = np.rint(y / zoom * camera.fy + camera.cy)
            inside = self._inside(film, u, v)
            at = np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)
            found = np.where(inside, z[at], 0)
            guess = np.where(found > 0, found, guess)
        return found


class Rectangles(_Aligned):
    """Every pixel covers the pixels whose middles lie inside its square's projection; the nearest depth stays."""

    effect = "align_to_color"

    def resampled(self, take: Take, z: Floats) -> Floats:
        """As a rasteriser does it: what only touches a square is not covered."""
        film, camera = take.film, take.film.camera
        safe, half = np.where(z > 0, z, 1), (1 + self.amount) / 2
        u = (take.directions[0] - self.x / safe) * camera.fx + camera.cx
        v = take.directions[1] * camera.fy + camera.cy
        first, last = np.ceil(np.stack([v, u]) - half), np.ceil(np.stack([v, u]) + half) - 1
        out = np.full(camera.shape, np.inf)
        steps = range(int(np.ceil(2 * half)) + 1)
        for down in steps:
            for across in steps:
                y, x = first[0] + down, first[1] + across
                there = (z > 0) & (y <= last[0]) & (x <= last[1]) & self._inside(film, x, y)
                np.minimum.at(out, (y[there].astype(int), x[there].astype(int)), z[there])
        return np.where(np.isfinite(out), out, 0)
