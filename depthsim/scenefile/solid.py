"""STL and OFF files: shapes without materials, read by trimesh."""

from io import BytesIO
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.scenefile.raw import RawMesh


def read_solid(path: Path, data: bytes) -> RawMesh:
    """Vertices and faces; no face has a material."""
    import trimesh

    if path.suffix.lower() == ".stl" and _is_cut_off(data):
        raise InputError(path, "", "is shorter than its header says, as if cut off", "export or copy the file again")
    scene = trimesh.load_scene(BytesIO(data), file_type=path.suffix[1:].lower(), process=False)
    parts = [part for part in scene.geometry.values() if isinstance(part, trimesh.Trimesh)]
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([np.zeros((0, 3)), *(part.vertices for part in parts)])
    faces = [part.faces + offset for part, offset in zip(parts, offsets, strict=False)]
    joined = np.concatenate([np.zeros((0, 3), dtype=np.int64), *faces])
    return RawMesh(vertices, joined, ("",), np.zeros(len(joined), dtype=np.int64))


def _is_cut_off(data: bytes) -> bool:
    """Whether an STL lacks what follows; trimesh takes it for an empty one. Binary files may start with "solid" too."""
    text = data.lower() if data[:5].lower() == b"solid" else b""
    if b"facet" in text or b"endsolid" in text:
        return b"endsolid" not in text
    return len(data) != 84 + 50 * int.from_bytes(data[80:84], "little")
