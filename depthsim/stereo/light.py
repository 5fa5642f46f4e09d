"""How much light comes from each surface to an imager: projector, sun and sky, scattered and mirrored."""

import numpy as np

from depthsim.intensity import value_noise
from depthsim.kernels import inlined, kernel
from depthsim.lanes import choose, cut_off, load_floats, spread, square_root, store, to_floats
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


# Rows of what is known of a block's rays: from the scene, ...
(
    _X, _Y, _Z, _NORMAL_X, _NORMAL_Y, _NORMAL_Z, _SCATTERED, _MIRRORED, _CONTRAST, _LIT, _SUNLIT, _ALBEDO, _TEXTURE,
    _FACING, _TOWARD_X, _PER_POWER, _BEAM, _ACROSS, _DOWN, _RIGHT, _BELOW, _DIAGONAL, _ROWS,
) = range(23)  # fmt: skip
_LANES = 16


@inlined
def _collect(at, count, work, grain, speckle, looks, ray_x, ray_y, depth, face, tag, lit, sunlit, normals, albedo):
    """Read what is known of ``count`` rays from ``at`` on; a ray that meets nothing has no normal and no light."""
    end = at + count
    faces, tags, depths, lits = face[at:end], tag[at:end], depth[at:end], lit[at:end]
    z, light = work[_Z], work[_LIT]
    work[_X, :count], work[_Y, :count] = ray_x[at:end], ray_y[at:end]
    for i in range(count):
        z[i] = depths[i] if faces[i] >= 0 else _f(1)
    if sunlit.size > 0:
        work[_SUNLIT, :count] = sunlit[at:end]
    if albedo.size > 0:
        work[_ALBEDO, :count] = albedo[at:end]
    # Most rays meet the face, and so the material, that the one before has met.
    before = np.int32(-2)
    nx = ny = nz = scattered = mirrored = contrast = _f(0)
    for i in range(count):
        if faces[i] != before:
            before, t = faces[i], tags[i]
            f = np.uint32(max(before, np.int32(0)))
            nx, ny, nz = (normals[f, 0], normals[f, 1], normals[f, 2]) if before >= 0 else (_f(0), _f(0), _f(0))
            scattered, mirrored, contrast = looks[t, 0], looks[t, 1], looks[t, 2]
        work[_NORMAL_X, i], work[_NORMAL_Y, i], work[_NORMAL_Z, i] = nx, ny, nz
        work[_SCATTERED, i], work[_MIRRORED, i], work[_CONTRAST, i] = scattered, mirrored, contrast
    uneven, across, down = grain[0], np.int64(grain[2]), np.int64(grain[3])
    row_size, pixels = np.int64(grain[1]), np.int64(grain[1]) // across
    row, u = at // row_size, at % row_size
    i = 0
    while i < count:
        # As far as the row of rays goes.
        part = min(count - i, row_size - u)
        own = speckle[row // down * pixels + u // across :]
        ray, pixel = u % across, 0
        for k in range(i, i + part):
            light[k] = own[pixel]
            ray += 1
            if ray == across:
                ray, pixel = 0, pixel + 1
        i, u, row = i + part, 0, row + 1
    for i in range(count):
        bright = max(_f(1) + uneven * light[i], _f(0))
        light[i] = bright if (faces[i] >= 0) & (lits[i] != 0) else _f(0)


@inlined
def _positive(values):
    return choose(values > _f(0), values, _f(0))


@inlined
def _row(work, row, i):
    """Address of a row's numbers from ``i`` on."""
    return work + 4 * (row * BLOCK + i)


@inlined
def _texture(count, work, places, pose, pixel, wavelengths):
    """The surfaces' texture, which stays where it is in the world: octaves of noise."""
    rays, points = work.ctypes.data, places.ctypes.data
    for i in range(0, BLOCK, _LANES):
        x, y = load_floats(_row(rays, _X, i), _LANES), load_floats(_row(rays, _Y, i), _LANES)
        z = load_floats(_row(rays, _Z, i), _LANES)
        store(_row(points, 0, i), (x * pose[0] + y * pose[1] + pose[2]) * z + pose[9])
        store(_row(points, 1, i), (x * pose[3] + y * pose[4] + pose[5]) * z + pose[10])
        store(_row(points, 2, i), (x * pose[6] + y * pose[7] + pose[8]) * z + pose[11])
        store(_row(rays, _TEXTURE, i), spread(_f(0), _LANES))
    nearest, depth, contrast = _f(np.inf), work[_Z], work[_CONTRAST]
    for i in range(count):
        nearest = min(nearest, depth[i] if contrast[i] != _f(0) else _f(np.inf))
    for octave in range(wavelengths.size):
        length = wavelengths[octave]
        if length <= _f(2) * (nearest * pixel + _f(1e-6)):
            continue
        scale = _f(1) / length
        for i in range(0, count, _LANES):
            # Full strength from four rays a wavelength on, none below two.
            per_ray = length / (load_floats(_row(rays, _Z, i), _LANES) * pixel + _f(1e-6))
            fade = _positive((per_ray - _f(2)) * _f(0.5))
            fade = choose(fade < _f(1), fade, _f(1))
            x, y, z = (
                load_floats(_row(points, 0, i), _LANES) * scale,
                load_floats(_row(points, 1, i), _LANES) * scale,
                load_floats(_row(points, 2, i), _LANES) * scale,
            )
            before = load_floats(_row(rays, _TEXTURE, i), _LANES)
            store(_row(rays, _TEXTURE, i), before + (value_noise(x, y, z) - _f(0.5)) * fade)


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
def _shine(work, rays, places, pattern):
    """What of the projector's light arrives [W/m²]: its radiant intensity, interpolated, and none outside its field.

    rays: address of ``work``. places: (BLOCK,) int32 scratch.
    """
    height, width = pattern.shape
    here, below = pattern.reshape(-1), pattern.reshape(-1)[width:]
    for i in range(0, BLOCK, _LANES):
        u = load_floats(_row(rays, _TOWARD_X, i), _LANES) * _f(-1 / PITCH) + _f((width - 1) / 2)
        v = load_floats(_row(rays, _Y, i), _LANES) * _f(1 / PITCH) + _f((height - 1) / 2)
        power = _positive(load_floats(_row(rays, _PER_POWER, i), _LANES))
        # Written so that what is not a number is outside.
        power = choose(u < _f(width - 1), choose(v < _f(height - 1), power, _f(0)), _f(0))
        power = choose(_f(0) <= u, choose(_f(0) <= v, power, _f(0)), _f(0))
        u, v = choose(power > _f(0), u, _f(0)), choose(power > _f(0), v, _f(0))
        column, row = cut_off(u), cut_off(v)
        store(_row(rays, _PER_POWER, i), power)
        store(_row(rays, _ACROSS, i), u - to_floats(column))
        store(_row(rays, _DOWN, i), v - to_floats(row))
        store(places.ctypes.data + 4 * i, row * _i(width) + column)
    for i in range(BLOCK):
        at = np.uint32(places[i])
        work[_BEAM, i], work[_RIGHT, i] = here[at], here[at + np.uint32(1)]
        work[_BELOW, i], work[_DIAGONAL, i] = below[at], below[at + np.uint32(1)]
    for i in range(0, BLOCK, _LANES):
        s, t = load_floats(_row(rays, _ACROSS, i), _LANES), load_floats(_row(rays, _DOWN, i), _LANES)
        left, right = load_floats(_row(rays, _BEAM, i), _LANES), load_floats(_row(rays, _RIGHT, i), _LANES)
        low, low_right = load_floats(_row(rays, _BELOW, i), _LANES), load_floats(_row(rays, _DIAGONAL, i), _LANES)
        above = left + (right - left) * s
        power = load_floats(_row(rays, _PER_POWER, i), _LANES)
        store(_row(rays, _BEAM, i), (above + (low + (low_right - low) * s - above) * t) * power)


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
    work[_ALBEDO] = _f(-1)
    corners = np.empty(BLOCK, np.int32)
    for at in range(start, stop, BLOCK):
        count = min(BLOCK, stop - at)
        _collect(at, count, work, grain, speckle, looks, ray_x, ray_y, depth, face, tag, lit, sunlit, normals, albedo)
        _texture(count, work, places, pose, pixel, contrasts)
        _aim(work.ctypes.data, pose, offset, source)
        _shine(work, work.ctypes.data, corners, pattern)
        _leave(work.ctypes.data, light[0], light[1], sun)
        out[at : at + count] = work[_BEAM, :count]
