"""Active stereo as a sensor: images of the scene, matched as a camera matches them."""

import threading
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.materials import Materials
from depthsim.parallel import core_count
from depthsim.raycast import Caster
from depthsim.sensor.effect import Effect, Stage
from depthsim.sensor.frame import Frame
from depthsim.sensor.motion import Motion
from depthsim.sensor.sensor import Measurement, Sensor, to_units
from depthsim.stereo.matcher import Matcher, to_depth
from depthsim.stereo.render import Renderer
from depthsim.stereo.settings import ActiveStereo


@dataclass(frozen=True)
class StereoMeasurement(Measurement):
    """A measurement with the (height, width) uint8 images it was made from."""

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]


class StereoSensor:
    """Measures depth in a scene as :class:`~depthsim.sensor.Sensor` does, but by physics in place of effects.

    Effects may follow the matcher; those that bend rays or move the camera cannot, and are an InputError.
    """

    def __init__(
        self,
        caster: Caster,
        camera: Camera,
        settings: ActiveStereo | None = None,
        effects: Sequence[Effect] = (),
        materials: Materials | None = None,
    ) -> None:
        self._after = Sensor(caster, camera, effects, materials)
        for effect in self._after.effects:
            if effect.stage <= Stage.OPTICS:
                raise InputError("sensor profile", effect.id, "cannot follow active_stereo", "leave that effect out")
        self.caster, self.camera, self.materials = caster, camera, self._after.materials
        self.effects, self.settings = self._after.effects, settings or ActiveStereo()
        pinhole = Camera.model_validate(camera.model_dump() | {"model": "pinhole", "distortion": (0.0,) * 5})
        self._renderer = Renderer(caster, pinhole, self.settings, self.materials)
        self._take = _undistorted_places(camera, pinhole) if any(camera.distortion) else None
        self._matchers = threading.local()

    def measure(
        self,
        pose: NDArray[np.float64],
        *,
        index: int = 0,
        stamp: float = 0.0,
        seed: int = 0,
        motion: Motion | None = None,
        threads: int | None = None,
        out: Measurement | None = None,
    ) -> StereoMeasurement:
        """One frame; the arguments are those of :meth:`depthsim.sensor.Sensor.measure`."""
        threads, pose = threads or core_count(), np.asarray(pose, np.float64)
        asked, before = any(effect.needs_right for effect in self.effects), out.cast_already if out else None
        clean = self.caster.cast(self.camera, pose, right=asked, threads=threads, out=before)
        left, right = self._renderer.render(pose, seed, index, threads)
        depth = to_depth(self._matcher().match(left, right, threads), self.camera.focal_baseline)
        if self._take is not None:
            depth = np.where(self._take >= 0, depth.reshape(-1)[self._take], np.float32(0))
        motion = motion or Motion.still(pose)
        frame = Frame(depth, clean, self.camera, self.caster.scene, self.materials, motion, seed, index, stamp, threads)
        for effect in self.effects:
            effect.apply(frame)
        units = to_units(frame.depth, self.camera, threads, out.units if out else None)
        return StereoMeasurement(units, frame.depth, clean, left, right)

    def _matcher(self) -> Matcher:
        """This thread's own: a matcher keeps its volumes of costs."""
        if not hasattr(self._matchers, "matcher"):
            self._matchers.matcher = Matcher(self.settings.matcher)
        matcher: Matcher = self._matchers.matcher
        return matcher


def _undistorted_places(camera: Camera, pinhole: Camera) -> NDArray[np.int64]:
    """(height, width) the nearest pixel of the rectified image for each pixel, as an index; -1 outside it."""
    u = np.rint(camera.rays[0] * pinhole.fx + pinhole.cx).astype(np.int64)
    v = np.rint(camera.rays[1] * pinhole.fy + pinhole.cy).astype(np.int64)
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    return np.where(inside, v * camera.width + u, -1)
