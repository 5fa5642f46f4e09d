"""Mutations that know a container: checksums and lengths are right after them, so that readers go on."""

import io
import json
import sqlite3
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random

from qa.fuzzing.documents import as_json, mutate_document, mutate_json
from qa.fuzzing.plain import extreme, mutate_bytes, mutate_text

_PNG = b"\x89PNG\r\n\x1a\n"
_SIDES = (0, 1, 2, 3, 16, 255, 4096, 8191, 8192, 65535, 1 << 20, (1 << 26) + 1, (1 << 31) - 1, (1 << 32) - 1)
_BOMB: dict[int, bytes] = {}


def bomb(size: int) -> bytes:
    """Zeros, deflated a thousand times smaller."""
    if size not in _BOMB:
        packer = zlib.compressobj(9)
        block = bytes(1 << 20)
        parts = [packer.compress(block[: min(len(block), size - at)]) for at in range(0, size, len(block))]
        _BOMB[size] = b"".join([*parts, packer.flush()])
    return _BOMB[size]


def png_chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    """The chunks of a whole PNG."""
    chunks, at = [], len(_PNG)
    while at + 12 <= len(data):
        (size,) = struct.unpack_from(">I", data, at)
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + size]))
        at += 12 + size
    return chunks


def png_of(chunks: list[tuple[bytes, bytes]]) -> bytes:
    """A PNG of chunks, with lengths and checksums that are right."""
    parts = [
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks
    ]
    return _PNG + b"".join(parts)


def mutate_png(data: bytes, rng: Random) -> bytes:
    """A PNG with another header, other pixels, other chunks, or broken bytes."""
    if rng.random() < 0.3:
        return mutate_bytes(data, rng)
    chunks = png_chunks(data)
    for _ in range(rng.choice((1, 1, 2, 3))):
        if not chunks:
            break
        at = rng.randrange(len(chunks))
        kind, body = chunks[at]
        lot = rng.random()
        if lot < 0.45:
            place = next((k for k, chunk in enumerate(chunks) if chunk[0] == b"IHDR" and len(chunk[1]) == 13), None)
            if place is not None:
                chunks[place] = b"IHDR", _png_header(chunks[place][1], rng)
        elif lot < 0.65:
            place = next((k for k, chunk in enumerate(chunks) if chunk[0] == b"IDAT"), at)
            chunks[place] = b"IDAT", _png_pixels(chunks[place][1], rng)
        elif lot < 0.72:
            del chunks[at]
        elif lot < 0.8:
            chunks.insert(rng.randrange(len(chunks) + 1), (kind, body))
        elif lot < 0.85:
            other = rng.randrange(len(chunks))
            chunks[at], chunks[other] = chunks[other], chunks[at]
        else:
            chunks.insert(rng.randrange(len(chunks) + 1), _png_extra(rng))
    return png_of(chunks)


def _png_header(body: bytes, rng: Random) -> bytes:
    width, height, bits, colour, *rest = struct.unpack(">IIBBBBB", body)
    if rng.random() < 0.4:
        width = rng.choice((width, *_SIDES))
    if rng.random() < 0.4:
        height = rng.choice((height, *_SIDES))
    if rng.random() < 0.6:
        bits = rng.choice((0, 1, 2, 3, 4, 8, 16, 32, 255))
        colour = rng.choice((0, 1, 2, 3, 4, 5, 6, 7, 255))
    rest[2] = rng.choice((0, 0, 1, 2))
    return struct.pack(">IIBBBBB", width, height, bits, colour, *rest)


def _png_pixels(body: bytes, rng: Random) -> bytes:
    lot = rng.random()
    if lot < 0.1:
        return bomb(rng.choice((1 << 20, 1 << 26)))
    if lot < 0.5:
        return mutate_bytes(body, rng)
    try:
        raw = zlib.decompress(body)
    except zlib.error:
        return body
    return zlib.compress(mutate_bytes(raw, rng), 1)


def _png_extra(rng: Random) -> tuple[bytes, bytes]:
    kind = rng.choice((b"PLTE", b"tRNS", b"gAMA", b"cHRM", b"iCCP", b"zTXt", b"tEXt", b"iTXt", b"pHYs", b"sRGB",
    b"eXIf", b"acTL",
                       b"fcTL", b"fdAT", b"bKGD", b"IEND", b"IHDR", b"IDAT", b"\0\0\0\0", b"aaaa"))  # fmt: skip
    body = rng.choice(
        (b"", b"\0", b"icc\0\0" + bomb(1 << 22), b"k\0\0" + bomb(1 << 22), rng.randbytes(rng.randrange(30)))
    )
    return kind, body


def mutate_npy(data: bytes, rng: Random) -> bytes:
    """An .npy with another header, or broken bytes."""
    if rng.random() < 0.4 or len(data) < 12:
        return mutate_bytes(data, rng)
    (size,) = struct.unpack_from("<H", data, 8)
    header, body = data[10 : 10 + size], data[10 + size :]
    if rng.random() < 0.3:
        header = mutate_text(header, rng)[:60_000]
    else:
        kind = rng.choice(
            ("<f4", "<f8", "<u2", ">u2", "|u1", "|O", "<U8", "|V4", "<c16", "|b1", "<M8[s]", "<i8", "x", "<f2", "|S0")
        )
        sides = [
            rng.choice((0, 1, 2, 12, 16, -1, 10**6, 10**9, 10**12, 1 << 62, 1 << 70))
            for _ in range(rng.choice((0, 1, 2, 2, 3, 40)))
        ]
        shape = rng.choice((str(tuple(sides)), str(sides), "7", "None", "(" * 300 + ")" * 300, "(1e3,)", "('a',)"))
        order = rng.choice(("False", "True", "1"))
        header = f"{{'descr': '{kind}', 'fortran_order': {order}, 'shape': {shape}, }}\n".encode()
    return data[:8] + struct.pack("<H", len(header)) + header + body


