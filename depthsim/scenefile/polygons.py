"""Polygons to triangles."""

import numpy as np
from numpy.typing import NDArray


def triangulate(
    vertices: NDArray[np.float64], counts: NDArray[np.int64], corners: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles of polygons, in the order of the polygons, with their winding.

    A polygon becomes a fan from its first corner; where that would turn a triangle over (the polygon is not convex),
    its ears are clipped one by one.

    vertices: (V, 3). counts: (P,) corners per polygon. corners: (sum of counts,) indices into ``vertices``.
    Returns (F, 3) indices into ``vertices`` and (F,) the polygon that each triangle is of. Polygons of fewer than
    three corners give no triangle. Corners that are out of range are kept for the caller to complain about.
    """
    starts = np.cumsum(counts) - counts
    sizes = np.maximum(counts - 2, 0)
    polygon = np.repeat(np.arange(len(counts)), sizes)
    first = np.cumsum(sizes) - sizes
    step = np.arange(len(polygon)) - first[polygon]
    start = starts[polygon]
    faces = np.stack([corners[start], corners[start + step + 1], corners[start + step + 2]], axis=1)
    if (counts > 3).any() and corners.min() >= 0 and corners.max() < len(vertices):
        for index in _turned_over(vertices, faces, polygon, len(counts)):
            ring = corners[starts[index] : starts[index] + counts[index]]
            faces[first[index] : first[index] + sizes[index]] = ring[_clip_ears(vertices[ring])]
    return faces, polygon


def _turned_over(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], polygon: NDArray[np.int64], count: int
) -> NDArray[np.int64]:
    """The polygons whose fan has a triangle that faces against the polygon."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    cross = np.cross(b - a, c - a)
    total = np.stack([np.bincount(polygon, cross[:, axis], minlength=count) for axis in range(3)], axis=1)[polygon]
    against = np.einsum("fi,fi->f", cross, total) < -1e-9 * np.einsum("fi,fi->f", total, total)
    return np.unique(polygon[against])


def _clip_ears(ring: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n - 2, 3) indices of triangles that fill a simple polygon (n, 3)."""
    normal = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    axis = int(np.argmax(np.abs(normal)))
    flat = np.delete(ring, axis, axis=1) * ([1.0, -1.0] if (normal[axis] < 0) ^ (axis == 1) else [1.0, 1.0])
    left, triangles = list(range(len(flat))), []
    while len(left) > 3:
        ear = next((i for i in range(len(left)) if _is_ear(flat, left, i)), 0)
        triangles.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
        del left[ear]
    return np.array([*triangles, left])


def _is_ear(flat: NDArray[np.float64], left: list[int], i: int) -> bool:
    """Whether corner ``i`` of what is left sticks out and no other corner lies in its triangle."""
    ring = [left[i - 1], left[i], left[(i + 1) % len(left)]]
    a, b, c = flat[ring]
    if _twice_area(a, b, c) <= 0:
        return False
    others = flat[[j for j in left if j not in ring]]
    others = others[~(others[:, None] == flat[ring]).all(axis=2).any(axis=1)]
    inside = (_twice_area(a, b, others) >= 0) & (_twice_area(b, c, others) >= 0) & (_twice_area(c, a, others) >= 0)
    return not inside.any()


def _twice_area(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twice the signed area of triangles in the plane; the last may be many points."""
    return np.asarray((b[0] - a[0]) * (c[..., 1] - a[1]) - (b[1] - a[1]) * (c[..., 0] - a[0]))
