"""Intensity images: the same bytes always, and a texture that stays on the surface."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray
from shapes import MATERIALS, Array, as_scene, camera, look_at, quad, random_poses, soup, strips, wall, world_rays

from depthsim.camera import Camera
from depthsim.intensity import intensity_image, value_noise
from depthsim.lanes import load_floats, store
from depthsim.raycast import Caster
from depthsim.scene import Scene


def picture(scene: Scene, cam: Camera, pose: Array, threads: int | None = None) -> NDArray[np.uint8]:
    return intensity_image(Caster(scene).cast(cam, pose), cam, pose, scene, MATERIALS, threads)


def test_the_same_bytes_for_any_number_of_threads() -> None:
    scene, cam, pose = (
        as_scene(soup(np.random.default_rng(1), 500)),
        camera(203, 149, 150),
        look_at((3, 1, 1), (0, 0, 0)),
    )
    one = picture(scene, cam, pose, 1)
    for threads in (1, 2, 3, 4):
        assert picture(scene, cam, pose, threads).tobytes() == one.tobytes()


def test_what_is_not_hit_is_black_and_what_is_hit_is_not() -> None:
    scene, cam = as_scene(wall(2, half=0.5)), camera()
    image, hit = picture(scene, cam, np.eye(4)), Caster(scene).cast(cam, np.eye(4)).hit
    assert 0.1 < hit.mean() < 0.9
    assert not image[~hit].any()
    assert image[hit].min() > 10


def test_materials_differ_in_albedo_and_texture() -> None:
    cam = camera(90, 60, 60)
    cement, formboard, plastic = np.split(picture(strips(3.0, cam), cam, np.eye(4)).astype(float), 3, axis=1)
    assert formboard.std() == 0  # its texture is 0
    assert cement.std() > 5 and plastic.std() > 5
    assert cement.mean() > plastic.mean()


def bilinear(image: NDArray[np.uint8], u: Array, v: Array) -> Array:
    i, j = np.floor(u).astype(int), np.floor(v).astype(int)
    a, b, grey = u - i, v - j, image.astype(float)
    top, bottom = (grey[j + k, i] * (1 - a) + grey[j + k, i + 1] * a for k in (0, 1))
    return top * (1 - b) + bottom * b


@pytest.mark.parametrize("away", [(0, 0, 0), (-40, 90, 10), (5e5, -3e5, 100), (-2000, -3000, 0)])
def test_the_texture_stays_on_the_surface(away: tuple[float, float, float]) -> None:
    vertices, faces = quad((-3, -3, 0), (6, 0, 0), (0, 6, 0))
    scene, cam = as_scene((vertices + np.array(away), faces)), camera(320, 240, 400)
    one, two = (
        look_at((0.2, -0.3, 1.5), (0, 0, 0), up=(0, 1, 0)),
        look_at((-0.3, -0.4, 1.6), (0.1, 0, 0), up=(0.1, 1, 0)),
    )
    for pose in (one, two):
        pose[:3, 3] += away
    first, second = picture(scene, cam, one), picture(scene, cam, two)
    origins, rays = world_rays(cam, one)
    points = origins + rays * Caster(scene).cast(cam, one).depth.reshape(-1, 1)
    seen = (points - two[:3, 3]) @ two[:3, :3]
    u, v = cam.fx * seen[:, 0] / seen[:, 2] + cam.cx, cam.fy * seen[:, 1] / seen[:, 2] + cam.cy
    inside = (u > 1) & (u < cam.width - 2) & (v > 1) & (v < cam.height - 2)
    assert inside.mean() > 0.4
    a, b = first.reshape(-1)[inside].astype(float), bilinear(second, u[inside], v[inside])
    assert a.std() > 8
    # What differs is interpolation, rounding, and the finest octave, which fades with range.
    assert np.abs(a - b).mean() < 1.5
    assert np.percentile(np.abs(a - b), 99) < 6
    assert np.corrcoef(a, b)[0, 1] > 0.99


@settings(max_examples=20)
@given(st.integers(0, 2**32), st.sampled_from([1e-3, 1.0, 1e3]))
def test_any_pose_in_any_scene_gives_a_picture(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    vertices, faces = soup(rng, 100)
    pose = random_poses(rng, 1, 3)[0]
    pose[:3, 3] *= scale
    image = picture(as_scene((vertices * scale, faces)), camera(), pose)
    assert image.shape == (48, 64) and image.dtype == np.uint8


@njit
def _noise_at(points, out):  # type: ignore[no-untyped-def]
    x, y, z = (
        load_floats(points[0].ctypes.data, 16),
        load_floats(points[1].ctypes.data, 16),
        load_floats(points[2].ctypes.data, 16),
    )
    store(out.ctypes.data, value_noise(x, y, z))


def test_the_texture_is_a_hash_of_the_corners_of_a_grid() -> None:
    corners = np.random.default_rng(3).integers(-(1 << 20), 1 << 20, (3, 16))
    found = np.empty(16, np.float32)
    _noise_at(corners.astype(np.float32), found)
    for corner, value in zip(corners.T.tolist(), found, strict=True):
        h = 0
        for place, factor in zip(corner, (0x8DA6B343, 0xD8163841, 0xCB1AB31F), strict=True):
            h ^= (place % (1 << 32)) * factor
        h = (h ^ h >> 16) * 0x7FEB352D % (1 << 32)
        h = (h ^ h >> 15) * 0x846CA68B % (1 << 32)
        assert value == ((h ^ h >> 16) >> 8) * 2.0**-24
