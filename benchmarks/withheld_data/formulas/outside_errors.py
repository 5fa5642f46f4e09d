"""Biases, noise and outliers that no bank has: of materials, angles, heights and halves of the picture."""

import numpy as np
from scipy import ndimage

from benchmarks.withheld_data.film import Film, Formula, Rng, Take
from benchmarks.withheld_data.formulas.outside_holes import near_edges
from benchmarks.withheld_data.formulas.seen import draw_tag, of_tag, ranges


class Translucent(Formula):
    """Light goes into one material before it comes back: its depth is too large."""

    effect = "material_bias"
    span = (5e-4, 0.3)
    axes = ("material", "surface")

    def __init__(self, rng: Rng, film: Film) -> None:
        self.tag = draw_tag(rng, film, 0.05)

    def bias(self, take: Take) -> None:
        """amount: by how much [m]."""
        take.z = np.where(of_tag(take, self.tag) & (take.z > 0), take.z + self.amount, take.z)


class SlantedTooFar(Formula):
    """What is seen at a grazing angle is measured too far."""

    effect = "incidence_bias"
    span = (5e-4, 0.5)
    axes = ("incidence", "surface")

    def bias(self, take: Take) -> None:
        """amount: at 90 degrees [m]; it goes with the fourth power of the sine."""
        take.z = np.where(take.z > 0, take.z + self.amount * np.sin(take.angle) ** 4, take.z)


class StretchedFar(Formula):
    """Beyond a knee depths are stretched."""

    effect = "far_bias"
    span = (5e-4, 0.8)
    axes = ("range",)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.knee = float(ranges(film)[int(rng.integers(300, 600))])

    def bias(self, take: Take) -> None:
        """amount: share of what is beyond the knee [m]."""
        take.z = take.z + self.amount * np.maximum(take.z - self.knee, 0)


class SmokeAbove(Formula):
    """The noise grows with the height of the point: steam under the ceiling."""

    effect = "height_noise"
    statistic = "spread"
    span = (0.02, 12.0)
    axes = ("height", "surface")

    def spread(self, take: Take) -> None:
        """amount: factor less 1 at 2.5 m; it goes with the square."""
        take.sigma = take.sigma * (1 + self.amount * np.clip(take.points[..., 2] / 2.5, 0, 1) ** 2)


class OneSideNoisy(Formula):
    """The noise grows from left to right: the projector points aside."""

    effect = "column_noise"
    statistic = "spread"
    span = (0.02, 12.0)
    axes = ("image_column", "image_position")

    def spread(self, take: Take) -> None:
        """amount: factor less 1 at the right."""
        take.sigma = take.sigma * (1 + self.amount * take.film.u / take.film.camera.width)


class NoisyEdges(Formula):
    """Near depth edges there is more noise, and nothing in between."""

    effect = "edge_noise"
    statistic = "spread"
    span = (0.05, 60.0)
    axes = ("edge_distance", "residual_tail")

    def spread(self, take: Take) -> None:
        """amount: factor less 1 within four pixels of an edge."""
        take.sigma = np.where(near_edges(take, 4), take.sigma * (1 + self.amount), take.sigma)


class Reflections(Formula):
    """One material shows in patches what it reflects, which is farther."""

    effect = "reflections"
    statistic = "spurious"
    span = (1e-4, 0.5)
    axes = ("material", "surface", "residual_tail", "incidence")

    def __init__(self, rng: Rng, film: Film) -> None:
        self.tag, self.further = draw_tag(rng, film, 0.05), float(rng.uniform(1.4, 2.2))

    def tail(self, take: Take) -> None:
        """amount: share of the material that does."""
        field = ndimage.gaussian_filter(take.rng("reflections").standard_normal(take.z.shape), 3.0)
        shows = of_tag(take, self.tag) & (field > np.quantile(field, 1 - self.amount))
        take.z = np.where(shows, take.z * self.further, take.z)


class TornFrames(Formula):
    """In some frames the upper rows are still those of the frame before."""

    effect = "torn_frames"
    span = (0.02, 0.95)
    axes = ("motion", "time", "image_row", "image_position", "frame_neighbours", "edge_distance", "residual_tail")

    def __init__(self, rng: Rng, film: Film) -> None:
        self._turn, self._row = rng.random(len(film)), rng.uniform(0.2, 0.9, len(film))

    def finish(self, take: Take) -> None:
        """amount: share of the frames that are torn."""
        turn = min(take.index, len(self._turn) - 1)
        if take.index > 0 and self._turn[turn] < self.amount:
            rows = int(self._row[turn] * len(take.z))
            take.z[:rows] = take.film.make(take.index - 1, ()).z[:rows]
