"""The ray caster over one scene."""

import os
import threading
from collections.abc import Collection
from copy import copy
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.parallel import core_count, run_threads
from depthsim.raycast import embree
from depthsim.raycast.geometry import Geometry
from depthsim.raycast.placed import Placed, meshes_of_movers, rows_of
from depthsim.scene import NO_TAG, Scene


class Caster:
    """Casts the rays of a camera into a scene.

    The acceleration structure is built once. Vertices are kept relative to the scene's middle, so that scenes far from
    the origin keep float32's precision where it matters. With ``backend="embreex"``, or where the Embree library
    cannot be loaded, embreex's own call does the same more slowly.

    Of a scene with objects that move each has a structure of its own, built once like that of what stands.
    """

    def __init__(self, scene: Scene, backend: str | None = None) -> None:
        backend = backend or os.environ.get("DEPTHSIM_RAYCASTER") or "embree"
        if backend not in ("embree", "embreex"):
            raise InputError("DEPTHSIM_RAYCASTER", "", f"there is no ray caster {backend!r}", "use embree or embreex")
        self.scene = scene
        self._middle = _checked_bounds(scene).mean(axis=0)
        # A miss is face -1: with NO_TAG put before the first face, face + 1 needs no test.
        self._face_tags = np.concatenate([[np.uint8(NO_TAG)], scene.face_tags]).astype(np.uint8)
        count, faces = scene.standing
        vertices, faces_of_rest = scene.vertices[:count] - self._middle, scene.faces[:faces]
        self._embree: embree.EmbreeScene | None = None
        self._opaque: dict[bytes, Any]
        self._objects: tuple[embree.EmbreeScene, ...] = ()
        if backend == "embree":
            try:
                self._embree = embree.EmbreeScene(vertices, faces_of_rest)
                self._objects = tuple(embree.EmbreeScene(*mesh) for mesh in meshes_of_movers(scene))
                self._lanes = embree.packet_lanes()
            except embree.EmbreeMissing:
                backend = "embreex"
        self.backend = backend
        if self._embree is None:
            from depthsim.raycast.fallback import EmbreexScene

            self._embreex = EmbreexScene(vertices, faces_of_rest, meshes_of_movers(scene))
        self._opaque, self._lock = {}, threading.Lock()

    def retagged(self, scene: Scene) -> "Caster":
        """A caster over the same triangles with the tags and motions of ``scene``; it shares what was built."""
        if not (np.array_equal(scene.vertices, self.scene.vertices) and np.array_equal(scene.faces, self.scene.faces)):
            raise ValueError(f"scene {scene.name!r} has other triangles than {self.scene.name!r}")
        if [mover.faces for mover in scene.movers] != [mover.faces for mover in self.scene.movers]:
            raise ValueError(f"in scene {scene.name!r} other faces move than in {self.scene.name!r}")
        other = copy(self)
        other.scene, other._opaque = scene, {}
        other._face_tags = np.concatenate([[np.uint8(NO_TAG)], scene.face_tags]).astype(np.uint8)
        return other

    def standing(self) -> "Caster":
        """A caster over what stands alone; it shares what was built."""
        other = copy(self)
        other.scene, other._objects, other._opaque = replace(self.scene, movers=()), (), {}
        if self._embree is None:
            other._embreex = self._embreex.standing()
        return other

    def cast(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        *,
        right: bool = False,
        rays: NDArray[np.float32] | None = None,
        stamps: float | NDArray[np.float64] = 0.0,
        threads: int | None = None,
        out: Geometry | None = None,
    ) -> Geometry:
        """The clean geometry that the left imager sees.

        poses: (4, 4) or (N, 4, 4) camera to world; or (N, height, 4, 4), a pose for every row.
        stamps: when, for objects that move [s]: one for all poses, (N,), or (N, height), a time for every row.
        right: also find out whether the right imager sees each point.
        rays: (2, height, width) float32 directions at z = 1 in place of the camera's own.
        threads: all cores by default; the result does not depend on it.
        out: the result of an earlier call, to be written over where its shape fits.
        """
        poses = np.asarray(poses, np.float64)
        if rays is not None and rays.shape != (2, *camera.shape):
            raise ValueError(f"rays must be {(2, *camera.shape)}, not {rays.shape}")
        if not np.isfinite(poses).all():
            raise ValueError("a pose is not finite")
        if poses.shape[-2:] != (4, 4) or poses.ndim not in (2, 3, 4):
            raise ValueError(f"poses must be (4, 4), (N, 4, 4) or (N, {camera.height}, 4, 4), not {poses.shape}")
        if poses.ndim == 4 and poses.shape[1] != camera.height:
            raise ValueError(f"poses has {poses.shape[1]} rows, the camera {camera.height}")
        single = poses.ndim == 2
        poses = poses.reshape(-1, 1, 4, 4) if poses.ndim < 4 else poses
        shape = camera.shape if single else (len(poses), *camera.shape)
        if out is None or out.depth.shape != shape or right != (out.right_sees is not None):
            out = Geometry.empty(shape, right)
        pictures = out.reshaped((-1, *camera.shape))
        rows = np.empty((*poses.shape[:2], 12), np.float32)
        rows[..., :9] = poses[..., :3, :3].reshape(*poses.shape[:2], 9)
        rows[..., 9:] = poses[..., :3, 3] - self._middle
        if self._embree is not None:
            from depthsim.raycast.kernel import tile_rays

            tiles = _camera_tiles(camera, self._lanes) if rays is None else tile_rays(rays, self._lanes)
        times = np.asarray(stamps, np.float64)
        if self.scene.movers and times.shape not in ((), (len(poses),), (len(poses), camera.height)):
            raise ValueError(f"stamps are {times.shape} for {len(poses)} poses of {camera.height} rows")
        for index in range(len(poses)):
            at = np.atleast_1d(times if times.ndim == 0 else times[index])
            if self._embree is not None:
                placed = self._placed(camera, poses[index], at)
                self._cast_tiles(camera, tiles, rows[index], pictures[index], right, threads or core_count(), placed)
            else:
                rays = camera.rays if rays is None else rays
                where = rows_of(self.scene.movers, at, self._middle)
                self._embreex.cast(camera, rays, rows[index], self._face_tags, pictures[index], right, where)
        return out

    def reached(
        self,
        camera: Camera,
        pose: NDArray[np.float64],
        depth: NDArray[np.float32],
        direction: NDArray[np.floating],
        threads: int | None = None,
        stamps: float | NDArray[np.float64] = 0.0,
        rays: NDArray[np.float32] | None = None,
        through: Collection[str] = (),
    ) -> NDArray[np.uint8]:
        """(height, width) uint8: 1 where light from far away reaches what the camera sees, 0 in shadow or no hit.

        pose: (4, 4) camera to world, or (height, 4, 4), a pose for every row. rays: (2, height, width) float32, at
        z = 1 in place of the camera's own. depth: (height, width) float32, as cast by these. direction: (3,) unit
        vector towards the light, in the world. The side that a surface turns to the light is not asked for. stamps:
        when [s], one for all rows or one for each. through: tags of what light passes, unless it moves.
        """
        out, toward = np.empty(camera.shape, np.uint8), np.asarray(direction, np.float32)
        times = np.atleast_1d(np.asarray(stamps, np.float64))
        poses, rays = pose.reshape(-1, 4, 4), camera.rays if rays is None else rays
        rows = np.concatenate([poses[:, :3, :3].reshape(-1, 9), poses[:, :3, 3] - self._middle], axis=1)
        rows = rows.astype(np.float32)
        if self._embree is None:
            where = rows_of(self.scene.movers, times, self._middle)
            self._without(through).reached(rays, rows, depth, toward, out, where)
            return out
        from depthsim.raycast.packet import FIELDS
        from depthsim.raycast.skyward import reach_kernel

        arguments, valid = embree.query_arguments(), embree.all_lanes()
        occluded, reach_rows = embree.address(f"rtcOccluded{self._lanes}"), reach_kernel(self._lanes)
        scenes = [(self._without(through).handle, rows, toward[None], out)]
        placed = self._placed(camera, poses, times)
        if placed is not None:
            for number, handle in enumerate(placed.handles):
                own = np.ascontiguousarray(placed.rows[:, number])
                turned = own[:, :9].reshape(-1, 3, 3) @ rows[:, :9].reshape(-1, 3, 3).swapaxes(1, 2) @ toward
                scenes.append((int(handle), own, turned, np.empty(camera.shape, np.uint8)))
        threads = threads or core_count()
        cuts = np.linspace(0, camera.height, threads + 1).astype(int)

        def work(index: int) -> None:
            packet = embree.aligned((FIELDS * self._lanes,), np.float32)
            for handle, frames, lights, free in scenes:
                reach_rows(
                    cuts[index], cuts[index + 1], occluded, handle, arguments, valid, packet, frames, lights,
                    rays[0], rays[1], depth, free,
                )  # fmt: skip

        run_threads(work, threads)
        for *_, free in scenes[1:]:
            out &= free
        return out

    def _without(self, tags: Collection[str]) -> Any:
        """What stands less the faces with some tags, in a structure of its own, which is built once."""
        numbers = bytes(number for number, tag in enumerate(self.scene.tags) if tag in tags)
        with self._lock:
            if numbers not in self._opaque:
                self._opaque[numbers] = self._built_without(numbers)
            return self._opaque[numbers]

    def _built_without(self, numbers: bytes) -> Any:
        count, faces = self.scene.standing
        opaque = ~np.isin(self.scene.face_tags[:faces], [*numbers])
        if opaque.all():
            return self._embree or self._embreex
        mesh = self.scene.vertices[:count] - self._middle, self.scene.faces[:faces][opaque]
        if self._embree is not None:
            return embree.EmbreeScene(*mesh)
        from depthsim.raycast.fallback import EmbreexScene

        return EmbreexScene(*mesh, meshes_of_movers(self.scene))

    def _placed(self, camera: Camera, pose: NDArray[np.float64], stamps: NDArray[np.float64]) -> Placed | None:
        """The objects that move, in front of a camera at ``pose``, (1 or H, 4, 4)."""
        if not self._objects:
            return None
        return Placed(self.scene.movers, stamps, pose, camera.baseline, self._middle, self._objects)

    def _cast_tiles(
        self,
        camera: Camera,
        tiles: NDArray[np.float32],
        pose: NDArray[np.float32],
        out: Geometry,
        right: bool,
        threads: int,
        placed: Placed | None,
    ) -> None:
        from depthsim.raycast.kernel import cast_kernel
        from depthsim.raycast.packet import FIELDS, PIXELS

        assert self._embree is not None
        lanes, cast_tiles = self._lanes, cast_kernel(self._lanes, placed is not None)
        scene, arguments, valid = self._embree.handle, embree.query_arguments(), embree.all_lanes()
        intersect, occluded = embree.address(f"rtcIntersect{lanes}"), embree.address(f"rtcOccluded{lanes}")
        counter = np.zeros(1, np.int64)
        right_sees = out.right_sees if right and out.right_sees is not None else np.empty((0, 0), np.uint8)
        baseline = np.float32(camera.baseline)
        objects = _NO_OBJECTS
        if placed is not None:
            objects = (placed.rows, placed.handles, placed.first_faces, placed.boxes)

        def work(_: int) -> None:
            packets, shadows = (embree.aligned((PIXELS // lanes, FIELDS * lanes), np.float32) for _ in range(2))
            turns = embree.aligned((PIXELS // lanes, 9 * lanes), np.float32)
            frames = embree.aligned((PIXELS // lanes, objects[0].shape[1], 12 * lanes), np.float32)
            cast_tiles(
                counter, intersect, occluded, scene, arguments, valid, packets, shadows, turns,
                tiles, pose, baseline, self._face_tags, out.depth, out.face, out.cosine, out.tag, right_sees,
                frames, *objects,
            )  # fmt: skip

        run_threads(work, threads)


_NO_OBJECTS = (
    np.empty((1, 0, 12), np.float32),
    np.empty(0, np.int64),
    np.empty(0, np.int32),
    np.empty((2, 0, 4), np.float32),
)


@lru_cache(maxsize=8)
def _camera_tiles(camera: Camera, lanes: int) -> NDArray[np.float32]:
    """A camera's rays as the kernel takes them: the same for every frame."""
    from depthsim.raycast.kernel import tile_rays

    return tile_rays(camera.rays, lanes)


def _checked_bounds(scene: Scene) -> NDArray[np.float64]:
    """(2, 3) the corners of what the faces span; ValueError for a scene that the kernel must not be given."""
    count = len(scene.vertices)
    if not len(scene.faces):
        raise ValueError(f"scene {scene.name!r} has no faces")
    if scene.faces.max() >= count:
        raise ValueError(f"scene {scene.name!r} has a face with vertex {scene.faces.max()}, but {count} vertices")
    if len(scene.face_tags) != len(scene.faces):
        raise ValueError(f"scene {scene.name!r} has {len(scene.faces)} faces, but {len(scene.face_tags)} tags of faces")
    used = np.zeros(count, np.bool_)
    used[scene.faces] = True
    if not np.isfinite(scene.vertices[used]).all():
        raise ValueError(f"scene {scene.name!r} has a vertex that is not finite")
    if not scene.standing[1]:
        raise ValueError(f"in scene {scene.name!r} everything moves")
    used[scene.standing[0] :] = False
    vertices = scene.vertices[used]
    return np.stack([vertices.min(axis=0), vertices.max(axis=0)])
