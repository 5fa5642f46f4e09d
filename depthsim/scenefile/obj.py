"""OBJ files.

Not by trimesh: of a file without its .mtl, trimesh 5.2 loses the ``usemtl`` names; it counts negative indices from the
end of the file rather than from their line, takes index 0 for 1, and misreads polygons that follow ``f 1//1`` lines.
"""

import codecs
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.look import PROCEDURAL, Look, Texture
from depthsim.scenefile.polygons import triangulate
from depthsim.scenefile.raw import RawMesh
from depthsim.yamlfile import beside

_OPTIONS = re.compile(r"^(?:-[a-z]+(?:\s+(?:on|off|[-+]?[0-9.]+(?:e[-+]?[0-9]+)?))*\s+)*", re.IGNORECASE)
"""Options before the file name of a texture, such as ``-s 1 1 1``."""


def read_obj(path: Path, data: bytes) -> RawMesh:
    """Vertices, faces and the ``usemtl`` name of each face, in the order of the file.

    Of the .mtl the textures of ``map_Kd`` are taken, where it is there; everything else (normals, lines, points,
    groups, other properties of materials) is left out.
    """
    positions: list[float] = []
    counts: list[int] = []
    corners: list[int] = []
    face_names: list[int] = []
    face_lines: list[int] = []
    names: dict[str, int] = {}
    name = -1
    number = 0
    lines = _lines(data)
    textures = _textures(path, lines)
    places: list[float] = []
    place_of_corner: list[int] = []
    try:
        for number, line in enumerate(lines, 1):
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
                if textures:
                    place_of_corner += _places(words[1:], len(places) // 2)
                counts.append(len(indices))
                corners += indices
                face_names.append(name)
                face_lines.append(number)
            elif words[0] == "vt" and textures:
                places += (float(words[1]), float(words[2]) if len(words) > 2 else 0.0)
            elif words[0] == "usemtl":
                name = names.setdefault(line.strip()[len("usemtl") :].strip(), len(names))
    except (ValueError, IndexError):
        raise InputError(
            path, f"line {number}", f"cannot be read: {line.strip()[:60]!r}", "correct that line"
        ) from None
    vertices = np.array(positions).reshape(-1, 3)
    flat, count = np.array(corners, dtype=np.int64) - 1, np.array(counts, dtype=np.int64)
    if len(wrong := np.flatnonzero((flat < 0) | (flat >= len(vertices)))):
        face = int(np.searchsorted(np.cumsum(count), wrong[0], side="right"))
        problem = f"uses vertex {flat[wrong[0]] + 1}, and there are {len(vertices)}"
        raise InputError(path, f"line {face_lines[face]}", problem, "correct the face, or export the mesh again")
    if not textures:
        faces, polygon = triangulate(vertices, count, flat)
        return RawMesh(vertices, faces, tuple(names), np.array(face_names, dtype=np.int64)[polygon])
    corner, polygon = triangulate(vertices[flat], count, np.arange(len(flat)))
    face_name = np.array(face_names, dtype=np.int64)[polygon]
    look = _look(tuple(names), face_name, np.array(place_of_corner, dtype=np.int64)[corner], places, textures)
    return RawMesh(vertices, flat[corner], tuple(names), face_name, look)


def _textures(path: Path, lines: list[str]) -> dict[str, Texture]:
    """The textures by material, from the .mtl files that are there."""
    found: dict[str, Texture] = {}
    for line in lines:
        if not line.startswith("mtllib"):
            continue
        name = line[len("mtllib") :].strip().replace("\\", "/")
        try:
            file = beside(path, name, "mtllib")
            text = _lines(file.read_bytes()) if file.is_file() else []
        except (InputError, OSError):  # of the materials of a mesh their names alone are needed
            continue
        material = ""
        for number, entry in enumerate(text, 1):
            words = entry.split(maxsplit=1)
            if len(words) == 2 and words[0] == "newmtl":
                material = words[1].strip()
            elif len(words) == 2 and words[0].lower() == "map_kd" and (picture := _OPTIONS.sub("", words[1]).strip()):
                found[material] = Texture(file, f"line {number}", picture)
    return found


def _places(words: list[str], known: int) -> list[int]:
    """The texture coordinates of a face's corners, -1 for one without. known: how many there are so far."""
    parts = (word.split("/") for word in words)
    numbers = [int(part[1]) if len(part) > 1 and part[1] else 0 for part in parts]
    return [n + known if n < 0 else n - 1 for n in numbers]


def _look(
    names: tuple[str, ...],
    face_names: NDArray[np.int64],
    place: NDArray[np.int64],
    places: list[float],
    textures: dict[str, Texture],
) -> Look | None:
    """The look of faces with these texture coordinates, (F, 3) indices into ``places``."""
    known = np.array(places, np.float32).reshape(-1, 2)
    look = Look.none(len(face_names))
    own = tuple(dict.fromkeys(textures[name] for name in names if name in textures))
    of_name = np.array([own.index(textures[name]) if name in textures else PROCEDURAL for name in names], np.int32)
    has = np.all((place >= 0) & (place < len(known)), axis=1)
    texture = np.where(has, of_name[face_names], PROCEDURAL).astype(np.int32)
    if not (texture >= 0).any():
        return None
    return Look(texture, known[np.where(has[:, None], place, 0)], look.colors, own)


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
