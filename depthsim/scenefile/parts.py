"""The meshes of a scene, placed in the world, with their material names still as the files have them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.moving import NAME, Instance, Mover
from depthsim.scenefile.locate import SCENE_SUFFIXES, find_scene
from depthsim.scenefile.mesh import Mesh, clean, read_mesh, transformed, up_of
from depthsim.scenefile.moves import Moves, check_names, family, read_moves
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
    instances: tuple[Instance, ...] = ()
    """the objects in it"""


@dataclass(frozen=True)
class Travel:
    """A part that moves: its place among the parts, and that of the mover it goes along with among the movers."""

    part: int
    moves: Moves | None
    parent: int | None


@dataclass(frozen=True)
class Parts:
    """All meshes of a scene, and what the scene file says beside them. What moves comes last, parents first."""

    name: str
    source: Path
    parts: tuple[Part, ...]
    tags: Mapping[str, str]
    trajectories: dict[str, dict[str, Any]]
    travels: tuple[Travel, ...] = ()

    @property
    def instances(self) -> tuple[Instance, ...]:
        """The objects of all parts; none where the scene is one mesh without a name."""
        return tuple(instance for part in self.parts for instance in part.instances)

    @property
    def movers(self) -> tuple[Mover, ...]:
        """What moves, with its places in ``vertices`` and ``faces``."""
        ends = np.cumsum([(len(part.mesh.vertices), len(part.mesh.faces)) for part in self.parts], axis=0)
        found = []
        for travel in self.travels:
            part, moves = self.parts[travel.part], travel.moves
            vertices, faces = (int(end) for end in ends[travel.part])
            own = (vertices - len(part.mesh.vertices), vertices), (faces - len(part.mesh.faces), faces)
            name = part.instances[0].name
            if moves is None:
                found.append(Mover(name, own[1], own[0], parent=travel.parent))
            else:
                keys = (moves.path, travel.parent, moves.begin, moves.repeated, moves.spec, moves.delay)
                found.append(Mover(name, own[1], own[0], *keys))
        return tuple(found)

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
    parts, travels = _in_order(path, parts, entries)
    return Parts(spec.name or path.stem, path, tuple(parts), spec.tags, spec.trajectories, travels)


def _in_order(path: Path, parts: list[Part], entries: list[MeshEntry]) -> tuple[list[Part], tuple[Travel, ...]]:
    """The parts with their objects, what stands before what moves."""
    check_names([entry.name for entry in entries], path)
    if len(entries) == 1 and entries[0].name is None and entries[0].parts is None and entries[0].moves is None:
        return parts, ()
    names = _names(parts, entries)
    moves = [
        None if entry.moves is None else read_moves(entry.moves, path, f"meshes.{i}.moves")
        for i, entry in enumerate(entries)
    ]
    parents = family(names, [entry.parent for entry in entries], [one is not None for one in moves], path)
    parts = [
        replace(part, instances=_instances(path, part, name, entry))
        for part, name, entry in zip(parts, names, entries, strict=True)
    ]
    going = [i for i in range(len(parts)) if moves[i] is not None or parents[i] is not None]
    going.sort(key=lambda i: _depth(i, parents))
    standing = [i for i in range(len(parts)) if i not in going]
    if not standing:
        raise InputError(path, "meshes", "everything moves", "leave one mesh without `moves`, such as the ground")
    order = [*standing, *going]
    travels = tuple(
        Travel(order.index(i), moves[i], None if (p := parents[i]) is None else going.index(p)) for i in going
    )
    return [parts[i] for i in order], travels


def _depth(number: int, parents: list[int | None]) -> int:
    """How many ancestors that move a mesh has."""
    parent = parents[number]
    return 0 if parent is None else 1 + _depth(parent, parents)


def _names(parts: list[Part], entries: list[MeshEntry]) -> list[str]:
    """A name for every mesh: its own, or one of its file or builder that no other has."""
    taken = {entry.name for entry in entries if entry.name is not None}
    names = []
    for part, entry in zip(parts, entries, strict=True):
        stem = "".join(c if NAME.fullmatch(c) else "_" for c in Path(part.label).stem)[:56] or "mesh"
        turns = (stem if turn == 1 else f"{stem}_{turn}" for turn in count(1))
        name = entry.name or next(turn for turn in turns if turn not in taken)
        taken.add(name)
        names.append(name)
    return names


def _instances(path: Path, part: Part, name: str, entry: MeshEntry) -> tuple[Instance, ...]:
    if entry.parts is None:
        return (Instance(name, len(part.mesh.faces)),)
    if entry.moves is not None:
        raise InputError(path, f"{part.place}.parts", "is given of a mesh that moves", "leave it out: it is one object")
    total = sum(faces for _, faces in entry.parts)
    if total != len(part.mesh.faces) or min(faces for _, faces in entry.parts) < 0:
        problem = f"counts {total} faces of {len(part.mesh.faces)}"
        raise InputError(path, f"{part.place}.parts", problem, "correct the numbers, or leave `parts` out")
    return tuple(Instance(one, faces) for one, faces in entry.parts)


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
