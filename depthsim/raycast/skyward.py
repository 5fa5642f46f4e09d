"""Which of the points that a camera sees a light from far away reaches: one ray each, towards the light."""

from functools import cache
from typing import Any

import numpy as np

from depthsim.kernels import kernel
from depthsim.llvm import bits_float, call_embree
from depthsim.raycast.kernel import SKIN
from depthsim.raycast.packet import (
    DIRECTION_X,
    DIRECTION_Y,
    DIRECTION_Z,
    FAR,
    MASK,
    NEAR,
    ORIGIN_X,
    ORIGIN_Y,
    ORIGIN_Z,
)


@cache
def reach_kernel(lanes: int) -> Any:
    """The kernel for packets of ``lanes`` rays: 16, 8 or 4."""

    @kernel
    def reach_rows(
        start, stop, occluded, scene, arguments, valid, packet, poses, directions, ray_x, ray_y, depth, out
    ):  # fmt: skip
        """Rows ``start`` to ``stop`` of ``out``, (H, W) uint8: 1 where nothing lies on the way; 0 where nothing is hit.

        poses: (1 or H, 12) rotation row by row, then translation. directions: (1 or H, 3) to the light.
        ray_x, ray_y: (H, W) at z = 1. depth: (H, W) z-depth of the points.
        """
        width = depth.shape[1]
        for lane in range(lanes):
            packet[MASK * lanes + lane] = bits_float(np.int32(-1))
            packet[NEAR * lanes + lane] = np.float32(0)
        for v in range(start, stop):
            pose, direction = poses[v if len(poses) > 1 else 0], directions[v if len(directions) > 1 else 0]
            for lane in range(lanes):
                packet[DIRECTION_X * lanes + lane], packet[DIRECTION_Y * lanes + lane] = direction[0], direction[1]
                packet[DIRECTION_Z * lanes + lane] = direction[2]
            for u0 in range(0, width, lanes):
                for lane in range(lanes):
                    u = min(u0 + lane, width - 1)
                    # A little before the surface, so that it does not hide itself.
                    x, y, z = ray_x[v, u], ray_y[v, u], depth[v, u] * SKIN
                    packet[ORIGIN_X * lanes + lane] = (pose[0] * x + pose[1] * y + pose[2]) * z + pose[9]
                    packet[ORIGIN_Y * lanes + lane] = (pose[3] * x + pose[4] * y + pose[5]) * z + pose[10]
                    packet[ORIGIN_Z * lanes + lane] = (pose[6] * x + pose[7] * y + pose[8]) * z + pose[11]
                    packet[FAR * lanes + lane] = np.float32(np.inf) if z > np.float32(0) else np.float32(0)
                call_embree(occluded, valid.ctypes.data, scene, packet.ctypes.data, arguments.ctypes.data)
                for lane in range(min(lanes, width - u0)):
                    hit = depth[v, u0 + lane] > np.float32(0)
                    # Embree marks a ray that meets something by a far end of minus infinity.
                    free = packet[FAR * lanes + lane] > np.float32(0)
                    out[v, u0 + lane] = np.uint8(1) if hit and free else np.uint8(0)

    return reach_rows
