"""What the two infrared imagers see of a scene."""

import math
import zlib

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.coloring import albedo_of
from depthsim.draws import Draws, Seed
from depthsim.materials import Materials
from depthsim.moving import objects_seen
from depthsim.parallel import core_count, split
from depthsim.raycast import Caster, Geometry
from depthsim.scene import NO_TAG
from depthsim.stereo import imager
from depthsim.stereo.light import BLOCK, WAVELENGTHS, radiance
from depthsim.stereo.pattern import dot_pattern
from depthsim.stereo.settings import ActiveStereo

SIDES = ("left", "right")
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Shares of red, green and blue in how bright a colour is (ITU-R BT.709): what a texture scatters at 850 nm."""
_TEXTURE = 0.6
"""Contrast of a surface's texture at 850 nm as a share of that in visible light: dyes are much alike there."""


class Renderer:
    """Renders rectified pairs. ``camera`` must be a pinhole; the right imager is its equal at +baseline."""

    def __init__(self, caster: Caster, camera: Camera, settings: ActiveStereo, materials: Materials) -> None:
        self.caster, self.camera, self.settings = caster, camera, settings
        self._source = settings.projector.position * camera.baseline
        across, down = settings.imager.samples, rows_of_rays(settings, camera)
        self._eyes = [_fine(camera, across, down, self._source - x) for x in (0.0, camera.baseline)]
        self._pattern = dot_pattern(settings.projector)
        self._falloff = imager.falloff(camera, settings.imager, core_count())
        scene = caster.scene
        # Far from the origin float32 loses the finest octave; a multiple of all wavelengths near the scene is taken.
        self._origin = 256 * np.round(scene.vertices[scene.faces[0, 0]] / 256)
        self._clear = materials.clear
        self._looks = np.zeros((NO_TAG + 1, 3), np.float32)
        for index, tag in enumerate(scene.tags):
            material = materials[tag]
            self._looks[index] = material.ir_reflectance, material.gloss, _TEXTURE * material.texture

    def render(
        self, pose: NDArray[np.float64], seed: int | Seed, index: int, threads: int, stamp: float = 0.0
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """The left and right image, (height, width) uint8, of frame ``index`` at ``pose`` (4, 4) and ``stamp`` [s]."""
        settings, camera = self.settings, self.camera
        images = [self._light(side, pose, seed, threads, stamp) for side in range(2)]
        time, gain = imager.exposure(images, settings.imager, camera)
        left, right = (
            imager.develop(
                image, settings.imager, camera, time, gain * (1 + side * settings.imager.imbalance),
                Draws(seed, f"active_stereo {SIDES[side]}", index, threads), threads,
            )
            for side, image in enumerate(images)
        )  # fmt: skip
        return left, right

    def _light(
        self, side: int, pose: NDArray[np.float64], seed: int | Seed, threads: int, stamp: float
    ) -> NDArray[np.float32]:
        """(height, width) irradiance on one imager [W/m²]."""
        eye, light, scene = self._eyes[side], self.settings.light, self.caster.scene
        offset = side * self.camera.baseline
        place = pose.copy()
        place[:3, 3] += pose[:3, 0] * offset
        met: Geometry = self.caster.cast(eye, place, right=True, stamps=stamp, threads=threads)
        assert met.right_sees is not None
        sun = np.asarray(light.sun_direction) / np.linalg.norm(light.sun_direction)
        # Without a sun its shadows are of no interest, and any picture will do.
        sunlit = met.right_sees
        if light.sun:
            sunlit = self.caster.reached(eye, place, met.depth, sun, threads, stamp, through=self._clear)
        rays = (eye.width, eye.width // self.camera.width, eye.height // self.camera.height)
        grain = np.array([self.settings.projector.speckle, *rays], np.float32)
        albedo = np.empty(0, np.float32)
        if scene.look is not None:
            albedo = (albedo_of(met, eye, place, scene, threads, stamp) @ _LUMINANCE).reshape(-1)
        out = np.empty(eye.shape, np.float32)
        flat = [picture.reshape(-1) for picture in (met.depth, met.face, met.tag, met.right_sees, sunlit)]

        def shine(
            start: int, stop: int, frame: NDArray[np.float64], origin: NDArray[np.float64], out: NDArray[np.float32]
        ) -> None:
            """Pixels ``start`` to ``stop``; ``frame``: the imager's pose in that of texture and normals, (4, 4)."""
            row = np.concatenate([frame[:3, :3].reshape(-1), frame[:3, 3] - origin]).astype(np.float32)
            # Speckle stays while surface and imager stay, and is another once one of them moves.
            still = zlib.crc32(np.round(frame * 1000).astype(np.int64).tobytes())
            pixels = self.camera.height * self.camera.width
            speckle = Draws(seed, f"speckle {SIDES[side]}", still, threads).normal((pixels,))
            arguments = (
                row, np.float32(1 / eye.fx), np.float32(offset), np.float32(self._source), self._pattern,
                np.array([light.ambient, light.sun], np.float32), (pose[:3, :3].T @ sun).astype(np.float32),
                self._looks, np.array(WAVELENGTHS, np.float32), speckle, grain, eye.rays[0].reshape(-1),
                eye.rays[1].reshape(-1), *flat, scene.normals, albedo, out,
            )  # fmt: skip
            if stop - start == out.size:
                split(radiance, out.size, threads, *arguments, multiple=BLOCK)
            else:
                radiance(start, stop, *arguments)

        shine(0, out.size, place, self._origin, out.reshape(-1))
        own = np.empty(out.size if scene.movers else 0, np.float32)
        for _, seen, beside in objects_seen(scene.movers, met.face.reshape(-1), place, stamp):
            shine(int(seen[0]), int(seen[-1]) + 1, beside, np.zeros(3), own)
            out.reshape(-1)[seen] = own[seen]
        return imager.gather(out, self._falloff, self.camera, self.settings.imager, threads)


def rows_of_rays(settings: ActiveStereo, camera: Camera) -> int:
    """How many rays lie above each other in a pixel: as many as beside each other, or half, where dots are as wide.

    Disparity is measured along rows. Down, rays two standard deviations of a dot apart see 99 % of what is there, and
    blurring by the lens follows.
    """
    dot = settings.projector.dot_width * 1e-3 * camera.fy
    return min(settings.imager.samples, math.ceil(settings.imager.samples / (4 * dot)))


def _fine(camera: Camera, across: int, down: int, source: float) -> Camera:
    """The same view with more rays a pixel; its "right imager" is the projector, ``source`` metres to the right."""
    keys = camera.model_dump() | {
        "width": camera.width * across,
        "height": camera.height * down,
        "fx": camera.fx * across,
        "fy": camera.fy * down,
        "cx": (camera.cx + 0.5) * across - 0.5,
        "cy": (camera.cy + 0.5) * down - 0.5,
        "baseline": source,
        "color": None,
    }
    # Not checked, because the projector may be to the left; not copied, because a copy keeps the rays it has made.
    return Camera.model_construct(**keys)
