"""A tagged triangle mesh, and how parts are placed, repeated and put together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """Triangles with a material tag each.

    vertices: (V, 3) float64 [m].
    faces: (F, 3) uint32 indices into ``vertices``; seen from outside, counter-clockwise.
    face_tags: (F,) uint8 indices into ``tags``.
    tags: the material tags in use, names from materials.yaml.
    """

    vertices: Floats
    faces: NDArray[np.uint32]
    face_tags: NDArray[np.uint8]
    tags: tuple[str, ...]

    @classmethod
    def of(cls, vertices: ArrayLike, faces: ArrayLike, tag: str) -> Part:
        """A part that is one material all over."""
        triangles = np.ascontiguousarray(faces, dtype=np.uint32)
        return cls(
            np.ascontiguousarray(vertices, dtype=np.float64), triangles, np.zeros(len(triangles), np.uint8), (tag,)
        )

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Part:
        """Shifted by (x, y, z) [m]."""
        return replace(self, vertices=self.vertices + np.array([x, y, z]))

    def turned(self, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> Part:
        """Turned about the fixed axes x, then y, then z [degrees]."""
        return replace(self, vertices=self.vertices @ rotation(roll, pitch, yaw).T)

    def scaled(self, x: float, y: float | None = None, z: float | None = None) -> Part:
        """Scaled about the origin, all axes alike if only one factor is given; the factors are positive."""
        return replace(self, vertices=self.vertices * (x, x if y is None else y, x if z is None else z))

    @property
    def corners(self) -> Floats:
        """(F, 3, 3): the three corners of each face [m]."""
        return self.vertices[self.faces]

    @property
    def areas(self) -> Floats:
        """(F,) areas of the faces [m²]."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))

    @property
    def volume(self) -> float:
        """The enclosed volume [m³], by the divergence theorem; negative if the faces look inward."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def rotation(roll: ArrayLike = 0.0, pitch: ArrayLike = 0.0, yaw: ArrayLike = 0.0) -> Floats:
    """(..., 3, 3) rotations about the fixed axes x, then y, then z [degrees]."""
    x, y, z = np.broadcast_arrays(*(np.radians(np.asarray(angle, dtype=np.float64)) for angle in (roll, pitch, yaw)))
    (cx, sx), (cy, sy), (cz, sz) = ((np.cos(angle), np.sin(angle)) for angle in (x, y, z))
    rows = (
        (cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx),
        (sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx),
        (-sy, cy * sx, cy * cx),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def join(parts: Iterable[Part]) -> Part:
    """Several parts as one; equal tags become one."""
    pieces = list(parts)
    tags = tuple(dict.fromkeys(tag for piece in pieces for tag in piece.tags))
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    return Part(
        np.concatenate([piece.vertices for piece in pieces]),
        np.concatenate([piece.faces + np.uint32(start) for piece, start in zip(pieces, starts, strict=False)]),
        np.concatenate(
            [np.array([tags.index(tag) for tag in piece.tags], np.uint8)[piece.face_tags] for piece in pieces]
        ),
        tags,
    )


def copies(part: Part, positions: ArrayLike, matrices: ArrayLike | None = None) -> Part:
    """A part at each of N positions (N, 3) [m], each first transformed by its (3, 3) matrix if there are any.

    ``matrices`` is (N, 3, 3) or one (3, 3) for all, such as ``rotation(...) * scale``; determinants are positive.
    """
    places = np.asarray(positions, dtype=np.float64).reshape(-1, 3)
    turn = np.eye(3) if matrices is None else np.asarray(matrices, dtype=np.float64)
    turn = np.broadcast_to(turn, (len(places), 3, 3))
    vertices = np.einsum("nij,vj->nvi", turn, part.vertices) + places[:, None]
    steps = (np.arange(len(places), dtype=np.uint32) * np.uint32(len(part.vertices)))[:, None, None]
    return Part(
        vertices.reshape(-1, 3),
        (part.faces[None] + steps).reshape(-1, 3),
        np.tile(part.face_tags, len(places)),
        part.tags,
    )


def spin(yaw: ArrayLike, scale: ArrayLike = 1.0) -> Floats:
    """(N, 3, 3) matrices for :func:`copies`: turned about z [degrees] and scaled."""
    return rotation(yaw=yaw) * np.asarray(scale, dtype=np.float64)[..., None, None]
