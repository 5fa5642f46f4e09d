"""What effects need of a scene, from a clean depth image alone: incidence, normals, what the right imager sees."""

from functools import cached_property, lru_cache

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
_ROUNDING = _f(3e-7)
"""Of 1 / depth, relative."""
_TRIES = 6
"""How often a ray of another view is followed to the plane of the pixel where it comes out."""
_FINE = 4
"""Columns of the right image to a pixel."""
_SMOOTH = _f(0.1)
"""[px] By so much the step of the disparity may change from pixel to pixel on one surface."""
_TOLERANCE = _f(0.2)
"""[px] What is nearer by less of disparity hides nothing."""


@inlined
def _slope(back2, back1, here, ahead1, ahead2):
    """The step of 1 / depth from pixel to pixel at the middle one of five in a line, 0 for a pixel alone.

    1 / depth is linear in the picture on a plane, and 0 where there is nothing. Of the two sides that counts more on
    which it is more so: it is the surface that the pixel is on, where the other one crosses an edge.
    """
    back, ahead, least = here - back1, ahead1 - here, _ROUNDING * here
    bend = abs(ahead - back)
    bend_back = abs(back1 - back2 - back) if back2 > _ZERO else bend
    bend_ahead = abs(ahead2 - ahead1 - ahead) if ahead2 > _ZERO else bend
    of_ahead = (bend_back + least) ** 2 if ahead1 > _ZERO else _ZERO
    of_back = (bend_ahead + least) ** 2 if back1 > _ZERO else _ZERO
    total = of_ahead + of_back
    return (ahead * of_ahead + back * of_back) / (total if total > _ZERO else _ONE)


@kernel
def _find_planes(start, stop, width, rays, turns, w, planes, cosine):
    """Rows ``start`` to ``stop``. w: 1 / depth with a margin of two pixels, 0 where there is nothing, in one line.

    turns: of each pixel, from slopes along u and v to those along x and y. planes: (3, pixels) n of n·X = 1, written.
    """
    wide = width + 4
    for v in range(start, stop):
        # Slices, because the compiler does not use the vector unit where an index may be any.
        at, middle = v * width, (v + 2) * wide + 2
        b2, b1, h = w[middle - 2 :][:width], w[middle - 1 :][:width], w[middle:][:width]
        a1, a2 = w[middle + 1 :][:width], w[middle + 2 :][:width]
        u2, u1 = w[middle - 2 * wide :][:width], w[middle - wide :][:width]
        d1, d2 = w[middle + wide :][:width], w[middle + 2 * wide :][:width]
        x, y = rays[0, at : at + width], rays[1, at : at + width]
        xu, xv, yu, yv = (turns[0, at : at + width], turns[1, at : at + width],
                          turns[2, at : at + width], turns[3, at : at + width])  # fmt: skip
        px, py, pz = planes[0, at : at + width], planes[1, at : at + width], planes[2, at : at + width]
        cosines = cosine[at : at + width]
        for i in range(width):
            across, down = _slope(b2[i], b1[i], h[i], a1[i], a2[i]), _slope(u2[i], u1[i], h[i], d1[i], d2[i])
            # On the plane 1 / depth = n·(x, y, 1).
            there = h[i] > _ZERO
            nx = xu[i] * across + xv[i] * down if there else _ZERO
            ny = yu[i] * across + yv[i] * down if there else _ZERO
            nz = h[i] - nx * x[i] - ny * y[i]
            px[i], py[i], pz[i] = nx, ny, nz
            size = np.sqrt((nx * nx + ny * ny + nz * nz) * (x[i] * x[i] + y[i] * y[i] + _ONE))
            cosines[i] = min(h[i] / (size if there else _ONE), _ONE)


@lru_cache(maxsize=8)
def _turns(camera: Camera) -> NDArray[np.float32]:
    """(4, pixels): x by u, x by v, y by u, y by v; what a slope along u or v adds to that along x or y."""
    if min(camera.shape) < 2:
        return np.zeros((4, camera.width * camera.height), np.float32)  # a line has no slope across
    x, y = camera.rays.astype(np.float64)
    (x_v, x_u), (y_v, y_u) = np.gradient(x), np.gradient(y)
    area = x_u * y_v - y_u * x_v
    return np.stack([y_v, -y_u, -x_v, x_u]).reshape(4, -1).astype(np.float32) / area.reshape(-1).astype(np.float32)


@kernel
def _meet(start, stop, width, intrinsics, k, turns, rays, planes, tags, depth, face, cosine, tag):
    """Rows ``start`` to ``stop`` of another view: the ray meets the plane of the pixel that it comes out at.

    intrinsics: fx, fy, cx, cy. k: distortion. turns: (1 or rows, 12) that view's rotation and origin as seen here.
    """
    height = planes.shape[1] // width
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
                nx, ny, nz = planes[0, at], planes[1, at], planes[2, at]
                along = nx * dx + ny * dy + nz * dz
                z = (_ONE - (nx * r[9] + ny * r[10] + nz * r[11])) / along if along > _ZERO else _ZERO
                if at == before or not z > _ZERO:
                    break
                px, py, pz = r[9] + z * dx, r[10] + z * dy, r[11] + z * dz
            met = at >= 0 and z > _ZERO
            depth[i], face[i] = (z, at) if met else (_ZERO, -1)
            tag[i], cosine[i] = tags[at] if met else np.uint8(255), _ZERO
            if met:
                nx, ny, nz = planes[0, at], planes[1, at], planes[2, at]
                size = np.sqrt((nx * nx + ny * ny + nz * nz) * (dx * dx + dy * dy + dz * dz))
                cosine[i] = min((nx * dx + ny * dy + nz * dz) / size, _ONE)


