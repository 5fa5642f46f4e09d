"""Colours of what a camera sees, from a mesh's own textures and the colours of its corners.

A texture is kept at half its size, a quarter and so on (Williams 1983, 'Pyramidal parametrics'), and is taken between
the two sizes whose texels come next to the pixel's: sharp from near, without flicker from afar. Pictures and textures
have a gamma of 2, as those of :mod:`depthsim.intensity`.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.intensity import intensity_image, light_on_faces
from depthsim.kernels import inlined, kernel
from depthsim.look import PROCEDURAL, Look
from depthsim.materials import Materials
from depthsim.parallel import core_count, split
from depthsim.raycast import Geometry
from depthsim.scene import Scene

NONE = np.float32(-1)
"""The albedo of what has none of its own."""
_f = np.float32


@dataclass(frozen=True)
class _Pyramids:
    """The textures at all their sizes. texels: (N, 3) uint8, row by row. levels: (L, 3) int64, where each begins, its
    width and its height. first: (T + 1,) int64, the first level of each texture."""

    texels: NDArray[np.uint8]
    levels: NDArray[np.int64]
    first: NDArray[np.int64]


def _halved(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Half the size, each texel the mean light of four."""
    height, width = picture.shape[:2]
    even = np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge").astype(np.float32)
    squares = np.square(even, out=even)
    squares = (squares[::2, ::2] + squares[1::2, ::2] + squares[::2, 1::2] + squares[1::2, 1::2]) / 4
    return np.rint(np.sqrt(squares)).astype(np.uint8)


@lru_cache(maxsize=2)
def _pyramids_of(holder: "_ById") -> _Pyramids:
    texels, levels, first, at = [], [], [0], 0
    for picture in holder.look.pictures:
        sizes = [picture]
        while max(sizes[-1].shape[:2]) > 1:
            sizes.append(_halved(sizes[-1]))
        for one in sizes:
            texels.append(one.reshape(-1, 3))
            levels.append((at, one.shape[1], one.shape[0]))
            at += one.shape[0] * one.shape[1]
        first.append(len(levels))
    none = np.zeros((1, 3), np.uint8)
    return _Pyramids(
        np.concatenate([*texels, none]),
        np.array(levels, np.int64).reshape(-1, 3),
        np.array(first, np.int64),
    )


class _ById:
    """A look as a key, by its identity."""

    def __init__(self, look: Look) -> None:
        self.look = look

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ById) and other.look is self.look

    def __hash__(self) -> int:
        return id(self.look)


@inlined
def _texel(texels, level, u, v, channel):
    """A texture at one of its sizes, interpolated, as a share of the light."""
    width, height = level[1], level[2]
    x, y = (u - np.floor(u)) * width - 0.5, (np.ceil(v) - v) * height - 0.5
    i, j = np.int64(np.floor(x)), np.int64(np.floor(y))
    s, t = x - i, y - j
    left, right, above, below = i % width, (i + 1) % width, j % height, (j + 1) % height
    total = 0.0
    for row, across in ((above, 1 - t), (below, t)):
        for column, along in ((left, 1 - s), (right, s)):
            value = np.float64(texels[level[0] + row * width + column, channel]) / 255
            total += across * along * value * value
    return total


