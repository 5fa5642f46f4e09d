"""A closed rough tube of any number of faces, and the camera in it: the scene of the speed figures."""

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.presets import preset
from depthsim.scene import Scene


def tube(faces: int, seed: int = 0) -> Scene:
    """A tube along x with bumps and grain, closed at both ends, of about ``faces`` triangles."""
    around = max(8, int(np.sqrt(faces / 2)))
    along = around
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    x, a = np.meshgrid(np.linspace(-2.0, 30.0, along), angle, indexing="ij")
    grain = np.random.default_rng(seed).standard_normal(x.shape)
    radius = 2.0 + 0.3 * np.sin(3 * a + x) + 0.045 * grain
    vertices = np.stack([x, radius * np.cos(a), radius * np.sin(a)], axis=-1).reshape(-1, 3)
    i, j = (index.reshape(-1) for index in np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij"))
    a00, a01 = i * around + j, i * around + (j + 1) % around
    a10, a11 = a00 + around, a01 + around
    ring, ends = np.arange(around), len(vertices) + np.arange(2)
    last = (along - 1) * around
    caps = [
        np.stack([np.full(around, ends[0]), ring, (ring + 1) % around], axis=1),
        np.stack([np.full(around, ends[1]), last + (ring + 1) % around, last + ring], axis=1),
    ]
    walls = [np.stack([a00, a10, a11], axis=1), np.stack([a00, a11, a01], axis=1)]
    triangles = np.concatenate([*walls, *caps]).astype(np.uint32)
    vertices = np.concatenate([vertices, [[-2.0, 0, 0], [30.0, 0, 0]]])
    tags = (np.arange(len(triangles)) // 997 % 3).astype(np.uint8)
    return Scene(f"tube of {len(triangles):,} faces", vertices, triangles, tags, ("cement", "formboard", "plastic"))


def box() -> Scene:
    """A box of 12 faces, seen from inside."""
    corners = np.array([[x, y, z] for x in (-3.0, 17.0) for y in (-3.0, 3.0) for z in (-2.5, 2.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))], np.uint32)
    return Scene("box of 12 faces", corners, faces, np.zeros(12, np.uint8), ("cement",))


def view() -> NDArray[np.float64]:
    """(4, 4) the camera near the tube's axis, looking along it."""
    pose = np.eye(4)
    pose[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    pose[:3, 3] = [0, 0.1, 0.2]
    return pose


def camera(width: int = 848, height: int = 480) -> Camera:
    """A D435 of that resolution."""
    return preset("d435", width, height)
