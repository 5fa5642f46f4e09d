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
    """Faces of one colour. vertices: (V, 3) float32 [m]. faces: (F, 3) uint32. colour: RGB."""

    name: str
    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]
    colour: tuple[int, int, int]


def by_material(scene: Scene, materials: Materials) -> list[Group]:
    """A group for each tag."""
    palette = colours.material_colours(scene.tags, materials)
    return [
        group
        for index, tag in enumerate(scene.tags)
        if (group := _group(scene, tag, scene.face_tags == index, palette[index])) is not None
    ]


def by_share(scene: Scene, share: NDArray[np.float32]) -> list[Group]:
    """Groups of faces with about the same part of the gap on a square metre. share: (faces,) of the whole gap."""
    density = share / np.maximum(scene.areas, 1e-12)
    known = density[share > 0]
    most = float(np.percentile(known, 98)) if known.size else 1.0
    place = np.clip(density / most, 0, 1)
    step = np.minimum((place * _STEPS).astype(np.int64), _STEPS - 1)
    groups = []
    for number in range(_STEPS):
        colour = colours.SHARE[round(255 * number / (_STEPS - 1))]
        if (group := _group(scene, f"share{number}", step == number, colour)) is not None:
            groups.append(group)
    return groups


def _group(scene: Scene, name: str, chosen: NDArray[np.bool_], colour: NDArray[np.uint8]) -> Group | None:
    if not chosen.any():
        return None
    used, corners = np.unique(scene.faces[chosen], return_inverse=True)
    red, green, blue = (int(channel) for channel in colour)
    faces = corners.reshape(-1, 3).astype(np.uint32)
    return Group(name, scene.vertices[used].astype(np.float32), faces, (red, green, blue))
