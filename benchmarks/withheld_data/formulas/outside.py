"""Effects that no bank has: the diagnosis must say where they lie, and name nothing."""

from dataclasses import replace

import numpy as np
from scipy import ndimage

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


class DirtyCover(Formula):
    """Specks on the glass that stay where they are: holes in fixed places of the image, in many small patches."""

    effect = "fixed_holes"
    statistic = "holes"
    span = (1e-3, 0.9)
    axes = ("image_position", "image_row", "image_column", "frame_neighbours", "pixel_neighbours")

    def __init__(self, rng: Rng, film: Film) -> None:
        self.grain = float(rng.uniform(0.8, 4.0))
        self._order = ndimage.gaussian_filter(rng.standard_normal(film.camera.shape), self.grain)
        self._order = np.argsort(np.argsort(self._order, axis=None)).reshape(film.camera.shape) / self._order.size

    def lose(self, take: Take) -> Mask:
        """amount: share of the image that is covered."""
        return self._order < self.amount


class AgeingNoise(Formula):
    """The noise grows while the camera runs, as the projector fades."""

    effect = "ageing_noise"
    statistic = "spread"
    span = (0.02, 10.0)
    axes = ("time", "motion")

    def __init__(self, rng: Rng, film: Film) -> None:
        self.power = float(rng.uniform(0.6, 2.0))
        self._seconds = max(float(film.stamps[-1] - film.stamps[0]), 1e-9)

    def spread(self, take: Take) -> None:
        """amount: factor less 1 at the end."""
        share = (take.stamp - float(take.film.stamps[0])) / self._seconds
        take.sigma = take.sigma * (1 + self.amount * share**self.power)


class NoisyCorner(Formula):
    """One place of the scene is noisy, whatever it is made of: a heater, a curtain in the wind."""

    effect = "noisy_place"
    statistic = "spread"
    span = (0.02, 12.0)
    axes = ("surface", "height", "image_position", "material")

    def __init__(self, rng: Rng, film: Film) -> None:
        take = film.make(len(film) // 2, (), noise=False)
        seen = take.points[take.z > 0]
        self._centre = seen[int(rng.integers(len(seen)))]
        self.radius = float(rng.uniform(0.4, 1.2))

    def spread(self, take: Take) -> None:
        """amount: factor less 1 within the radius [m]."""
        near = np.linalg.norm(take.points - self._centre, axis=-1) < self.radius
        take.sigma = np.where(near, take.sigma * (1 + self.amount), take.sigma)


class TravellingWave(Formula):
    """A wave of disparity that travels over the image, as a beat between exposure and scan has it."""

    effect = "travelling_wave"
    span = (2e-3, 1.5)
    axes = ("pixel_neighbours", "frame_neighbours", "time", "image_position", "image_row", "image_column")

    def __init__(self, rng: Rng, film: Film) -> None:
        height = film.camera.height
        self.length = float(rng.uniform(0.15, 0.6) * height)
        self.angle, self.per_frame = float(rng.uniform(0, np.pi)), float(rng.uniform(0.07, 0.45))

    def bias(self, take: Take) -> None:
        """amount: its height [px]; length in pixels, per_frame in turns."""
        along = take.film.u * np.cos(self.angle) + take.film.v * np.sin(self.angle)
        wave = self.amount * np.sin(2 * np.pi * (along / self.length + self.per_frame * take.index))
        d = take.disparity
        take.z = np.where(d > 0, take.film.inverse(np.maximum(d + wave, d / 3)), 0)


class ForeignThing(Formula):
    """A thing hangs in the scene that its model does not have."""

    effect = "foreign_thing"
    span = (0.02, 0.5)
    axes = ("surface", "image_position", "residual_tail", "height", "edge_distance", "range")

    def __init__(self, rng: Rng, film: Film) -> None:
        take = film.make(len(film) // 2, (), noise=False)
        v, u = np.nonzero(take.z > 0)
        at = int(rng.integers(len(v)))
        eye = take.origins[v[at], 0]
        self._centre = eye + float(rng.uniform(0.4, 0.8)) * (take.points[v[at], u[at]] - eye)

    def bias(self, take: Take) -> None:
        """amount: radius of a ball [m]."""
        poses = np.broadcast_to(take.poses, (take.film.camera.height, 4, 4))
        local = np.einsum("vji,vj->vi", poses[:, :3, :3], self._centre - poses[:, :3, 3])[:, None]
        ray = np.stack([take.directions[0], take.directions[1], np.ones_like(take.z)], axis=-1)
        a, b = (ray**2).sum(axis=-1), (ray * local).sum(axis=-1)
        root = b**2 - a * ((local**2).sum(axis=-1) - self.amount**2)
        near = np.where(root > 0, (b - np.sqrt(np.maximum(root, 0))) / a, 0)
        hit = (near > 0.1) & ((take.z == 0) | (near < take.z))
        take.z = np.where(hit, near, take.z)
        take.sigma = np.where(hit, take.film.law(take.z, take.geometry.tag), take.sigma)


class NoisyFrames(Formula):
    """Some frames are noisier than the rest: another projector in the room, now and then."""

    effect = "noisy_frames"
    statistic = "spread"
    span = (0.02, 15.0)
    axes = ("time", "frame_neighbours", "residual_tail", "motion")

    def __init__(self, rng: Rng, film: Film) -> None:
        self._noisy = rng.random(len(film)) < rng.uniform(0.2, 0.5)
        self._noisy[int(rng.integers(len(film)))] = True

    def spread(self, take: Take) -> None:
        """amount: factor less 1 in such frames."""
        take.sigma = take.sigma * (1 + self.amount * self._noisy[min(take.index, len(self._noisy) - 1)])


class FrameGain(Formula):
    """Each frame has a scale of its own: the rectification is estimated anew all the time."""

    effect = "frame_gain"
    span = (5e-4, 0.1)
    axes = ("time", "range", "frame_neighbours", "pixel_neighbours")

    def bias(self, take: Take) -> None:
        """amount: std of the scale."""
        take.z = take.z * (1 + self.amount * np.clip(take.rng("gain").standard_normal(), -3, 3))


class DarkBar(Formula):
    """A bar of rows without depth wanders over the image: a lamp's beat against the shutter."""

    effect = "wandering_bar"
    statistic = "holes"
    span = (2e-3, 1.0)
    axes = ("time", "image_row", "image_position", "pixel_neighbours", "frame_neighbours")

    def __init__(self, rng: Rng, film: Film) -> None:
        self.width, self.per_frame = float(rng.uniform(0.05, 0.25)), float(rng.uniform(0.05, 0.4))
        self.begin = float(rng.random())

    def lose(self, take: Take) -> Mask:
        """amount: chance in the bar; width and way a frame in image heights."""
        row = (take.film.v / take.film.camera.height - self.begin - self.per_frame * take.index) % 1.0
        return (row < self.width) & (take.rng("bar").random(take.z.shape) < self.amount)
