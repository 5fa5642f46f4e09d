"""What a scene holds and what may be wrong with it: :func:`inspect_scene`."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.materials import Materials, load_materials
from depthsim.scenefile.hints import origin_hint, size_hint, up_hint
from depthsim.scenefile.locate import SCENE_SUFFIXES
from depthsim.scenefile.parts import read_parts
from depthsim.scenefile.tagging import check_maps, shown, tag_of
from depthsim.scenefile.topology import Topology, topology


@dataclass(frozen=True)
class NameReport:
    """The faces of one mesh that have the same material name."""

    name: str
    tag: str | None
    """the tag that the name leads to, None if there is none"""
    faces: int
    area: float
    """[m²]"""


@dataclass(frozen=True)
class MeshReport:
    """One mesh of the scene."""

    label: str
    names: tuple[NameReport, ...]
    faces: int
    zero_area: int
    """faces without area, left out"""
    read_as: str
    """the units and the up axis that its file was read with"""
    topology: Topology


@dataclass(frozen=True)
class SceneReport:
    """All that :func:`inspect_scene` finds."""

    name: str
    source: Path
    vertices: int
    faces: int
    bounds: NDArray[np.float64]
    """(2, 3): the lowest and the highest corner [m], z up"""
    meshes: tuple[MeshReport, ...]
    trajectories: tuple[str, ...]
    tags: tuple[str, ...]
    """the tags that there are to choose from"""
    hints: tuple[str, ...]

    @property
    def unmapped(self) -> tuple[str, ...]:
        """The material names that lead to no tag."""
        names = {name.name: None for mesh in self.meshes for name in mesh.names if name.tag is None}
        return tuple(names)

    @property
    def tag_guesses(self) -> dict[str, str]:
        """A tag for every material name without one, to be corrected; of very many names, one for ``*``."""
        names = [shown(name) for name in self.unmapped]
        names = names if len(names) <= 12 else [*names[:11], "*"]
        return {name: self._guess(name) for name in names}

    def _guess(self, name: str) -> str:
        likely = [tag for tag in self.tags if tag in name.lower()]
        return (likely or [tag for tag in self.tags if tag == "plastic"] or list(self.tags))[0]


def inspect_scene(
    scene: str | Path,
    *,
    tags: Mapping[str, str] | None = None,
    units: str | None = None,
    up: str | None = None,
    materials: Materials | None = None,
) -> SceneReport:
    """What a scene holds: names, tags, areas, size, holes, flipped faces, trajectories.

    The arguments are those of :func:`depthsim.scenefile.load_scene`; unlike it, this reports names without a tag rather
    than to fail on them. Raises :class:`depthsim.errors.InputError` for what cannot be read.
    """
    tags, materials = tags or {}, materials or load_materials()
    found = read_parts(scene, units, up)
    check_maps(found, tags, materials)
    meshes = []
    for part in found.parts:
        mesh = part.mesh
        area = np.bincount(mesh.face_names, mesh.areas, minlength=len(mesh.names))
        count = np.bincount(mesh.face_names, minlength=len(mesh.names))
        names = tuple(
            NameReport(name, tag_of(name, part, found, tags, materials), int(n), float(a))
            for name, n, a in zip(mesh.names, count, area, strict=True)
            if n
        )
        names = tuple(sorted(names, key=lambda entry: (-entry.area, entry.name)))
        surface = topology(mesh.vertices, mesh.faces)
        meshes.append(MeshReport(part.label, names, len(mesh.faces), mesh.zero_area, part.read_as, surface))
    vertices, faces = found.vertices, found.faces
    bounds = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    up_is_known = up is not None or found.source.suffix.lower() in (*SCENE_SUFFIXES, ".glb", ".gltf")
    hints = (size_hint(bounds), origin_hint(bounds), None if up_is_known else up_hint(vertices, faces))
    return SceneReport(
        name=found.name,
        source=found.source,
        vertices=len(vertices),
        faces=len(faces),
        bounds=bounds,
        meshes=tuple(meshes),
        trajectories=tuple(found.trajectories),
        tags=tuple(materials.tags),
        hints=tuple(hint for hint in hints if hint),
    )
