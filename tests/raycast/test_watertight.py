"""No ray slips through a closed mesh, or the fill rate would measure the ray caster."""

import numpy as np
import pytest
from shapes import as_scene, box, camera, random_poses, sphere

from depthsim.raycast import Caster


def jittered_sphere(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed mesh of 20,480 irregular faces around the origin, which sees all of it."""
    vertices, faces = sphere(5)
    rng = np.random.default_rng(seed)
    return vertices * rng.uniform(0.9, 1.1, (len(vertices), 1)) + rng.normal(0, 0.004, vertices.shape), faces


def irregular_box(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed box of thousands of faces, from squares to splinters."""
    cuts = np.random.default_rng(seed).uniform(-1, 1, (3, 25))
    return box((-1, -1, -1), (1, 1, 1), cuts)


@pytest.mark.parametrize("mesh", [jittered_sphere, irregular_box])
def test_a_closed_mesh_has_no_hole_in_ten_million_rays(mesh) -> None:
    caster, cam = Caster(as_scene(mesh(1))), camera(848, 480, 300)
    rays, result = 0, None
    for pose in random_poses(np.random.default_rng(2), 13, 0.6):
        result = caster.cast(cam, pose, out=result)
        assert np.count_nonzero(~result.hit) == 0
        assert np.count_nonzero(result.depth <= 0) == 0
        rays += result.hit.size
    assert rays * 2 > 10_000_000  # with the other mesh


@pytest.mark.parametrize("mesh", [jittered_sphere, irregular_box])
@pytest.mark.parametrize("away", [0.0, 5e5])
def test_no_ray_aimed_at_an_edge_or_a_vertex_slips_through(mesh, away: float) -> None:
    vertices, faces = mesh(3)
    rng, cam = np.random.default_rng(4), camera(640, 400)
    caster = Caster(as_scene((vertices + away, faces)))
    for pose in random_poses(rng, 8, 0.5):
        inside = (vertices - pose[:3, 3]) @ pose[:3, :3]  # in the camera's frame
        ahead = faces[(inside[faces, 2] > 0.2).all(axis=1)]
        corner = inside[ahead[rng.integers(0, len(ahead), cam.width * cam.height)]]
        share = rng.uniform(size=(len(corner), 1)) * (rng.uniform(size=(len(corner), 1)) < 0.7)  # 0 is the vertex
        point = corner[:, 0] * (1 - share) + corner[:, 1] * share
        rays = (point[:, :2] / point[:, 2:]).T.reshape(2, *cam.shape).astype(np.float32)
        pose[:3, 3] += away
        assert np.count_nonzero(~caster.cast(cam, pose, rays=rays).hit) == 0


@pytest.mark.parametrize("backend", ["embree", "embreex"])
def test_a_camera_square_to_a_regular_grid_has_no_hole(backend: str) -> None:
    # Every ray meets a vertex to the last bit or nearly: Embree alone lets one in a hundred through.
    n, cam = 120, camera(217, 161, 425)
    x, y = np.meshgrid(*[np.arange(-n, n + 1) * 0.01] * 2, indexing="ij")
    grid = np.stack([x, y, np.full_like(x, 4.25)], axis=-1).reshape(-1, 3)
    a = (np.arange(2 * n)[:, None] * (2 * n + 1) + np.arange(2 * n)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + 2 * n + 2], 1), np.stack([a, a + 2 * n + 2, a + 2 * n + 1], 1)])
    for turn in (np.eye(4), *random_poses(np.random.default_rng(10), 3, 0)):
        seen = Caster(as_scene((grid @ turn[:3, :3].T, faces)), backend).cast(cam, turn)
        assert seen.hit.all()
        assert np.abs(seen.depth - 4.25).max() < 1e-5
