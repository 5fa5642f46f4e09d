"""Where a fused mesh may be trusted."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from depthsim.camera import Camera
from depthsim.raycast.geometry import Geometry

LEAST_COSINE = 0.5
"""Of the incidence: past 60 degrees half a pixel is a large step in depth."""
LEAST_MARGIN = 3
"""[px] From an edge, at any range."""


def trusted(seen: Geometry, camera: Camera, truncation: float, depth_max: float) -> NDArray[np.bool_]:
    """(height, width): where the mesh is hit, not at a grazing angle, and farther than the truncation from any edge.

    At an edge, or at the border of what was fused, the two sides of the truncated distance mix. The margin is the
    truncation distance [m] at the nearest depth around it, in pixels.
    """
    depth = seen.depth
    good = seen.hit & (seen.cosine > LEAST_COSINE) & (depth < depth_max)
    if not good.any():
        return good
    near = np.where(seen.hit, depth, np.inf).astype(np.float32)
    low, high = minimum_filter(near, 3), maximum_filter(near, 3)
    # A plane seen at LEAST_COSINE steps by less than this from one pixel to the next but one.
    step = 2 * depth / camera.fx * np.sqrt(1 / LEAST_COSINE**2 - 1) + truncation / 4
    with np.errstate(invalid="ignore"):
        edge = ~seen.hit | (high - low > step)
    margin = max(LEAST_MARGIN, round(truncation * camera.fx / float(np.median(depth[good]))))
    return np.asarray(good & ~maximum_filter(edge, 2 * margin + 1))
