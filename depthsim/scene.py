"""A scene: triangles with a material tag each, in metres, z up."""

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.look import Look

NO_TAG = 255
"""The index in a picture of tags where a ray hit nothing; a scene has at most this many tags."""


@dataclass(frozen=True)
class Scene:
    """Triangles with a material tag each.

    vertices: (V, 3) float64, world frame, metres, z up.
    faces: (F, 3) uint32 indices into ``vertices``; seen from outside, counter-clockwise.
    face_tags: (F,) uint8 indices into ``tags``.
    tags: the material tags in use, names from materials.yaml.
    trajectories: by name, the trajectory specifications that came with the scene; the first one is its default.
    source: the file it was read from.
    look: the colours that its mesh files have; None where they have none.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.uint32]
    face_tags: NDArray[np.uint8]
    tags: tuple[str, ...]
    trajectories: dict[str, dict[str, object]] = field(default_factory=dict)
    source: Path | None = None
    look: Look | None = None

    @cached_property
    def normals(self) -> NDArray[np.float32]:
        """(F, 3) unit geometric normals, float32; zero for a face without area."""
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        cross = np.cross(b - a, c - a)
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        return np.divide(cross, length, out=np.zeros_like(cross), where=length > 0).astype(np.float32)

    @cached_property
    def areas(self) -> NDArray[np.float64]:
        """(F,) areas of the faces [m²]."""
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))

    @cached_property
    def digest(self) -> str:
        """24 hexadecimal digits that stand for triangles, tags and colours of faces: another scene has others."""
        digest = hashlib.blake2b(digest_size=12)
        look = () if self.look is None else (self.look.texture, self.look.uv, self.look.colors, *self.look.pictures)
        for array in (self.vertices, self.faces, self.face_tags, *look):
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3): the lowest and the highest corner [m]."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])
