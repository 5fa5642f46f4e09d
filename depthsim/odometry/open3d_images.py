"""A run's frames as Open3D takes them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.exporting.tables import colour
from depthsim.open3d_loader import load_open3d
from depthsim.runs import Run


def quiet_open3d() -> Any:
    """Open3D without its warnings, which tell of every buffer that grows."""
    o3d = load_open3d()
    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    return o3d


FUSING = 0.5
"""[px] What the principal point is moved by for fusion: there Open3D 0.20 cuts a pixel's coordinates off in place of
rounding them, as if whole numbers were the corners of pixels; everywhere else they are the centres, as they are here.
Without this, a floor seen at 60 degrees at 160x120 lies 16 mm too deep in the mesh."""


def intrinsic_matrix(o3d: Any, camera: Camera, shift: float = 0.0) -> Any:
    """The (3, 3) matrix, the principal point moved by ``shift`` [px]; Open3D has no distortion."""
    if any(camera.distortion):
        raise InputError("camera.yaml", "distortion", "is not zero, and Open3D has none", "rectify the run")
    matrix = [[camera.fx, 0, camera.cx + shift], [0, camera.fy, camera.cy + shift], [0, 0, 1]]
    return o3d.core.Tensor(np.array(matrix, np.float64))


def depth_image(o3d: Any, run: Run, index: int) -> Any:
    """Depth in the camera's units; what is saturated has none."""
    raw = run.depth_raw(index).copy()
    raw[run.saturated(index)] = 0
    return o3d.t.geometry.Image(o3d.core.Tensor(raw))


def colour_image(o3d: Any, run: Run, index: int) -> Any:
    """Three channels: the intensity image, or mid-grey where the run has none."""
    image = run.rgb(index)
    if image is None:
        image = np.full(run.camera.shape, 128, np.uint8)
    return o3d.t.geometry.Image(o3d.core.Tensor(np.ascontiguousarray(colour(image))))


def matrix_of(tensor: Any) -> NDArray[np.float64]:
    """A copy of a 4x4 tensor."""
    return np.array(tensor.cpu().numpy(), np.float64)
