"""Polygons to triangles."""

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import inlined, kernel

_MOST_TESTS = 1_000_000_000
"""Corners that are tested while polygons are cut up: some seconds. A ring of n corners may take n³ of them."""


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
        left = _MOST_TESTS
        for index in _turned_over(vertices, faces, polygon, len(counts)):
            ring = corners[starts[index] : starts[index] + counts[index]]
            triangles, tests = _clip_ears(_flattened(vertices[ring]), left)
            faces[first[index] : first[index] + sizes[index]] = ring[triangles]
            left -= tests
            if left <= 0:
                break
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


def _flattened(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) a polygon (n, 3) in the plane that it is largest in, counter-clockwise."""
    normal = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    axis = int(np.argmax(np.abs(normal)))
    turn = [1.0, -1.0] if (normal[axis] < 0) ^ (axis == 1) else [1.0, 1.0]
    return np.ascontiguousarray(np.delete(ring, axis, axis=1) * turn)


@kernel
def _clip_ears(flat: NDArray[np.float64], most: int) -> tuple[NDArray[np.int64], int]:
    """(n - 2, 3) indices of triangles that fill a simple polygon (n, 2), and how many corners were tested for it.

    After ``most`` tests, or where there is no ear, as in a polygon that crosses itself, the first corner is cut off.
    """
    n = len(flat)
    left, triangles = np.arange(n), np.empty((n - 2, 3), np.int64)
    tests = 0
    for row in range(n - 3):
        count, ear = n - row, 0
        for i in range(count):
            if tests >= most:
                break
            a, b, c = left[i - 1], left[i], left[(i + 1) % count]
            tests += 1
            if _twice_area(flat, a, b, c) <= 0:
                continue
            free = True
            for j in range(count):
                other = left[j]
                if other == a or other == b or other == c:  # noqa: PLR1714, SIM109 - `in` is slow in numba
                    continue
                tests += 1
                if (
                    _twice_area(flat, a, b, other) >= 0
                    and _twice_area(flat, b, c, other) >= 0
                    and _twice_area(flat, c, a, other) >= 0
                    and not (_same(flat, other, a) or _same(flat, other, b) or _same(flat, other, c))
                ):
                    free = False
                    break
            if free:
                ear = i
                break
        triangles[row, 0], triangles[row, 1], triangles[row, 2] = left[ear - 1], left[ear], left[(ear + 1) % count]
        for j in range(ear, count - 1):
            left[j] = left[j + 1]
        left = left[: count - 1]
    triangles[n - 3] = left
    return triangles, tests


@inlined
def _twice_area(flat, a, b, c):
    """Twice the signed area of a triangle of three corners."""
    return (flat[b, 0] - flat[a, 0]) * (flat[c, 1] - flat[a, 1]) - (flat[b, 1] - flat[a, 1]) * (flat[c, 0] - flat[a, 0])


@inlined
def _same(flat, a, b):
    """Whether two corners are at one place, as where a polygon with a hole touches itself."""
    return flat[a, 0] == flat[b, 0] and flat[a, 1] == flat[b, 1]