@inlined
def _cover(nearest, low, high, d_low, d_high):
    """Put a stretch of a surface into a row of the right image. low, high: its ends there [px]; d: disparities."""
    first, last = np.int64(np.ceil(low * _FINE)), np.int64(np.floor(high * _FINE))
    per = (d_high - d_low) / (high - low) if high > low else _ZERO
    for k in range(max(first, 0), min(last + 1, nearest.size)):
        nearest[k] = max(nearest[k], d_low + per * (_f(k) / _FINE - low))


@inlined
def _is_joined(d, u):
    """Whether a pixel and the next one are of one surface: the step between them is that to a neighbour of one."""
    step = d[u + 1] - d[u]
    before = d[u] - d[u - 1] if u > 0 and d[u - 1] > _ZERO else step
    after = d[u + 2] - d[u + 1] if u + 2 < d.size and d[u + 2] > _ZERO else step
    alike = min(abs(step - before), abs(after - step)) < _SMOOTH
    return (d[u] > _ZERO) & (d[u + 1] > _ZERO) & (abs(step) < _ONE) & alike


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
            at = _f(u) - d[u]
            if u + 1 < width and _is_joined(d, u):
                _cover(nearest, at, at + _ONE + d[u] - d[u + 1], d[u], d[u + 1])
            else:
                _cover(nearest, at, at + _HALF, d[u], d[u])
            if u == 0 or not _is_joined(d, u - 1):
                _cover(nearest, at - _HALF, at, d[u], d[u])
        for u in range(width):
            k = np.int64(np.rint((_f(u) - d[u]) * _FINE))
            hidden = 0 <= k < nearest.size and nearest[k] > d[u] + _TOLERANCE
            sees[v * width + u] = np.uint8(1) if d[u] > _ZERO and not hidden else np.uint8(0)


class _Straight(Geometry):
    """The image itself. Its planes are fitted when an effect first asks for the incidence, as few do."""

    def __init__(
        self, seen: "Seen", depth: NDArray[np.float32], face: NDArray[np.int32], tag: NDArray[np.uint8]
    ) -> None:
        self._seen, self.depth, self.face, self.tag, self.right_sees = seen, depth, face, tag, None

    @cached_property
    def cosine(self) -> NDArray[np.float32]:  # type: ignore[override]
        """As of every :class:`Geometry`."""
        return self._seen.planes[1].reshape(self.depth.shape)


class Seen:
    """What a clean depth image shows of a scene, for effects in place of the scene.

    depth: (height, width) [m], 0 where there is nothing. tag: (height, width) index into ``tags``. pose: (4, 4) camera
    to world. Every pixel is taken for a piece of the plane through its neighbours on the same surface, so that normals
    are off on what is a pixel or two wide. The right imager's view is the left one's, warped row by row, with edges
    midway between pixels: what only the right one would see hides nothing.
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
        face = np.arange(depth.size, dtype=np.int32).reshape(depth.shape)
        nothing = depth <= 0
        face[nothing] = NO_FACE
        tag = np.array(tag)
        tag[nothing] = NO_TAG
        self._threads, self._straight = threads, _Straight(self, depth, face, tag)

    @cached_property
    def planes(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(3, pixels): n of the plane n·X = 1 in the camera's frame, 0 where there is nothing; (pixels,) its cosine."""
        eye, depth = self._camera, self._straight.depth
        w = np.zeros((eye.height + 5, eye.width + 4), np.float32)  # a row more, as slices run over the last one's end
        np.divide(_ONE, depth, out=w[2:-3, 2:-2], where=depth > 0)
        planes, cosine = np.empty((3, depth.size), np.float32), np.empty(depth.size, np.float32)
        arrays = eye.rays.reshape(2, -1), _turns(eye), w.reshape(-1), planes, cosine
        split(_find_planes, eye.height, self._threads, eye.width, *arrays)
        return planes, cosine

    @cached_property
    def normals(self) -> NDArray[np.float32]:
        """(pixels, 3) unit normals in the world, 0 where there is nothing."""
        planes = self.planes[0].T
        length = np.linalg.norm(planes, axis=1, keepdims=True)
        unit = np.divide(planes, length, out=np.zeros_like(planes), where=length > 0)
        return np.asarray(unit @ self._pose[:3, :3].T.astype(np.float32))

    def cast(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        *,
        right: bool = False,
        rays: NDArray[np.float32] | None = None,
        stamps: float | NDArray[np.float64] = 0.0,
        threads: int | None = None,
        out: Geometry | None = None,
    ) -> Geometry:
        """What rays meet, as of :meth:`~depthsim.raycast.Caster.cast`; (4, 4) without ``rays`` is the image itself.

        ``stamps`` make no difference. A ray that comes out beyond the image, or where it shows nothing, meets nothing.
        """
        found: Geometry = self._straight
        threads = threads or 1
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
            _meet, eye.height, threads, eye.width, intrinsics, k, flat, rays, self.planes[0], tags,
            *(picture.reshape(-1) for picture in pictures),
        )  # fmt: skip
        return found
