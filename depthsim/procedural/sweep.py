"""Shapes drawn along paths: tubes, pipes, branches, gate frames, ribbons, leaves."""

import numpy as np
from numpy.typing import ArrayLike

from depthsim.procedural.part import Floats, Part
from depthsim.procedural.primitives import grid_faces

SQUARE = np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])


def circle(sides: int) -> Floats:
    """(sides, 2) points on the unit circle, counter-clockwise."""
    angle = np.arange(sides) * (2 * np.pi / sides)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def sweep(paths: ArrayLike, scale: ArrayLike, section: ArrayLike, tag: str, ring: bool = False) -> Part:
    """Solids swept along paths, with flat ends, or without ends where the paths are rings.

    paths: (B, N, 3) or (N, 3) points [m]; a ring does not repeat its first point.
    scale: (B, N) or what broadcasts to it [m]: the size of the section along the path.
    section: (M, 2), counter-clockwise about its origin as seen along the path: to the right, and up where the path is
    level. Sections keep their turn along a path (parallel transport), so a path that is a ring lies in one plane.
    """
    line = np.asarray(paths, dtype=np.float64)
    line = line[None] if line.ndim == 2 else line
    outline = np.asarray(section, dtype=np.float64)
    count, steps, sides = len(line), line.shape[1], len(outline)
    sideways, up = _frames(line, ring)
    size = np.broadcast_to(np.asarray(scale, dtype=np.float64), (count, steps))[..., None, None]
    offsets = sideways[:, :, None] * outline[:, :1] + up[:, :, None] * outline[:, 1:]
    vertices = (line[:, :, None] + offsets * size).reshape(count, -1, 3)
    rows = np.arange(steps * sides).reshape(steps, sides)
    rows = np.concatenate([rows, rows[:, :1]], axis=1)
    if ring:
        rows = np.concatenate([rows, rows[:1]])
    else:
        vertices = np.concatenate([vertices, line[:, :1], line[:, -1:]], axis=1)
        ends = np.full((2, sides + 1), steps * sides)
        ends[1] += 1
        rows = np.concatenate([ends[:1], rows, ends[1:]])
    faces = grid_faces(rows[::-1])[None] + (np.arange(count) * vertices.shape[1])[:, None, None]
    return Part.of(vertices.reshape(-1, 3), faces.reshape(-1, 3), tag)


def tube(path: ArrayLike, radius: ArrayLike, tag: str, sides: int = 10) -> Part:
    """A round bar along one path (N, 3) [m]; the radius may vary along it."""
    return sweep(path, radius, circle(sides), tag)


def rounded_rectangle(width: float, height: float, radius: float, steps: int = 5) -> Floats:
    """(4·steps, 2) points of a rectangle about the origin with round corners [m], counter-clockwise."""
    angle = np.linspace(0, np.pi / 2, steps)
    corners = []
    for quarter, (x, y) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        center = np.array([x * (width / 2 - radius), y * (height / 2 - radius)])
        turn = angle + quarter * np.pi / 2
        corners.append(center + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1))
    return np.concatenate(corners)


def frame(width: float, height: float, thickness: float, tag: str, radius: float = 0.1) -> Part:
    """An upright rectangular frame about the origin, square in section, seen along x; sizes at its middle line [m]."""
    outline = rounded_rectangle(width, height, radius)
    path = np.stack([np.zeros(len(outline)), outline[:, 0], outline[:, 1]], axis=1)
    return sweep(path, thickness / 2, SQUARE, tag, ring=True)


def ribbons(paths: ArrayLike, half_widths: ArrayLike, tag: str) -> Part:
    """Thin strips along paths (B, N, 3) [m], such as blades and fronds; not closed.

    half_widths: (B, N, 3) vectors from the middle line to the edge [m]; zero at the last point makes a tip.
    """
    line = np.asarray(paths, dtype=np.float64)
    half = np.broadcast_to(np.asarray(half_widths, dtype=np.float64), line.shape)
    count, steps = line.shape[:2]
    vertices = np.stack([line - half, line + half], axis=2).reshape(count, -1, 3)
    rows = np.arange(2 * steps).reshape(steps, 2)
    if not half[:, -1].any():
        rows[-1, 1] = rows[-1, 0]
        faces, vertices = grid_faces(rows), vertices[:, :-1]
    else:
        faces = grid_faces(rows)
    indices = faces[None] + (np.arange(count) * vertices.shape[1])[:, None, None]
    return Part.of(vertices.reshape(-1, 3), indices.reshape(-1, 3), tag)


def leaves(bases: Floats, along: Floats, across: Floats, fold: ArrayLike, tag: str) -> Part:
    """N leaves of two triangles each, folded along the middle; not closed.

    bases, along, across: (N, 3) the stalk's end, from there to the tip, from the middle line to the right edge [m].
    fold: how far the edges stand off the middle line [m].
    """
    normal = np.cross(across, along)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    middle = bases + 0.45 * along + normal * np.broadcast_to(np.asarray(fold)[..., None], bases.shape)
    vertices = np.stack([bases, middle + across, bases + along, middle - across], axis=1)
    faces = np.array([[0, 1, 2], [0, 2, 3]])[None] + 4 * np.arange(len(bases))[:, None, None]
    return Part.of(vertices.reshape(-1, 3), faces.reshape(-1, 3), tag)


def _frames(line: Floats, ring: bool) -> tuple[Floats, Floats]:
    """(B, N, 3) unit vectors to the right and up of the sections along the paths."""
    if ring:
        tangent = np.roll(line, -1, axis=1) - np.roll(line, 1, axis=1)
    else:
        tangent = np.empty_like(line)
        tangent[:, 1:-1] = line[:, 2:] - line[:, :-2]
        tangent[:, 0], tangent[:, -1] = line[:, 1] - line[:, 0], line[:, -1] - line[:, -2]
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    # Start from the axis that the path keeps away from most; z is preferred where it is as good as another.
    most = np.abs(tangent).max(axis=1) - (0, 0, 1e-9)
    reference = np.eye(3)[np.argmin(most, axis=1)]
    up = np.empty_like(line)
    for step in range(line.shape[1]):
        along = tangent[:, step]
        reference = reference - np.einsum("bi,bi->b", reference, along)[:, None] * along
        reference /= np.linalg.norm(reference, axis=1, keepdims=True)
        up[:, step] = reference
    return np.cross(tangent, up), up
