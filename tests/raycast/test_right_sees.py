"""What the right imager sees, which sits at +baseline along the camera's x."""

import numpy as np
import pytest
from shapes import as_scene, camera, intersect, look_at, quad, random_poses, soup, sphere, wall, world_rays

from depthsim.raycast import Caster


def runs(row: np.ndarray) -> list[tuple[int, int]]:
    """First pixel and length of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], row.astype(int), [0]])))
    return [(int(a), int(b - a)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


@pytest.mark.parametrize("backend", ["embree", "embreex"])
@pytest.mark.parametrize(("plate", "behind", "baseline"), [(0.5, 2.0, 0.05), (0.8, 1.0, 0.05), (1.0, 4.0, 0.095)])
def test_a_plate_in_front_of_a_wall_casts_its_shadow_to_its_left(
    backend: str, plate: float, behind: float, baseline: float
) -> None:
    # For the right imager the wall's point X is behind the plate's x where (X - b) / behind = (x - b) / plate, so the
    # pixel of X is left of that of x by f·b·(1 / plate - 1 / behind).
    cam, pose = camera(320, 200, 400, baseline=baseline), random_poses(np.random.default_rng(1), 1, 3)[0]
    left, right = -60, 80  # the plate's sides in the left image [px from the middle]
    low, size = np.array([left, -40]) / cam.fx * plate, np.array([right - left, 80]) / cam.fx * plate
    meshes = [quad((*low, plate), (0, size[1], 0), (size[0], 0, 0)), wall(behind, half=10)]
    meshes = [(vertices @ pose[:3, :3].T + pose[:3, 3], faces) for vertices, faces in meshes]
    seen = Caster(as_scene(*meshes, tags=["plastic", "cement"]), backend).cast(cam, pose, right=True)
    width = cam.fx * baseline * (1 / plate - 1 / behind)
    for row in (70, 100, 130):
        ((first, length),) = runs(seen.right_sees[row] == 0)
        assert abs(length - width) <= 1
        assert abs(first - (cam.cx + left - width)) <= 1
        assert abs(first + length - (cam.cx + left)) <= 1
        assert (seen.tag[row, first : first + length] == 1).all()  # on the wall
    assert seen.right_sees[:40].all() and seen.right_sees[-40:].all()


@pytest.mark.parametrize("backend", ["embree", "embreex"])
def test_of_a_ball_alone_the_right_imager_misses_the_left_flank(backend: str) -> None:
    ball, cam, pose = sphere(5), camera(120, 120, 140, baseline=0.6), look_at((2.5, 0, 0), (0, 0, 0))
    scene = as_scene(ball)
    seen = Caster(scene, backend).cast(cam, pose, right=True)
    origins, rays = world_rays(cam, pose)
    points = (origins + rays * seen.depth.reshape(-1, 1)).reshape(*cam.shape, 3)
    toward = pose[:3, 3] + cam.baseline * pose[:3, 0] - points
    facing = (seen.normals(scene) * toward).sum(axis=-1) / np.linalg.norm(toward, axis=-1)
    assert seen.right_sees[seen.hit & (facing > 0)].all()
    # Just beyond the rim the ball hides its points by less than the skin of a thousandth of the range.
    hidden = seen.hit & (facing < -0.03)
    assert not seen.right_sees[hidden].any()
    rows, columns = np.nonzero(hidden)
    assert len(rows) > 100
    assert (columns < cam.cx).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_soup_against_float64(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene, cam = as_scene(soup(rng, 120)), camera(baseline=0.2)
    pose = look_at((2.5, 1, 0.5), (0, 0, 0))
    seen = Caster(scene).cast(cam, pose, right=True)
    origins, rays = world_rays(cam, pose)
    points = origins + rays * seen.depth.reshape(-1, 1)
    start = origins + cam.baseline * pose[:3, 0]
    blocked = (intersect(scene, start, points - start) < 1 - 1e-3).any(axis=1).reshape(cam.shape)
    expected = seen.hit & ~blocked
    assert 0.02 < (seen.hit & blocked).mean() < 0.9
    assert np.count_nonzero(seen.right_sees != expected) <= 3


def test_a_wall_alone_hides_nothing_even_at_a_grazing_angle() -> None:
    scene, cam = as_scene(wall(2)), camera(160, 120, 100)
    for degrees in (0, 60, 80, 85):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        for turn in (
            [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            [[c, 0, -s], [0, 1, 0], [s, 0, c]],
            [[1, 0, 0], [0, c, s], [0, -s, c]],
        ):
            pose = np.eye(4)
            pose[:3, :3] = turn
            seen = Caster(scene).cast(cam, pose, right=True)
            assert seen.hit.any()
            assert np.array_equal(seen.right_sees.astype(bool), seen.hit)
