"""The ray kernel: a tile of 4x4 pixels as one, two or four packets, with the clean geometry read in the same pass.

A packet is as wide as the processor's vector unit, and the kernel is compiled for that width: a field of a packet is
one vector (:mod:`depthsim.lanes`), read and written by its address.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import inlined, kernel
from depthsim.lanes import choose, count_true, load_floats, load_ints, magnitude, spread, square_root, store, to_mask
from depthsim.llvm import bits_float, call_embree, copy_bytes, fetch_add, float_bits
from depthsim.raycast.packet import (
    ACROSS,
    BARYCENTRIC,
    DIRECTION_X,
    DIRECTION_Y,
    DIRECTION_Z,
    FAR,
    FIELDS,
    GEOMETRY,
    INSTANCE,
    MASK,
    MISSED,
    NORMAL_X,
    NORMAL_Y,
    NORMAL_Z,
    ORIGIN_X,
    PIXELS,
    PRIMITIVE,
    TILE,
    TOWARD,
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
    down, across = -(-height // TILE), -(-width // TILE)
    rays = np.pad(rays, ((0, 0), (0, down * TILE - height), (0, across * TILE - width)), "edge")
    # A tile's rows and columns, each cut into those of a packet.
    packet_rows, packet_columns = lanes // ACROSS[lanes], ACROSS[lanes]
    cut = rays.reshape(2, down, TILE // packet_rows, packet_rows, across, TILE // packet_columns, packet_columns)
    tiles = cut.transpose(0, 1, 4, 2, 5, 3, 6).reshape(2, down, across, PIXELS)
    return np.ascontiguousarray(tiles, np.float32)


@kernel
def _place(lanes, across, packets, shadows, turns, pose, v0, baseline):
    """Write out for every lane where the imagers are, and how they are turned, in the rows of pixels from ``v0`` on.

    Time, near end, id and flags of a ray stay at the zero that they come with.
    """
    down, beside = lanes // across, TILE // across
    for part in range(PIXELS // lanes):
        for lane in range(lanes):
            k = min(v0 + part // beside * down + lane // across, pose.shape[0] - 1)
            for n in range(9):
                turns[part, n * lanes + lane] = pose[k, n]
            for axis in range(3):
                packets[part, (ORIGIN_X + axis) * lanes + lane] = pose[k, 9 + axis]
                shadows[part, (ORIGIN_X + axis) * lanes + lane] = pose[k, 9 + axis] + pose[k, 3 * axis] * baseline
            packets[part, MASK * lanes + lane] = bits_float(_NONE)
            shadows[part, MASK * lanes + lane] = bits_float(_NONE)
            packets[part, INSTANCE * lanes + lane] = bits_float(_NONE)


@inlined
def _aim(lanes, packet, turn, ray, plane):
    """Turn a packet's camera-frame (x, y, 1) into the world; its x stand at ``ray``, its y a ``plane`` behind."""
    field = 4 * lanes
    x, y = load_floats(ray, lanes), load_floats(ray + plane, lanes)
    for axis in range(3):
        row = turn + 3 * axis * field
        toward = load_floats(row, lanes) * x + load_floats(row + field, lanes) * y + load_floats(row + 2 * field, lanes)
        store(packet + (DIRECTION_X + axis) * field, toward)


@inlined
def _missed(lanes, packet):
    """Which lanes met nothing."""
    return load_ints(packet + GEOMETRY * 4 * lanes, lanes) == _NONE


@inlined
def _nudge(lanes, packet, turn):
    """Move the rays that missed by NUDGE along the image's diagonal, and mark their lanes by -1 in MISSED."""
    field = 4 * lanes
    missed = _missed(lanes, packet)
    store(packet + MISSED * field, to_mask(missed))
    step = choose(missed, NUDGE, _ZERO)
    for axis in range(3):
        row, at = turn + 3 * axis * field, packet + (DIRECTION_X + axis) * field
        store(at, load_floats(at, lanes) + step * (load_floats(row, lanes) + load_floats(row + field, lanes)))


