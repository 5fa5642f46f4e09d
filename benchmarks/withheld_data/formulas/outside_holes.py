"""Holes that no bank has: lost on the way, with the camera's motion, over time, or where the picture is."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Floats, Formula, Mask, Rng, Take
from benchmarks.withheld_data.formulas.holes import Chance


class LostLines(Formula):
    """Single rows of a frame get lost on the way, others in every frame."""

    effect = "lost_lines"
    statistic = "holes"
    span = (1e-3, 0.9)
    axes = ("image_row", "pixel_neighbours")

    def lose(self, take: Take) -> Mask:
        """amount: share of the rows."""
        height, width = take.z.shape
        return np.repeat(take.rng("lines").random((height, 1)) < self.amount, width, axis=1)


class LostBlocks(Formula):
    """Squares of 16x16 pixels get lost, others in every frame, as of a picture that was sent compressed."""

    effect = "lost_blocks"
    statistic = "holes"
    span = (1e-3, 0.9)
    axes = ("pixel_neighbours", "image_position")

    def lose(self, take: Take) -> Mask:
        """amount: share of the squares."""
        height, width = take.z.shape
        lost = take.rng("blocks").random((height // 16 + 1, width // 16 + 1)) < self.amount
        return np.repeat(np.repeat(lost, 16, axis=0), 16, axis=1)[:height, :width]


class HoleBursts(Chance):
    """Some frames have many more holes than the rest."""

    effect = "hole_bursts"
    axes = ("time", "frame_neighbours", "motion")

    def __init__(self, rng: Rng, film: Film) -> None:
        self._poor = rng.random(len(film)) < rng.uniform(0.2, 0.5)
        self._poor[[0, -1]] = True, False

    def chance(self, take: Take) -> Floats:
        """amount: chance in such frames."""
        return np.full(take.z.shape, self.amount * self._poor[min(take.index, len(self._poor) - 1)])


class HolesWithSpeed(Chance):
    """What moves too fast over the picture is not matched."""

    effect = "motion_holes"
    axes = ("motion", "time", "frame_neighbours")

    def __init__(self, rng: Rng, film: Film) -> None:
        way = np.linalg.norm(np.diff(film.poses[:, :3, 3], axis=0), axis=1)
        cosine = (np.einsum("nji,nji->n", film.poses[1:, :3, :3], film.poses[:-1, :3, :3]) - 1) / 2
        speed = way + np.arccos(np.clip(cosine, -1, 1))
        self._share = (np.append(speed, speed[-1:]) / max(float(speed.max()), 1e-9)) ** 2
        self._stamps = film.stamps

    def chance(self, take: Take) -> Floats:
        """amount: chance where the camera is fastest; it goes with the square of the speed."""
        return np.full(take.z.shape, self.amount * np.interp(take.stamp, self._stamps, self._share))


class AgeingHoles(Chance):
    """Ever more holes while the camera runs."""

    effect = "ageing_holes"
    axes = ("time", "motion")

    def chance(self, take: Take) -> Floats:
        """amount: chance at the end; it goes with the square of the time."""
        share = (take.index / max(len(take.film) - 1, 1)) ** 2
        return np.full(take.z.shape, self.amount * share)


class DarkCorners(Chance):
    """Less light to the corners, and more holes."""

    effect = "vignetting_holes"
    axes = ("image_radius", "image_position", "image_row", "image_column")

    def chance(self, take: Take) -> Floats:
        """amount: chance in the corners; it goes with the fourth power of the radius."""
        camera = take.film.camera
        u, v = (take.film.u - camera.cx) / camera.width, (take.film.v - camera.cy) / camera.height
        return self.amount * np.minimum(2 * (u * u + v * v), 1) ** 2


class HolesAtEdges(Chance):
    """On both sides of a depth edge, up or down as well as left or right, pixels are lost by chance."""

    effect = "edge_holes"
    axes = ("edge_distance", "pixel_neighbours")

    def chance(self, take: Take) -> Floats:
        """amount: chance within three pixels of an edge."""
        return self.amount * near_edges(take, 3)


def near_edges(take: Take, reach: int) -> Mask:
    """(height, width) so near to where the clean disparity is 1 px off the line through its neighbours [px]."""
    d = take.clean_disparity
    bent = [np.abs(ndimage.correlate1d(d, [1, -2, 1], axis=axis, mode="nearest")) > 1.0 for axis in (0, 1)]
    return np.asarray(ndimage.binary_dilation(bent[0] | bent[1], iterations=reach))
