"""OBJ files.

Not by trimesh: of a file without its .mtl, trimesh 5.2 loses the ``usemtl`` names; it counts negative indices from the
end of the file rather than from their line, takes index 0 for 1, and misreads polygons that follow ``f 1//1`` lines.
"""

import codecs
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.scenefile.polygons import triangulate
from depthsim.scenefile.raw import RawMesh


def read_obj(path: Path, data: bytes) -> RawMesh:
    """Vertices, faces and the ``usemtl`` name of each face, in the order of the file.

    Everything else (normals, texture coordinates, lines, points, groups, the .mtl) is left out.
    """
    positions: list[float] = []
    counts: list[int] = []
    corners: list[int] = []
    face_names: list[int] = []
    face_lines: list[int] = []
    names: dict[str, int] = {}
    name = -1
    number = 0
    try:
        for number, line in enumerate(_lines(data), 1):
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                _, x, y, z, *_ = words
                positions += (float(x), float(y), float(z))
            elif words[0] == "f":
                if "#" in line:
                    words = line.partition("#")[0].split()
                indices = [int(word.partition("/")[0]) for word in words[1:]]
                if indices and min(indices) < 0:
                    end = len(positions) // 3
                    indices = [index + end + 1 if index < 0 else index for index in indices]
                if name < 0:
                    name = names.setdefault("", len(names))
                counts.append(len(indices))
                corners += indices
                face_names.append(name)
                face_lines.append(number)
            elif words[0] == "usemtl":
                name = names.setdefault(line.strip()[len("usemtl") :].strip(), len(names))
    except ValueError:
        raise InputError(
            path, f"line {number}", f"cannot be read: {line.strip()[:60]!r}", "correct that line"
        ) from None
    vertices = np.array(positions).reshape(-1, 3)
    flat, count = np.array(corners, dtype=np.int64) - 1, np.array(counts, dtype=np.int64)
    if len(wrong := np.flatnonzero((flat < 0) | (flat >= len(vertices)))):
        face = int(np.searchsorted(np.cumsum(count), wrong[0], side="right"))
        problem = f"uses vertex {flat[wrong[0]] + 1}, and there are {len(vertices)}"
        raise InputError(path, f"line {face_lines[face]}", problem, "correct the face, or export the mesh again")
    faces, polygon = triangulate(vertices, count, flat)
    return RawMesh(vertices, faces, tuple(names), np.array(face_names, dtype=np.int64)[polygon])


def _lines(data: bytes) -> list[str]:
    """The lines of the file, those continued by a backslash joined to one (and empty ones left for the rest)."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if "\\\n" in text or "\\\r" in text:
        for i in range(len(lines) - 2, -1, -1):
            if lines[i].endswith("\\"):
                lines[i], lines[i + 1] = lines[i][:-1] + " " + lines[i + 1], ""
    return lines
