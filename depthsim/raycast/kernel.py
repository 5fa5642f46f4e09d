"""The ray kernel: 4x4 pixels a packet through ``rtcIntersect16``, with the clean geometry read in the same pass.

A loop over the 16 lanes becomes a few machine instructions where the compiler can see it: one flat array with offsets
known when it compiles, no branch, no call. Rows of four pixels are loaded before they are stored, because the compiler
cannot know that the picture and the packet do not overlap.
"""

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import inlined, kernel
from depthsim.llvm import bits_float, call_embree, fetch_add, float_bits

TILE = 4
"""A packet is 4x4 pixels: squares share more of the tree than strips (16x1 took 1.3 times as long)."""
LANES = TILE * TILE

# Where the fields of RTCRayHit16 begin, in floats; each is 16 long. RTCRay16 is its first half.
ORIGIN_X, ORIGIN_Y, ORIGIN_Z, NEAR = 0, 16, 32, 48
DIRECTION_X, DIRECTION_Y, DIRECTION_Z, TIME = 64, 80, 96, 112
FAR, MASK, ID, FLAGS = 128, 144, 160, 176
NORMAL_X, NORMAL_Y, NORMAL_Z, BARYCENTRIC = 192, 208, 224, 240
PRIMITIVE, GEOMETRY, INSTANCE = 272, 288, 304
MISSED, PACKET = 336, 352
"""RTCRayHit16 takes 320 floats, or 336 where Embree was built with instance arrays; behind it, which lanes missed."""

_NONE = np.int32(-1)
_FAR_AWAY = np.float32(np.inf)
_ZERO, _ONE = np.float32(0), np.float32(1)
NUDGE = np.float32(1e-5)
"""How far, at z = 1, a ray that met nothing is moved before it is cast again: 0.005 px of a D435.

Embree's ROBUST flag closes the edges of a mesh but not its vertices: of the rays that meet a vertex to the last bit,
about one in a hundred slips through. A camera square to a regular grid has many of those, and the fill rate would
measure them. (1e-6 left one in fifty of them, 1e-5 none in ten thousand.)"""
SKIN = np.float32(1 - 1e-3)
"""A point is hidden from the right imager by what is nearer than this share of its own range: what is left out would
shift the disparity by less than a hundredth of a pixel, and a surface must not hide itself."""


@inlined
def _set_origin(packet, pose, k, begin, end, shift):
    """Put lanes ``begin`` to ``end`` where the left imager is, or the right one for ``shift`` = baseline.

    pose: (K, 12), rotation row by row, then translation.
    """
    x, y, z = pose[k, 9] + pose[k, 0] * shift, pose[k, 10] + pose[k, 3] * shift, pose[k, 11] + pose[k, 6] * shift
    for lane in range(begin, end):
        packet[ORIGIN_X + lane] = x
        packet[ORIGIN_Y + lane] = y
        packet[ORIGIN_Z + lane] = z


@inlined
def _aim(packet, rays, row, column, pose, k, begin, end):
    """Turn a tile's camera-frame (x, y, 1) into the world."""
    for lane in range(begin, end):
        x, y = rays[0, row, column, lane], rays[1, row, column, lane]
        packet[DIRECTION_X + lane] = pose[k, 0] * x + pose[k, 1] * y + pose[k, 2]
        packet[DIRECTION_Y + lane] = pose[k, 3] * x + pose[k, 4] * y + pose[k, 5]
        packet[DIRECTION_Z + lane] = pose[k, 6] * x + pose[k, 7] * y + pose[k, 8]


