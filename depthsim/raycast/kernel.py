"""The ray kernel: a tile of 4x4 pixels as one, two or four packets, with the clean geometry read in the same pass.

A packet is as wide as the processor's vector unit, and the kernel is compiled for that width. A loop over the lanes of
a packet becomes a few machine instructions where the compiler can see it: one flat array with offsets known when it
compiles, no branch, no call. Rows of pixels are copied as a whole, because the compiler cannot know that the picture
and the packet do not overlap.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import inlined, kernel
from depthsim.llvm import bits_float, call_embree, copy_bytes, fetch_add, float_bits
from depthsim.raycast.packet import (
    ACROSS,
    BARYCENTRIC,
    DIRECTION_X,
    DIRECTION_Y,
    DIRECTION_Z,
    FAR,
    GEOMETRY,
    INSTANCE,
    MASK,
    MISSED,
    NORMAL_X,
    NORMAL_Y,
    NORMAL_Z,
    ORIGIN_X,
    ORIGIN_Y,
    ORIGIN_Z,
    PIXELS,
    PRIMITIVE,
    TILE,
    pixel_order,
)

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


def tile_rays(rays: NDArray[np.float32], lanes: int) -> NDArray[np.float32]:
    """(2, H, W) rays as the kernel takes them, (2, tiles down, tiles across, 16), in the order of the packets.

    A tile that hangs over the border casts the last pixels again; nobody reads the copies.
    """
    height, width = rays.shape[1:]
    tiles = np.empty((2, -(-height // TILE), -(-width // TILE), PIXELS), np.float32)
    _fill_tiles(np.ascontiguousarray(rays, np.float32), np.array(pixel_order(lanes)), tiles)
    return tiles


@kernel
def _fill_tiles(rays, order, tiles):
    height, width = rays.shape[1], rays.shape[2]
    for axis in range(2):
        for row in range(tiles.shape[1]):
            for column in range(tiles.shape[2]):
                for k in range(PIXELS):
                    v, u = TILE * row + order[k, 0], TILE * column + order[k, 1]
                    tiles[axis, row, column, k] = rays[axis, min(v, height - 1), min(u, width - 1)]


@inlined
def _set_origin(lanes, packet, pose, k, begin, end, shift):
    """Put lanes ``begin`` to ``end`` where the left imager is, or the right one for ``shift`` = baseline.

    pose: (K, 12), rotation row by row, then translation.
    """
    x, y, z = pose[k, 9] + pose[k, 0] * shift, pose[k, 10] + pose[k, 3] * shift, pose[k, 11] + pose[k, 6] * shift
    for lane in range(begin, end):
        packet[ORIGIN_X * lanes + lane] = x
        packet[ORIGIN_Y * lanes + lane] = y
        packet[ORIGIN_Z * lanes + lane] = z


@inlined
def _aim(lanes, packet, rays, row, column, part, pose, k, begin, end):
    """Turn the camera-frame (x, y, 1) of a tile's packet ``part`` into the world."""
    first = part * lanes
    for lane in range(begin, end):
        x, y = rays[0, row, column, first + lane], rays[1, row, column, first + lane]
        packet[DIRECTION_X * lanes + lane] = pose[k, 0] * x + pose[k, 1] * y + pose[k, 2]
        packet[DIRECTION_Y * lanes + lane] = pose[k, 3] * x + pose[k, 4] * y + pose[k, 5]
        packet[DIRECTION_Z * lanes + lane] = pose[k, 6] * x + pose[k, 7] * y + pose[k, 8]