@kernel
def _color(
    start, stop, pose, focal, ray_x, ray_y, depth, face, cosine, vertices, faces, texture, uv, colors,
    texels, levels, first, out,
):  # fmt: skip
    """The albedo of pixels ``start`` to ``stop``: (pixels, 3) in ``out``, NONE for what has none of its own.

    pose: (12,) rotation row by row and translation, camera to world. focal: fx·fy [px²].
    """
    for k in range(start, stop):
        f = face[k]
        if f < 0 or texture[f] == PROCEDURAL:
            out[k, 0] = out[k, 1] = out[k, 2] = NONE
            continue
        z, x, y = np.float64(depth[k]), np.float64(ray_x[k]), np.float64(ray_y[k])
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        bb = cc = bc = pb = pc = 0.0
        for i in range(3):
            p = (pose[3 * i] * x + pose[3 * i + 1] * y + pose[3 * i + 2]) * z + pose[9 + i] - a[i]
            e, g = b[i] - a[i], c[i] - a[i]
            bb, cc, bc, pb, pc = bb + e * e, cc + g * g, bc + e * g, pb + p * e, pc + p * g
        area = max(bb * cc - bc * bc, 1e-300)  # the square of twice the face's
        # Rounding may put the point beyond an edge of the face.
        second = min(max((cc * pb - bc * pc) / area, 0.0), 1.0)
        third = min(max((bb * pc - bc * pb) / area, 0.0), 1.0 - second)
        weights = (1 - second - third, second, third)
        t, u, v, level, share = texture[f], 0.0, 0.0, np.int64(0), 0.0
        if t >= 0:
            for i in range(3):
                u, v = u + weights[i] * uv[f, i, 0], v + weights[i] * uv[f, i, 1]
            e0, e1 = uv[f, 1, 0] - uv[f, 0, 0], uv[f, 1, 1] - uv[f, 0, 1]
            g0, g1 = uv[f, 2, 0] - uv[f, 0, 0], uv[f, 2, 1] - uv[f, 0, 1]
            begin, last = first[t], first[t + 1] - 1
            density = abs(e0 * g1 - e1 * g0) * levels[begin, 1] * levels[begin, 2] / np.sqrt(area)
            # At a slant a pixel is longer than it is wide: between the two, or the texture is blurred across.
            wide = density * z * z / focal / np.sqrt(max(np.float64(cosine[k]), 0.05))
            at = min(max(0.5 * np.log2(max(wide, 1e-12)), 0.0), np.float64(last - begin))
            level = begin + np.int64(at)
            share = at - np.floor(at) if level < last else 0.0
        for channel in range(3):
            value = 0.0
            for i in range(3):
                corner = np.float64(colors[f, i, channel]) / 255
                value += weights[i] * corner * corner
            if t >= 0:
                near = _texel(texels, levels[level], u, v, channel)
                if share > 0:
                    near += share * (_texel(texels, levels[level + 1], u, v, channel) - near)
                value *= near
            out[k, channel] = _f(value)


def albedo_of(
    geometry: Geometry,
    camera: Camera,
    pose: NDArray[np.float64],
    scene: Scene,
    threads: int | None = None,
    stamp: float = 0.0,
) -> NDArray[np.float32]:
    """(height, width, 3) share of red, green and blue light that surfaces scatter, NONE where the mesh has no colours.

    pose: (4, 4) camera to world. stamp: when, for objects that move [s]. Raises :class:`InputError` for a texture that
    cannot be read.
    """
    look = scene.look
    if look is None:
        return np.full((*camera.shape, 3), NONE)
    pyramids = _pyramids_of(_ById(look))
    out = np.empty((camera.width * camera.height, 3), np.float32)
    row = np.concatenate([pose[:3, :3].reshape(-1), pose[:3, 3]])
    split(
        _color, len(out), threads or core_count(), row, float(camera.fx * camera.fy), camera.rays[0].reshape(-1),
        camera.rays[1].reshape(-1), geometry.depth.reshape(-1), geometry.face.reshape(-1), geometry.cosine.reshape(-1),
        scene.at(stamp).vertices, scene.faces, look.texture, look.uv, look.colors, pyramids.texels, pyramids.levels,
        pyramids.first, out,
    )  # fmt: skip
    return out.reshape(*camera.shape, 3)


def color_image(
    geometry: Geometry,
    camera: Camera,
    pose: NDArray[np.float64],
    scene: Scene,
    materials: Materials,
    threads: int | None = None,
    stamp: float = 0.0,
) -> NDArray[np.uint8]:
    """(height, width, 3) uint8 picture of one pose's geometry, or (height, width) where no mesh has colours.

    Surfaces without colours of their own are grey, as :func:`~depthsim.intensity.intensity_image` has them. pose:
    (4, 4) camera to world. stamp: when, for objects that move [s]. Raises :class:`InputError` for a texture that cannot
    be read.
    """
    grey = intensity_image(geometry, camera, pose, scene, materials, threads, stamp)
    if scene.look is None:
        return grey
    albedo = albedo_of(geometry, camera, pose, scene, threads, stamp)
    light = light_on_faces(scene, stamp)[np.maximum(geometry.face, 0)]
    own = albedo[..., 0] >= 0
    picture = np.repeat(grey[..., None], 3, axis=2)
    picture[own] = np.rint(np.sqrt(np.clip(albedo[own] * light[own, None], 0, 1)) * _f(255))
    return picture
