"""What effects need of a scene, from a clean depth image alone: incidence, normals, what the right imager sees."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.kernels import inlined, kernel
from depthsim.parallel import split
from depthsim.raycast import Geometry
from depthsim.raycast.geometry import NO_FACE
from depthsim.scene import NO_TAG

_f = np.float32
_ZERO, _HALF, _ONE, _TWO = _f(0), _f(0.5), _f(1), _f(2)
_NONE = _f(np.nan)
_ROUNDING = _f(3e-7)
"""Of 1 / depth, relative."""
_TRIES = 6
"""How often a ray of another view is followed to the plane of the pixel where it comes out."""
_FINE = 4
"""Columns of the right image to a pixel."""
_TOLERANCE = _f(0.2)
"""[px] What is nearer by less of disparity hides nothing."""


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
def _find_planes(start, stop, width, ray_x, ray_y, w, planes, cosine):
    """Rows ``start`` to ``stop``. w: 1 / depth, 0 where there is none. planes: n of n·X = 1, 0 where there is none."""
    height = w.size // width
    for v in range(start, stop):
        for u in range(width):
            i = v * width + u
            cosine[i], planes[i, 0], planes[i, 1], planes[i, 2] = _ZERO, _ZERO, _ZERO, _ZERO
            if not w[i] > _ZERO:
                continue
            across = _slope(w, i, 1, u, width - 1 - u)
            down = _slope(w, i, width, v, height - 1 - v)
            # On the plane 1 / depth = n·(x, y, 1): from its slopes along u and v to those along x and y.
            side, line = 1 if u < width - 1 else -1, width if v < height - 1 else -width
            sign = 1 if line > 0 else -1
            xu, yu = (ray_x[i + side] - ray_x[i]) * side, (ray_y[i + side] - ray_y[i]) * side
            xv, yv = (ray_x[i + line] - ray_x[i]) * sign, (ray_y[i + line] - ray_y[i]) * sign
            area = xu * yv - yu * xv
            nx, ny = (across * yv - down * yu) / area, (down * xu - across * xv) / area
            nz = w[i] - nx * ray_x[i] - ny * ray_y[i]
            planes[i, 0], planes[i, 1], planes[i, 2] = nx, ny, nz
            ray = np.sqrt(ray_x[i] * ray_x[i] + ray_y[i] * ray_y[i] + _ONE)
            cosine[i] = min(w[i] / (np.sqrt(nx * nx + ny * ny + nz * nz) * ray), _ONE)


@kernel
def _meet(start, stop, width, intrinsics, k, turns, rays, planes, tags, depth, face, cosine, tag):
    """Rows ``start`` to ``stop`` of another view: the ray meets the plane of the pixel that it comes out at.

    intrinsics: fx, fy, cx, cy. k: distortion. turns: (1 or rows, 12) that view's rotation and origin as seen here.
    """
    height = planes.shape[0] // width
    fx, fy, cx, cy = intrinsics
    for v in range(start, stop):
        r = turns[v if turns.shape[0] > 1 else 0]
        for u in range(width):
            i, at, z = v * width + u, v * width + u, _ZERO
            x, y = rays[0, v, u], rays[1, v, u]
            dx, dy, dz = r[0] * x + r[1] * y + r[2], r[3] * x + r[4] * y + r[5], r[6] * x + r[7] * y + r[8]
            # At first as if the camera had only turned; then from where that comes out.
            px, py, pz = dx, dy, dz
            for _ in range(_TRIES):
                before, at = at, -1
                if not pz > _ZERO:
                    break
                a, b = px / pz, py / pz
                s = a * a + b * b
                radial = _ONE + s * (k[0] + s * (k[1] + s * k[4]))
                a, b = (
                    a * radial + _TWO * k[2] * a * b + k[3] * (s + _TWO * a * a),
                    b * radial + k[2] * (s + _TWO * b * b) + _TWO * k[3] * a * b,
                )
                column, row = np.int64(np.floor(fx * a + cx + _HALF)), np.int64(np.floor(fy * b + cy + _HALF))
                if not (0 <= column < width and 0 <= row < height):
                    break
                at = row * width + column
                n = planes[at]
                along = n[0] * dx + n[1] * dy + n[2] * dz
                z = (_ONE - (n[0] * r[9] + n[1] * r[10] + n[2] * r[11])) / along if along > _ZERO else _ZERO
                if at == before or not z > _ZERO:
                    break
                px, py, pz = r[9] + z * dx, r[10] + z * dy, r[11] + z * dz
            met = at >= 0 and z > _ZERO
            depth[i], face[i] = (z, at) if met else (_ZERO, -1)
            tag[i], cosine[i] = tags[at] if met else np.uint8(255), _ZERO
            if met:
                n = planes[at]
                size = np.sqrt((n[0] ** 2 + n[1] ** 2 + n[2] ** 2) * (dx * dx + dy * dy + dz * dz))
                cosine[i] = min((n[0] * dx + n[1] * dy + n[2] * dz) / size, _ONE)


@inlined
def _cover(nearest, low, high, d_low, d_high):
    """Put a stretch of a surface into a row of the right image. low, high: its ends there [px]; d: disparities."""
    first, last = np.int64(np.ceil(low * _FINE)), np.int64(np.floor(high * _FINE))
    per = (d_high - d_low) / (high - low) if high > low else _ZERO
    for k in range(max(first, 0), min(last + 1, nearest.size)):
        nearest[k] = max(nearest[k], d_low + per * (_f(k) / _FINE - low))


@kernel
def _look_from_the_right(start, stop, width, focal_baseline, depth, sees):
    """Rows ``start`` to ``stop``: warp each to the right image, and see which of its pixels are still the nearest."""
    nearest, d = np.empty(width * _FINE, np.float32), np.empty(width, np.float32)
    for v in range(start, stop):
        nearest[:] = _ZERO
        for u in range(width):
            z = depth[v * width + u]
            d[u] = focal_baseline / z if z > _ZERO else _ZERO
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


class Seen:
    """What a clean depth image shows of a scene, for effects in place of the scene.

    depth: (height, width) [m], 0 where there is nothing. tag: (height, width) index into ``tags``. pose: (4, 4) camera
    to world. Every pixel is taken for a piece of the plane through its neighbours on the same surface, so that normals
    are off on what is a pixel or two wide. The right imager's view is the left one's, warped row by row: what only the
    right one would see hides nothing, and steps of less than a pixel of disparity are slopes.
    """

    def __init__(
        self,
        depth: NDArray[np.float32],
        camera: Camera,
        tag: NDArray[np.uint8],
        tags: tuple[str, ...],
        pose: NDArray[np.float64],
        threads: int = 1,
    ) -> None:
        self.tags, self._camera, self._pose = tags, camera, pose
        met, size = depth > 0, depth.size
        w = np.divide(_ONE, depth, out=np.zeros(depth.shape, np.float32), where=met).reshape(-1)
        self._planes, cosine = np.empty((size, 3), np.float32), np.empty(size, np.float32)
        ray_x, ray_y = camera.rays.reshape(2, -1)
        split(_find_planes, camera.height, threads, camera.width, ray_x, ray_y, w, self._planes, cosine)
        face = np.where(met, np.arange(size, dtype=np.int32).reshape(depth.shape), np.int32(NO_FACE))
        self._straight = Geometry(depth, face, cosine.reshape(depth.shape), np.where(met, tag, np.uint8(NO_TAG)))

    @cached_property
    def normals(self) -> NDArray[np.float32]:
        """(pixels, 3) unit normals in the world, 0 where there is nothing."""
        length = np.linalg.norm(self._planes, axis=1, keepdims=True)
        unit = np.divide(self._planes, length, out=np.zeros_like(self._planes), where=length > 0)
        return np.asarray(unit @ self._pose[:3, :3].T.astype(np.float32))

    def cast(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        *,
        right: bool = False,
        rays: NDArray[np.float32] | None = None,
        threads: int | None = None,
        out: Geometry | None = None,
    ) -> Geometry:
        """What rays meet, as of :meth:`~depthsim.raycast.Caster.cast`; (4, 4) without ``rays`` is the image itself.

        A ray that comes out beyond the image, or where it shows nothing, meets nothing.
        """
        found, threads = self._straight, threads or 1
        if rays is not None:
            found = self._bent(np.asarray(poses, np.float64), rays, threads)
        if right:
            found.right_sees = np.empty(camera.shape, np.uint8)
            arrays = found.depth.reshape(-1), found.right_sees.reshape(-1)
            split(_look_from_the_right, camera.height, threads, camera.width, _f(camera.focal_baseline), *arrays)
        return found if rays is None else found.reshaped((1, *camera.shape))

    def _bent(self, poses: NDArray[np.float64], rays: NDArray[np.float32], threads: int) -> Geometry:
        eye, found = self._camera, Geometry.empty(self._camera.shape, right=False)
        turns = np.linalg.inv(self._pose) @ poses.reshape(-1, 4, 4)
        flat = np.concatenate([turns[:, :3, :3].reshape(-1, 9), turns[:, :3, 3]], axis=1).astype(np.float32)
        intrinsics = tuple(_f(value) for value in (eye.fx, eye.fy, eye.cx, eye.cy))
        k, tags = np.array(eye.distortion, np.float32), self._straight.tag.reshape(-1)
        pictures = (found.depth, found.face, found.cosine, found.tag)
        split(
            _meet, eye.height, threads, eye.width, intrinsics, k, flat, rays, self._planes, tags,
            *(picture.reshape(-1) for picture in pictures),
        )  # fmt: skip
        return found