@cache
def cast_kernel(lanes: int) -> Any:
    """The kernel for packets of ``lanes`` rays: 16, 8 or 4."""
    across, parts = ACROSS[lanes], PIXELS // lanes
    down, beside = lanes // across, TILE // across

    @kernel
    def cast_tiles(
        counter, intersect, occluded, scene, arguments, valid, packets, shadows,
        rays, pose, baseline, face_tags, depth, face, cosine, tag, right_sees,
    ):  # fmt: skip
        """Cast rows of tiles until ``counter`` has passed the last; threads that share the counter share the work.

        packets, shadows: a tile's (16 / lanes, FIELDS · lanes), zero when they are new.
        rays: (2, tiles down, tiles across, 16) x and y at z = 1, so the ray parameter of a hit is its z-depth.
        pose: (K, 12), rotation row by row, then translation; K is 1, or H for a pose a row (rolling shutter).
        face_tags: tag of face f at f + 1, so that a miss, face -1, needs no test.
        depth, face, cosine, tag: (H, W), written. right_sees: the same, or without pixels where it is not wanted.
        """
        height, width = depth.shape
        per_row, want_right = pose.shape[0] > 1, right_sees.size > 0
        none = bits_float(_NONE)
        for part in range(parts):
            packet, shadow = packets[part], shadows[part]
            for lane in range(lanes):
                # Time, near end, id and flags stay at the zero that they come with.
                packet[MASK * lanes + lane] = none
                shadow[MASK * lanes + lane] = none
                packet[INSTANCE * lanes + lane] = none
            _set_origin(lanes, packet, pose, 0, 0, lanes, _ZERO)
            _set_origin(lanes, shadow, pose, 0, 0, lanes, baseline)
        while True:
            row = fetch_add(counter.ctypes.data, 1)
            v0 = TILE * row
            if v0 >= height:
                break
            for column in range((width + TILE - 1) // TILE):
                u0 = TILE * column
                whole = v0 + TILE <= height and u0 + TILE <= width
                missed = np.int32(0)
                for part in range(parts):
                    packet, top = packets[part], v0 + part // beside * down
                    if per_row:
                        for j in range(down):
                            k, begin = min(top + j, height - 1), j * across
                            _set_origin(lanes, packet, pose, k, begin, begin + across, _ZERO)
                            _aim(lanes, packet, rays, row, column, part, pose, k, begin, begin + across)
                    else:
                        _aim(lanes, packet, rays, row, column, part, pose, 0, 0, lanes)
                    for lane in range(lanes):
                        packet[FAR * lanes + lane] = _FAR_AWAY
                        packet[GEOMETRY * lanes + lane] = none
                    call_embree(intersect, valid.ctypes.data, scene, packet.ctypes.data, arguments.ctypes.data)
                    missed += _count_missed(lanes, packet)
                # Where most of the rays miss, it is because nothing is there; a tile at the border counts its copies.
                if missed > 0 and (missed <= PIXELS // 2 or not whole):
                    for part in range(parts):
                        packet, top = packets[part], v0 + part // beside * down
                        for j in range(down):
                            k = min(top + j, height - 1) if per_row else 0
                            _nudge(lanes, packet, pose, k, j * across, j * across + across)
                        lost = packet.ctypes.data + 4 * MISSED * lanes
                        call_embree(intersect, lost, scene, packet.ctypes.data, arguments.ctypes.data)
                for part in range(parts):
                    packet, v, u = packets[part], v0 + part // beside * down, u0 + part % beside * across
                    _finish(lanes, packet)
                    if whole:
                        _store(lanes, across, packet, face_tags, v, u, depth, face, cosine, tag)
                    else:
                        _store_inside(lanes, across, packet, face_tags, v, u, depth, face, cosine, tag)
                if want_right:
                    for part in range(parts):
                        packet, shadow, top = packets[part], shadows[part], v0 + part // beside * down
                        for j in range(down):
                            k, begin = min(top + j, height - 1) if per_row else 0, j * across
                            if per_row:
                                _set_origin(lanes, shadow, pose, k, begin, begin + across, baseline)
                            _look_from_right(lanes, packet, shadow, pose, k, begin, begin + across, baseline)
                        call_embree(occluded, valid.ctypes.data, scene, shadow.ctypes.data, arguments.ctypes.data)
                        left = u0 + part % beside * across
                        for j in range(min(down, height - top)):
                            for i in range(min(across, width - left)):
                                lane = j * across + i
                                # Embree marks a ray that meets something by a far end of minus infinity.
                                hit = float_bits(packet[PRIMITIVE * lanes + lane]) != _NONE
                                seen = hit and shadow[FAR * lanes + lane] >= _ZERO
                                right_sees[top + j, left + i] = np.uint8(1) if seen else np.uint8(0)

    return cast_tiles


@inlined
def _count_missed(lanes, packet):
    """The number of lanes that met nothing."""
    count = np.int32(0)
    for lane in range(lanes):
        count += np.int32(1) if float_bits(packet[GEOMETRY * lanes + lane]) == _NONE else np.int32(0)
    return count


@inlined
def _nudge(lanes, packet, pose, k, begin, end):
    """Move the rays that missed by NUDGE along the image's diagonal, and mark their lanes by -1 in MISSED."""
    for lane in range(begin, end):
        missed = float_bits(packet[GEOMETRY * lanes + lane]) == _NONE
        packet[MISSED * lanes + lane] = bits_float(_NONE) if missed else _ZERO
        step = NUDGE if missed else _ZERO
        packet[DIRECTION_X * lanes + lane] += step * (pose[k, 0] + pose[k, 1])
        packet[DIRECTION_Y * lanes + lane] += step * (pose[k, 3] + pose[k, 4])
        packet[DIRECTION_Z * lanes + lane] += step * (pose[k, 6] + pose[k, 7])


@inlined
def _finish(lanes, packet):
    """Work out the cosine of incidence, into a row that nobody reads, and clear what a miss left behind."""
    for lane in range(lanes):
        nx, ny = packet[NORMAL_X * lanes + lane], packet[NORMAL_Y * lanes + lane]
        nz = packet[NORMAL_Z * lanes + lane]
        dx, dy = packet[DIRECTION_X * lanes + lane], packet[DIRECTION_Y * lanes + lane]
        dz = packet[DIRECTION_Z * lanes + lane]
        normal2, direction2 = nx * nx + ny * ny + nz * nz, dx * dx + dy * dy + dz * dz
        c = abs(nx * dx + ny * dy + nz * dz) / np.sqrt(normal2 * direction2)
        hit = float_bits(packet[GEOMETRY * lanes + lane]) != _NONE
        packet[BARYCENTRIC * lanes + lane] = (c if c < _ONE else _ONE) if hit else _ZERO
        packet[FAR * lanes + lane] = packet[FAR * lanes + lane] if hit else _ZERO
        packet[PRIMITIVE * lanes + lane] = packet[PRIMITIVE * lanes + lane] if hit else bits_float(_NONE)


@inlined
def _store(lanes, across, packet, face_tags, v, u, depth, face, cosine, tag):
    """Copy the lanes to their pixels, of which the first is (v, u), row by row."""
    start, width = packet.ctypes.data, depth.shape[1]
    for j in range(lanes // across):
        pixel, lane = 4 * ((v + j) * width + u), j * across
        copy_bytes(depth.ctypes.data + pixel, start + 4 * (FAR * lanes + lane), 4 * across)
        copy_bytes(cosine.ctypes.data + pixel, start + 4 * (BARYCENTRIC * lanes + lane), 4 * across)
        copy_bytes(face.ctypes.data + pixel, start + 4 * (PRIMITIVE * lanes + lane), 4 * across)
        for i in range(across):
            tag[v + j, u + i] = face_tags[float_bits(packet[PRIMITIVE * lanes + lane + i]) + 1]


@inlined
def _store_inside(lanes, across, packet, face_tags, v, u, depth, face, cosine, tag):
    """The same for a packet that hangs over the border."""
    height, width = depth.shape
    for j in range(min(lanes // across, height - v)):
        for i in range(min(across, width - u)):
            lane = j * across + i
            depth[v + j, u + i] = packet[FAR * lanes + lane]
            cosine[v + j, u + i] = packet[BARYCENTRIC * lanes + lane]
            face[v + j, u + i] = float_bits(packet[PRIMITIVE * lanes + lane])
            tag[v + j, u + i] = face_tags[float_bits(packet[PRIMITIVE * lanes + lane]) + 1]


@inlined
def _look_from_right(lanes, packet, shadow, pose, k, begin, end, baseline):
    """Aim from the right imager at the points that were hit.

    A point R (x, y, 1) Z + t is R ((x, y, 1) - (b / Z, 0, 0)) Z away from the right imager.
    """
    for lane in range(begin, end):
        z = packet[FAR * lanes + lane]
        shift = baseline / z if z > _ZERO else _ZERO
        shadow[DIRECTION_X * lanes + lane] = packet[DIRECTION_X * lanes + lane] - pose[k, 0] * shift
        shadow[DIRECTION_Y * lanes + lane] = packet[DIRECTION_Y * lanes + lane] - pose[k, 3] * shift
        shadow[DIRECTION_Z * lanes + lane] = packet[DIRECTION_Z * lanes + lane] - pose[k, 6] * shift
        # A ray of no length, where nothing was hit, meets nothing.
        shadow[FAR * lanes + lane] = z * SKIN
