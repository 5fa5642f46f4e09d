"""Which frames of a recording a diagnosis looks at, and what is known of them before any sensor has looked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.config import DepthData
from depthsim.raycast import Caster, Geometry


@dataclass
class CleanFrame:
    """One frame without a sensor.

    across: (pixels,) the clean depth beyond an edge [m], 0 where there is none. per_spread: (pixels,) 1 over the
    simulator's own spread of the depth [1/m]. places: (axes, pixels that are counted), see :func:`counting.places`.
    """

    index: int
    stamp: float
    pose: NDArray[np.float64]
    geometry: Geometry
    across: NDArray[np.float32]
    per_spread: NDArray[np.float32]
    places: NDArray[np.unsignedinteger]


def cast_clean(caster: Caster, camera: Camera, pose: NDArray[np.float64]) -> Geometry:
    """What a camera sees from a pose (4, 4), and whether the imagers beside it see that, too.

    Of an aligned camera those are both imagers, of others the right one.
    """
    if not camera.aligned:
        return caster.cast(camera, pose, right=True, threads=1)
    left = float(camera.left_pose[0, 3])
    met = caster.cast(_beside(camera, left + camera.baseline), pose, right=True, threads=1)
    if abs(left) > 1e-6:
        other = caster.cast(_beside(camera, left), pose, right=True, threads=1)
        assert met.right_sees is not None and other.right_sees is not None
        np.minimum(met.right_sees, other.right_sees, out=met.right_sees)
    return met


def _beside(camera: Camera, x: float) -> Camera:
    """The same view with its other imager at ``x`` [m]; not checked, because that may be to the left."""
    plain = {"baseline": x, "color": None, "aligned": False, "depth": None}
    return Camera.model_construct(**{**dict(camera), **plain})


def select_frames(count: int, pixels: int, limit: DepthData) -> list[NDArray[np.int64]]:
    """Blocks of frames in a row, spread over the run; a short run is taken whole.

    Neighbours in time are alike, and a block is never parted between fitting and validating.
    """
    wanted = int(np.clip(limit.pixels // max(pixels, 1), limit.least_frames, limit.most_frames))
    length = int(np.clip(min(count, wanted) // 10, 1 if count < 8 else 2, limit.block))
    number = max(min(count, wanted) // length, 1)
    if count <= wanted + length:
        return [block for block in np.array_split(np.arange(count), number) if len(block)]
    starts = np.linspace(0, count - length, number).round().astype(np.int64)
    return [np.arange(start, start + length) for start in np.unique(starts)]
