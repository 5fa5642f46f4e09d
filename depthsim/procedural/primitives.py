"""Closed solids, and the plane: boxes, bodies of revolution, spheres, cushions.

Every solid stands on or around the origin as its docstring says; its faces look outward.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthsim.procedural.part import Floats, Part, copies, rotation

Indices = NDArray[np.int64]
_CUBE_FACES = np.array(
    [
        (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
        (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
    ]
)  # fmt: skip
_CUBE = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])


def grid_faces(rows: Indices) -> Indices:
    """(F, 3) triangles of a grid of vertex indices (N, M); a face turns from the second axis to the first.

    Where neighbours in the grid are the same vertex, as at a pole, the triangle without area is left out.
    """
    a, b, c, d = rows[:-1, :-1], rows[:-1, 1:], rows[1:, 1:], rows[1:, :-1]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return faces[distinct]


def box(size: ArrayLike, tag: str, center: ArrayLike = (0.0, 0.0, 0.0)) -> Part:
    """A box of ``size`` (x, y, z) [m] about ``center``."""
    return Part.of(_CUBE * np.asarray(size) + np.asarray(center), _CUBE_FACES, tag)


def boxes(sizes: ArrayLike, centers: ArrayLike, tag: str, turns: ArrayLike | None = None) -> Part:
    """N boxes of ``sizes`` (N, 3) about ``centers`` (N, 3) [m], each turned by its (3, 3) of ``turns`` if given."""
    places = np.asarray(centers, dtype=np.float64).reshape(-1, 3)
    stretch = np.zeros((len(places), 3, 3))
    stretch[:, range(3), range(3)] = sizes
    return copies(box((1, 1, 1), tag), places, stretch if turns is None else np.asarray(turns) @ stretch)


def plane(size: tuple[float, float], cells: tuple[int, int], tag: str) -> Part:
    """A rectangle in z = 0 about the origin that looks up, in (x, y) cells of two triangles each; not closed."""
    x = np.linspace(-size[0] / 2, size[0] / 2, cells[0] + 1)
    y = np.linspace(-size[1] / 2, size[1] / 2, cells[1] + 1)
    vertices = np.stack([*np.meshgrid(x, y), np.zeros((len(y), len(x)))], axis=-1).reshape(-1, 3)
    return Part.of(vertices, grid_faces(np.arange(len(vertices)).reshape(len(y), len(x))), tag)


def revolve(profile: ArrayLike, segments: int, tag: str, closed: bool = False) -> Part:
    """A body of revolution about z.

    profile: (N, 2) of (radius, z) [m], upwards along the outside; an end off the axis gets a flat cap. With
    ``closed`` it is a polygon off the axis, counter-clockwise in (radius, z), and the body is a ring.
    """
    line = np.asarray(profile, dtype=np.float64)
    if not closed:
        caps = [[[0.0, line[end, 1]]] if line[end, 0] > 0 else np.empty((0, 2)) for end in (0, -1)]
        line = np.concatenate([caps[0], line, caps[1]])
    angle = np.arange(segments) * (2 * np.pi / segments)
    radius, height = line[:, :1], np.repeat(line[:, 1:], segments, axis=1)
    vertices = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1).reshape(-1, 3)
    rows = np.arange(len(vertices)).reshape(len(line), segments)
    rows = np.where(radius == 0, rows[:, :1], rows)
    rows = np.concatenate([rows, rows[:, :1]], axis=1)
    return _compact(vertices, grid_faces(np.concatenate([rows, rows[:1]]) if closed else rows), tag)


def cylinder(radius: float, height: float, tag: str, segments: int = 20) -> Part:
    """An upright cylinder that stands on z = 0."""
    return revolve([(radius, 0), (radius, height)], segments, tag)


def cone(bottom: float, top: float, height: float, tag: str, segments: int = 20) -> Part:
    """A cone or its stump that stands on z = 0; ``top`` may be 0."""
    return revolve([(bottom, 0), (top, height)], segments, tag)


def torus(radius: float, thickness: float, tag: str, segments: int = 28, sides: int = 12) -> Part:
    """A ring about the origin in z = 0; ``thickness`` is the radius of its tube."""
    angle = np.arange(sides) * (2 * np.pi / sides)
    return revolve(
        np.stack([radius + thickness * np.cos(angle), thickness * np.sin(angle)], axis=1), segments, tag, True
    )


def sphere(radius: float, tag: str, segments: int = 20, rings: int = 12) -> Part:
    """A ball about the origin."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    profile = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    profile[[0, -1], 0] = 0
    return revolve(profile, segments, tag)


def cushion(size: ArrayLike, tag: str, roundness: float = 0.35, segments: int = 24, rings: int = 12) -> Part:
    """A rounded box of ``size`` [m] about the origin: a superellipsoid, from a ball (1) towards a box (near 0)."""
    ball = sphere(1, tag, segments, rings)
    x, y, z = ball.vertices.T
    flat = np.hypot(x, y)
    flat = np.where(flat > 1e-9, flat, 1)

    def bend(value: Floats) -> Floats:
        return np.sign(value) * np.abs(value) ** roundness

    ring = np.hypot(x, y) ** roundness
    shape = np.stack([ring * bend(x / flat), ring * bend(y / flat), bend(z)], axis=1)
    return Part.of(shape * np.asarray(size) / 2, ball.faces, tag)


def icosphere(subdivisions: int, tag: str) -> Part:
    """A unit ball of 20·4^n even triangles."""
    golden = (1 + 5**0.5) / 2
    vertices = np.array([[0, a, b * golden] for a in (-1, 1) for b in (-1, 1)], dtype=np.float64)
    vertices = np.concatenate([np.roll(vertices, shift, axis=1) for shift in range(3)])
    distance = np.linalg.norm(vertices[:, None] - vertices[None], axis=-1)
    near = (distance > 1e-9) & (distance < 2.1)
    faces = np.array(
        [(a, b, c) for a in range(12) for b in range(a) for c in range(b) if near[a, b] and near[b, c] and near[c, a]]
    )
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    inward = np.einsum("ij,ij->i", a, np.cross(b, c)) < 0
    faces[inward] = faces[inward][:, ::-1]
    for _ in range(subdivisions):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=-1).reshape(-1, 2)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (inverse.reshape(-1, 3) + len(vertices)).T
        a, b, c = faces.T
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        faces = np.concatenate([np.stack(f, axis=1) for f in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    return Part.of(vertices / np.linalg.norm(vertices, axis=1, keepdims=True), faces, tag)


def lying(part: Part) -> Part:
    """An upright part laid along x."""
    return Part(part.vertices @ rotation(pitch=90).T, part.faces, part.face_tags, part.tags)


def _compact(vertices: Floats, faces: Indices, tag: str) -> Part:
    """A part without the vertices that no face uses."""
    used, inverse = np.unique(faces, return_inverse=True)
    return Part.of(vertices[used], inverse.reshape(-1, 3), tag)
