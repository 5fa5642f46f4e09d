"""The occupancy test: which voxels in front of the camera a depth picture has wrongly free, or wrongly occupied.

As OctoMap takes a scan: a voxel with a point in it is occupied, one that a ray passes on its way is free, all else is
unknown (Hornung et al., "OctoMap: an efficient probabilistic 3D mapping framework", 2013). The clean depth of the same
pixels is the truth. The grid lies along the camera's axes and begins elsewhere in each frame, so that a wall on a
border of voxels is no accident of a whole recording.
"""

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.tasks.view import Floats, Shares, View
from depthsim.kernels import kernel

VOXEL, REACH = 0.1, 5.0
"""[m] The side of a voxel, and how far the map goes: ahead along the optical axis, and to all sides."""
_SIDE, _DEEP = 2 * round(REACH / VOXEL) + 2, round(REACH / VOXEL) + 2
_FREE, _OCCUPIED = 1, 2
_STRIDES = np.array([0.7548776662466927, 0.5698402909980532])
"""Of a sequence that fills the square evenly, the plastic number's (Roberts, 2018), for where the grid begins."""


def occupancy(view: View, depth: Floats) -> NDArray[np.uint8]:
    """The grid that a picture (rows, width) [m] makes: 0 unknown, 1 free, 2 occupied."""
    grid = np.zeros((_DEEP, _SIDE, _SIDE), np.uint8)
    across, ahead = (view.index * _STRIDES) % 1
    # Rays are no more than half a voxel apart at the end of the map.
    apart = max(1, int(view.camera.fx * VOXEL / 2 / REACH))
    x, y = view.camera.rays
    _carve(depth, x, y, apart, across, ahead, grid)
    return grid


def obstacle_figures(truth: NDArray[np.uint8], seen: NDArray[np.uint8]) -> Shares:
    """voxels_wrongly_free, of those that are occupied, and voxels_wrongly_occupied, of those that are free."""
    occupied, free = truth == _OCCUPIED, truth == _FREE
    return {
        "voxels_wrongly_free": (100.0 * int((occupied & (seen == _FREE)).sum()), int(occupied.sum())),
        "voxels_wrongly_occupied": (100.0 * int((free & (seen == _OCCUPIED)).sum()), int(free.sum())),
    }


@kernel
def _carve(depth, x, y, apart, across, ahead, grid):
    height, width = depth.shape
    for v in range(0, height, apart):
        for u in range(0, width, apart):
            z, end = VOXEL / 4, min(np.float64(depth[v, u]), REACH)
            while z < end:
                _mark(z, x[v, u], y[v, u], across, ahead, _FREE, grid)
                z += VOXEL / 2
    for v in range(height):
        for u in range(width):
            z = np.float64(depth[v, u])
            if 0 < z < REACH:
                _mark(z, x[v, u], y[v, u], across, ahead, _OCCUPIED, grid)


@kernel
def _mark(z, x, y, across, ahead, what, grid):
    """Mark the voxel of a point, where it is on the map."""
    if abs(x * z) < REACH and abs(y * z) < REACH:
        i = int(np.floor(x * z / VOXEL + across)) + _SIDE // 2
        j = int(np.floor(y * z / VOXEL + across)) + _SIDE // 2
        grid[int(z / VOXEL + ahead), j, i] = what
