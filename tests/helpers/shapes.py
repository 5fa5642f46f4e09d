"""Small scenes built in NumPy, cameras that look at them, and a float64 ray caster of a few lines to be checked by."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.materials import Materials
from depthsim.scene import Scene

Array = NDArray[np.float64]
Mesh = tuple[Array, NDArray[np.uint32]]
"""(V, 3) vertices and (F, 3) faces."""

MATERIALS = Materials.model_validate(
    {"cement": {"m": 0.35, "albedo": 0.6}, "formboard": {"m": 0.5, "texture": 0.0}, "plastic": {"m": 0.85}}
)


def camera(width: int = 64, height: int = 48, focal: float = 50.0, **keys: object) -> Camera:
    """A camera whose axis goes through the middle of the image."""
    middle = {"cx": (width - 1) / 2, "cy": (height - 1) / 2}
    plain = {"width": width, "height": height, "fx": focal, "fy": focal, "baseline": 0.05}
    return Camera.model_validate({**plain, **middle, **keys})


def look_at(eye: Sequence[float], target: Sequence[float], up: Sequence[float] = (0, 0, 1)) -> Array:
    """(4, 4) camera to world: z to the target, x to the right, y down."""
    pose = np.eye(4)
    z = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    x = np.cross(z, up)
    x = x / np.linalg.norm(x)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    pose[:3, 3] = eye
    return pose


def random_poses(rng: np.random.Generator, count: int, radius: float) -> Array:
    """(count, 4, 4) poses turned every way, at most ``radius`` from the origin."""
    q, r = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    q = q * np.sign(np.einsum("nii->ni", r))[:, None, :]
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = q * np.sign(np.linalg.det(q))[:, None, None]
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    poses[:, :3, 3] = radius * np.cbrt(rng.uniform(size=(count, 1))) * direction
    return poses


def as_scene(*meshes: Mesh, tags: Sequence[str] | None = None) -> Scene:
    """One scene of several meshes, each with its tag; all cement if none are given."""
    names = tags or ["cement"] * len(meshes)
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    known = tuple(dict.fromkeys(names))
    return Scene(
        name="test",
        vertices=np.concatenate([vertices for vertices, _ in meshes]).astype(float),
        faces=np.concatenate([faces + offset for (_, faces), offset in zip(meshes, offsets[:-1], strict=True)]).astype(
            np.uint32
        ),
        face_tags=np.repeat([known.index(n) for n in names], [len(faces) for _, faces in meshes]).astype(np.uint8),
        tags=known,
    )


def quad(corner: Sequence[float], a: Sequence[float], b: Sequence[float]) -> Mesh:
    """The parallelogram from ``corner`` along ``a`` and ``b``; its normal is a x b."""
    p, a_, b_ = (np.array(v, float) for v in (corner, a, b))
    return np.stack([p, p + a_, p + a_ + b_, p + b_]), np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


def wall(distance: float, half: float = 50.0) -> Mesh:
    """A wall square to the optical axis of a camera with the pose eye(4)."""
    return quad((-half, -half, distance), (0, 2 * half, 0), (2 * half, 0, 0))


def box(low: Sequence[float], high: Sequence[float], lines: Sequence[Sequence[float]] = ((), (), ())) -> Mesh:
    """A closed box, normals outward; ``lines`` are further cuts along x, y and z, which all sides share."""
    cuts = [np.unique([lo, *more, hi]) for lo, hi, more in zip(low, high, lines, strict=True)]
    corners: list[Array] = []
    for axis, side in itertools.product(range(3), (0, -1)):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        a, b = np.meshgrid(cuts[u], cuts[v], indexing="ij")
        grid = np.zeros((*a.shape, 3))
        grid[..., u], grid[..., v], grid[..., axis] = a, b, cuts[axis][side]
        p, q, r, s = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
        turns = [(p, q, r), (p, r, s)] if side else [(p, r, q), (p, s, r)]
        corners += [np.stack(turn, axis=-2).reshape(-1, 3, 3) for turn in turns]
    vertices, index = np.unique(np.concatenate(corners).reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3).astype(np.uint32)


def sphere(subdivisions: int, radius: float = 1.0, centre: Sequence[float] = (0, 0, 0)) -> Mesh:
    """A closed sphere of 20·4^subdivisions faces, normals outward."""
    g = (1 + 5**0.5) / 2
    vertices = np.array([p for s, t in itertools.product((1, -1), (g, -g)) for p in ((0, s, t), (s, t, 0), (t, 0, s))])
    near = np.isclose(np.linalg.norm(vertices[:, None] - vertices, axis=2), 2)
    faces = np.array(
        [f for f in itertools.combinations(range(12), 3) if near[f[0], f[1]] & near[f[1], f[2]] & near[f[2], f[0]]]
    )
    flip = np.linalg.det(vertices[faces]) < 0
    faces[flip] = faces[flip][:, ::-1]
    for _ in range(subdivisions):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        unique, index = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (index.reshape(-1, 3) + len(vertices)).T
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        a, b, c = faces.T
        faces = np.concatenate([np.stack(f, axis=1) for f in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices * radius + np.array(centre, float), faces.astype(np.uint32)


def soup(rng: np.random.Generator, count: int, spread: float = 2.0, size: float = 0.4) -> Mesh:
    """Triangles anywhere within ``spread`` of the origin, in float32's grid."""
    vertices = rng.uniform(-spread, spread, (count, 1, 3)) + rng.normal(0, size, (count, 3, 3))
    return vertices.reshape(-1, 3).astype(np.float32).astype(float), np.arange(3 * count, dtype=np.uint32).reshape(
        -1, 3
    )


