"""Plain intensity images, so that RGB-D systems have features: shaded surfaces with a procedural texture.

The texture lives in the world, so it stays on the surface while the camera moves. It is value noise (hashed corners of
a grid, interpolated) in four octaves; an octave that is finer than the pixels is faded out, because it would flicker.
This is no model of any real imager: depthsim's subject is depth.
"""

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.kernels import inlined, kernel
from depthsim.lanes import cut_off, high_product, load_floats, round_down, shift_down, store, to_floats
from depthsim.materials import Materials
from depthsim.moving import objects_seen
from depthsim.parallel import core_count, split
from depthsim.raycast import Geometry
from depthsim.scene import NO_TAG, Scene

_LIGHT = np.array([0.35, 0.25, 0.90], np.float32)
"""Where the light comes from, world frame; the rest is ambient."""
_WAVELENGTHS = (0.8, 0.2, 0.05, 0.0125)
_BLOCK, LANES = 256, 16
_f, _i = np.float32, np.int32
_ACROSS, _ALONG, _UP, _SECOND, _THIRD = np.array(
    [0x8DA6B343, 0xD8163841, 0xCB1AB31F, 0x7FEB352D, 0x846CA68B], np.uint32
).view(np.int32)
"""Factors of the hash."""


@inlined
def _place(i, factor):
    """What a corner's hash takes of its place along one axis: the product i · factor, its bits mixed once."""
    low = i * factor
    return low ^ shift_down(low, _i(16)) ^ high_product(i, factor) * _i(1 << 16)


@inlined
def _corner(place):
    """Numbers in [0, 1) for corners of the grid, by the integer hash of C. Wellons ("lowbias32")."""
    h = place * _SECOND
    h = (h ^ shift_down(h, _i(15))) * _THIRD
    return to_floats(shift_down(h ^ shift_down(h, _i(16)), _i(8))) * _f(2.0**-24)


@inlined
def _mix(a, b, t):
    return a + (b - a) * t


@inlined
def _smooth(t):
    return t * t * (_f(3) - _f(2) * t)


@inlined
def value_noise(x, y, z):  # noqa: ANN201 - numba
    """Value noise in [0, 1] at points given in grid units, vectors of float32."""
    fx, fy, fz = round_down(x), round_down(y), round_down(z)
    ix, iy, iz = cut_off(fx), cut_off(fy), cut_off(fz)
    u, v, w = _smooth(x - fx), _smooth(y - fy), _smooth(z - fz)
    left, right = _place(ix, _ACROSS), _place(ix + _i(1), _ACROSS)
    near, far = _place(iy, _ALONG), _place(iy + _i(1), _ALONG)
    low, high = _place(iz, _UP), _place(iz + _i(1), _UP)
    bottom = _mix(
        _mix(_corner(left ^ near ^ low), _corner(right ^ near ^ low), u),
        _mix(_corner(left ^ far ^ low), _corner(right ^ far ^ low), u),
        v,
    )
    top = _mix(
        _mix(_corner(left ^ near ^ high), _corner(right ^ near ^ high), u),
        _mix(_corner(left ^ far ^ high), _corner(right ^ far ^ high), u),
        v,
    )
    return _mix(bottom, top, w)


