"""Effects that no bank has: the diagnosis must say where they lie, and name nothing."""

from dataclasses import replace

import numpy as np

from benchmarks.withheld_data.film import Film, Formula, Mask, Rng, Take
from benchmarks.withheld_data.world import World


class RowBanding(Formula):
    """Every row of every frame has an offset of its own in disparity: the supply of the imager is not quiet."""

    effect = "row_banding"
    span = (2e-3, 1.0)
    axes = ("image_row", "pixel_neighbours")

    def bias(self, take: Take) -> None:
        """amount: std of the rows [px]."""
        d = take.disparity
        rows = take.rng("rows").normal(0, self.amount, (len(d), 1))
        take.z = np.where(d > 0, take.film.inverse(np.maximum(d + rows, d / 3)), 0)


class WavyRange(Formula):
    """A bias that waves with depth, as that of a camera that measures phases."""

    effect = "wavy_range"
    span = (5e-4, 0.3)
    axes = ("range", "disparity_phase")

    def __init__(self, rng: Rng, film: Film) -> None:
        self.length, self.phase = float(rng.uniform(0.4, 1.2)), float(rng.uniform(0, 2 * np.pi))

    def bias(self, take: Take) -> None:
        """amount: its height [m]."""
        wave = self.amount * np.sin(2 * np.pi * take.z / self.length + self.phase)
        take.z = np.where(take.z > 0, np.maximum(take.z + wave, take.z / 2), 0)


class WarmAir(Formula):
    """A bias that grows with the height of the point: a layer of warm air, or a scene that was measured aslant."""

    effect = "height_bias"
    span = (5e-4, 0.3)
    axes = ("height", "surface")

    def __init__(self, rng: Rng, film: Film) -> None:
        self.sign = float(rng.choice([-1, 1]))

    def bias(self, take: Take) -> None:
        """amount: metres of depth per metre of height above the middle."""
        above = take.points[..., 2] - 0.5 * min(film_height(take.film), 3.0)
        take.z = np.where(take.z > 0, np.maximum(take.z + self.sign * self.amount * above, take.z / 2), 0)


def film_height(film: Film) -> float:
    """How high the scene is [m]."""
    low, high = film.world.scene.bounds[:, 2]
    return float(high - low)


class MovedThing(Formula):
    """One thing of the scene does not stand where the scene says."""

    effect = "moved_region"
    span = (0.005, 0.2)
    axes = ("surface", "image_position", "material")

    def __init__(self, rng: Rng, film: Film) -> None:
        self._faces = film.world.parts[int(rng.integers(len(film.world.parts)))] if film.world.parts else (0, 0)
        way = rng.normal(size=3) * (1, 1, 0.1)
        self._way = way / np.linalg.norm(way)
        self._moved: tuple[float, World] | None = None

    def bias(self, take: Take) -> None:
        """amount: how far [m]. The frame is cast in the scene as it really is."""
        if self._moved is None or self._moved[0] != self.amount:
            scene = take.film.world.scene
            vertices = scene.vertices.copy()
            vertices[np.unique(scene.faces[slice(*self._faces)])] += self._way * self.amount
            self._moved = self.amount, replace(take.film.world, scene=replace(scene, vertices=vertices))
        take.geometry = self._moved[1].caster.cast(take.film.camera, take.poses, threads=2)
        take.z = take.geometry.depth.astype(np.float64)
        take.sigma = take.film.law(take.z, take.geometry.tag)


class SmudgedLens(Formula):
    """A finger's print on the glass: holes in one region of the image."""

    effect = "hole_region"
    statistic = "holes"
    span = (1e-3, 1.0)
    axes = ("image_position", "image_row", "image_column", "image_radius")

    def __init__(self, rng: Rng, film: Film) -> None:
        self.centre = rng.uniform(0.15, 0.85, 2)
        self.size = rng.uniform(0.08, 0.2, 2)

    def lose(self, take: Take) -> Mask:
        """amount: chance in its middle."""
        height, width = take.film.camera.shape
        u = (take.film.u / width - self.centre[0]) / self.size[0]
        v = (take.film.v / height - self.centre[1]) / self.size[1]
        return take.rng("smudge").random(take.z.shape) < self.amount * np.exp(-0.5 * (u * u + v * v))


class Flicker(Formula):
    """The noise comes and goes with time, as under lamps that beat with the frame rate."""

    effect = "flicker"
    statistic = "spread"
    span = (0.02, 10.0)
    axes = ("time", "frame_neighbours")

    def __init__(self, rng: Rng, film: Film) -> None:
        self.period, self.phase = float(rng.uniform(4.3, 9.7)), float(rng.uniform(0, 1))

    def spread(self, take: Take) -> None:
        """amount: factor less 1 at its peak; period in frames."""
        share = 0.5 + 0.5 * np.sin(2 * np.pi * (take.index / self.period + self.phase))
        take.sigma = take.sigma * (1 + self.amount * share)


class StuckFrames(Formula):
    """Some frames show the picture of an earlier one once more."""

    effect = "stuck_frames"
    statistic = "stuck"
    span = (0.02, 0.95)
    axes = ("frame_neighbours", "time", "motion", "residual_tail")

    def __init__(self, rng: Rng, film: Film) -> None:
        self._turn = rng.random(len(film))

    def shown(self, index: int) -> int:
        """amount: share of the frames that are stuck."""
        while index > 0 and self._turn[index] < self.amount:
            index -= 1
        return index
