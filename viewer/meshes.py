"""The scene's mesh in groups of one colour each, as the page draws it: by material, or by share of the gap."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.materials import Materials
from depthsim.scene import Scene
from viewer import colours

_STEPS = 24
"""Groups of faces for the shares: a colour each."""


@dataclass(frozen=True)
class Group:
    """Faces of one colour. vertices: (V, 3) float32 [m]. faces: (F, 3) uint32. colour: RGB.

    instance: of which object, by its number from 1, where there are several. mover: its place among those that move,
    in whose frame the vertices are; None for what stands.
    """

    name: str
    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]
    colour: tuple[int, int, int]
    instance: int = 0
    mover: int | None = None


def by_material(scene: Scene, materials: Materials) -> list[Group]:
    """A group for each tag, and for each object where there are several."""
    palette = colours.material_colours(scene.tags, materials)
    found = []
    for number, name, chosen in _objects(scene):
        for index, tag in enumerate(scene.tags):
            label = f"{name}/{tag}" if number else tag
            group = _group(scene, label, chosen & (scene.face_tags == index), palette[index], number)
            found += [] if group is None else [group]
    return found


def _objects(scene: Scene) -> list[tuple[int, str, NDArray[np.bool_]]]:
    """Number, name and faces of each object; number 0 where the scene is one."""
    if len(scene.objects) == 1:
        return [(0, "", np.ones(len(scene.faces), np.bool_))]
    whose = scene.instance_of_face[1:]
    return [(number, one.name, whose == number) for number, one in enumerate(scene.objects, start=1)]


def by_share(scene: Scene, share: NDArray[np.float32]) -> list[Group]:
    """Groups of faces with about the same part of the gap on a square metre. share: (faces,) of the whole gap."""
    density = share / np.maximum(scene.areas, 1e-12)
    known = density[share > 0]
    most = float(np.percentile(known, 98)) if known.size else 1.0
    place = np.clip(density / most, 0, 1)
    step = np.minimum((place * _STEPS).astype(np.int64), _STEPS - 1)
    groups = []
    for instance, name, chosen in _objects(scene):
        for number in range(_STEPS):
            colour = colours.SHARE[round(255 * number / (_STEPS - 1))]
            label = f"{name}/share{number}" if instance else f"share{number}"
            if (group := _group(scene, label, chosen & (step == number), colour, instance)) is not None:
                groups.append(group)
    return groups


def _group(
    scene: Scene, name: str, chosen: NDArray[np.bool_], colour: NDArray[np.uint8], instance: int
) -> Group | None:
    if not chosen.any():
        return None
    used, corners = np.unique(scene.faces[chosen], return_inverse=True)
    red, green, blue = (int(channel) for channel in colour)
    faces = corners.reshape(-1, 3).astype(np.uint32)
    mover = instance - 1 - (len(scene.objects) - len(scene.movers))
    vertices = scene.vertices[used].astype(np.float32)
    return Group(name, vertices, faces, (red, green, blue), instance, mover if instance and mover >= 0 else None)
