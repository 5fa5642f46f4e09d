"""PLY files.

Not by trimesh: it keeps no per-face property through the triangulation, refuses binary files that mix triangles with
quads, and takes a file that was cut off for a smaller mesh.
"""

import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.look import PLAIN, PROCEDURAL, Look, Texture
from depthsim.scenefile.polygons import triangulate
from depthsim.scenefile.raw import RawMesh

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip

_Column = tuple[NDArray, NDArray]
"""Of one property: how many values each row has, and all values in one row after another."""


@dataclass
class _Element:
    name: str
    rows: int
    types: dict[str, tuple[str, str]] = field(default_factory=dict)
    """per property the type of its values and, for a list, of its length"""


def read_ply(path: Path, data: bytes) -> RawMesh:
    """Vertices, faces (or ``tristrips``) and the per-face property ``material``, from ASCII or binary PLY.

    The material name is the integer as text, or the name that the header gives it: ``comment material 0 cement``.
    """
    order, elements, names, body = _header(path, data)
    if not order:  # numbers as text: from here on as if they were doubles in a binary file
        body = np.fromiter(map(float, body.split()), np.float64).tobytes()
        order = "="
        for element in elements:
            element.types = {key: ("f8", "f8" if count else "") for key, (_, count) in element.types.items()}
    tables: dict[str, dict[str, _Column]] = {}
    offset = 0
    for element in elements:
        tables[element.name], offset = _read(path, element, body, order, offset)
    if body[offset:].strip(b"\r\n\t \0"):
        fix = "correct its header, or write the file again"
        raise InputError(path, "", "holds more than its header says", fix)
    vertices = _positions(path, tables.get("vertex", {}))
    faces, polygon = _faces(path, tables, vertices)
    table = tables.get("face", {})
    look = _look(path, data, tables, faces, polygon)
    if "material" not in table:
        return RawMesh(vertices, faces, ("",), np.zeros(len(faces), dtype=np.int64), look)
    known, face_names = np.unique(table["material"][1].astype(np.int64)[polygon], return_inverse=True)
    labels = tuple(names.get(int(i), str(i)) for i in known)
    return RawMesh(vertices, faces, labels, face_names.astype(np.int64), look)


def _look(
    path: Path,
    data: bytes,
    tables: dict[str, dict[str, _Column]],
    faces: NDArray[np.int64],
    polygon: NDArray[np.int64],
) -> Look | None:
    """The colours of vertices, and the textures of triangles as MeshLab writes them.

    Those are ``comment TextureFile NAME`` in the header, the list ``texcoord`` of each face, and its ``texnumber``.
    Of our own are the list ``corner_colors``, RGB of each corner, and textures in the file, elements ``texture_N``.
    """
    vertex, face, look = tables.get("vertex", {}), tables.get("face", {}), Look.none(len(faces))
    texture, uv, colors = look.texture, look.uv, look.colors
    if {"red", "green", "blue"} <= vertex.keys():
        rgb = np.stack([vertex[name][1] for name in ("red", "green", "blue")], axis=1)
        texture, colors = np.full_like(texture, PLAIN), _as_bytes(rgb)[faces]
    if "corner_colors" in face and (face["corner_colors"][0] == 9).all():
        colors = _as_bytes(face["corner_colors"][1].reshape(-1, 9))[polygon].reshape(-1, 3, 3)
    head = data[: data.find(b"end_header")].decode("utf-8", "replace")
    names = [line.split(maxsplit=2)[2].strip() for line in head.splitlines() if line.startswith("comment TextureFile ")]
    textures = [Texture(path, f"texture {k}", name) for k, name in enumerate(names)]
    for k in range(len(tables)):
        if "png" in (table := tables.get(f"texture_{k}", {})):
            textures.append(Texture(path, f"texture {k}", data=table["png"][1].astype(np.uint8).tobytes()))
    if "texcoord" in face and (face["texcoord"][0] == 6).all() and len(polygon) == len(face["texcoord"][0]):
        uv = face["texcoord"][1].astype(np.float32).reshape(-1, 3, 2)[polygon]
        number = face["texnumber"][1][polygon] if "texnumber" in face else np.zeros(len(faces))
        plain = np.where((number == PLAIN) | (texture == PLAIN), PLAIN, PROCEDURAL)
        texture = np.where((number >= 0) & (number < len(textures)), number, plain).astype(np.int32)
    return None if (texture == PROCEDURAL).all() else Look(texture, uv, colors, tuple(textures))


def _as_bytes(colors: NDArray) -> NDArray[np.uint8]:
    """Colours as bytes; those that are no whole numbers are from 0 to 1."""
    whole = np.issubdtype(colors.dtype, np.integer) or colors.max(initial=0) > 1
    return np.clip(np.rint(colors * (1 if whole else 255)), 0, 255).astype(np.uint8)


def _positions(path: Path, table: dict[str, _Column]) -> NDArray[np.float64]:
    """(V, 3), none if there are no vertices."""
    if not table:
        return np.zeros((0, 3))
    if not {"x", "y", "z"} <= table.keys():
        raise InputError(path, "element vertex", "lacks x, y or z", "write the file again")
    return np.stack([table[axis][1] for axis in "xyz"], axis=1).astype(np.float64)


