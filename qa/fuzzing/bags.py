"""Mutations of ROS 1 bags and MCAP files, record by record."""

import bz2
import struct
from random import Random

from qa.fuzzing.plain import extreme, mutate_bytes

_MAGIC = b"#ROSBAG V2.0\n"


def records(data: bytes) -> list[tuple[bytes, bytes]]:
    """The (header, data) records of a whole ROS 1 bag."""
    found, at = [], len(_MAGIC)
    while at + 4 <= len(data):
        (size,) = struct.unpack_from("<I", data, at)
        header = data[at + 4 : at + 4 + size]
        at += 4 + size
        (size,) = struct.unpack_from("<I", data, at)
        found.append((header, data[at + 4 : at + 4 + size]))
        at += 4 + size
    return found


def bag_of(found: list[tuple[bytes, bytes]]) -> bytes:
    """A ROS 1 bag of records."""
    parts = [struct.pack("<I", len(part)) + part for record in found for part in record]
    return _MAGIC + b"".join(parts)


def mutate_bag(data: bytes, rng: Random) -> bytes:
    """A ROS 1 bag with broken bytes, other records, other fields, or chunks in a compression."""
    if rng.random() < 0.35:
        return mutate_bytes(data, rng)
    found = records(data)
    for _ in range(rng.choice((1, 1, 2))):
        if not found:
            break
        at = rng.randrange(len(found))
        header, body = found[at]
        lot = rng.random()
        if lot < 0.3:
            found[at] = header, mutate_bytes(body, rng)
        elif lot < 0.5:
            found[at] = _field(header, rng), body
        elif lot < 0.6:
            del found[at]
        elif lot < 0.7:
            found.insert(rng.randrange(len(found)), (header, body))
        else:
            chunk = next((k for k, (head, _) in enumerate(found) if b"compression=none" in head), None)
            if chunk is not None:
                found[chunk] = _compressed(*found[chunk], rng)
    return bag_of(found)


def _field(header: bytes, rng: Random) -> bytes:
    """A header with one of its fields changed, by lengths that are right."""
    fields, at = [], 0
    while at + 4 <= len(header):
        (size,) = struct.unpack_from("<I", header, at)
        fields.append(header[at + 4 : at + 4 + size])
        at += 4 + size
    if fields:
        k = rng.randrange(len(fields))
        name, _, value = fields[k].partition(b"=")
        fields[k] = name + b"=" + rng.choice((b"", extreme(rng), mutate_bytes(value, rng)))
        if rng.random() < 0.2:
            del fields[k]
    return b"".join(struct.pack("<I", len(field)) + field for field in fields)


def _compressed(header: bytes, body: bytes, rng: Random) -> tuple[bytes, bytes]:
    import lz4.frame

    how = rng.choice(("bz2", "lz4"))
    old = struct.pack("<I", len(b"compression=none")) + b"compression=none"
    new = f"compression={how}".encode()
    header = header.replace(old, struct.pack("<I", len(new)) + new)
    packed = bz2.compress(mutate_bytes(body, rng)) if how == "bz2" else lz4.frame.compress(mutate_bytes(body, rng))
    return header, packed if rng.random() < 0.6 else mutate_bytes(packed, rng)


def mutate_mcap(data: bytes, rng: Random) -> bytes:
    """An MCAP with broken bytes, other records, or another end, so that it is read from the start."""
    if rng.random() < 0.4:
        return mutate_bytes(data, rng)
    head, found, at = data[:8], [], 8
    while at + 9 <= len(data) - 8:
        op, size = struct.unpack_from("<BQ", data, at)
        found.append((op, data[at + 9 : at + 9 + size]))
        at += 9 + size
    for _ in range(rng.choice((1, 1, 2))):
        k = rng.randrange(len(found))
        op, body = found[k]
        lot = rng.random()
        if lot < 0.5:
            found[k] = op, mutate_bytes(body, rng)
        elif lot < 0.65:
            found[k] = op, body[: rng.randrange(30)] + extreme(rng) + body[30:]
        elif lot < 0.8:
            found.insert(rng.randrange(len(found)), found[k])
        elif lot < 0.9 and len(found) > 1:
            del found[k]
        else:
            found[k] = rng.choice((op, rng.randrange(16), 255)), body
    if rng.random() < 0.3:
        found = [record for record in found if record[0] not in (2, 15)]  # no footer: damaged, so salvaged
    return head + b"".join(struct.pack("<BQ", op, len(body)) + body for op, body in found) + data[-8:]
