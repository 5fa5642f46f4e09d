"""What is wrong with a surface: holes, flipped faces, edges of more than two faces, faces given twice."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Topology:
    """Counts over one mesh, after vertices at equal positions are merged into one.

    A body is a set of faces that hang together by edges of exactly two faces.
    """

    boundary_edges: int
    """edges of one face: the rims of holes"""
    boundary_loops: int
    """rims; those that touch at a vertex count as one"""
    non_manifold_edges: int
    """edges of three or more faces"""
    flipped_edges: int
    """edges that both of their faces traverse in the same direction"""
    flipped_faces: int
    """faces wound against the larger part of their body; not counted in one-sided bodies (Möbius strips)"""
    duplicate_faces: int
    """faces on the same three vertices as another one, whatever their winding"""
    bodies: int
    closed_bodies: int
    """bodies without any boundary or non-manifold edge"""
    inside_out_bodies: int
    """closed bodies whose faces look inwards: right for a room, wrong for a thing"""


def topology(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Topology:
    """The topology of triangles; vertices (V, 3), faces (F, 3) indices into them."""
    from scipy.sparse.csgraph import connected_components

    corners = merge_equal(vertices)[faces]
    count = len(corners)
    tails = corners.reshape(-1)
    heads = np.roll(corners, -1, axis=1).reshape(-1)
    key = np.minimum(tails, heads) * (int(corners.max()) + 1) + np.maximum(tails, heads)
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    sizes = np.diff(starts, append=len(key))
    face_of, forward = order // 3, (tails < heads)[order]

    paired = starts[sizes == 2]
    left, right = face_of[paired], face_of[paired + 1]
    same = forward[paired] == forward[paired + 1]
    # Each face stands twice in the graph, as it is and turned over; a flipped edge joins it to its neighbour's other
    # self. A body then falls into two halves, one per side, unless it has only one side.
    joined = _graph(
        np.concatenate([left, left + count]),
        np.concatenate([right + count * same, right + count * ~same]),
        2 * count,
    )
    side = connected_components(joined, directed=False)[1]
    bodies, body = connected_components(_graph(left, right, count), directed=False)
    two_sided = side[:count] != side[count:]
    turned = two_sided & (side[:count] > side[count:])
    flipped = np.bincount(body, turned, minlength=bodies)
    faces_in = np.bincount(body, minlength=bodies)
    turned ^= (2 * flipped > faces_in)[body]

    open_edges = np.repeat(sizes != 2, sizes)
    closed = np.bincount(body[face_of[open_edges]], minlength=bodies) == 0
    closed &= np.bincount(body, ~two_sided, minlength=bodies) == 0
    rim = order[starts[sizes == 1]]
    on_rim, ends = np.unique([tails[rim], heads[rim]], return_inverse=True)
    tail, head = ends.reshape(2, -1)
    loops = connected_components(_graph(tail, head, len(on_rim)), directed=False)[0]
    return Topology(
        boundary_edges=len(rim),
        boundary_loops=int(loops),
        non_manifold_edges=int((sizes > 2).sum()),
        flipped_edges=int(same.sum()),
        flipped_faces=int((turned & two_sided).sum()),
        duplicate_faces=count - _distinct(np.sort(corners, axis=1)),
        bodies=int(bodies),
        closed_bodies=int(closed.sum()),
        inside_out_bodies=int((closed & (_volumes(vertices, faces, turned, body, bodies) < 0)).sum()),
    )


def merge_equal(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """(V,) for each vertex a number that those at the same position share."""
    order = np.lexsort(vertices.T)
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(vertices[order], axis=0) != 0).any(axis=1)
    merged = np.empty(len(order), dtype=np.int64)
    merged[order] = np.cumsum(new) - 1
    return merged


def _distinct(rows: NDArray[np.int64]) -> int:
    """How many different rows of three."""
    order = np.lexsort(rows.T)
    return 1 + int((np.diff(rows[order], axis=0) != 0).any(axis=1).sum())


def _graph(a: NDArray[np.int64], b: NDArray[np.int64], nodes: int) -> Any:
    from scipy.sparse import coo_array

    return coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(nodes, nodes)).tocsr()


def _volumes(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], turned: NDArray[np.bool_], body: NDArray, bodies: int
) -> NDArray[np.float64]:
    """(bodies,) six times the signed volume, all faces turned as most of their body."""
    a, b, c = (vertices[faces[:, corner]] - vertices.mean(axis=0) for corner in range(3))
    six = np.einsum("fi,fi->f", a, np.cross(b, c))
    return np.bincount(body, np.where(turned, -six, six), minlength=bodies).astype(np.float64)
