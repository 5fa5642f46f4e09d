"""The same cast through embreex's own call: slower, and independent of our kernel, so it also checks it."""

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.raycast.geometry import NO_FACE, Geometry
from depthsim.raycast.kernel import NUDGE, SKIN
from depthsim.raycast.packet import PIXELS, TILE

Mesh = tuple[NDArray[np.float64], NDArray[np.uint32]]
_NO_OBJECTS = np.empty((1, 0, 3, 4), np.float32)


class EmbreexScene:
    """Triangles in an embreex scene, and those of each object that moves in one of its own.

    There are no instances in it: rays are turned into the frame of an object, and the nearest hit of all is taken.
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.uint32], objects: Sequence[Mesh] = ()) -> None:
        self._scene, *self._objects = (_Triangles(*mesh) for mesh in ((vertices, faces), *objects))
        self._first_faces = np.cumsum([len(faces), *(len(mesh[1]) for mesh in objects)])

    def standing(self) -> "EmbreexScene":
        """What stands alone."""
        other = copy(self)
        other._objects = []
        return other

    def cast(
        self,
        camera: Camera,
        rays: NDArray[np.float32],
        pose: NDArray[np.float32],
        face_tags: NDArray[np.uint8],
        out: Geometry,
        right: bool,
        objects: NDArray[np.float32] = _NO_OBJECTS,
    ) -> None:
        """Fill ``out``; the arguments are those of the kernel. objects: (1 or H, objects, 3, 4) object to world."""
        height, width = camera.shape
        where = np.broadcast_to(objects.swapaxes(0, 1)[:, :, None], (objects.shape[1], height, width, 3, 4))
        where = where.reshape(objects.shape[1], height * width, 3, 4)
        rotation = np.broadcast_to(pose[:, :9].reshape(-1, 1, 3, 3), (height, width, 3, 3))
        origin = np.ascontiguousarray(np.broadcast_to(pose[:, None, 9:], (height, width, 3))).reshape(-1, 3)
        directions = np.stack([rays[0], rays[1], np.ones_like(rays[0])], axis=-1)
        direction = np.einsum("hwij,hwj->hwi", rotation, directions).astype(np.float32).reshape(-1, 3)
        found = self._meet(origin, direction, where)
        missed = _may_have_slipped(found["geomID"].reshape(height, width) < 0).reshape(-1)
        direction[missed] += NUDGE * (rotation[..., 0] + rotation[..., 1]).reshape(-1, 3)[missed]
        again = self._meet(origin[missed], direction[missed], where[:, missed])
        for name in ("geomID", "primID", "tfar", "Ng"):
            found[name][missed] = again[name]
        hit = found["geomID"] >= 0
        depth = np.where(hit, found["tfar"], 0).astype(np.float32)
        face = np.where(hit, found["primID"], NO_FACE).astype(np.int32)
        normal = found["Ng"]
        lengths = np.linalg.norm(normal, axis=1) * np.linalg.norm(direction, axis=1)
        cosine = np.abs((normal * direction).sum(axis=1)) / np.where(hit, lengths, 1)
        out.depth[:] = depth.reshape(height, width)
        out.face[:] = face.reshape(height, width)
        out.cosine[:] = np.where(hit, np.minimum(cosine, 1), 0).reshape(height, width)
        out.tag[:] = face_tags[face + 1].reshape(height, width)
        if right and out.right_sees is not None:
            sideways = rotation[..., 0].reshape(-1, 3)
            shift = np.divide(camera.baseline, depth, out=np.zeros_like(depth), where=depth > 0)
            toward = direction - sideways * shift[:, None]
            start = origin + sideways * np.float32(camera.baseline)
            blocked = self._blocked(start, toward, where, depth * SKIN)
            out.right_sees[:] = (hit & ~blocked).reshape(height, width)

    def _meet(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32], where: NDArray[np.float32]
    ) -> dict[str, NDArray[Any]]:
        """What rays meet, as embreex says it; faces are numbered through, normals are in the world."""
        found: dict[str, NDArray[Any]] = self._scene.run(origin, direction, output=1)
        for tree, first, pose in zip(self._objects, self._first_faces, where, strict=False):
            own = tree.run(*_into(pose, origin, direction), output=1)
            nearer = (own["geomID"] >= 0) & ((found["geomID"] < 0) | (own["tfar"] < found["tfar"]))
            own["primID"] = own["primID"] + first
            own["Ng"] = np.einsum("nij,nj->ni", pose[..., :3], own["Ng"])
            for name in ("geomID", "primID", "tfar", "Ng"):
                found[name][nearer] = own[name][nearer]
        return found

    def _blocked(
        self,
        origin: NDArray[np.float32],
        direction: NDArray[np.float32],
        where: NDArray[np.float32],
        far: NDArray[np.float32] | None = None,
    ) -> NDArray[np.bool_]:
        """Whether rays meet anything before ``far``."""
        blocked = np.asarray(self._scene.run(origin, direction, far, query="OCCLUDED")) >= 0
        for tree, pose in zip(self._objects, where, strict=True):
            blocked |= np.asarray(tree.run(*_into(pose, origin, direction), far, query="OCCLUDED")) >= 0
        return np.asarray(blocked)

    def reached(
        self,
        rays: NDArray[np.float32],
        poses: NDArray[np.float32],
        depth: NDArray[np.float32],
        direction: NDArray[np.float32],
        out: NDArray[np.uint8],
        objects: NDArray[np.float32] = _NO_OBJECTS,
    ) -> None:
        """Fill ``out``; the arguments are those of the kernel. objects: (1 or H, objects, 3, 4) object to world."""
        x, y = rays
        places = np.stack([x, y, np.ones_like(x)], axis=-1) * (depth * SKIN)[..., None]
        turned = places @ poses[:, :9].reshape(-1, 3, 3).swapaxes(1, 2)
        origin = (turned + poses[:, None, 9:]).reshape(-1, 3)
        toward = np.ascontiguousarray(np.broadcast_to(direction, origin.shape))
        where = np.broadcast_to(objects.swapaxes(0, 1)[:, :, None], (objects.shape[1], *depth.shape, 3, 4))
        where = where.reshape(objects.shape[1], depth.size, 3, 4)
        out[:] = (depth > 0) & ~self._blocked(origin, toward, where).reshape(depth.shape)


class _Triangles:
    """An embreex scene of one mesh."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.uint32]) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene(robust=True)
        self._mesh = TriangleMesh(self._scene, vertices.astype(np.float32)[faces])
        self.run: Callable[..., Any] = self._scene.run


def _into(
    pose: NDArray[np.float32], origin: NDArray[np.float32], direction: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Rays in the world in the frame of an object, which is (N, 3, 4) at ``pose``."""
    back = np.ascontiguousarray(pose[..., :3].swapaxes(1, 2))
    turned = np.einsum("nij,nj->ni", back, origin - pose[..., 3]), np.einsum("nij,nj->ni", back, direction)
    return tuple(np.ascontiguousarray(part, np.float32) for part in turned)  # type: ignore[return-value]


def _may_have_slipped(missed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The misses that are cast again, as in the kernel: those of tiles that mostly hit or hang over the border."""
    height, width = missed.shape
    rows, columns = height // TILE, width // TILE
    again = np.ones((rows + 1, columns + 1), np.bool_)
    tiles = missed[: rows * TILE, : columns * TILE].reshape(rows, TILE, columns, TILE)
    again[:rows, :columns] = tiles.sum(axis=(1, 3)) <= PIXELS // 2
    return missed & again.repeat(TILE, axis=0).repeat(TILE, axis=1)[:height, :width]