def npy_of(kind: str, shape: tuple[int, ...], body: bytes) -> bytes:
    """An .npy as its header says, whatever the body holds."""
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\0" + struct.pack("<H", len(header)) + header + body


def mutate_npz(data: bytes, rng: Random) -> bytes:
    """A zip of other arrays, with other names, packed far too well, or broken bytes."""
    if rng.random() < 0.4:
        return mutate_bytes(data, rng)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for known in old.namelist():
            name, body, lot = known, old.read(known), rng.random()
            if lot < 0.1:
                continue
            if lot < 0.2:
                name = rng.choice(
                    ("../../etc/passwd", "/etc/passwd", "a", "face_share", "image_share", "image_share.npy")
                )
            elif lot < 0.25:
                size = rng.choice((1 << 20, 1 << 26))
                body = npy_of("<f4", rng.choice(((size // 4,), (size // 4 * 1000,), (1024, size // 4096))), bytes(size))
            elif lot < 0.8:
                body = mutate_npy(body, rng)
            new.writestr(name, body)
    return out.getvalue()


def mutate_gltf(data: bytes, rng: Random) -> bytes:
    """A glTF's JSON; the lists of nodes may become a net that doubles and doubles again."""
    if rng.random() < 0.08:
        header = json.loads(data)
        count = rng.choice((3, 30))
        header["nodes"] = [{"children": [k + 1] * 10} for k in range(count)] + [{"mesh": 0}]
        return as_json(header)
    return mutate_json(data, rng)


def mutate_glb(data: bytes, rng: Random) -> bytes:
    """A GLB with another header in JSON, other chunks, or broken bytes."""
    if rng.random() < 0.25:
        return mutate_bytes(data, rng)
    (size,) = struct.unpack_from("<I", data, 12)
    text, rest = data[20 : 20 + size], data[20 + size :]
    lot = rng.random()
    if lot < 0.8:
        text = mutate_gltf(text, rng)
    elif lot < 0.9:
        rest = mutate_bytes(rest, rng)
    else:
        return data[: 8 + 4 * rng.randrange(4)] + extreme(rng) + data[12:]
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + rest
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def mutate_ply(data: bytes, rng: Random) -> bytes:
    """A PLY whose header promises something else, or whose body is broken."""
    end = data.find(b"end_header") + len("end_header\n")
    head, body = data[:end], data[end:]
    if rng.random() < 0.6:
        return mutate_text(head, rng) + body
    is_text = b"ascii" in head
    return head + (mutate_text if is_text else mutate_bytes)(body, rng)


_SQL = (
    "UPDATE messages SET data = ?", "UPDATE messages SET timestamp = ?", "UPDATE messages SET topic_id = ?",
    "UPDATE topics SET name = ?", "UPDATE topics SET type = ?", "UPDATE topics SET serialization_format = ?",
)  # fmt: skip
_CELLS = (
    None,
    0,
    -1,
    1.5,
    "x",
    b"\0\1",
    b"",
    1 << 62,
    -(1 << 62),
    "a\0b",
    "/nodes",
    "sensor_msgs/msg/Image",
    float("inf"),
)
_SCHEMES = (
    "DROP TABLE messages", "DROP TABLE topics", "ALTER TABLE messages RENAME COLUMN data TO x",
    "UPDATE messages SET data = zeroblob(50000000)",
)  # fmt: skip


def mutate_db3(data: bytes, rng: Random, scratch: Path) -> bytes:
    """An sqlite3 bag with other cells, other messages, another scheme, or broken bytes."""
    if rng.random() < 0.35:
        return mutate_bytes(data, rng)
    file = scratch / "mutated.db3"
    file.write_bytes(data)
    base = sqlite3.connect(file)
    try:
        base.executescript("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF")
        lot = rng.random()
        if lot < 0.5:
            rows = base.execute("SELECT rowid, data FROM messages").fetchall()
            for number, body in rng.sample(rows, min(len(rows), rng.choice((1, 1, 3)))):
                base.execute("UPDATE messages SET data = ? WHERE rowid = ?", (mutate_bytes(body, rng), number))
        elif lot < 0.9:
            where = "" if rng.random() < 0.3 else f" WHERE rowid = {rng.randrange(1, 8)}"
            base.execute(rng.choice(_SQL) + where, (rng.choice(_CELLS),))
        else:
            base.executescript(rng.choice(_SCHEMES))
        base.commit()
    except sqlite3.Error:
        base.rollback()
    finally:
        base.close()
    return file.read_bytes()


def by_suffix(name: str) -> Callable[[bytes, Random], bytes]:
    """The mutator of a file by the ending of its name; text where there is none of its own."""
    from qa.fuzzing.bags import mutate_bag, mutate_mcap
    from qa.fuzzing.documents import mutate_yaml

    known: dict[str, Callable[[bytes, Random], bytes]] = {
        ".yaml": mutate_yaml, ".json": mutate_json, ".gltf": mutate_gltf, ".glb": mutate_glb, ".png": mutate_png,
        ".npy": mutate_npy, ".npz": mutate_npz, ".ply": mutate_ply, ".stl": mutate_bytes, ".bin": mutate_bytes,
        ".bag": mutate_bag, ".mcap": mutate_mcap,
    }  # fmt: skip
    return known.get(Path(name).suffix, mutate_text)


__all__ = ["bomb", "by_suffix", "mutate_db3", "mutate_document", "npy_of", "png_chunks", "png_of"]
