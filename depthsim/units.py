"""Depth in metres, and in the whole units that a camera stores."""

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.kernels import kernel
from depthsim.parallel import split

SATURATED = 65535
"""The 16-bit value of a depth that is too far for the unit."""


@kernel
def _round_to_units(start, stop, units_per_metre, depth, units):
    """Depth [m] as the camera stores it: whole units, 0 for a hole, 65535 where it would not fit."""
    z, out = depth[start:stop], units[start:stop]
    for i in range(z.size):
        value = z[i] * units_per_metre + np.float32(0.5)
        # Written so that what is not a number becomes a hole.
        value = value if value > np.float32(0) else np.float32(0)
        value = value if value < np.float32(SATURATED) else np.float32(SATURATED)
        out[i] = np.uint16(np.int32(value))


def to_depth_raw(
    depth: NDArray[np.float32], camera: Camera, threads: int = 1, out: NDArray[np.uint16] | None = None
) -> NDArray[np.uint16]:
    """Depth [m] as the camera's 16-bit picture, halves rounded up; 0 is a hole, 65535 too far for the unit."""
    out = np.empty(depth.shape, np.uint16) if out is None else out
    per_metre = np.float32(1 / camera.depth_scale)
    split(_round_to_units, depth.size, threads, per_metre, depth.reshape(-1), out.reshape(-1))
    return out


def to_metres(raw: NDArray[np.uint16], camera: Camera, depth: NDArray[np.float32]) -> None:
    """Write the depth [m] that a camera's picture stands for into ``depth``."""
    np.multiply(raw, np.float32(camera.depth_scale), out=depth, casting="unsafe")
