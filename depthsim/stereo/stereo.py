"""From a pose to the depth that active stereo finds: images of the scene, matched as a camera matches them."""

import threading

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.draws import Seed
from depthsim.materials import Materials
from depthsim.raycast import Caster
from depthsim.stereo.matcher import Matcher, to_depth
from depthsim.stereo.render import Renderer
from depthsim.stereo.settings import ActiveStereo


class Stereo:
    """Two infrared imagers, a projector and a matcher in a scene; safe to be asked from many threads."""

    def __init__(self, caster: Caster, camera: Camera, settings: ActiveStereo, materials: Materials) -> None:
        self._settings, self._focal_baseline = settings, camera.focal_baseline
        pinhole = Camera.model_validate(camera.model_dump() | {"model": "pinhole", "distortion": (0.0,) * 5})
        self._renderer = Renderer(caster, pinhole, settings, materials)
        self._take = _undistorted_places(camera, pinhole) if any(camera.distortion) else None
        self._matchers = threading.local()

    def measure(
        self, pose: NDArray[np.float64], seed: int | Seed, index: int, threads: int, stamp: float = 0.0
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.uint8]]:
        """(height, width) each: depth [m], 0 for a hole, and the left and the right image it was matched from.

        pose: (4, 4) camera to world. index: the number of the frame in its run. stamp: when [s].
        """
        left, right = self._renderer.render(pose, seed, index, threads, stamp)
        depth = to_depth(self._matcher().match(left, right, threads), self._focal_baseline)
        if self._take is not None:
            depth = np.where(self._take >= 0, depth.reshape(-1)[self._take], np.float32(0))
        return depth, left, right

    def _matcher(self) -> Matcher:
        """This thread's own: a matcher keeps its volumes of costs."""
        if not hasattr(self._matchers, "matcher"):
            self._matchers.matcher = Matcher(self._settings.matcher)
        matcher: Matcher = self._matchers.matcher
        return matcher


def _undistorted_places(camera: Camera, pinhole: Camera) -> NDArray[np.int64]:
    """(height, width) the nearest pixel of the rectified image for each pixel, as an index; -1 outside it."""
    u = np.rint(camera.rays[0] * pinhole.fx + pinhole.cx).astype(np.int64)
    v = np.rint(camera.rays[1] * pinhole.fy + pinhole.cy).astype(np.int64)
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    return np.where(inside, v * camera.width + u, -1)