def _faces(
    path: Path, tables: dict[str, dict[str, _Column]], vertices: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(F, 3) triangles and (F,) the row that each is of."""
    table = tables.get("face") or tables.get("tristrips") or {}
    lists = [key for key in ("vertex_indices", "vertex_index") if key in table]
    if not lists:
        return np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    counts, corners = (column.astype(np.int64) for column in table[lists[0]])
    if not tables.get("face"):
        counts, corners = _strips_apart(counts, corners)
    if len(wrong := np.flatnonzero((corners < 0) | (corners >= len(vertices)))):
        face = int(np.searchsorted(np.cumsum(counts), wrong[0], side="right")) + 1
        problem = f"uses vertex {corners[wrong[0]]} (counted from 0), and there are {len(vertices)}"
        raise InputError(path, f"face {face}", problem, "export the mesh again")
    return triangulate(vertices, counts, corners)


def _strips_apart(counts: NDArray[np.int64], corners: NDArray[np.int64]) -> tuple[NDArray, NDArray]:
    """Triangle strips, parted by rows and by -1 within a row, as triangles: every second one is wound backwards."""
    flat = np.insert(corners, np.cumsum(counts)[:-1], -1)
    at = np.arange(len(flat))
    odd = ((at - np.maximum.accumulate(np.where(flat < 0, at + 1, 0))) % 2 == 1)[:-2, None]
    three = np.stack([flat[:-2], flat[1:-1], flat[2:]], axis=1)
    faces = np.where(odd, three[:, [1, 0, 2]], three)[(three >= 0).all(axis=1)]
    return np.full(len(faces), 3), faces.reshape(-1)


def _header(path: Path, data: bytes) -> tuple[str, list[_Element], dict[int, str], bytes]:
    """The byte order ("" for text), the elements, the material names in comments, and what follows the header."""
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise InputError(path, "", "is not a PLY file", "give a file that starts with `ply` and has an `end_header`")
    newline = b"\r\n" if data[3:5] == b"\r\n" else data[3:4]
    order, elements, names = "?", [], {}
    for number, line in enumerate(data[:end].replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n"), 1):
        words = line.decode("utf-8", "replace").split()
        try:
            match words:
                case ["format", kind, *_]:
                    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[kind]
                case ["comment", "material", index, *name] if index.lstrip("-").isdigit() and name:
                    names[int(index)] = " ".join(name)
                case ["element", name, rows]:
                    elements.append(_Element(name, int(rows)))
                case ["property", "list", count, kind, key]:
                    elements[-1].types[key] = (_TYPES[kind], _TYPES[count])
                case ["property", kind, key]:
                    elements[-1].types[key] = (_TYPES[kind], "")
        except (KeyError, IndexError, ValueError):
            problem = f"cannot be read: {' '.join(words)[:60]!r}"
            raise InputError(path, f"line {number}", problem, "correct that line of the header") from None
    if order == "?":
        raise InputError(path, "", "has no `format` line", "write the file again")
    return order, elements, names, data[data.find(newline, end) + len(newline) :]


def _read(path: Path, element: _Element, body: bytes, order: str, offset: int) -> tuple[dict[str, _Column], int]:
    """The columns of an element's rows from ``offset`` on, and where they end."""
    if not element.rows:
        return {}, offset
    try:
        table = _as_table(element, body, order, offset)
        if table is not None:
            return table
        return _row_by_row(element, body, order, offset)
    except (struct.error, ValueError):
        problem = f"ends before the {element.rows} rows that its header promises"
        raise InputError(path, f"element {element.name}", problem, "write or copy the file again") from None


def _as_table(element: _Element, body: bytes, order: str, offset: int) -> tuple[dict[str, _Column], int] | None:
    """All rows at once, or None where a list is not as long in every row as in the first."""
    fields: list[tuple] = []
    at = offset
    for key, (kind, count) in element.types.items():
        length = 1
        if count:
            (length,) = np.frombuffer(body, order + count, 1, at)
            fields.append((f"length of {key}", order + count))
            at += np.dtype(count).itemsize
        fields.append((key, order + kind, (int(length),)))
        at += int(length) * np.dtype(kind).itemsize
    layout = np.dtype(fields)
    if offset + element.rows * layout.itemsize > len(body) and not any(count for _, count in element.types.values()):
        raise ValueError
    if offset + element.rows * layout.itemsize > len(body):
        return None
    rows = np.frombuffer(body, layout, element.rows, offset)
    columns = {}
    for key, (_, count) in element.types.items():
        if count and (rows[f"length of {key}"] != rows[f"length of {key}"][0]).any():
            return None
        columns[key] = (np.full(len(rows), rows[key].shape[1]), rows[key].reshape(-1))
    return columns, offset + rows.nbytes


def _row_by_row(element: _Element, body: bytes, order: str, offset: int) -> tuple[dict[str, _Column], int]:
    """Rows whose lists differ in length."""
    codes = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
    values: dict[str, list[float]] = {key: [] for key in element.types}
    lengths: dict[str, list[int]] = {key: [] for key in element.types}
    at = offset
    for _ in range(element.rows):
        for key, (kind, count) in element.types.items():
            length = 1
            if count:
                length = int(struct.unpack_from(order + codes[count], body, at)[0])
                at += struct.calcsize(order + codes[count])
            values[key] += struct.unpack_from(f"{order}{length}{codes[kind]}", body, at)
            lengths[key].append(length)
            at += length * struct.calcsize(order + codes[kind])
    return {key: (np.array(lengths[key], dtype=np.int64), np.array(values[key])) for key in element.types}, at
