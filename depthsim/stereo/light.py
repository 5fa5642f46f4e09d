"""How much light comes from each surface to an imager: projector, sun and sky, scattered and mirrored."""

import numpy as np

from depthsim.intensity import value_noise
from depthsim.kernels import inlined, kernel
from depthsim.stereo.pattern import PITCH

_f, _i = np.float32, np.int32
BLOCK = 256
WAVELENGTHS = (0.4, 0.1, 0.025, 0.00625)
"""[m] Octaves of the surfaces' texture."""
_SHARPNESS = 50.0
"""Exponent of the mirrored lobe (Blinn and Phong): half its height about 10° from the mirror's direction."""


@inlined
def _pattern_at(pattern, x, y):
    """The projector's radiant intensity towards (x, y, 1), interpolated; 0 outside its field."""
    height, width = pattern.shape
    u, v = x * _f(1 / PITCH) + _f((width - 1) / 2), y * _f(1 / PITCH) + _f((height - 1) / 2)
    # Written so that what is not a number is outside.
    if not (u >= _f(0) and v >= _f(0) and u < _f(width - 1) and v < _f(height - 1)):
        return _f(0)
    i, j = _i(u), _i(v)
    s, t = u - _f(i), v - _f(j)
    above = pattern[j, i] + (pattern[j, i + 1] - pattern[j, i]) * s
    below = pattern[j + 1, i] + (pattern[j + 1, i + 1] - pattern[j + 1, i]) * s
    return above + (below - above) * t


@kernel
def radiance(  # noqa: ANN201 - numba
    start, stop, pose, pixel, offset, source, pattern, light, sun, looks, contrasts, speckle, grain,
    ray_x, ray_y, depth, face, tag, lit, sunlit, normals, albedo, out,
):  # fmt: skip
    """Radiance [W/m²/sr] from what rays ``start`` to ``stop`` of an imager meet.

    pose: (12,) rotation row by row, and the imager's place in the frame of the texture. pixel: a ray's width at z = 1.
    offset, source: x of the imager and of the projector, in the left camera's frame [m].
    pattern: of :func:`~depthsim.stereo.pattern.dot_pattern`. light: (2,) irradiance of sky and sun [W/m²].
    sun: (3,) towards it, camera frame. looks: (256, 3) by tag: scattered and mirrored share, and contrast of texture.
    speckle: (H·W,) normal numbers a pixel, ``grain`` (3,) its contrast, rays a row, and rays a pixel each way.
    lit, sunlit: uint8, whether the projector and the sun see the point. normals: (F, 3) world. albedo: what meshes with
    colours of their own scatter, in place of the first of ``looks``, below 0 for others; or nothing.
    """
    texture = np.empty(BLOCK, np.float32)
    px, py, pz = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    row_size, samples = np.int64(grain[1]), np.int64(grain[2])
    pixels = row_size // samples
    for at in range(start, stop, BLOCK):
        count = min(BLOCK, stop - at)
        z, x, y = depth[at : at + count], ray_x[at : at + count], ray_y[at : at + count]
        plain = True
        for i in range(count):
            px[i] = (pose[0] * x[i] + pose[1] * y[i] + pose[2]) * z[i] + pose[9]
            py[i] = (pose[3] * x[i] + pose[4] * y[i] + pose[5]) * z[i] + pose[10]
            pz[i] = (pose[6] * x[i] + pose[7] * y[i] + pose[8]) * z[i] + pose[11]
            texture[i] = _f(0)
            plain = plain and looks[tag[at + i], 2] == _f(0)
        if not plain:
            for octave in range(contrasts.size):
                length = contrasts[octave]
                scale = _f(1) / length
                for i in range(count):
                    # Full strength from four rays a wavelength on, none below two.
                    fade = min(max((length / (z[i] * pixel + _f(1e-6)) - _f(2)) * _f(0.5), _f(0)), _f(1))
                    texture[i] += (value_noise(px[i] * scale, py[i] * scale, pz[i] * scale) - _f(0.5)) * fade
        for i in range(count):
            k = at + i
            if face[k] < 0:
                out[k] = light[0] * _f(1 / np.pi)
                continue
            f = face[k]
            wx, wy, wz = normals[f, 0], normals[f, 1], normals[f, 2]
            nx = pose[0] * wx + pose[3] * wy + pose[6] * wz
            ny = pose[1] * wx + pose[4] * wy + pose[7] * wz
            nz = pose[2] * wx + pose[5] * wy + pose[8] * wz
            vx, vy, vz = -x[i], -y[i], _f(-1)
            size = np.sqrt(vx * vx + vy * vy + _f(1))
            vx, vy, vz = vx / size, vy / size, vz / size
            facing = nx * vx + ny * vy + nz * vz
            if facing < _f(0):
                nx, ny, nz, facing = -nx, -ny, -nz, -facing
            left_x = x[i] + offset / z[i]
            lx, ly, lz = source / z[i] - left_x, -y[i], _f(-1)
            size = np.sqrt(lx * lx + ly * ly + _f(1))
            beam = _f(0)
            toward = (nx * lx + ny * ly + nz * lz) / size
            mirrored_beam = _f(0)
            t = tag[k]
            # Schlick's share: every surface mirrors at a slant.
            mirrored = looks[t, 1] + (_f(1) - looks[t, 1]) * (_f(1) - facing) ** 5
            if lit[k] != 0 and toward > _f(0):
                beam = _pattern_at(pattern, -lx, -ly) * toward / (size * size * z[i] * z[i])
                v, u = (k // row_size) // samples, (k % row_size) // samples
                beam *= max(_f(1) + grain[0] * speckle[v * pixels + u], _f(0))
                mirrored_beam = beam * _lobe(nx, ny, nz, vx + lx / size, vy + ly / size, vz + lz / size)
            day = max(nx * sun[0] + ny * sun[1] + nz * sun[2], _f(0)) * light[1] * _f(sunlit[k])
            mirrored_day = day * _lobe(nx, ny, nz, vx + sun[0], vy + sun[1], vz + sun[2]) if day > _f(0) else _f(0)
            share = looks[t, 0] * (_f(1) - mirrored) * max(_f(1) + looks[t, 2] * texture[i], _f(0))
            if albedo.size > 0 and albedo[k] >= _f(0):
                share = albedo[k] * (_f(1) - mirrored)
            scattered = share * (beam + day + light[0]) * _f(1 / np.pi)
            out[k] = scattered + mirrored * (light[0] * _f(1 / np.pi) + mirrored_beam + mirrored_day)


@inlined
def _lobe(nx, ny, nz, hx, hy, hz):
    """The mirrored lobe [1/sr] about the half-way direction h, of any length."""
    along = (nx * hx + ny * hy + nz * hz) / np.sqrt(hx * hx + hy * hy + hz * hz + _f(1e-12))
    return _f((_SHARPNESS + 8) / (8 * np.pi)) * max(along, _f(0)) ** _f(_SHARPNESS)