def world_rays(cam: Camera, pose: Array) -> tuple[Array, Array]:
    """Origins and directions (H·W, 3) whose parameter is the z-depth, worked out in float64 from the definition."""
    v, u = np.mgrid[: cam.height, : cam.width]
    ray = np.stack([(u - cam.cx) / cam.fx, (v - cam.cy) / cam.fy, np.ones(cam.shape)], axis=-1).reshape(-1, 3)
    return np.broadcast_to(pose[:3, 3], ray.shape), ray @ pose[:3, :3].T


def intersect(scene: Scene, origins: Array, directions: Array) -> Array:
    """(R, F) ray parameter where ray and face meet, inf where they do not: Möller and Trumbore 1997, in float64."""
    a, b, c = (scene.vertices[scene.faces[:, corner]] for corner in range(3))
    e1, e2 = b - a, c - a
    with np.errstate(all="ignore"):
        p = np.cross(directions[:, None], e2)
        det = (p * e1).sum(axis=2)
        s = origins[:, None] - a
        u = (p * s).sum(axis=2) / det
        q = np.cross(s, e1)
        v = (q * directions[:, None]).sum(axis=2) / det
        t = (q * e2).sum(axis=2) / det
        inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return np.where(inside, t, np.inf)


def first_hits(scene: Scene, origins: Array, directions: Array) -> tuple[Array, NDArray[np.int64], Array]:
    """Depth and face of the nearest hit, inf and -1 for none, and the depth of the one behind it, for every ray."""
    t = intersect(scene, origins, directions)
    face = t.argmin(axis=1)
    depth = t[np.arange(len(t)), face]
    t[np.arange(len(t)), face] = np.inf
    return depth, np.where(np.isfinite(depth), face, -1), t.min(axis=1)


def strips(distance: float, cam: Camera) -> Scene:
    """A wall square to a camera at eye(4): a third of the image's width each of cement, formboard and plastic."""
    cuts = np.array([-2, -1 / 6, 1 / 6, 2]) * cam.width / cam.fx * distance
    half = cuts[-1]
    sides = itertools.pairwise(cuts)
    parts = [quad((left, -half, distance), (0, 2 * half, 0), (right - left, 0, 0)) for left, right in sides]
    return as_scene(*parts, tags=["cement", "formboard", "plastic"])