def tile_rays(rays: NDArray[np.float32]) -> NDArray[np.float32]:
    """(2, H, W) rays as the kernel takes them, (2, tiles down, tiles across, 16).

    A tile that hangs over the border casts the last pixels again; nobody reads the copies.
    """
    height, width = rays.shape[1:]
    tiles = np.empty((2, -(-height // TILE), -(-width // TILE), LANES), np.float32)
    _fill_tiles(np.ascontiguousarray(rays, np.float32), tiles)
    return tiles


@kernel
def _fill_tiles(rays, tiles):
    height, width = rays.shape[1], rays.shape[2]
    whole = width // TILE
    for axis in range(2):
        for v in range(tiles.shape[1] * TILE):
            row, tile_row = rays[axis, min(v, height - 1)], tiles[axis, v // TILE]
            lane = v % TILE * TILE
            for column in range(whole):
                for k in range(TILE):
                    tile_row[column, lane + k] = row[column * TILE + k]
            for column in range(whole, tiles.shape[2]):
                for k in range(TILE):
                    tile_row[column, lane + k] = row[min(column * TILE + k, width - 1)]


@kernel
def cast_tiles(  # noqa: ANN201 - numba
    counter, intersect, occluded, scene, arguments, valid, packet, shadow,
    rays, pose, baseline, face_tags, depth, face, cosine, tag, right_sees,
):  # fmt: skip
    """Cast rows of tiles until ``counter`` has passed the last; threads that share the counter share the work.

    rays: (2, tiles down, tiles across, 16) x and y at z = 1, so the ray parameter of a hit is its z-depth.
    pose: (K, 12), rotation row by row, then translation; K is 1, or H for a pose a row (rolling shutter).
    face_tags: tag of face f at f + 1, so that a miss, face -1, needs no test.
    depth, face, cosine, tag: (H, W), written. right_sees: the same, or without pixels where it is not wanted.
    """
    height, width = depth.shape
    per_row, want_right = pose.shape[0] > 1, right_sees.size > 0
    none = bits_float(_NONE)
    for lane in range(LANES):
        # Time, near end, id and flags stay at the zero that they come with.
        packet[MASK + lane] = none
        shadow[MASK + lane] = none
        packet[INSTANCE + lane] = none
    _set_origin(packet, pose, 0, 0, LANES, _ZERO)
    _set_origin(shadow, pose, 0, 0, LANES, baseline)
    while True:
        row = fetch_add(counter.ctypes.data, 1)
        v0 = TILE * row
        if v0 >= height:
            break
        for column in range((width + TILE - 1) // TILE):
            u0 = TILE * column
            whole = v0 + TILE <= height and u0 + TILE <= width
            if per_row:
                for j in range(TILE):
                    k = min(v0 + j, height - 1)
                    _set_origin(packet, pose, k, j * TILE, j * TILE + TILE, _ZERO)
                    _aim(packet, rays, row, column, pose, k, j * TILE, j * TILE + TILE)
            else:
                _aim(packet, rays, row, column, pose, 0, 0, LANES)
            for lane in range(LANES):
                packet[FAR + lane] = _FAR_AWAY
                packet[GEOMETRY + lane] = none
            call_embree(intersect, valid.ctypes.data, scene, packet.ctypes.data, arguments.ctypes.data)
            missed = _count_missed(packet)
            # Where most of the rays miss, it is because nothing is there; a tile at the border counts its copies.
            if missed > 0 and (missed <= LANES // 2 or not whole):
                for j in range(TILE):
                    _nudge(packet, pose, min(v0 + j, height - 1) if per_row else 0, j * TILE, j * TILE + TILE)
                lanes = packet.ctypes.data + 4 * MISSED
                call_embree(intersect, lanes, scene, packet.ctypes.data, arguments.ctypes.data)
            _finish(packet)
            _store(packet, face_tags, whole, v0, u0, depth, face, cosine, tag)
            if want_right:
                for j in range(TILE):
                    k = min(v0 + j, height - 1) if per_row else 0
                    if per_row:
                        _set_origin(shadow, pose, k, j * TILE, j * TILE + TILE, baseline)
                    _look_from_right(packet, shadow, pose, k, j * TILE, j * TILE + TILE, baseline)
                call_embree(occluded, valid.ctypes.data, scene, shadow.ctypes.data, arguments.ctypes.data)
                for j in range(min(TILE, height - v0)):
                    for i in range(min(TILE, width - u0)):
                        lane = j * TILE + i
                        # Embree marks a ray that meets something by a far end of minus infinity.
                        seen = float_bits(packet[PRIMITIVE + lane]) != _NONE and shadow[FAR + lane] >= _ZERO
                        right_sees[v0 + j, u0 + i] = np.uint8(1) if seen else np.uint8(0)


@inlined
def _count_missed(packet):
    """The number of lanes that met nothing."""
    count = np.int32(0)
    for lane in range(LANES):
        count += np.int32(1) if float_bits(packet[GEOMETRY + lane]) == _NONE else np.int32(0)
    return count


@inlined
def _nudge(packet, pose, k, begin, end):
    """Move the rays that missed by NUDGE along the image's diagonal, and mark their lanes by -1 in MISSED."""
    for lane in range(begin, end):
        missed = float_bits(packet[GEOMETRY + lane]) == _NONE
        packet[MISSED + lane] = bits_float(_NONE) if missed else _ZERO
        step = NUDGE if missed else _ZERO
        packet[DIRECTION_X + lane] += step * (pose[k, 0] + pose[k, 1])
        packet[DIRECTION_Y + lane] += step * (pose[k, 3] + pose[k, 4])
        packet[DIRECTION_Z + lane] += step * (pose[k, 6] + pose[k, 7])


@inlined
def _finish(packet):
    """Work out the cosine of incidence, into a row that nobody reads, and clear what a miss left behind."""
    for lane in range(LANES):
        nx, ny, nz = packet[NORMAL_X + lane], packet[NORMAL_Y + lane], packet[NORMAL_Z + lane]
        dx, dy, dz = packet[DIRECTION_X + lane], packet[DIRECTION_Y + lane], packet[DIRECTION_Z + lane]
        normal2, direction2 = nx * nx + ny * ny + nz * nz, dx * dx + dy * dy + dz * dz
        c = abs(nx * dx + ny * dy + nz * dz) / np.sqrt(normal2 * direction2)
        hit = float_bits(packet[GEOMETRY + lane]) != _NONE
        packet[BARYCENTRIC + lane] = (c if c < _ONE else _ONE) if hit else _ZERO
        packet[FAR + lane] = packet[FAR + lane] if hit else _ZERO
        packet[PRIMITIVE + lane] = packet[PRIMITIVE + lane] if hit else bits_float(_NONE)


@inlined
def _store(packet, face_tags, whole, v0, u0, depth, face, cosine, tag):
    """Copy the lanes to their pixels; only the tiles at the border need the second form."""
    height, width = depth.shape
    if whole:
        for j in range(TILE):
            lane, v = j * TILE, v0 + j
            z0, z1, z2, z3 = packet[FAR + lane], packet[FAR + lane + 1], packet[FAR + lane + 2], packet[FAR + lane + 3]
            at = BARYCENTRIC + lane
            c0, c1, c2, c3 = packet[at], packet[at + 1], packet[at + 2], packet[at + 3]
            at = PRIMITIVE + lane
            f0, f1 = float_bits(packet[at]), float_bits(packet[at + 1])
            f2, f3 = float_bits(packet[at + 2]), float_bits(packet[at + 3])
            t0, t1, t2, t3 = face_tags[f0 + 1], face_tags[f1 + 1], face_tags[f2 + 1], face_tags[f3 + 1]
            depth[v, u0], depth[v, u0 + 1], depth[v, u0 + 2], depth[v, u0 + 3] = z0, z1, z2, z3
            cosine[v, u0], cosine[v, u0 + 1], cosine[v, u0 + 2], cosine[v, u0 + 3] = c0, c1, c2, c3
            face[v, u0], face[v, u0 + 1], face[v, u0 + 2], face[v, u0 + 3] = f0, f1, f2, f3
            tag[v, u0], tag[v, u0 + 1], tag[v, u0 + 2], tag[v, u0 + 3] = t0, t1, t2, t3
    else:
        for j in range(min(TILE, height - v0)):
            for i in range(min(TILE, width - u0)):
                lane = j * TILE + i
                depth[v0 + j, u0 + i] = packet[FAR + lane]
                cosine[v0 + j, u0 + i] = packet[BARYCENTRIC + lane]
                face[v0 + j, u0 + i] = float_bits(packet[PRIMITIVE + lane])
                tag[v0 + j, u0 + i] = face_tags[float_bits(packet[PRIMITIVE + lane]) + 1]


@inlined
def _look_from_right(packet, shadow, pose, k, begin, end, baseline):
    """Aim from the right imager at the points that were hit.

    A point R (x, y, 1) Z + t is R ((x, y, 1) - (b / Z, 0, 0)) Z away from the right imager.
    """
    for lane in range(begin, end):
        z = packet[FAR + lane]
        shift = baseline / z if z > _ZERO else _ZERO
        shadow[DIRECTION_X + lane] = packet[DIRECTION_X + lane] - pose[k, 0] * shift
        shadow[DIRECTION_Y + lane] = packet[DIRECTION_Y + lane] - pose[k, 3] * shift
        shadow[DIRECTION_Z + lane] = packet[DIRECTION_Z + lane] - pose[k, 6] * shift
        # A ray of no length, where nothing was hit, meets nothing.
        shadow[FAR + lane] = z * SKIN
