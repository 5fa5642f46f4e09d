"""The driver's filling of holes."""

from typing import ClassVar

import numpy as np

from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_ZERO, _INF = np.float32(0), np.float32(np.inf)


@kernel
def _fill_from_left(reach, depth):
    for v in range(depth.shape[0]):
        away = 0
        for u in range(1, depth.shape[1]):
            away = away + 1 if depth[v, u] == _ZERO else 0
            if 0 < away <= reach:
                depth[v, u] = depth[v, u - 1]


@kernel
def _fill_from_around(nearest, reach, depth):
    """Row by row, from what is filled already; the picture's first and last row and first column stay."""
    # How many pixels on from one that was measured: of this row and of the one above, of which the one below has none.
    width = depth.shape[1]
    above, here = np.zeros(width, np.int32), np.zeros(width, np.int32)
    for v in range(1, depth.shape[0] - 1):
        here[:] = 0
        for u in range(1, width):
            if depth[v, u] != _ZERO:
                continue
            none = _INF if nearest else _ZERO
            best, on = depth[v - 1, u] if above[u] < reach else none, above[u]
            for y, x in ((v - 1, u - 1), (v, u - 1), (v + 1, u - 1), (v + 1, u)):
                from_here = above[x] if y < v else here[x] if y == v else 0
                other = depth[y, x] if from_here < reach else _ZERO
                if (other > best and not nearest) or (_ZERO < other < best and nearest):
                    best, on = other, from_here
            depth[v, u] = best if best < _INF else _ZERO
            here[u] = on + 1
        above, here = here, above


@kernel
def _fill_with_means(reach, depth):
    """Ring by ring, all pixels of a ring at once; (height, width)."""
    height, width = depth.shape
    v_of, u_of = np.nonzero(depth == _ZERO)
    mean, left = np.empty(v_of.size, np.float32), v_of.size
    for _ in range(reach):
        for i in range(left):
            total, count = _ZERO, 0
            for v in range(max(v_of[i] - 1, 0), min(v_of[i] + 2, height)):
                for u in range(max(u_of[i] - 1, 0), min(u_of[i] + 2, width)):
                    total += depth[v, u]
                    count += depth[v, u] != _ZERO
            mean[i] = total / np.float32(count) if count > 0 else _ZERO
        still = 0
        for i in range(left):
            depth[v_of[i], u_of[i]] = mean[i]
            if mean[i] == _ZERO:
                v_of[still], u_of[still] = v_of[i], u_of[i]
                still += 1
        if still in (0, left):
            break
        left = still


class HoleFilling(Effect):
    """Holes get the depth of a neighbour: left, above, the farthest or nearest of five, or the mean of eight.

    The five are above, upper left, left, lower left and below. Pixels are filled row by row, each from what is filled
    already, so that depths run on to the right and down, for ``reach`` pixels. From around, the picture's first and
    last rows and first column stay as they are, and a pixel below a hole that could not be filled gets no nearest one.
    Means are filled in from the borders of the holes, a ring of pixels at a time.
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
        high=4,
        unit="1",
        neutral=-1,
        about="-1: off, 0: from the left, 1: farthest from around, 2: nearest from around, 3: from above, 4: means",
        source="librealsense's default; 3 and 4: none, for other drivers",
        starts=(0, 1, 2, 3, 4),
    )
    reach: int = parameter(
        1000,
        low=1,
        high=1000,
        unit="px",
        about="how far a depth runs on; 1000: over any hole",
        source="librealsense, which has no limit; other drivers fill small holes only",
        starts=(1, 1000),
    )

    def apply(self, frame: Frame) -> None:
        """Fill the holes; one after another, so on one thread."""
        if self.mode == 0:
            _fill_from_left(self.reach, frame.depth)
        elif self.mode == 3:
            _fill_from_left(self.reach, frame.depth.T)
        elif self.mode == 4:
            _fill_with_means(self.reach, frame.depth)
        else:
            _fill_from_around(self.mode == 2, self.reach, frame.depth)
