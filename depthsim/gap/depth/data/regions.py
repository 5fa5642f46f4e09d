"""The scene cut into regions: where on it the gap lies."""

import numpy as np
from numpy.typing import NDArray

from depthsim.scene import Scene


def split_scene(scene: Scene, levels: int = 6) -> NDArray[np.int16]:
    """(faces,) a region of each: the scene split at the middle of its widest side, ``levels`` times over, by area.

    What moves is a region for each object.
    """
    middles = scene.vertices[scene.faces].mean(axis=1)
    region = np.zeros(len(scene.faces), np.int16)
    parts = [np.arange(scene.standing[1])]
    for _ in range(levels):
        halves = []
        for part in parts:
            if len(part) < 2:
                halves.append(part)
                continue
            side = int(np.argmax(np.ptp(middles[part], axis=0)))
            order = part[np.argsort(middles[part, side], kind="stable")]
            area = np.cumsum(scene.areas[order])
            at = int(np.clip(np.searchsorted(area, area[-1] / 2), 1, len(order) - 1))
            halves += [order[:at], order[at:]]
        parts = halves
    for number, part in enumerate(parts):
        region[part] = number
    for number, mover in enumerate(scene.movers, start=len(parts)):
        region[slice(*mover.faces)] = number
    return region


def region_name(scene: Scene, region_of_face: NDArray[np.int16], region: int) -> str:
    """A region in words: what it is made of and where it lies."""
    faces = np.flatnonzero(region_of_face == region)
    corners = scene.vertices[scene.faces[faces]].reshape(-1, 3)
    if not len(faces):
        return "nothing"
    if faces[0] >= scene.standing[1]:
        return f"{next(mover.name for mover in scene.movers if mover.faces[0] == faces[0])}, which moves"
    tags = np.bincount(scene.face_tags[faces], scene.areas[faces], len(scene.tags))
    low, high = corners.min(axis=0), corners.max(axis=0)
    spans = ", ".join(f"{axis} {a:.1f} to {b:.1f}" for axis, a, b in zip("xyz", low, high, strict=True))
    return f"{scene.tags[int(tags.argmax())]} at {spans} m"
