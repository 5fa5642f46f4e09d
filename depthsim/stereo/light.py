"""How much light comes from each surface to an imager: projector, sun and sky, scattered and mirrored."""

import numpy as np

from depthsim.intensity import value_noise
from depthsim.kernels import inlined, kernel
from depthsim.lanes import choose, load_floats, spread, square_root, store
from depthsim.stereo.pattern import PITCH

_f, _i = np.float32, np.int32
BLOCK = 256
WAVELENGTHS = (0.4, 0.1, 0.025, 0.00625)
"""[m] Octaves of the surfaces' texture."""
_SHARPNESS = 50.0
"""Exponent of the mirrored lobe (Blinn and Phong): half its height about 10° from the mirror's direction."""
_POLISHED = 0.5
"""What mirrors more than this share is a mirror, with a lobe of 64 times the exponent: 1.2° in place of 10°. On metal
that is brushed the dots are seen in a wide glare; in a mirror they are not on its surface at all."""


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


# Rows of what is known of a block's rays: from the scene, ...
(
    _X, _Y, _Z, _NORMAL_X, _NORMAL_Y, _NORMAL_Z, _SCATTERED, _MIRRORED, _CONTRAST, _LIT, _SUNLIT, _ALBEDO, _TEXTURE,
    _FACING, _TOWARD_X, _PER_POWER, _BEAM, _ROWS,
) = range(18)  # fmt: skip
_LANES = 16


