"""The 3D view worked out here, for browsers without a GPU: points and lines in a depth buffer, as WebGL has them."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from depthsim.kernels import kernel
from depthsim.parallel import core_count, split
from viewer.controls.fly import camera_pose

_f = np.float32
_NEAR = 0.05
"""[m] What is nearer to the eye is not drawn."""
_NOTHING = np.uint64(2**64 - 1)
_STEPS_PER_METRE = _f(2**16)
"""Of depth in the buffer, whose low 24 bits are the colour: the nearest of two is the lesser number."""


@dataclass(frozen=True, eq=False)
class View:
    """Where a browser looks from. pose: (4, 4) optical axes to world. width, height, focal: [px]."""

    pose: NDArray[np.float64]
    width: int
    height: int
    focal: float

    @classmethod
    def of(cls, camera: viser.CameraHandle) -> "View | None":
        """The view of a browser; None while its window has no room for one."""
        width, height = int(camera.image_width), int(camera.image_height)
        if min(width, height) < 1:
            return None
        return cls(camera_pose(camera), width, height, height / 2 / float(np.tan(camera.fov / 2)))


class Drawing:
    """A picture of a view in the making."""

    def __init__(self, view: View) -> None:
        self._view = view
        self._nearest = np.full((view.height, view.width), _NOTHING, np.uint64)

    def points(
        self, points: NDArray[np.float32], colours: NDArray[np.uint8], size: float, pose: NDArray[np.float64]
    ) -> None:
        """Squares of one size that face the view, and grow with nearness.

        points: (N, 3) [m]. colours: (N, 3) RGB. size: half a side [m], as viser has it. pose: (4, 4) points to world.
        """
        turn, move = self._seen_from(pose)
        side = _f(2 * size * self._view.focal)
        split(_squares, self._view.height, core_count(), points, colours, turn, move, self._lens, side, self._nearest)

    def lines(self, ends: NDArray[np.floating], colour: tuple[int, int, int], pose: NDArray[np.float64]) -> None:
        """Straight lines, 2 px wide. ends: (N, 2, 3) [m]. pose: (4, 4) lines to world."""
        turn, move = self._seen_from(pose)
        red, green, blue = colour
        rgb = np.uint64(red << 16 | green << 8 | blue)
        _strokes(np.asarray(ends, np.float32) @ turn.T + move, rgb, self._lens, self._nearest)

    def picture(self, background: tuple[int, int, int]) -> NDArray[np.uint8]:
        """(height, width, 3) RGB."""
        rgb = np.empty((*self._nearest.shape, 3), np.uint8)
        split(_colour, len(rgb), core_count(), self._nearest, np.array(background, np.uint8), rgb)
        return rgb

    @property
    def _lens(self) -> NDArray[np.float32]:
        return np.array([self._view.focal, self._view.width / 2, self._view.height / 2], np.float32)

    def _seen_from(self, pose: NDArray[np.float64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        seen = np.linalg.inv(self._view.pose) @ pose
        return np.ascontiguousarray(seen[:3, :3], np.float32), np.ascontiguousarray(seen[:3, 3], np.float32)


@kernel
def _squares(start, stop, points, colours, turn, move, lens, side, nearest):
    """The rows from ``start`` to ``stop``: every thread goes through all points, and keeps to rows of its own."""
    width, height = nearest.shape[1], nearest.shape[0]
    focal, middle_u, middle_v = lens
    for i in range(len(points)):
        x, y, z = points[i]
        depth = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + move[2]
        if depth < _f(_NEAR):
            continue
        per_metre = focal / depth
        half = max(side / depth, _f(1)) * _f(0.5)
        v = (turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + move[1]) * per_metre + middle_v
        if v < _f(0) or v >= _f(height) or v + half < _f(start) or v - half > _f(stop):
            continue  # as WebGL does, which leaves out what has its middle outside
        u = (turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + move[0]) * per_metre + middle_u
        if u < _f(0) or u >= _f(width):
            continue
        # From the first to before the last pixel whose middle is inside; unsigned, as those need no look for the sign.
        first, last = np.uint32(max(u - half, _f(0)) + _f(0.5)), np.uint32(min(u + half + _f(0.5), _f(width)))
        top, bottom = np.uint32(max(v - half, _f(start)) + _f(0.5)), np.uint32(min(v + half + _f(0.5), _f(stop)))
        rgb = np.uint64(colours[i, 0]) << 16 | np.uint64(colours[i, 1]) << 8 | np.uint64(colours[i, 2])
        value = np.uint64(depth * _STEPS_PER_METRE) << 24 | rgb
        for row in range(top, bottom):
            for column in range(first, last):
                nearest[row, column] = min(nearest[row, column], value)


@kernel
def _strokes(ends, rgb, lens, nearest):
    height, width = nearest.shape
    focal, middle_u, middle_v = lens
    for i in range(len(ends)):
        a, b = ends[i, 0], ends[i, 1]
        if a[2] > b[2]:
            a, b = b, a
        if b[2] <= _f(_NEAR):
            continue
        cut = max((_f(_NEAR) - a[2]) / max(b[2] - a[2], _f(1e-9)), _f(0))
        x, y, z = a[0] + cut * (b[0] - a[0]), a[1] + cut * (b[1] - a[1]), max(a[2], _f(_NEAR))
        u0, v0, u1, v1 = x / z * focal, y / z * focal, b[0] / b[2] * focal, b[1] / b[2] * focal
        steps = int(max(abs(u1 - u0), abs(v1 - v0))) + 1
        for step in range(steps + 1):
            t = _f(step) / _f(steps)
            column = int(np.floor(u0 + t * (u1 - u0) + middle_u))
            row = int(np.floor(v0 + t * (v1 - v0) + middle_v))
            if row < 1 or row >= height or column < 1 or column >= width:
                continue
            depth = _f(1) / ((_f(1) - t) / z + t / b[2])  # along a line on the screen, it is 1 / z that is even
            value = np.uint64(depth * _STEPS_PER_METRE) << 24 | rgb
            for v in range(row - 1, row + 1):
                for w in range(column - 1, column + 1):
                    nearest[v, w] = min(nearest[v, w], value)


@kernel
def _colour(start, stop, nearest, background, rgb):
    for v in range(start, stop):
        for u in range(nearest.shape[1]):
            value = nearest[v, u]
            if value == _NOTHING:
                rgb[v, u] = background
            else:
                rgb[v, u, 0], rgb[v, u, 1], rgb[v, u, 2] = value >> 16 & 255, value >> 8 & 255, value & 255
