"""What effects need of a scene, from a clean depth image alone: incidence, normals, what the right imager sees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.kernels import inlined, kernel
from depthsim.parallel import split
from depthsim.raycast import Geometry
from depthsim.raycast.geometry import NO_FACE
from depthsim.scene import NO_TAG

_f = np.float32
_ZERO, _HALF, _ONE = _f(0), _f(0.5), _f(1)
_NONE = _f(np.nan)
_ROUNDING = _f(3e-7)
"""Of 1 / depth, relative."""
_FINE = 4
"""Columns of the right image to a pixel."""
_TOLERANCE = _f(0.2)
"""[px] What is nearer by less of disparity hides nothing."""


@dataclass(frozen=True)
class Seen:
    """The surfaces of one depth image, one a pixel. tags: of the materials. normals: (pixels, 3) in the world."""

    tags: tuple[str, ...]
    normals: NDArray[np.float32]


@inlined
def _one_side(w, here, next_, further, other):
    """The step of 1 / depth from a pixel to its neighbour, and how far it is from that of a plane on this side.

    Not a number without a neighbour. other: on the other side of the pixel, where there is no ``further`` one.
    """
    step = w[next_] - w[here] if next_ != here and w[next_] > _ZERO else _NONE
    beyond = w[further] - w[next_] if further != next_ and w[further] > _ZERO else _NONE
    if np.isnan(beyond) and other != here and w[other] > _ZERO:
        beyond = w[here] - w[other]
    return step, abs(beyond - step) if not np.isnan(beyond) else _ZERO


@inlined
def _slope(w, here, stride, before, after):
    """The step of 1 / depth from pixel to pixel along a line, 0 for a pixel alone.

    1 / depth is linear in the picture on a plane. Of the two sides that counts more on which it is more so: it is the
    surface that the pixel is on, where the other one crosses an edge. before, after: how many pixels there are.
    """
    left, right = here - stride * min(before, 1), here + stride * min(after, 1)
    back, bend_back = _one_side(w, here, left, here - stride * min(before, 2), right)
    ahead, bend_ahead = _one_side(w, here, right, here + stride * min(after, 2), left)
    if np.isnan(back):
        return ahead if not np.isnan(ahead) else _ZERO
    if np.isnan(ahead):
        return -back
    least = _ROUNDING * w[here]
    a, b = (bend_ahead + least) ** 2, (bend_back + least) ** 2
    return (ahead * b - back * a) / (a + b)


@kernel
def _turn(start, stop, width, rotation, ray_x, ray_y, w, cosine, normals):
    """Rows ``start`` to ``stop``. w: 1 / depth, 0 where there is none. rotation: (9,) camera to world."""
    height = w.size // width
    for v in range(start, stop):
        for u in range(width):
            i = v * width + u
            cosine[i] = _ZERO
            for k in range(3):
                normals[i, k] = _ZERO
            if not w[i] > _ZERO:
                continue
            across = _slope(w, i, 1, u, width - 1 - u)
            down = _slope(w, i, width, v, height - 1 - v)
            # The plane n·X = 1 has 1 / depth = n·(x, y, 1): solve for its slopes along x and y.
            side, line = 1 if u < width - 1 else -1, width if v < height - 1 else -width
            xu, yu = (ray_x[i + side] - ray_x[i]) * side, (ray_y[i + side] - ray_y[i]) * side
            sign = 1 if line > 0 else -1
            xv, yv = (ray_x[i + line] - ray_x[i]) * sign, (ray_y[i + line] - ray_y[i]) * sign
            area = xu * yv - yu * xv
            nx = (across * yv - down * yu) / area if area != _ZERO else _ZERO
            ny = (down * xu - across * xv) / area if area != _ZERO else _ZERO
            nz = w[i] - nx * ray_x[i] - ny * ray_y[i]
            length = np.sqrt(nx * nx + ny * ny + nz * nz)
            ray = np.sqrt(ray_x[i] * ray_x[i] + ray_y[i] * ray_y[i] + _ONE)
            cosine[i] = min(w[i] / (length * ray), _ONE)
            # Towards the camera.
            for k in range(3):
                turned = rotation[3 * k] * nx + rotation[3 * k + 1] * ny + rotation[3 * k + 2] * nz
                normals[i, k] = -turned / length


@inlined
def _cover(nearest, low, high, d_low, d_high):
    """Put a stretch of a surface into a row of the right image. low, high: its ends there [px]; d: disparities."""
    first, last = np.int64(np.ceil(low * _FINE)), np.int64(np.floor(high * _FINE))
    per = (d_high - d_low) / (high - low) if high > low else _ZERO
    for k in range(max(first, 0), min(last + 1, nearest.size)):
        nearest[k] = max(nearest[k], d_low + per * (_f(k) / _FINE - low))


@kernel
def _look_from_the_right(start, stop, width, focal_baseline, w, sees):
    """Rows ``start`` to ``stop``: warp each to the right image, and see which of its pixels are still the nearest."""
    nearest, d = np.empty(width * _FINE, np.float32), np.empty(width, np.float32)
    for v in range(start, stop):
        nearest[:] = _ZERO
        for u in range(width):
            d[u] = focal_baseline * w[v * width + u]
        for u in range(width):
            if not d[u] > _ZERO:
                continue
            at, joined = _f(u) - d[u], u + 1 < width and d[u + 1] > _ZERO and abs(d[u + 1] - d[u]) < _ONE
            if joined:
                _cover(nearest, at, at + _ONE + d[u] - d[u + 1], d[u], d[u + 1])
            else:
                _cover(nearest, at, at + _HALF, d[u], d[u])
            if u == 0 or not (d[u - 1] > _ZERO and abs(d[u] - d[u - 1]) < _ONE):
                _cover(nearest, at - _HALF, at, d[u], d[u])
        for u in range(width):
            k = np.int64(np.rint((_f(u) - d[u]) * _FINE))
            hidden = 0 <= k < nearest.size and nearest[k] > d[u] + _TOLERANCE
            sees[v * width + u] = np.uint8(1) if d[u] > _ZERO and not hidden else np.uint8(0)


def see(
    depth: NDArray[np.float32],
    camera: Camera,
    tag: NDArray[np.uint8],
    tags: tuple[str, ...],
    pose: NDArray[np.float64],
    threads: int = 1,
) -> tuple[Geometry, Seen]:
    """What a cast would have found of one frame, as far as its depth shows it.

    depth: (height, width) [m], 0 where there is nothing. tag: (height, width) index into ``tags``. pose: (4, 4) camera
    to world. Normals are those of the plane through a pixel and its neighbours on the same surface, so that they are
    off on what is a pixel or two wide. The right imager's view is the left one's, warped row by row: what only the
    right one would see hides nothing, and steps of less than a pixel of disparity are slopes.
    """
    shape, width = depth.shape, depth.shape[1]
    w = np.divide(_ONE, depth, out=np.zeros(shape, np.float32), where=depth > 0).reshape(-1)
    cosine, normals, sees = np.empty(w.size, _f), np.empty((w.size, 3), _f), np.empty(w.size, np.uint8)
    ray_x, ray_y = camera.rays.reshape(2, -1)
    rotation = pose[:3, :3].astype(np.float32).reshape(-1)
    split(_turn, shape[0], threads, width, rotation, ray_x, ray_y, w, cosine, normals)
    split(_look_from_the_right, shape[0], threads, width, _f(camera.focal_baseline), w, sees)
    met = depth > 0
    face = np.where(met, np.arange(w.size, dtype=np.int32).reshape(shape), np.int32(NO_FACE))
    own = np.where(met, tag, np.uint8(NO_TAG))
    return Geometry(depth, face, cosine.reshape(shape), own, sees.reshape(shape)), Seen(tags, normals)
