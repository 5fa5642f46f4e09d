"""The meshes of a scene, placed in the world, with their material names still as the files have them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.scenefile.locate import SCENE_SUFFIXES, find_scene
from depthsim.scenefile.mesh import Mesh, clean, read_mesh, transformed, up_of
from depthsim.scenefile.raw import RawMesh
from depthsim.scenefile.spec import METRES, Axis, MeshEntry, read_scene_file
from depthsim.yamlfile import beside

LARGEST, SMALLEST = 1e6, 1e-4
"""The width that a scene may have [m]."""

MOST_REPEATED = 5_000_000
"""Faces that a scene file may have without a mesh file as large: a line a mesh could otherwise fill any memory.

Those of builders count three times, because they take time to build.
"""
_BUILT = 3

_TO_Z_UP = {"z": np.eye(3), "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])}


@dataclass(frozen=True)
class Part:
    """One mesh in the world frame: metres, z up."""

    label: str
    """its file or builder, for people"""
    place: str
    """its key in the scene file, such as ``meshes.2``; empty for a mesh file on its own"""
    mesh: Mesh
    tags: Mapping[str, str]
    """the tag map of this mesh alone"""
    read_as: str
    """the units and the up axis that its file was read with"""


@dataclass(frozen=True)
class Parts:
    """All meshes of a scene, and what the scene file says beside them."""

    name: str
    source: Path
    parts: tuple[Part, ...]
    tags: Mapping[str, str]
    trajectories: dict[str, dict[str, Any]]

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        """(V, 3) the vertices of all meshes, one mesh after another [m]."""
        return np.concatenate([part.mesh.vertices for part in self.parts])

    @cached_property
    def faces(self) -> NDArray[np.int64]:
        """(F, 3) the faces of all meshes, indices into ``vertices``."""
        counts = [len(part.mesh.vertices) for part in self.parts]
        offsets = np.cumsum(counts) - counts
        return np.concatenate([part.mesh.faces + offset for part, offset in zip(self.parts, offsets, strict=True)])


def read_parts(scene: str | Path, units: str | None = None, up: str | None = None) -> Parts:
    """The meshes of a scene file, of a mesh file, of a run folder or of a built-in scene.

    ``units`` and ``up`` go before those of the scene file; they are of mesh files, since builders make metres, z up.
    Raises :class:`InputError` for whatever cannot be read, and for a scene of no plausible size.
    """
    path = find_scene(scene)
    if units is not None and units not in METRES:
        raise InputError(path, f"`units` {units}", "no such unit", "the units are " + ", ".join(METRES))
    if up is not None and up not in get_args(Axis):
        raise InputError(path, f"`up` {up}", "no such axis", "the axes are " + ", ".join(get_args(Axis)))
    if path.suffix.lower() in SCENE_SUFFIXES:
        parts = _of_scene_file(path, units, up)
    else:
        unit, axis = units or "m", up or up_of(path)
        part = Part(path.name, "", _upright(read_mesh(path), unit, axis), {}, f"{unit}, {axis} up")
        parts = Parts(path.stem if path.stem != "scene" else path.resolve().parent.name, path, (part,), {}, {})
    width = float(np.ptp(parts.vertices, axis=0).max())
    if not SMALLEST <= width <= LARGEST:
        fix = "give the units of its meshes by `units` or `units:` (" + ", ".join(METRES) + "), or a `scale:`"
        raise InputError(path, "", f"the scene is {width:.3g} m wide", fix)
    return parts


def _of_scene_file(path: Path, units: str | None, up: str | None) -> Parts:
    spec, entries = read_scene_file(path)
    parts = []
    known: dict[str, Mesh] = {}
    more = 0
    for i, entry in enumerate(entries):
        place = f"meshes.{i}"
        key = entry.file or f"{entry.build} {sorted(entry.parameters.items())}"
        weight = _BUILT if entry.build is not None else int(key in known)
        if entry.file is not None:
            file = beside(path, entry.file, f"{place}.file")
            if not file.is_file():
                raise InputError(path, f"{place}.file", f"no such file: {entry.file}", "correct its name")
            mesh = known[key] = known.get(key) or read_mesh(file)
            unit, axis = units or entry.units or spec.units or "m", up or entry.up or spec.up or up_of(file)
        else:
            mesh = known[key] = known.get(key) or _built(path, place, entry)
            unit, axis = entry.units or "m", entry.up or "z"
        more += len(mesh.faces) * weight
        if more > MOST_REPEATED:
            problem = f"the meshes placed again have over {MOST_REPEATED:,} faces, those of builders counted threefold"
            raise InputError(path, place, problem, "place fewer of them")
        placed = transformed(_upright(mesh, unit, axis), *_placement(entry))
        parts.append(Part(entry.file or entry.build or "", place, placed, entry.tags, f"{unit}, {axis} up"))
    return Parts(spec.name or path.stem, path, tuple(parts), spec.tags, spec.trajectories)


def _built(path: Path, place: str, entry: MeshEntry) -> Mesh:
    """What a builder makes."""
    from depthsim import procedural

    try:
        part = procedural.build(entry.build or "", **entry.parameters)
    except (ValueError, TypeError) as error:
        problem, _, fix = str(error).partition("; ")
        raise InputError(path, place, problem, fix or "correct `build` or `parameters`") from None
    raw = RawMesh(
        np.asarray(part.vertices, dtype=np.float64),
        np.asarray(part.faces, dtype=np.int64),
        tuple(part.tags),
        np.asarray(part.face_tags, dtype=np.int64),
    )
    return clean(raw, path, place)


def _upright(mesh: Mesh, unit: str, axis: str) -> Mesh:
    """The mesh in metres, z up."""
    if unit == "m" and axis == "z":
        return mesh
    return transformed(mesh, METRES[unit] * _TO_Z_UP[axis], np.zeros(3))


def _placement(entry: MeshEntry) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation times scale, (3, 3), and the translation, (3,) [m]: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.deg2rad(entry.rotate)), np.sin(np.deg2rad(entry.rotate))
    roll = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    pitch = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    yaw = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return yaw @ pitch @ roll @ np.diag(entry.scale), np.array(entry.translate)
