"""From a frame to a coloured point cloud in the camera's frame, thinned evenly where it must be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import kernel
from depthsim.parallel import core_count, split
from depthsim.units import SATURATED
from viewer.paint import Painted
from viewer.shot import Shot

_f = np.float32
_GOLDEN = 0.618
"""From row to row the kept pixels shift by this share of their spacing, so that no lines appear."""


@dataclass(frozen=True)
class Cloud:
    """points: (N, 3) float32 [m], x right, y down, z forward. colours: (N, 3) uint8. size: of a point [m]."""

    points: NDArray[np.float32]
    colours: NDArray[np.uint8]
    size: float


def make_cloud(shot: Shot, painted: Painted, one_in: int = 1, *, with_holes: bool = False) -> Cloud:
    """The cloud of a frame: every ``one_in``-th pixel that has a return.

    with_holes: pixels without a return are shown too, where their surface is.
    """
    height, width = shot.depth_raw.shape
    shift = max(1, round(_GOLDEN * one_in)) if one_in > 1 else 0
    clean = shot.clean if shot.clean is not None else np.zeros((height, width), np.float32)
    depth = np.empty((height, width), np.float32)
    counts = np.zeros(height, np.int64)
    scale, threads = _f(shot.camera.depth_scale), core_count()
    split(_depths, height, threads, shot.depth_raw, scale, clean, with_holes, one_in, shift, depth, counts)
    begins = np.concatenate([[0], np.cumsum(counts)])
    points = np.empty((begins[-1], 3), np.float32)
    rgb = np.empty((begins[-1], 3), np.uint8)
    rays = shot.camera.rays
    split(_fill, height, threads, rays, depth, painted.index, painted.palette, one_in, shift, begins, points, rgb)
    typical = float(np.median(points[::97, 2])) if len(points) else 1.0
    return Cloud(points, rgb, 1.15 * typical / shot.camera.fx * float(np.sqrt(one_in)))


@kernel
def _depths(start, stop, units, scale, clean, with_holes, one_in, shift, depth, counts):
    for v in range(start, stop):
        count = 0
        for u in range(-(shift * v) % one_in, units.shape[1], one_in):
            value = units[v, u]
            z = _f(value) * scale if 0 < value < SATURATED else _f(0)
            if with_holes and z == _f(0):
                z = clean[v, u]
            depth[v, u] = z
            count += z > _f(0)
        counts[v] = count


@kernel
def _fill(start, stop, rays, depth, index, palette, one_in, shift, begins, points, rgb):
    for v in range(start, stop):
        at = begins[v]
        for u in range(-(shift * v) % one_in, depth.shape[1], one_in):
            z = depth[v, u]
            if z > _f(0):
                points[at, 0], points[at, 1], points[at, 2] = rays[0, v, u] * z, rays[1, v, u] * z, z
                colour = index[v, u]
                rgb[at, 0], rgb[at, 1], rgb[at, 2] = palette[colour, 0], palette[colour, 1], palette[colour, 2]
                at += 1
