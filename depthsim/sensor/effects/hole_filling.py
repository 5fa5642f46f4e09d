"""The driver's filling of holes."""

from typing import ClassVar

import numpy as np

from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_ZERO = np.float32(0)


@kernel
def _fill_from_left(depth):
    for v in range(depth.shape[0]):
        for u in range(1, depth.shape[1]):
            if depth[v, u] == _ZERO:
                depth[v, u] = depth[v, u - 1]


@kernel
def _fill_from_around(nearest, depth):
    """Row by row, from what is filled already; the picture's first and last row and first column stay."""
    for v in range(1, depth.shape[0] - 1):
        for u in range(1, depth.shape[1]):
            if depth[v, u] != _ZERO:
                continue
            best = depth[v - 1, u]
            for y, x in ((v - 1, u - 1), (v, u - 1), (v + 1, u - 1), (v + 1, u)):
                other = depth[y, x]
                best = other if (other > best and not nearest) or (_ZERO < other < best and nearest) else best
            depth[v, u] = best


class HoleFilling(Effect):
    """Holes get the depth of a neighbour: the left one, or the farthest or nearest of five.

    The five are above, upper left, left, lower left and below. Pixels are filled row by row, each from what is filled
    already, so that depths run on to the right and down. From around, the picture's first and last rows and first
    column stay as they are, and a pixel below a hole that could not be filled gets no nearest one.
    """

    id: ClassVar[str] = "hole_filling"
    stage: ClassVar[Stage] = Stage.PROCESSING
    rank: ClassVar[int] = 2
    source: ClassVar[str] = "librealsense, src/proc/hole-filling-filter.h and doc/post-processing-filters.md"
    axes = ("pixel_neighbours", "edge_distance", "image_column", "image_position")
    kinds = ("missing", "tail")
    recording = "a near object before a far background, with the camera's filters off and on"
    seen_on = ("stereo_shadow", "fill_rate")

    mode: int = parameter(
        1,
        low=-1,
        high=2,
        unit="1",
        neutral=-1,
        about="-1: off, 0: from the left, 1: farthest from around, 2: nearest from around",
        source="librealsense's default",
        starts=(0, 1, 2),
    )

    def apply(self, frame: Frame) -> None:
        """Fill the holes; one after another, so on one thread."""
        if self.mode == 0:
            _fill_from_left(frame.depth)
        else:
            _fill_from_around(self.mode == 2, frame.depth)
