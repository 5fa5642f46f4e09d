"""A run's frames as Open3D takes them: it has no distortion, so frames that have one are made straight first.

Each pixel of the pinhole image with the same matrix takes the nearest pixel of the recorded one. Depth between pixels
is not interpolated, as it would stretch surfaces over edges; the ray is off by half a pixel at most.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera, distort
from depthsim.exporting.tables import colour
from depthsim.open3d_loader import load_open3d
from depthsim.runs import Run


def quiet_open3d() -> Any:
    """Open3D without its warnings, one for every buffer that grows."""
    o3d = load_open3d()
    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    return o3d


FUSING = 0.5
"""[px] What the principal point is moved by for fusion: there Open3D 0.20 cuts a pixel's coordinates off in place of
rounding them, as if whole numbers were the corners of pixels; everywhere else they are the centres, as they are here.
Without this, a floor seen at 60 degrees at 160x120 lies 16 mm too deep in the mesh."""


def intrinsic_matrix(o3d: Any, camera: Camera, shift: float = 0.0) -> Any:
    """The (3, 3) matrix, the principal point moved by ``shift`` [px]."""
    matrix = [[camera.fx, 0, camera.cx + shift], [0, camera.fy, camera.cy + shift], [0, 0, 1]]
    return o3d.core.Tensor(np.array(matrix, np.float64))


def depth_image(o3d: Any, run: Run, index: int) -> Any:
    """Depth in the camera's units; what is saturated has none."""
    raw = run.depth_raw(index).copy()
    raw[run.saturated(index)] = 0
    return o3d.t.geometry.Image(o3d.core.Tensor(_straight(raw, run.camera)))


def colour_image(o3d: Any, run: Run, index: int) -> Any:
    """Three channels: the intensity image, or mid-grey where the run has none."""
    image = run.rgb(index)
    if image is None:
        image = np.full(run.camera.shape, 128, np.uint8)
    return o3d.t.geometry.Image(o3d.core.Tensor(np.ascontiguousarray(_straight(colour(image), run.camera))))


def _straight(image: NDArray[Any], camera: Camera) -> NDArray[Any]:
    """An image (height, width, ...) without distortion; 0 where the recorded one does not reach."""
    if not any(camera.distortion):
        return image
    places = _recorded_places(camera)
    straight = image.reshape(-1, *image.shape[2:])[places]
    straight[places < 0] = 0
    return straight


@lru_cache(maxsize=2)
def _recorded_places(camera: Camera) -> NDArray[np.intp]:
    """(height, width) the nearest recorded pixel of each pixel of the pinhole image, as an index; -1 outside."""
    v, u = np.mgrid[: camera.height, : camera.width]
    x, y = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
    bent_x, bent_y = distort(x, y, camera.distortion)
    u, v = np.rint(camera.fx * bent_x + camera.cx), np.rint(camera.fy * bent_y + camera.cy)
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    places = np.where(inside, v * camera.width + u, 0).astype(np.intp)
    # Beyond the image's own rays a distortion may fold over, back into the image: that pixel has another ray.
    ray_x, ray_y = camera.rays.reshape(2, -1)[:, places]
    inside &= np.hypot((ray_x - x) * camera.fx, (ray_y - y) * camera.fy) < 2
    return np.where(inside, places, -1)


def matrix_of(tensor: Any) -> NDArray[np.float64]:
    """A copy of a 4x4 tensor."""
    return np.array(tensor.cpu().numpy(), np.float64)
