"""Two other ray casters agree with ours, and threads, callers and buffers make no difference."""

import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import as_scene, box, camera, look_at, random_poses, soup, sphere, wall, world_rays

from depthsim.errors import InputError
from depthsim.open3d_loader import load_open3d
from depthsim.raycast import Caster, Geometry
from depthsim.raycast.fallback import EmbreexScene

PICTURES = ("depth", "face", "cosine", "tag", "right_sees")


def assert_same_bytes(a: Geometry, b: Geometry) -> None:
    for name in PICTURES:
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name


@settings(max_examples=20)
@given(st.integers(0, 2**32), st.integers(1, 3000), st.booleans())
def test_embreex_agrees(seed: int, count: int, rolling: bool) -> None:
    rng = np.random.default_rng(seed)
    scene = as_scene(soup(rng, count, size=0.3), sphere(1), tags=["plastic", "cement"])
    cam = camera(int(rng.integers(1, 90)), int(rng.integers(1, 70)), 60, baseline=0.1)
    poses = np.array([look_at(3 * eye / np.linalg.norm(eye), (0, 0, 0)) for eye in rng.normal(size=(cam.height, 3))])
    poses = poses[None] if rolling else poses[:2]
    ours, theirs = Caster(scene).cast(cam, poses, right=True), Caster(scene, "embreex").cast(cam, poses, right=True)
    assert ours.hit.any()
    # Where two faces meet in one point each may be the one.
    same = ours.face == theirs.face
    assert np.count_nonzero(~same) <= 1 + 1e-4 * same.size
    assert np.array_equal(ours.hit, theirs.hit)
    assert np.array_equal(ours.tag[same], theirs.tag[same])
    assert np.allclose(ours.depth[same], theirs.depth[same], rtol=1e-6, atol=0)
    assert np.allclose(ours.cosine[same], theirs.cosine[same], rtol=1e-6, atol=1e-6)
    assert np.count_nonzero(ours.right_sees != theirs.right_sees) <= 1 + 1e-4 * same.size


def test_the_fallback_steps_in_where_the_library_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    from depthsim.raycast import embree

    def missing() -> None:
        raise embree.EmbreeMissing("no library")

    monkeypatch.setattr(embree, "_library", missing)
    caster = Caster(as_scene(wall(2)))
    assert caster.backend == "embreex"
    assert isinstance(caster._embreex, EmbreexScene)
    assert np.abs(caster.cast(camera(), np.eye(4)).depth - 2).max() < 1e-6


@pytest.mark.parametrize("mesh", [sphere(4), box((-1, -1, -1), (1, 1, 1)), soup(np.random.default_rng(1), 20_000)])
def test_open3d_agrees(mesh) -> None:
    try:
        o3d = load_open3d()
    except InputError as error:
        pytest.skip(str(error))
    scene, cam, pose = as_scene(mesh), camera(161, 121, 130), look_at((2.5, 1.2, 0.8), (0, 0, 0))
    ours = Caster(scene).cast(cam, pose)
    tree = o3d.t.geometry.RaycastingScene()
    tree.add_triangles(o3d.core.Tensor(scene.vertices.astype(np.float32)), o3d.core.Tensor(scene.faces))
    found = tree.cast_rays(o3d.core.Tensor(np.hstack(world_rays(cam, pose)).astype(np.float32)))
    face = found["primitive_ids"].numpy().astype(np.int64).reshape(cam.shape)
    depth, normals = found["t_hit"].numpy().reshape(cam.shape), found["primitive_normals"].numpy()
    face[~np.isfinite(depth)] = -1
    same = face == ours.face
    assert same.mean() > 0.9995
    both = same & ours.hit
    assert both.mean() > 0.2
    slant = np.maximum(ours.cosine, 1e-3)
    assert (np.abs(ours.depth - depth) * slant)[both].max() < 5e-6
    assert np.abs(ours.normals(scene) - normals.reshape(*cam.shape, 3))[both].max() < 1e-4


def test_open3d_that_is_missing_is_reported_with_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "open3d", None)
    with pytest.raises(InputError, match=r"install it by `pip install '.\[open3d\]'`"):
        load_open3d()


@pytest.fixture(scope="module")
def caster() -> Caster:
    return Caster(as_scene(soup(np.random.default_rng(2), 5000), sphere(3), tags=["plastic", "cement"]))


def test_the_number_of_threads_makes_no_difference(caster: Caster) -> None:
    cam, pose = camera(203, 149, 150), look_at((2.5, 0.4, 0.9), (0, 0, 0))
    one = caster.cast(cam, pose, right=True, threads=1)
    for threads in (2, 3, 4, 64):
        assert_same_bytes(one, caster.cast(cam, pose, right=True, threads=threads))


def test_a_scene_built_again_gives_the_same_bytes(caster: Caster) -> None:
    cam, pose = camera(203, 149, 150), look_at((2.5, 0.4, 0.9), (0, 0, 0))
    again = Caster(caster.scene)
    assert_same_bytes(caster.cast(cam, pose, right=True), again.cast(cam, pose, right=True))


def test_two_python_threads_on_one_caster(caster: Caster) -> None:
    cam, poses = camera(101, 75, 80), random_poses(np.random.default_rng(3), 40, 2)
    expected = [caster.cast(cam, pose, right=True, threads=1) for pose in poses]
    results: dict[int, Geometry] = {}

    def work(start: int) -> None:
        for index in range(start, len(poses), 2):
            results[index] = caster.cast(cam, poses[index], right=True, threads=2)

    workers = [threading.Thread(target=work, args=(start,)) for start in (0, 1)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    for index, result in enumerate(expected):
        assert_same_bytes(result, results[index])


def test_written_over_is_as_good_as_new(caster: Caster) -> None:
    cam, poses = camera(61, 47, 40), random_poses(np.random.default_rng(4), 6, 2)
    used = caster.cast(cam, poses[0], right=True)
    for pose in poses[1:]:
        again = caster.cast(cam, pose, right=True, out=used)
        assert again is used
        assert_same_bytes(again, caster.cast(cam, pose, right=True))
    # What does not fit is not written to, and a picture that was not asked for is not left over from before.
    before = used.depth.copy()
    assert caster.cast(cam, poses[0], out=used).right_sees is None
    assert caster.cast(camera(60, 47), poses[0], right=True, out=used).depth.shape == (47, 60)
    assert caster.cast(cam, poses, right=True, out=used).depth.shape == (6, 47, 61)
    assert np.array_equal(used.depth, before)


def test_a_caster_outlives_the_arrays_it_was_made_of() -> None:
    vertices, faces = wall(2)
    caster = Caster(as_scene((vertices, faces)))
    vertices[:], faces[:] = 0, 0
    assert np.abs(caster.cast(camera(), np.eye(4)).depth - 2).max() < 1e-6
