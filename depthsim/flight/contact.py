"""Where a flight first touches a mesh: the sphere around the vehicle, moved along straight lines between samples."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import kernel
from depthsim.scene import Scene

Floats = NDArray[np.float64]

_CHUNK = 32
"""Segments looked at together: the triangles near their common box are found first."""
_HALVINGS = 40


@dataclass(frozen=True)
class Contact:
    """The first contact of a flight with a scene.

    time: [s]. position: (3,) the vehicle's centre then [m]. point: (3,) what it touches [m]. tag: of that face.
    """

    time: float
    position: Floats
    point: Floats
    tag: str

    def __str__(self) -> str:
        place = ", ".join(f"{value:.3f}" for value in self.point)
        return f"touches {self.tag} at {self.time:.3f} s, at ({place}) m"


def first_contact(scene: Scene, t: Floats, positions: Floats, radius: float) -> Contact | None:
    """The first time that a sphere of ``radius`` [m] around the positions (N, 3) [m] at (N,) stamps meets the mesh.

    The sphere moves straight and evenly from one position to the next. None if it meets nothing. Objects that move are
    not looked at.
    """
    count = scene.standing[1]
    corners = scene.vertices[scene.faces[:count]]
    low, high = corners.min(axis=1) - radius, corners.max(axis=1) + radius
    tags = scene.face_tags[:count]
    passed = ((low <= positions.max(axis=0)) & (high >= positions.min(axis=0))).all(axis=1)
    corners, low, high, tags = corners[passed], low[passed], high[passed], tags[passed]
    for begin in range(0, max(len(t) - 1, 1), _CHUNK):
        path = np.ascontiguousarray(positions[begin : begin + _CHUNK + 1])
        near = np.flatnonzero(((low <= path.max(axis=0)) & (high >= path.min(axis=0))).all(axis=1))
        if not near.size:
            continue
        segment, share, index, point = _first(path, corners[near], radius)
        if segment < 0:
            continue
        start, end = begin + segment, min(begin + segment + 1, len(t) - 1)
        time = t[start] + share * (t[end] - t[start])
        position = positions[start] + share * (positions[end] - positions[start])
        return Contact(float(time), position, point, scene.tags[tags[near[index]]])
    return None


@kernel
def _first(path, corners, radius):
    """The first segment that comes near a triangle, its share until then, the triangle, and the point touched."""
    point = np.zeros(3)
    for segment in range(max(len(path) - 1, 1)):
        a, b = path[segment], path[min(segment + 1, len(path) - 1)]
        best, which = 2.0, -1
        for index in range(len(corners)):
            if _gap(a, b, corners[index], point) > radius:
                continue
            low, high = 0.0, 1.0
            if _gap(a, a, corners[index], point) <= radius:
                high = 0.0
            else:
                for _ in range(_HALVINGS):
                    middle = 0.5 * (low + high)
                    if _gap(a, a + middle * (b - a), corners[index], point) <= radius:
                        high = middle
                    else:
                        low = middle
            if high < best:
                best, which = high, index
        if which >= 0:
            end = a + best * (b - a)
            _gap(end, end, corners[which], point)
            return segment, best, which, point
    return -1, 0.0, -1, point


@kernel
def _gap(a, b, triangle, point):
    """The distance between a segment and a triangle; ``point`` is left with the triangle's nearest point."""
    p, q, r = triangle[0], triangle[1], triangle[2]
    normal = np.cross(q - p, r - p)
    da, db = np.dot(normal, a - p), np.dot(normal, b - p)
    if da * db < 0:
        crossing = a + da / (da - db) * (b - a)
        if _inside(crossing, p, q, r, normal):
            point[:] = crossing
            return 0.0
    best = np.inf
    for end in range(2):
        x = a if end == 0 else b
        d = da if end == 0 else db
        size = np.dot(normal, normal)
        if size > 0:
            foot = x - d / size * normal
            if _inside(foot, p, q, r, normal):
                gap = abs(d) / np.sqrt(size)
                if gap < best:
                    best = gap
                    point[:] = foot
    for edge in range(3):
        u, v = triangle[edge], triangle[(edge + 1) % 3]
        s, w = _closest(a, b, u, v)
        on_edge = u + w * (v - u)
        gap = np.linalg.norm(a + s * (b - a) - on_edge)
        if gap < best:
            best = gap
            point[:] = on_edge
    return best


@kernel
def _inside(x, p, q, r, normal):
    """Whether a point of the triangle's plane is in the triangle."""
    u = np.dot(np.cross(q - p, x - p), normal)
    v = np.dot(np.cross(r - q, x - q), normal)
    w = np.dot(np.cross(p - r, x - r), normal)
    return u >= 0 and v >= 0 and w >= 0


@kernel
def _closest(a, b, u, v):
    """The shares along two segments where they are nearest (Ericson 2005, section 5.1.9)."""
    d, e, r = b - a, v - u, a - u
    dd, ee, de, er, dr = np.dot(d, d), np.dot(e, e), np.dot(d, e), np.dot(e, r), np.dot(d, r)
    if dd <= 0 and ee <= 0:
        return 0.0, 0.0
    if dd <= 0:
        return 0.0, min(max(er / ee, 0.0), 1.0)
    if ee <= 0:
        return min(max(-dr / dd, 0.0), 1.0), 0.0
    below = dd * ee - de * de
    s = min(max((de * er - dr * ee) / below, 0.0), 1.0) if below > 0 else 0.0
    w = (de * s + er) / ee
    if w < 0:
        w, s = 0.0, min(max(-dr / dd, 0.0), 1.0)
    elif w > 1:
        w, s = 1.0, min(max((de - dr) / dd, 0.0), 1.0)
    return s, w