@kernel
def _shade(start, stop, pose, pixel, wavelengths, albedos, contrasts, ray_x, ray_y, depth, face, shading, tag, image):
    """image = albedo · light · texture for pixels ``start`` to ``stop``. shading: (F,) the light on each face."""
    px, py, pz = np.empty(_BLOCK, np.float32), np.empty(_BLOCK, np.float32), np.empty(_BLOCK, np.float32)
    texture, noise = np.empty(_BLOCK, np.float32), np.empty(_BLOCK, np.float32)
    for at in range(start, stop, _BLOCK):
        end = min(at + _BLOCK, stop)
        z, x, y, out = depth[at:end], ray_x[at:end], ray_y[at:end], image[at:end]
        faces, tags = face[at:end], tag[at:end]
        for i in range(z.size):
            px[i] = (pose[0] * x[i] + pose[1] * y[i] + pose[2]) * z[i] + pose[9]
            py[i] = (pose[3] * x[i] + pose[4] * y[i] + pose[5]) * z[i] + pose[10]
            pz[i] = (pose[6] * x[i] + pose[7] * y[i] + pose[8]) * z[i] + pose[11]
            texture[i] = _f(0)
        for octave in range(wavelengths.size):
            length = wavelengths[octave]
            scale = _f(1) / length
            shown = _i(0)
            for i in range(z.size):
                shown |= _i(length > _f(2) * (z[i] * pixel)) & _i(z[i] > _f(0))
            if shown == _i(0):
                continue
            for i in range(0, z.size, LANES):
                qx, qy, qz = (
                    load_floats(px[i:].ctypes.data, LANES) * scale,
                    load_floats(py[i:].ctypes.data, LANES) * scale,
                    load_floats(pz[i:].ctypes.data, LANES) * scale,
                )
                store(noise[i:].ctypes.data, value_noise(qx, qy, qz))
            for i in range(z.size):
                # Full strength from six pixels a wavelength on, none below two.
                fade = (length / (z[i] * pixel + _f(1e-6)) - _f(2)) * _f(0.25)
                fade = min(max(fade, _f(0)), _f(1))
                value = noise[i]
                # Steeper than it comes, so that patches have the edges that feature detectors look for.
                value = min(max((value - _f(0.5)) * _f(2.5), _f(-0.5)), _f(0.5))
                texture[i] += value * fade
        for i in range(z.size):
            t = tags[i]
            light = shading[max(faces[i], _i(0))]
            grey = max(albedos[t] * light * (_f(1) + contrasts[t] * texture[i]), _f(0))
            # A square root for the gamma of an 8-bit camera: without it dark surfaces lose their texture.
            out[i] = np.uint8(_i(min(np.sqrt(grey) * _f(255) + _f(0.5), _f(255))))


def light_on_faces(scene: Scene, stamp: float = 0.0) -> NDArray[np.float32]:
    """(F,) float32: the light that falls on each face at ``stamp`` [s], at most 1."""
    light = _LIGHT / np.linalg.norm(_LIGHT)
    # Walls are often seen from behind in scenes by others, so the light shines on both sides.
    of_face: NDArray[np.float32] = (0.45 + 0.55 * np.abs(scene.normals_at(stamp) @ light)).astype(np.float32)
    return of_face


def intensity_image(
    geometry: Geometry,
    camera: Camera,
    pose: NDArray[np.float64],
    scene: Scene,
    materials: Materials,
    threads: int | None = None,
    stamp: float = 0.0,
) -> NDArray[np.uint8]:
    """(height, width) uint8 image of one pose's geometry; 0 where nothing is hit.

    pose: (4, 4) camera to world. stamp: when, for objects that move [s]; their texture goes with them.
    """
    image = np.empty(camera.shape, np.uint8)
    # float32 loses the finest octave far from the origin; a multiple of all wavelengths near the scene takes its place.
    origin = 256 * np.round(scene.vertices[scene.faces[0, 0]] / 256)
    row = np.concatenate([pose[:3, :3].reshape(-1), pose[:3, 3] - origin]).astype(np.float32)
    albedos, contrasts = np.zeros((2, NO_TAG + 1), np.float32)
    albedos[: len(scene.tags)] = [materials[tag].albedo for tag in scene.tags]
    contrasts[: len(scene.tags)] = [materials[tag].texture for tag in scene.tags]
    of_face = light_on_faces(scene, stamp)
    surface = np.float32(1 / camera.fx), np.array(_WAVELENGTHS, np.float32), albedos, contrasts
    x, y, z, face, tag, out = (
        picture.reshape(-1) for picture in (*camera.rays, geometry.depth, geometry.face, geometry.tag, image)
    )
    split(_shade, image.size, threads or core_count(), row, *surface, x, y, z, face, of_face, tag, out, multiple=_BLOCK)
    for _, pixels, beside in objects_seen(scene.movers, face, pose, stamp):
        row = np.concatenate([beside[:3, :3].reshape(-1), beside[:3, 3]]).astype(np.float32)
        own = np.empty(len(pixels), np.uint8)
        _shade(0, len(pixels), row, *surface, x[pixels], y[pixels], z[pixels], face[pixels], of_face, tag[pixels], own)
        out[pixels] = own
    return image
