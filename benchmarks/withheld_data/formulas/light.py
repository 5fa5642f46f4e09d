"""Light that is mirrored, and light that is not the camera's own."""

import numpy as np

from benchmarks.withheld_data.film import Film, Floats, Formula, Mask, Rng, Take
from depthsim.camera import Camera


class PhongHighlight(Formula):
    """A Phong lobe on the half vector between imager and projector, on glossy materials."""

    effect = "specular_dropout"
    statistic = "holes"
    span = (0.01, 1.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.power, self.beside = float(rng.uniform(20, 120)), float(rng.uniform(0.02, 0.04))

    def lobe(self, cosine: Floats) -> Floats:
        """1 in the middle of the mirror."""
        return cosine**self.power

    def lose(self, take: Take) -> Mask:
        """amount: chance on a mirror's middle; other materials by their gloss, from 0.1 on."""
        gloss = take.film.world.property("gloss")
        share = np.where(gloss >= 0.1, np.minimum(1.0, 0.35 + 2 * gloss), 0)
        half = _half_vector(take, self.beside)
        cosine = np.clip(np.sum(half * take.normals, axis=-1), 0, 1)
        chance = self.amount * share[take.geometry.tag] * self.lobe(cosine)
        return (take.rng("mirror").random(take.z.shape) < chance) & take.hit


class MirrorDisc(PhongHighlight):
    """All within an angle of the mirror direction, with a soft rim."""

    effect = "specular_dropout"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.reach, self.rim = float(rng.uniform(6, 16)), float(rng.uniform(0.8, 2.5))

    def lobe(self, cosine: Floats) -> Floats:
        """A logistic step of the angle."""
        return 1 / (1 + np.exp((np.degrees(np.arccos(cosine)) - self.reach) / self.rim))


def _half_vector(take: Take, beside: float) -> Floats:
    """Between the directions to the imager and to a projector ``beside`` it along x [m], world."""
    rotation = take.pose[:3, :3]
    to_camera = take.origins - take.points
    to_projector = to_camera + rotation[:, 0] * beside
    half = to_camera / np.maximum(np.linalg.norm(to_camera, axis=-1, keepdims=True), 1e-9)
    half = half + to_projector / np.maximum(np.linalg.norm(to_projector, axis=-1, keepdims=True), 1e-9)
    return half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-9)


class _Sun(Formula):
    """A sun that casts shadows where the scene is open, or shines through a window where it is a room."""

    statistic = "spread"
    span = (1e-2, 30.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        world = film.world
        self._window: tuple[Floats, Floats] | None = None
        if world.sun is not None:
            self._sun = world.sun
        else:
            # Through a hole in the wall x = 0 of the room.
            high, side = np.radians(rng.uniform(15, 40)), np.radians(rng.uniform(-40, 40))
            self._sun = np.array([-np.cos(high) * np.cos(side), np.cos(high) * np.sin(side), np.sin(high)])
            low = rng.uniform((0.1, 0.2), (0.45, 0.5)) * world.room[1, 1:]
            self._window = low, low + rng.uniform((0.35, 0.3), (0.6, 0.5)) * world.room[1, 1:]
        self.azimuth = float(np.degrees(np.arctan2(self._sun[1], self._sun[0])))
        self.elevation = float(np.degrees(np.arcsin(self._sun[2])))
        self._map = _ShadowMap(film, self._sun) if world.sun is not None else None

    def sunlight(self, take: Take) -> Floats:
        """n·s where the sun shines, else 0."""
        caught = np.clip(take.normals @ self._sun, 0, 1) * take.hit
        if self._map is not None:
            return caught * self._map.lit(take.points)
        if self._window is None:
            return caught
        step = -take.points[..., 0] / np.minimum(self._sun[0], -1e-6)
        at = take.points[..., 1:] - (take.points[..., 0] / self._sun[0])[..., None] * self._sun[1:]
        low, high = self._window
        return caught * ((at >= low) & (at <= high)).all(axis=-1) * (step >= 0)

    def known(self) -> dict[str, float]:
        """Where the sun stands."""
        return {"azimuth": self.azimuth, "elevation": self.elevation}


class SunNoiseAndHoles(_Sun):
    """Sunlit surfaces: the noise that is there grows by a factor, and some pixels become holes."""

    effect = "ambient_light"

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.holes = float(rng.uniform(0.03, 0.12))

    def spread(self, take: Take) -> None:
        """amount: factor less 1 in full sun."""
        take.sigma = take.sigma * (1 + self.amount * self.sunlight(take))

    def lose(self, take: Take) -> Mask:
        """In proportion to the same, to at most 60 %."""
        chance = np.minimum(self.holes * self.amount, 0.6) * self.sunlight(take)
        return take.rng("sun").random(take.z.shape) < chance


class Glare(_Sun):
    """Sunlit surfaces: mostly holes, by a saturating curve of the light, and a little noise of the disparity."""

    effect = "ambient_light"
    statistic = "holes"
    span = (5e-3, 4.0)

    def __init__(self, rng: Rng, film: Film) -> None:
        super().__init__(rng, film)
        self.noise = float(rng.uniform(0.02, 0.08))

    def spread(self, take: Take) -> None:
        """noise: std in full sun [px]."""
        z = take.geometry.depth.astype(np.float64)
        more = self.noise * np.sqrt(self.sunlight(take)) * z * z / take.film.camera.focal_baseline
        take.sigma = np.hypot(take.sigma, more)

    def lose(self, take: Take) -> Mask:
        """amount: 1 - exp(-amount · n·s) become holes."""
        return take.rng("sun").random(take.z.shape) < 1 - np.exp(-self.amount * self.sunlight(take))


class _ShadowMap:
    """The scene's depth as seen from the sun, by a very long lens far away."""

    AWAY, SIZE = 200.0, 1024

    def __init__(self, film: Film, sun: Floats) -> None:
        low, high = film.world.scene.bounds
        radius = float(np.linalg.norm(high - low) / 2)
        right = np.cross(sun, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        self._pose = np.eye(4)
        self._pose[:3, :3] = np.stack([right, np.cross(-sun, right), -sun], axis=1)
        self._pose[:3, 3] = (low + high) / 2 + sun * self.AWAY
        focal = self.SIZE / 2 / (radius / (self.AWAY - radius))
        middle = (self.SIZE - 1) / 2
        camera = Camera(width=self.SIZE, height=self.SIZE, fx=focal, fy=focal, cx=middle, cy=middle, baseline=0.05)
        self._focal, self._middle = focal, middle
        self._depth = film.world.caster.cast(camera, self._pose, threads=2).depth

    def lit(self, points: Floats) -> Mask:
        """(..., 3) points in the world: whether nothing is nearer to the sun by more than 3 cm."""
        local = (points - self._pose[:3, 3]) @ self._pose[:3, :3]
        z = np.maximum(local[..., 2], 1e-6)
        at = np.rint(local[..., :2] / z[..., None] * self._focal + self._middle).astype(int)
        u, v = np.clip(at[..., 0], 0, self.SIZE - 1), np.clip(at[..., 1], 0, self.SIZE - 1)
        nearest = self._depth[v, u]
        return (nearest <= 0) | (local[..., 2] <= nearest + 0.03)
