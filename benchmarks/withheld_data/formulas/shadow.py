"""What the right imager cannot see."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Formula, Mask, Rng, Take


class _Shadow(Formula):
    """amount is the share of the shadows that stay empty up to 1; beyond it, shadows are wider by so many pixels."""

    statistic = "holes"
    span = (0.02, 9.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.margin = float(rng.uniform(0.0, 1.5))

    def hidden(self, take: Take) -> Mask:
        """Where the right imager sees something nearer."""
        raise NotImplementedError

    def lose(self, take: Take) -> Mask:
        """Shadows are kept or filled patch by patch, eight rows by some columns at a time."""
        wide = self.margin + max(self.amount - 1, 0)
        hidden = self.hidden(take)
        if wide > 0.5 and hidden.any():
            away = ndimage.distance_transform_edt(~hidden, sampling=(2.0, 1.0))
            hidden = away <= wide
        height, width = hidden.shape
        turn = take.rng("shadow").random((height // 8 + 1, width // 24 + 1))
        patch = np.repeat(np.repeat(turn, 8, axis=0), 24, axis=1)[:height, :width]
        return hidden & (patch < min(self.amount, 1.0))


class OrderAlongRow(_Shadow):
    """A pixel is hidden if one to its right comes to lie at or left of it in the right image."""

    effect = "stereo_shadow"

    def hidden(self, take: Take) -> Mask:
        """The running minimum of u - d from the right."""
        d = take.clean_disparity
        at = np.where(d > 0, take.film.u - d, np.inf)
        least = np.minimum.accumulate(at[:, ::-1], axis=1)[:, ::-1]
        beside = np.concatenate([least[:, 1:], np.full((len(at), 1), np.inf)], axis=1)
        return (beside <= at - 0.25) & (d > 0)


class WarpedForward(_Shadow):
    """The disparities are carried to the right image, the nearest wins; who finds another there is hidden."""

    effect = "stereo_shadow"

    def hidden(self, take: Take) -> Mask:
        """A buffer of half pixels."""
        d = take.clean_disparity
        height, width = d.shape
        cell = np.clip(np.floor((take.film.u - d) * 2).astype(int) + 2 * width, 0, 4 * width)
        buffer = np.zeros((height, 4 * width + 2))
        rows = take.film.v.astype(int)
        for shift in (0, 1):
            np.maximum.at(buffer, (rows, cell + shift), d)
        return (buffer[rows, cell] > d + 1.0) & (d > 0)


class RightLooksBack(_Shadow):
    """The scene is cast from the right imager too: a pixel whose place there has another depth is hidden."""

    effect = "stereo_shadow"

    def hidden(self, take: Take) -> Mask:
        """Left-right check with a threshold of one pixel."""
        film = take.film
        pose = take.pose.copy()
        pose[:3, 3] += pose[:3, 0] * film.camera.baseline
        right = film.inverse(film.world.caster.cast(film.camera, pose, threads=2).depth.astype(np.float64))
        d = take.clean_disparity
        at = np.rint(film.u - d).astype(int)
        there = np.take_along_axis(right, np.clip(at, 0, film.camera.width - 1), axis=1)
        return (there > d + 1.0) & (at >= 0) & (d > 0)