@inlined
def _collect(at, count, work, grain, speckle, looks, ray_x, ray_y, depth, face, tag, lit, sunlit, normals, albedo):
    """Read what is known of ``count`` rays from ``at`` on; a ray that meets nothing has no normal and no light."""
    contrast, row_size, across, down = grain[0], np.int64(grain[1]), np.int64(grain[2]), np.int64(grain[3])
    pixels = row_size // across
    u, v = at % row_size, at // row_size
    for i in range(count):
        k = at + i
        f, t = face[k], tag[k]
        hit = f >= 0
        work[_X, i], work[_Y, i], work[_Z, i] = ray_x[k], ray_y[k], depth[k] if hit else _f(1)
        work[_NORMAL_X, i] = normals[f, 0] if hit else _f(0)
        work[_NORMAL_Y, i] = normals[f, 1] if hit else _f(0)
        work[_NORMAL_Z, i] = normals[f, 2] if hit else _f(0)
        work[_SCATTERED, i], work[_MIRRORED, i], work[_CONTRAST, i] = looks[t, 0], looks[t, 1], looks[t, 2]
        work[_ALBEDO, i] = albedo[k] if albedo.size > 0 else _f(-1)
        grain = _f(1) + contrast * speckle[v // down * pixels + u // across]
        work[_LIT, i] = max(grain, _f(0)) if hit and lit[k] != 0 else _f(0)
        work[_SUNLIT, i] = _f(sunlit[k])
        u += 1
        if u == row_size:
            u, v = 0, v + 1


@inlined
def _texture(count, work, places, pose, pixel, wavelengths):
    """The surfaces' texture, which stays where it is in the world: octaves of noise."""
    nearest, plain = _f(np.inf), True
    for i in range(count):
        x, y, z = work[_X, i], work[_Y, i], work[_Z, i]
        places[0, i] = (pose[0] * x + pose[1] * y + pose[2]) * z + pose[9]
        places[1, i] = (pose[3] * x + pose[4] * y + pose[5]) * z + pose[10]
        places[2, i] = (pose[6] * x + pose[7] * y + pose[8]) * z + pose[11]
        work[_TEXTURE, i] = _f(0)
        if work[_CONTRAST, i] != _f(0):
            plain, nearest = False, min(nearest, z)
    if plain:
        return
    px, py, pz, texture, depth = places[0], places[1], places[2], work[_TEXTURE], work[_Z]
    for octave in range(wavelengths.size):
        length = wavelengths[octave]
        if length <= _f(2) * (nearest * pixel + _f(1e-6)):
            continue
        scale = _f(1) / length
        for i in range(count):
            # Full strength from four rays a wavelength on, none below two.
            fade = min(max((length / (depth[i] * pixel + _f(1e-6)) - _f(2)) * _f(0.5), _f(0)), _f(1))
            texture[i] += (value_noise(px[i] * scale, py[i] * scale, pz[i] * scale) - _f(0.5)) * fade


@inlined
def _positive(values):
    return choose(values > _f(0), values, _f(0))


@inlined
def _row(work, row, i):
    """Address of a row's numbers from ``i`` on."""
    return work + 4 * (row * BLOCK + i)


@inlined
def _aim(work, pose, offset, source):
    """Turn the normals into the camera's frame and towards it, and find where in the pattern the points lie.

    work: address of the rows. _TEXTURE and what follows is written, _BEAM is what the pattern's intensity is to be
    multiplied by.
    """
    for i in range(0, BLOCK, _LANES):
        x, y = load_floats(_row(work, _X, i), _LANES), load_floats(_row(work, _Y, i), _LANES)
        near = _f(1) / load_floats(_row(work, _Z, i), _LANES)
        wx, wy = load_floats(_row(work, _NORMAL_X, i), _LANES), load_floats(_row(work, _NORMAL_Y, i), _LANES)
        wz = load_floats(_row(work, _NORMAL_Z, i), _LANES)
        nx = wx * pose[0] + wy * pose[3] + wz * pose[6]
        ny = wx * pose[1] + wy * pose[4] + wz * pose[7]
        nz = wx * pose[2] + wy * pose[5] + wz * pose[8]
        facing = (_f(0) - nx * x - ny * y - nz) / square_root(x * x + y * y + _f(1))
        side = choose(facing < _f(0), _f(-1), spread(_f(1), _LANES))
        nx, ny, nz = nx * side, ny * side, nz * side
        store(_row(work, _NORMAL_X, i), nx)
        store(_row(work, _NORMAL_Y, i), ny)
        store(_row(work, _NORMAL_Z, i), nz)
        store(_row(work, _FACING, i), facing * side)
        lx = near * (source - offset) - x
        square = lx * lx + y * y + _f(1)
        toward = _positive(nx * lx - ny * y - nz) / square_root(square)
        store(_row(work, _TOWARD_X, i), lx)
        store(_row(work, _PER_POWER, i), toward * near * near / square * load_floats(_row(work, _LIT, i), _LANES))


@inlined
def _shine(count, work, pattern):
    """What of the projector's light arrives [W/m²]."""
    for i in range(count):
        power = work[_PER_POWER, i]
        work[_BEAM, i] = _pattern_at(pattern, -work[_TOWARD_X, i], work[_Y, i]) * power if power > _f(0) else _f(0)


@inlined
def _leave(work, ambient, sunlight, sun):
    """How bright the points are for the imager, into _BEAM. sun: (3,) towards it. work: address of the rows."""
    sky = ambient * _f(1 / np.pi)
    for i in range(0, BLOCK, _LANES):
        x, y = load_floats(_row(work, _X, i), _LANES), load_floats(_row(work, _Y, i), _LANES)
        nx, ny = load_floats(_row(work, _NORMAL_X, i), _LANES), load_floats(_row(work, _NORMAL_Y, i), _LANES)
        nz, beam = load_floats(_row(work, _NORMAL_Z, i), _LANES), load_floats(_row(work, _BEAM, i), _LANES)
        gloss, lx = load_floats(_row(work, _MIRRORED, i), _LANES), load_floats(_row(work, _TOWARD_X, i), _LANES)
        # Schlick's share: every surface mirrors at a slant.
        slant = _f(1) - load_floats(_row(work, _FACING, i), _LANES)
        slant2 = slant * slant
        mirrored = gloss + (_f(1) - gloss) * slant2 * slant2 * slant
        size = _f(1) / square_root(x * x + y * y + _f(1))
        vx, vy, vz = _f(0) - x * size, _f(0) - y * size, _f(0) - size
        reach = _f(1) / square_root(lx * lx + y * y + _f(1))
        glare = beam * _lobe(gloss, nx, ny, nz, vx + lx * reach, vy - y * reach, vz - reach)
        incoming = beam + ambient
        if sunlight > _f(0):
            day = _positive(nx * sun[0] + ny * sun[1] + nz * sun[2]) * sunlight
            day = day * load_floats(_row(work, _SUNLIT, i), _LANES)
            glare = glare + day * _lobe(gloss, nx, ny, nz, vx + sun[0], vy + sun[1], vz + sun[2])
            incoming = incoming + day
        texture = load_floats(_row(work, _CONTRAST, i), _LANES) * load_floats(_row(work, _TEXTURE, i), _LANES)
        plain = load_floats(_row(work, _SCATTERED, i), _LANES) * _positive(texture + _f(1))
        own = load_floats(_row(work, _ALBEDO, i), _LANES)
        scattered = choose(own < _f(0), plain, own) * (_f(1) - mirrored) * incoming * _f(1 / np.pi)
        store(_row(work, _BEAM, i), scattered + mirrored * (glare + sky))


@inlined
def _lobe(gloss, nx, ny, nz, hx, hy, hz):
    """The mirrored lobe [1/sr] about the half-way direction h, of any length."""
    along = _positive((nx * hx + ny * hy + nz * hz) / square_root(hx * hx + hy * hy + hz * hz + _f(1e-12)))
    sharp = along * along
    for _ in range(5):
        sharp = sharp * sharp
    polished = gloss > _f(_POLISHED)
    along = choose(polished, sharp, along)
    # To the power of _SHARPNESS.
    power2 = along * along
    power4 = power2 * power2
    power16 = power4 * power4 * power4 * power4
    height = choose(
        polished, _f((64 * _SHARPNESS + 8) / (8 * np.pi)), spread(_f((_SHARPNESS + 8) / (8 * np.pi)), _LANES)
    )
    return power16 * power16 * power16 * power2 * height


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
    speckle: (H·W,) normal numbers a pixel, ``grain`` (4,) its contrast, rays a row, and rays a pixel across and down.
    lit, sunlit: uint8, whether the projector and the sun see the point. normals: (F, 3) world. albedo: what meshes with
    colours of their own scatter, in place of the first of ``looks``, below 0 for others; or nothing.
    """
    work, places = np.zeros((_ROWS, BLOCK), np.float32), np.empty((3, BLOCK), np.float32)
    for at in range(start, stop, BLOCK):
        count = min(BLOCK, stop - at)
        _collect(at, count, work, grain, speckle, looks, ray_x, ray_y, depth, face, tag, lit, sunlit, normals, albedo)
        _texture(count, work, places, pose, pixel, contrasts)
        _aim(work.ctypes.data, pose, offset, source)
        _shine(count, work, pattern)
        _leave(work.ctypes.data, light[0], light[1], sun)
        out[at : at + count] = work[_BEAM, :count]
