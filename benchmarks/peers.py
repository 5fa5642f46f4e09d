"""The peers of the ray caster, each made to cast the same rays: what a call of them takes.

Every function gives a call without arguments, or None where the peer is not installed.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.kernels import kernel
from depthsim.llvm import bits_float, call_embree, fetch_add
from depthsim.parallel import core_count, run_threads
from depthsim.raycast import embree
from depthsim.raycast.packet import (
    ACROSS,
    DIRECTION_X,
    DIRECTION_Y,
    DIRECTION_Z,
    FAR,
    FIELDS,
    GEOMETRY,
    INSTANCE,
    MASK,
    ORIGIN_X,
    ORIGIN_Y,
    ORIGIN_Z,
)
from depthsim.scene import Scene

Call = Callable[[], object]


def world_rays(camera: Camera, pose: NDArray) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Origins and directions (N, 3) float32 of a camera's rays, z = 1 in the camera."""
    directions = np.stack([*camera.rays, np.ones(camera.shape, np.float32)], axis=-1).reshape(-1, 3) @ pose[:3, :3].T
    origins = np.broadcast_to(pose[:3, 3], directions.shape)
    return np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32)


@cache
def _bare_kernel(lanes: int) -> Any:
    across, down = ACROSS[lanes], lanes // ACROSS[lanes]

    @kernel
    def bare_loop(counter, intersect, scene, arguments, valid, packet, pose, fx, fy, cx, cy, width, height):
        """Aim, call rtcIntersectN, and nothing else: no result is read."""
        none = bits_float(np.int32(-1))
        for lane in range(lanes):
            packet[MASK * lanes + lane] = none
            packet[INSTANCE * lanes + lane] = none
            packet[ORIGIN_X * lanes + lane] = pose[9]
            packet[ORIGIN_Y * lanes + lane] = pose[10]
            packet[ORIGIN_Z * lanes + lane] = pose[11]
        while True:
            v0 = down * fetch_add(counter.ctypes.data, 1)
            if v0 >= height:
                break
            for u0 in range(0, width, across):
                for lane in range(lanes):
                    x = (np.float32(u0 + lane % across) - cx) / fx
                    y = (np.float32(v0 + lane // across) - cy) / fy
                    packet[DIRECTION_X * lanes + lane] = pose[0] * x + pose[1] * y + pose[2]
                    packet[DIRECTION_Y * lanes + lane] = pose[3] * x + pose[4] * y + pose[5]
                    packet[DIRECTION_Z * lanes + lane] = pose[6] * x + pose[7] * y + pose[8]
                    packet[FAR * lanes + lane] = np.float32(np.inf)
                    packet[GEOMETRY * lanes + lane] = none
                call_embree(intersect, valid.ctypes.data, scene, packet.ctypes.data, arguments.ctypes.data)

    return bare_loop


def bare_loop(scene: Scene, camera: Camera, pose: NDArray) -> Call:
    """``rtcIntersectN`` in a loop on all cores, N as the device likes it: the floor under every caster that uses it."""
    middle = scene.bounds.mean(axis=0)
    tree, lanes = embree.EmbreeScene(scene.vertices - middle, scene.faces), embree.packet_lanes()
    row = np.concatenate([pose[:3, :3].reshape(-1), pose[:3, 3] - middle]).astype(np.float32)
    arguments, valid = embree.query_arguments(), embree.all_lanes()
    numbers = [np.float32(value) for value in (camera.fx, camera.fy, camera.cx, camera.cy)]
    intersect, loop = embree.address(f"rtcIntersect{lanes}"), _bare_kernel(lanes)

    def call(threads: int | None = None) -> None:
        counter = np.zeros(1, np.int64)

        def work(_: int) -> None:
            packet = embree.aligned((FIELDS * lanes,), np.float32)
            loop(counter, intersect, tree.handle, arguments, valid, packet, row, *numbers, camera.width, camera.height)

        run_threads(work, threads or core_count())

    return call


def embreex_run(scene: Scene, camera: Camera, pose: NDArray) -> Call:
    """embreex's own ``run`` with all outputs, the rays split over as many Python threads as there are cores."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    tree = EmbreeScene(robust=True)
    mesh = TriangleMesh(tree, scene.vertices.astype(np.float32)[scene.faces])
    origins, directions = world_rays(camera, pose)
    parts = list(zip(*(np.array_split(a, core_count()) for a in (origins, directions)), strict=True))
    pool = ThreadPoolExecutor(core_count())

    def call() -> object:
        return mesh and list(pool.map(lambda part: tree.run(*part, output=1), parts))

    return call


def open3d_cast_rays(scene: Scene, camera: Camera, pose: NDArray) -> Call | None:
    """Open3D's RaycastingScene.cast_rays."""
    from depthsim.errors import InputError
    from depthsim.open3d_loader import load_open3d

    try:
        o3d = load_open3d()
    except InputError:
        return None
    tree = o3d.t.geometry.RaycastingScene()
    tree.add_triangles(o3d.core.Tensor(scene.vertices.astype(np.float32)), o3d.core.Tensor(scene.faces))
    rays = o3d.core.Tensor(np.hstack(world_rays(camera, pose)))
    return lambda: tree.cast_rays(rays)


def mitsuba_intersect(scene: Scene, camera: Camera, pose: NDArray, variant: str) -> Call | None:
    """Mitsuba 3's ray_intersect_preliminary on rays that already lie in its arrays."""
    try:
        import drjit as dr
        import mitsuba as mi
    except ImportError:
        return None
    if variant not in mi.variants():
        return None
    mi.set_variant(variant)
    mesh = mi.Mesh("scene", len(scene.vertices), len(scene.faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = scene.vertices.astype(np.float32).ravel()
    parameters["faces"] = scene.faces.ravel()
    parameters.update()
    tree = mi.load_dict({"type": "scene", "mesh": mesh})
    origins, directions = world_rays(camera, pose)
    origin = mi.Point3f(*(mi.Float(np.ascontiguousarray(origins[:, axis])) for axis in range(3)))
    direction = mi.Vector3f(*(mi.Float(np.ascontiguousarray(directions[:, axis])) for axis in range(3)))
    dr.eval(origin, direction)
    dr.sync_thread()

    def call() -> object:
        mi.set_variant(variant)
        found = tree.ray_intersect_preliminary(mi.Ray3f(origin, direction), coherent=True)
        dr.eval(found)
        dr.sync_thread()
        return found

    return call
