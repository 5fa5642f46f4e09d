"""The same cast through embreex's own call: slower, and independent of our kernel, so it also checks it."""

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.raycast.geometry import NO_FACE, Geometry
from depthsim.raycast.kernel import NUDGE, SKIN
from depthsim.raycast.packet import PIXELS, TILE


class EmbreexScene:
    """Triangles in an embreex scene."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.uint32]) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene(robust=True)
        self._mesh = TriangleMesh(self._scene, vertices.astype(np.float32)[faces])

    def cast(
        self,
        camera: Camera,
        rays: NDArray[np.float32],
        pose: NDArray[np.float32],
        face_tags: NDArray[np.uint8],
        out: Geometry,
        right: bool,
    ) -> None:
        """Fill ``out``; the arguments are those of the kernel."""
        height, width = camera.shape
        rotation = np.broadcast_to(pose[:, :9].reshape(-1, 1, 3, 3), (height, width, 3, 3))
        origin = np.ascontiguousarray(np.broadcast_to(pose[:, None, 9:], (height, width, 3))).reshape(-1, 3)
        directions = np.stack([rays[0], rays[1], np.ones_like(rays[0])], axis=-1)
        direction = np.einsum("hwij,hwj->hwi", rotation, directions).astype(np.float32).reshape(-1, 3)
        found = self._scene.run(origin, direction, output=1)
        missed = _may_have_slipped(found["geomID"].reshape(height, width) < 0).reshape(-1)
        direction[missed] += NUDGE * (rotation[..., 0] + rotation[..., 1]).reshape(-1, 3)[missed]
        again = self._scene.run(origin[missed], direction[missed], output=1)
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
            blocked = self._scene.run(start, toward, depth * SKIN, query="OCCLUDED")
            out.right_sees[:] = (hit & (np.asarray(blocked) < 0)).reshape(height, width)

    def reached(
        self,
        camera: Camera,
        pose: NDArray[np.float32],
        depth: NDArray[np.float32],
        direction: NDArray[np.float32],
        out: NDArray[np.uint8],
    ) -> None:
        """Fill ``out``; the arguments are those of the kernel."""
        x, y = camera.rays
        places = np.stack([x, y, np.ones_like(x)], axis=-1) * (depth * SKIN)[..., None]
        origin = (places.reshape(-1, 3) @ pose[:9].reshape(3, 3).T + pose[9:]).astype(np.float32)
        toward = np.ascontiguousarray(np.broadcast_to(direction, origin.shape))
        blocked = np.asarray(self._scene.run(origin, toward, query="OCCLUDED")).reshape(depth.shape)
        out[:] = (depth > 0) & (blocked < 0)


def _may_have_slipped(missed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The misses that are cast again, as in the kernel: those of tiles that mostly hit or hang over the border."""
    height, width = missed.shape
    rows, columns = height // TILE, width // TILE
    again = np.ones((rows + 1, columns + 1), np.bool_)
    tiles = missed[: rows * TILE, : columns * TILE].reshape(rows, TILE, columns, TILE)
    again[:rows, :columns] = tiles.sum(axis=(1, 3)) <= PIXELS // 2
    return missed & again.repeat(TILE, axis=0).repeat(TILE, axis=1)[:height, :width]
