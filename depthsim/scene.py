"""A scene: triangles with a material tag each, in metres, z up."""

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.look import Look
from depthsim.moving import Instance, Mover, poses, started

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
    movers: the objects that move. Their faces come last, and their vertices are in their own frames: :meth:`at` has
    them where they are at a time.
    instances: its objects, in the order of their faces; without any the scene is one.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.uint32]
    face_tags: NDArray[np.uint8]
    tags: tuple[str, ...]
    trajectories: dict[str, dict[str, object]] = field(default_factory=dict)
    source: Path | None = None
    look: Look | None = None
    movers: tuple[Mover, ...] = ()
    instances: tuple[Instance, ...] = ()

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
        for mover in self.movers:
            digest.update(
                repr((mover.name, mover.faces, mover.parent, mover.begin is None, mover.zero, mover.repeated)).encode()
            )
            path = mover.path
            for array in () if path is None else (path.stamps, path.positions, path.quaternions):
                digest.update(np.ascontiguousarray(array).data)
        if len(self.instances) > 1:
            digest.update(repr(self.instances).encode())
        return digest.hexdigest()

    @property
    def standing(self) -> tuple[int, int]:
        """How many of its vertices and faces, from the first on, stand still."""
        first = self.movers[0] if self.movers else None
        return (first.vertices[0], first.faces[0]) if first else (len(self.vertices), len(self.faces))

    def started(self, stamp: float) -> "Scene":
        """The scene of a run whose first frame is at ``stamp`` [s]: objects that begin to move with it begin then."""
        return replace(self, movers=started(self.movers, stamp)) if self.movers else self

    def at(self, stamp: float) -> "Scene":
        """The scene as it stands at ``stamp`` [s], all vertices in the world; itself where nothing moves."""
        if not self.movers:
            return self
        vertices = self.vertices.copy()
        for mover, pose in zip(self.movers, poses(self.movers, stamp)[0], strict=True):
            own = slice(*mover.vertices)
            vertices[own] = vertices[own] @ pose[:3, :3].T + pose[:3, 3]
        return replace(self, vertices=vertices, movers=())

    def normals_at(self, stamp: float) -> NDArray[np.float32]:
        """:attr:`normals` as the objects are turned at ``stamp`` [s], in the world."""
        if not self.movers:
            return self.normals
        normals = self.normals.copy()
        for mover, pose in zip(self.movers, poses(self.movers, stamp)[0], strict=True):
            own = slice(*mover.faces)
            normals[own] = normals[own] @ pose[:3, :3].T.astype(np.float32)
        return normals

    @cached_property
    def objects(self) -> tuple[Instance, ...]:
        """``instances``, or the whole scene as one."""
        return self.instances or (Instance(self.name, len(self.faces)),)

    @cached_property
    def instance_of_face(self) -> NDArray[np.uint16]:
        """(F + 1,) the number of the object of face f at f + 1, counted from 1; 0 first, for no face."""
        counts = [instance.faces for instance in self.objects]
        return np.concatenate([[0], np.repeat(np.arange(1, len(counts) + 1), counts)]).astype(np.uint16)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3): the lowest and the highest corner [m]."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])
