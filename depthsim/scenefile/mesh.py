"""One mesh from a file: triangles with the material name each, as the file has them."""

import logging
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.scenefile import gltf, obj, ply, solid
from depthsim.scenefile.raw import RawMesh, wound_outwards

# Below the command line nothing prints, not even what trimesh has to say.
logging.getLogger("trimesh").addHandler(logging.NullHandler())

_READERS: dict[str, Callable[[Path, bytes], RawMesh]] = {
    ".obj": obj.read_obj,
    ".glb": gltf.read_gltf,
    ".gltf": gltf.read_gltf,
    ".ply": ply.read_ply,
    ".stl": solid.read_solid,
    ".off": solid.read_solid,
}
SUFFIXES = tuple(_READERS)
"""The file name endings of the meshes that can be read."""

SLIVER = 1e-10
"""A face has no area where its height is below this share of its longest edge."""


@dataclass(frozen=True)
class Mesh(RawMesh):
    """A mesh whose vertices are finite and all in use, and whose faces have an area."""

    zero_area: int = 0
    """how many faces without area were dropped"""


def up_of(path: Path) -> str:
    """The axis that points up in a file of this kind: y for glTF (by its specification), z for all others."""
    return "y" if path.suffix.lower() in (".glb", ".gltf") else "z"


def read_mesh(path: Path) -> Mesh:
    """The triangles of an OBJ, GLB, glTF, PLY, STL or OFF file, in its own units and axes.

    Raises :class:`InputError` for whatever keeps it from being a mesh: see :func:`clean`.
    """
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(path, "", f"is of no known kind ({path.suffix or 'no ending'})", f"give {_kinds()}")
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise InputError(path, "", "no such file", f"give the path of {_kinds()}") from None
    except OSError as error:
        raise InputError(
            path, "", (error.strerror or str(error)).lower(), f"give {_kinds()} that can be read"
        ) from None
    if not data.strip():
        raise InputError(path, "", "is empty", "export the mesh again")
    if data.startswith(b"version https://git-lfs"):
        raise InputError(path, "", "is a Git LFS pointer, not the mesh itself", "get the mesh by `git lfs pull`")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            raw = reader(path, data)
    except InputError:
        raise
    except Exception as error:  # whatever a parser throws on garbage
        reason = str(error).strip().split("\n")[0][:100] or "no reason given"
        problem = f"is not a readable {path.suffix[1:].upper()} file ({type(error).__name__}: {reason})"
        raise InputError(path, "", problem, "export it again, or as another of " + ", ".join(SUFFIXES)) from None
    return clean(raw, path)


def clean(raw: RawMesh, path: Path, place: str = "") -> Mesh:
    """The mesh without faces that have no area and without vertices that no face uses.

    Raises :class:`InputError` where there is no face, an index is out of range, a vertex that a face uses is not
    finite, or no face has an area.
    """
    vertices, faces = raw.vertices, raw.faces
    if not len(faces):
        raise InputError(path, place, "has no faces", "export triangles, not points, lines or curves")
    if len(wrong := np.argwhere((faces < 0) | (faces >= len(vertices)))):
        problem = f"uses vertex {faces[tuple(wrong[0])] + 1}, and there are {len(vertices)}"
        raise InputError(path, f"{place} face {wrong[0][0] + 1}".strip(), problem, "export the mesh again")
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    if len(infinite := np.flatnonzero(~np.isfinite(vertices).all(axis=1) & used)):
        bad = int(infinite[0])
        others = f", as are {len(infinite) - 1} others" if len(infinite) > 1 else ""
        problem = f"is not finite ({' '.join(str(x) for x in vertices[bad])}){others}"
        raise InputError(path, f"{place} vertex {bad + 1}".strip(), problem, "correct or remove it and the faces on it")
    kept = _has_area(vertices, faces)
    if not kept.any():
        raise InputError(path, place, f"not one of its {len(faces)} faces has an area", "export the mesh again")
    used[:] = False
    used[faces[kept]] = True
    index = np.cumsum(used) - 1
    look = None if raw.look is None else raw.look[kept]
    return Mesh(vertices[used], index[faces[kept]], raw.names, raw.face_names[kept], look, int((~kept).sum()))


def _has_area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(F,) whether a face is more than a point or a line."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    edges = np.stack([b - a, c - b, a - c])
    longest = np.einsum("efi,efi->ef", edges, edges).max(axis=0)
    return np.asarray(np.linalg.norm(np.cross(edges[0], edges[2]), axis=1) > SLIVER * longest)


def transformed(mesh: Mesh, matrix: NDArray[np.float64], offset: NDArray[np.float64]) -> Mesh:
    """The mesh with every vertex x at ``matrix @ x + offset``; a mirroring matrix turns the winding back."""
    faces, look = wound_outwards(mesh.faces, matrix), mesh.look
    if look is not None and np.linalg.det(matrix) < 0:
        look = look.turned_over()
    return replace(mesh, vertices=mesh.vertices @ matrix.T + offset, faces=faces, look=look)


def _kinds() -> str:
    return "a mesh (" + ", ".join(SUFFIXES) + ")"