@kernel
def _place_objects(lanes, across, frames, rows, v0):
    """Write out for every lane how the imager is turned in the frame of each object, and where, from row ``v0`` on."""
    down, beside = lanes // across, TILE // across
    for part in range(PIXELS // lanes):
        for number in range(rows.shape[1]):
            for lane in range(lanes):
                k = min(v0 + part // beside * down + lane // across, rows.shape[0] - 1)
                for n in range(12):
                    frames[part, number, n * lanes + lane] = rows[k, number, n]


@inlined
def _may_meet(lanes, packet, every, x, y, box):
    """How many lanes of the mask ``every`` go towards an object, their rays (x, y, 1); their mask is in TOWARD.

    box: (4,) what the object covers at z = 1: first and last x, first and last y.
    """
    none = spread(np.int32(0), lanes)
    across = choose(x > box[0], choose(x < box[1], load_ints(every, lanes), none), none)
    toward = choose(y > box[2], choose(y < box[3], across, none), none)
    store(packet + TOWARD * 4 * lanes, toward)
    return count_true(toward == _NONE)


@inlined
def _turn_into(lanes, packet, frame, x, y, offset):
    """Aim a packet's rays (x, y, 1) in another frame, from ``offset`` along the camera's x there."""
    field = 4 * lanes
    for axis in range(3):
        row = frame + 3 * axis * field
        sideways = load_floats(row, lanes)
        toward = sideways * x + load_floats(row + field, lanes) * y + load_floats(row + 2 * field, lanes)
        store(packet + (DIRECTION_X + axis) * field, toward)
        store(packet + (ORIGIN_X + axis) * field, load_floats(frame + (9 + axis) * field, lanes) + sideways * offset)


@inlined
def _meet_objects(lanes, query, how, packet, every, x, y, offset, frame, handles, boxes):
    """Cast rays into each object that they may meet, in its frame, and turn them back into the world.

    INSTANCE has the number of the object that a ray has met, where it has. every: address of the lanes' mask.
    """
    field, turned = 4 * lanes, False
    for number in range(handles.size):
        if _may_meet(lanes, packet, every, x, y, boxes[number]) == 0:
            continue
        turned = True
        _turn_into(lanes, packet, frame + number * 12 * field, x, y, offset)
        far, before = load_floats(packet + FAR * field, lanes), load_ints(packet + INSTANCE * field, lanes)
        call_embree(query, packet + TOWARD * field, handles[number], packet, how)
        nearer = load_floats(packet + FAR * field, lanes) < far
        store(packet + INSTANCE * field, choose(nearer, spread(np.int32(number), lanes), before))
    if turned:
        _turn_into(lanes, packet, frame + handles.size * 12 * field, x, y, offset)


@inlined
def _on_object(lanes, packet):
    """How many lanes met an object that moves."""
    return lanes - count_true(load_ints(packet + INSTANCE * 4 * lanes, lanes) == _NONE)


@kernel
def _turn_hits(lanes, packet, frames, first_faces):
    """Of the lanes that met an object that moves, turn the normal into the world and count the face in the scene.

    An object's frame is turned into the camera's, and that into the world.
    """
    world = frames[first_faces.size]
    for lane in range(lanes):
        number = float_bits(packet[INSTANCE * lanes + lane])
        if number < 0:
            continue
        own = frames[number]
        x, y, z = packet[NORMAL_X * lanes + lane], packet[NORMAL_Y * lanes + lane], packet[NORMAL_Z * lanes + lane]
        cx = own[lane] * x + own[3 * lanes + lane] * y + own[6 * lanes + lane] * z
        cy = own[lanes + lane] * x + own[4 * lanes + lane] * y + own[7 * lanes + lane] * z
        cz = own[2 * lanes + lane] * x + own[5 * lanes + lane] * y + own[8 * lanes + lane] * z
        for axis in range(3):
            row = 3 * axis * lanes + lane
            turned = world[row] * cx + world[row + lanes] * cy + world[row + 2 * lanes] * cz
            packet[(NORMAL_X + axis) * lanes + lane] = turned
        met = float_bits(packet[PRIMITIVE * lanes + lane]) + first_faces[number]
        packet[PRIMITIVE * lanes + lane] = bits_float(met)


@inlined
def _finish(lanes, packet):
    """Work out the cosine of incidence, into a field that nobody reads, and clear what a miss left behind."""
    field = 4 * lanes
    nx, dx = load_floats(packet + NORMAL_X * field, lanes), load_floats(packet + DIRECTION_X * field, lanes)
    ny, dy = load_floats(packet + NORMAL_Y * field, lanes), load_floats(packet + DIRECTION_Y * field, lanes)
    nz, dz = load_floats(packet + NORMAL_Z * field, lanes), load_floats(packet + DIRECTION_Z * field, lanes)
    normal2, direction2 = nx * nx + ny * ny + nz * nz, dx * dx + dy * dy + dz * dz
    c = magnitude(nx * dx + ny * dy + nz * dz) / square_root(normal2 * direction2)
    missed = _missed(lanes, packet)
    store(packet + BARYCENTRIC * field, choose(missed, _ZERO, choose(c < _ONE, c, _ONE)))
    store(packet + FAR * field, choose(missed, _ZERO, load_floats(packet + FAR * field, lanes)))
    store(packet + PRIMITIVE * field, choose(missed, _NONE, load_ints(packet + PRIMITIVE * field, lanes)))


@inlined
def _look_from_right(lanes, packet, shadow, turn, baseline):
    """Aim from the right imager at the points that were hit.

    A point R (x, y, 1) Z + t is R ((x, y, 1) - (b / Z, 0, 0)) Z away from the right imager.
    """
    field = 4 * lanes
    z = load_floats(packet + FAR * field, lanes)
    shift = choose(z > _ZERO, baseline / z, _ZERO)
    for axis in range(3):
        at = (DIRECTION_X + axis) * field
        toward = load_floats(packet + at, lanes) - load_floats(turn + 3 * axis * field, lanes) * shift
        store(shadow + at, toward)
    # A ray of no length, where nothing was hit, meets nothing.
    store(shadow + FAR * field, z * SKIN)


@inlined
def _mark_seen(lanes, packet, shadow):
    """1 in MISSED of ``shadow`` where the right imager sees a point, else 0."""
    field = 4 * lanes
    # Embree marks a ray that meets something by a far end of minus infinity.
    free = choose(load_floats(shadow + FAR * field, lanes) < _ZERO, np.int32(0), spread(np.int32(1), lanes))
    store(shadow + MISSED * field, choose(_missed(lanes, packet), np.int32(0), free))


@cache
def cast_kernel(lanes: int, moving: bool = False) -> Any:
    """The kernel for packets of ``lanes`` rays: 16, 8 or 4. moving: for a scene with objects that move.

    What moves is met first; then, no farther than that, what stands, for which Embree sets INSTANCE back to -1.
    """
    across, parts = ACROSS[lanes], PIXELS // lanes
    down, beside = lanes // across, TILE // across

    @kernel
    def cast_tiles(
        counter, intersect, occluded, scene, arguments, valid, packets, shadows, turns,
        rays, pose, baseline, face_tags, depth, face, cosine, tag, right_sees,
        frames, rows, handles, first_faces, boxes,
    ):  # fmt: skip
        """Cast rows of tiles until ``counter`` has passed the last; threads that share the counter share the work.

        packets, shadows: the packets of a tile, (16 / lanes, FIELDS * lanes), zero when they are new.
        turns: (16 / lanes, 9 * lanes), scratch.
        rays: (2, tiles down, tiles across, 16) x and y at z = 1, so the ray parameter of a hit is its z-depth.
        pose: (K, 12), rotation row by row, then translation; K is 1, or H for a pose a row (rolling shutter).
        face_tags: tag of face f at f + 1, so that a miss, face -1, needs no test.
        depth, face, cosine, tag: (H, W), written. right_sees: the same, or without pixels where it is not wanted.
        frames: (16 / lanes, objects + 1, 12 * lanes), scratch. rows and on: of
        :class:`~depthsim.raycast.placed.Placed`. These five are not looked at where nothing moves.
        """
        height, width = depth.shape
        field = 4 * lanes  # [bytes]
        first_packet, first_shadow, first_turn = packets.ctypes.data, shadows.ctypes.data, turns.ctypes.data
        every_lane, how = valid.ctypes.data, arguments.ctypes.data
        first_depth, first_cosine, first_face = depth.ctypes.data, cosine.ctypes.data, face.ctypes.data
        first_frame, frame_pace = frames.ctypes.data, 12 * field * frames.shape[1]
        pace, plane = FIELDS * field, 4 * PIXELS * rays.shape[1] * rays.shape[2]
        if moving:
            _place_objects(lanes, across, frames, rows, 0)
        while True:
            row = fetch_add(counter.ctypes.data, 1)
            v0 = TILE * row
            if v0 >= height:
                break
            _place(lanes, across, packets, shadows, turns, pose, v0, baseline)
            if moving and rows.shape[0] > 1:
                _place_objects(lanes, across, frames, rows, v0)
            for column in range((width + TILE - 1) // TILE):
                u0 = TILE * column
                whole = v0 + TILE <= height and u0 + TILE <= width
                ray = rays.ctypes.data + 4 * PIXELS * (row * rays.shape[2] + column)
                missed = np.int32(0)
                for part in range(parts):
                    packet, turn = first_packet + part * pace, first_turn + part * 9 * field
                    _aim(lanes, packet, turn, ray + part * field, plane)
                    store(packet + FAR * field, spread(_FAR_AWAY, lanes))
                    store(packet + GEOMETRY * field, spread(_NONE, lanes))
                    if moving:
                        x, y = load_floats(ray + part * field, lanes), load_floats(ray + part * field + plane, lanes)
                        store(packet + INSTANCE * field, spread(_NONE, lanes))
                        frame = first_frame + part * frame_pace
                        _meet_objects(lanes, intersect, how, packet, every_lane, x, y, _ZERO, frame, handles, boxes[0])
                    call_embree(intersect, every_lane, scene, packet, how)
                    missed += count_true(_missed(lanes, packet))
                # Where most of the rays miss, it is because nothing is there; a tile at the border counts its copies.
                if missed > 0 and (missed <= PIXELS // 2 or not whole):
                    for part in range(parts):
                        packet, turn = first_packet + part * pace, first_turn + part * 9 * field
                        _nudge(lanes, packet, turn)
                        call_embree(intersect, packet + MISSED * field, scene, packet, how)
                        if moving:
                            x = load_floats(ray + part * field, lanes) + NUDGE
                            y = load_floats(ray + part * field + plane, lanes) + NUDGE
                            frame, mask = first_frame + part * frame_pace, packet + MISSED * field
                            _meet_objects(lanes, intersect, how, packet, mask, x, y, _ZERO, frame, handles, boxes[0])
                for part in range(parts):
                    packet, turn = first_packet + part * pace, first_turn + part * 9 * field
                    v, u = v0 + part // beside * down, u0 + part % beside * across
                    if moving and _on_object(lanes, packet) > 0:
                        _turn_hits(lanes, packets[part], frames[part], first_faces)
                    _finish(lanes, packet)
                    if whole:
                        for j in range(down):
                            pixel, lane = 4 * ((v + j) * width + u), j * across
                            copy_bytes(first_depth + pixel, packet + FAR * field + 4 * lane, 4 * across)
                            copy_bytes(first_cosine + pixel, packet + BARYCENTRIC * field + 4 * lane, 4 * across)
                            copy_bytes(first_face + pixel, packet + PRIMITIVE * field + 4 * lane, 4 * across)
                            for i in range(across):
                                met = float_bits(packets[part, PRIMITIVE * lanes + lane + i])
                                tag[v + j, u + i] = face_tags[met + 1]
                    else:
                        for j in range(min(down, height - v)):
                            for i in range(min(across, width - u)):
                                lane = j * across + i
                                met = float_bits(packets[part, PRIMITIVE * lanes + lane])
                                depth[v + j, u + i] = packets[part, FAR * lanes + lane]
                                cosine[v + j, u + i] = packets[part, BARYCENTRIC * lanes + lane]
                                face[v + j, u + i], tag[v + j, u + i] = met, face_tags[met + 1]
                    if right_sees.size > 0:
                        shadow = first_shadow + part * pace
                        _look_from_right(lanes, packet, shadow, turn, baseline)
                        call_embree(occluded, every_lane, scene, shadow, how)
                        if moving:
                            z = load_floats(packet + FAR * field, lanes)
                            x = load_floats(ray + part * field, lanes) - choose(z > _ZERO, baseline / z, _ZERO)
                            y = load_floats(ray + part * field + plane, lanes)
                            frame = first_frame + part * frame_pace
                            _meet_objects(
                                lanes, occluded, how, shadow, every_lane, x, y, baseline, frame, handles, boxes[1]
                            )
                        _mark_seen(lanes, packet, shadow)
                        for j in range(min(down, height - v)):
                            for i in range(min(across, width - u)):
                                seen = float_bits(shadows[part, MISSED * lanes + j * across + i])
                                right_sees[v + j, u + i] = np.uint8(seen)

    return cast_tiles
