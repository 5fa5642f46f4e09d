"""Where the objects that move are in one cast, as the kernels take it: the camera in the frame of each.

An object's rays are turned into its frame, where its acceleration structure stands as it was built: nothing is built
for a frame, and every row of a rolling shutter has a time of its own. Embree's own instances, whose tree of boxes is
built for every frame, took 1.05 times as long on the shipped scenes, and are interpolated between a few times.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.moving import Mover, poses
from depthsim.raycast import embree
from depthsim.scene import Scene

_WIDER, _SLACK, _WIDEST = 1.001, 1e-3, 1.5
"""How much wider than it is an object's sphere is taken, and its box in the picture at z = 1; and the angle from the
axis [rad] beyond which it counts as being everywhere."""


def meshes_of_movers(scene: Scene) -> list[tuple[NDArray[np.float64], NDArray[np.uint32]]]:
    """The (V, 3) vertices and (F, 3) faces of each object that moves, in its own frame."""
    return [
        (scene.vertices[slice(*mover.vertices)], scene.faces[slice(*mover.faces)] - np.uint32(mover.vertices[0]))
        for mover in scene.movers
    ]


def rows_of(movers: Sequence[Mover], stamps: NDArray[np.float64], middle: NDArray[np.float64]) -> NDArray[np.float32]:
    """(K, objects, 3, 4) object to world, less ``middle``, at (K,) stamps [s]."""
    found = poses(movers, stamps)[:, :, :3]
    found[..., 3] -= middle
    return found.astype(np.float32)


class Placed:
    """The objects of a cast, as the last arguments of the kernel.

    stamps: (1,) or (H,) when the rows are exposed [s]. camera: (1, 4, 4) or (H, 4, 4) to world. baseline: [m].
    middle: what vertices in the world are relative to [m].

    handles: (objects,) of their scenes. first_faces: (objects,) in the whole scene. rows: (K, objects + 1, 12) the
    camera's rotation, row by row, and its place, in the frame of each object, and last in the world. boxes:
    (2, objects, 4) first and last x, first and last y at z = 1 of the left imager's rays, and of the right one's, that
    can meet each object.
    """

    def __init__(
        self,
        movers: Sequence[Mover],
        stamps: NDArray[np.float64],
        camera: NDArray[np.float64],
        baseline: float,
        middle: NDArray[np.float64],
        objects: Sequence[embree.EmbreeScene],
    ) -> None:
        self.handles = np.array([tree.handle for tree in objects], np.int64)
        self.first_faces = np.array([mover.faces[0] for mover in movers], np.int32)
        where = poses(movers, stamps)
        back, place = where[..., :3, :3].swapaxes(-1, -2), where[..., :3, 3]
        turn = back @ camera[:, None, :3, :3]
        at = np.einsum("knij,knj->kni", back, camera[:, None, :3, 3] - place)
        self.rows = np.empty((len(turn), len(movers) + 1, 12), np.float32)
        self.rows[:, :-1, :9], self.rows[:, :-1, 9:] = turn.reshape(*turn.shape[:2], 9), at
        self.rows[:, -1, :9] = camera[:, :3, :3].reshape(-1, 9)
        self.rows[:, -1, 9:] = camera[:, :3, 3] - middle
        centres = np.array([tree.centre for tree in objects])
        seen = np.einsum("knji,knj->kni", turn, centres - at)  # the objects in the camera's frame
        reach = np.array([tree.radius for tree in objects]) * _WIDER
        self.boxes = np.stack([_boxes(seen - [offset, 0, 0], reach) for offset in (0.0, baseline)])


def _boxes(seen: NDArray[np.float64], reach: NDArray[np.float64]) -> NDArray[np.float32]:
    """(objects, 4) what spheres cover at z = 1. seen: (K, objects, 3) from the imager [m]; reach: (objects,) [m]."""
    z = seen[..., 2]
    found = np.empty((len(reach), 4), np.float32)
    for axis in (0, 1):
        distance = np.hypot(seen[..., axis], z)
        half = np.arcsin(np.minimum(reach / np.maximum(distance, 1e-12), 1.0))
        middle = np.arctan2(seen[..., axis], z)
        low, high = middle - half, middle + half
        # A sphere that the imager is in, or that reaches round it, may be anywhere in the picture.
        near, ahead = (distance <= reach) | (low < -_WIDEST) | (high > _WIDEST), z + reach > 0
        first = np.where(near, -np.inf, np.tan(np.clip(low, -_WIDEST, _WIDEST)) - _SLACK)
        last = np.where(near, np.inf, np.tan(np.clip(high, -_WIDEST, _WIDEST)) + _SLACK)
        found[:, 2 * axis] = np.where(ahead, first, np.inf).min(axis=0)
        found[:, 2 * axis + 1] = np.where(ahead, last, -np.inf).max(axis=0)
    return found
