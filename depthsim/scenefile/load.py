"""Scenes from anywhere: :func:`load_scene`."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.look import Look, joined
from depthsim.materials import Materials, load_materials
from depthsim.scene import NO_TAG, Scene
from depthsim.scenefile.parts import Parts, read_parts
from depthsim.scenefile.tagging import check_maps, tag_of, unknown_names


def load_scene(
    scene: str | Path | Scene,
    *,
    tags: Mapping[str, str] | None = None,
    units: str | None = None,
    up: str | None = None,
    materials: str | Path | Materials | None = None,
) -> Scene:
    """A scene in metres, z up, every face with a tag of ``materials``.

    scene: the name of a built-in scene, or the path of a scene file (YAML), of a mesh (OBJ, GLB, glTF, PLY, STL, OFF)
    or of a run folder with a scene in it. A :class:`Scene` stays as it is, whatever else is said.
    tags: tags by material name, before those of the scene file; ``*`` stands for every other name.
    units: of the mesh files: m, cm, mm, in or ft. up: the axis that points up in them, z or y.
    materials: the ones that come with depthsim, if not given.

    The same files give the same arrays. Raises :class:`depthsim.errors.InputError`.
    """
    if isinstance(scene, Scene):
        return scene
    tags, materials = tags or {}, load_materials(materials)
    found = read_parts(scene, units, up)
    check_maps(found, tags, materials)
    tag_by_part, unknown = [], Counter[str]()
    for part in found.parts:
        counts = np.bincount(part.mesh.face_names, minlength=len(part.mesh.names))
        own = [tag_of(name, part, found, tags, materials) for name in part.mesh.names]
        unknown += Counter({n: int(c) for n, c, tag in zip(part.mesh.names, counts, own, strict=True) if tag is None})
        tag_by_part.append([tag if count else None for tag, count in zip(own, counts, strict=True)])
    if unknown:
        raise unknown_names(found, unknown, materials)
    in_use = sorted({tag for part_tags in tag_by_part for tag in part_tags if tag is not None})
    if len(in_use) > NO_TAG:
        raise InputError(found.source, "", f"uses {len(in_use)} tags, at most {NO_TAG} fit", "map some to one tag")
    index = {tag: i for i, tag in enumerate(in_use)}
    face_tags = [
        np.array([index.get(tag or "", 0) for tag in own], dtype=np.uint8)[part.mesh.face_names]
        for part, own in zip(found.parts, tag_by_part, strict=True)
    ]
    return Scene(
        name=found.name,
        vertices=found.vertices,
        faces=found.faces.astype(np.uint32),
        face_tags=np.concatenate(face_tags),
        tags=tuple(in_use),
        trajectories=found.trajectories,
        source=found.source,
        look=_look(found),
        movers=found.movers,
        instances=found.instances,
    )


def _look(found: Parts) -> Look | None:
    """The colours of all parts. Each that moves has textures of its own, and so has what stands, as they are saved."""
    looks, counts = [part.mesh.look for part in found.parts], [len(part.mesh.faces) for part in found.parts]
    if not found.travels:
        return joined(looks, counts)
    standing = len(looks) - len(found.travels)
    rest = joined(looks[:standing], counts[:standing])
    every = [None if look is None else look.compact() for look in (rest, *looks[standing:])]
    return joined(every, [sum(counts[:standing]), *counts[standing:]])
