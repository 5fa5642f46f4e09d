"""Objects that move: where they are, against the same triangles put there, and against embreex without instances."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapes import as_scene, box, camera, look_at, soup, sphere

from depthsim.moving import Mover, poses
from depthsim.raycast import Caster, Geometry
from depthsim.scene import Scene
from depthsim.trajectory import Trajectory

PICTURES = ("depth", "face", "cosine", "tag", "right_sees")


def moving_scene(seed: int = 0, count: int = 3) -> Scene:
    """A room, and so many balls and boxes on their ways in it; each but the first has the one before as its parent."""
    rng = np.random.default_rng(seed)
    room = box((-3, -3, -3), (3, 3, 3))
    things = [sphere(2) if k % 2 else box((-0.4, -0.3, -0.2), (0.4, 0.3, 0.2)) for k in range(count)]
    things = [(0.4 * vertices if k % 2 else vertices, faces) for k, (vertices, faces) in enumerate(things)]
    rest = as_scene(room, soup(rng, 200, size=0.2), *things, tags=["cement", "plastic", *["formboard"] * count])
    movers: list[Mover] = []
    v, f = len(room[0]) + 600, len(room[1]) + 200
    for k, (vertices, faces) in enumerate(things):
        turns = rng.normal(size=(3, 4))
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        path = Trajectory([0.0, 0.5, 1.0], rng.uniform(-0.7, 0.7, (3, 3)), turns)
        own = (f, f + len(faces)), (v, v + len(vertices))
        movers.append(Mover(f"thing_{k}", *own, path, parent=k - 1 if k == 2 else None, begin=0.0))
        v, f = own[1][1], own[0][1]
    return replace(rest, movers=tuple(movers))


def assert_alike(a: Geometry, b: Geometry, tolerance: float = 1e-5) -> None:
    assert np.array_equal(a.hit, b.hit)
    same = a.face == b.face
    assert np.count_nonzero(~same) <= 1 + 2e-3 * same.size  # where two faces meet in one point each may be the one
    grazing = np.maximum(0.05 / np.maximum(b.cosine[same], 1e-3), 1)  # below 3 degrees rounding goes far along a ray
    assert (np.abs(a.depth[same] - b.depth[same]) <= tolerance * (1 + b.depth[same]) * grazing).all()
    assert np.allclose(a.cosine[same], b.cosine[same], rtol=0, atol=1e-4)
    assert np.array_equal(a.tag[same], b.tag[same])
    assert a.right_sees is not None and b.right_sees is not None
    assert np.count_nonzero(a.right_sees != b.right_sees) <= 2 + 2e-3 * same.size


@settings(max_examples=15)
@given(st.integers(0, 2**32), st.floats(-0.5, 1.5))
@example(0, 0.7890996623639397)
def test_objects_are_where_their_path_says(seed: int, stamp: float) -> None:
    scene, cam = moving_scene(seed), camera(61, 47, 40, baseline=0.1)
    eye = np.random.default_rng(seed).uniform(-2, 2, 3)
    pose = look_at(eye, (0, 0, 0))
    moving = Caster(scene).cast(cam, pose, right=True, stamps=stamp)
    assert_alike(moving, Caster(scene.at(stamp)).cast(cam, pose, right=True))
    assert_alike(moving, Caster(scene, "embreex").cast(cam, pose, right=True, stamps=stamp))
    normals = moving.normals(scene, stamp)
    assert np.allclose(normals, moving.normals(scene.at(stamp)), atol=1e-5)


def test_every_row_sees_the_objects_at_its_own_time() -> None:
    scene, cam = moving_scene(), camera(64, 48, 40, baseline=0.1)
    pose = look_at((2.5, 1, 1), (0, 0, 0))
    stamps = np.linspace(0.1, 0.9, cam.height)
    caster = Caster(scene)
    rolling = caster.cast(cam, np.tile(pose, (1, cam.height, 1, 1)), right=True, stamps=stamps[None])[0]
    assert (np.bincount(rolling.tag.ravel(), minlength=3)[2]) > 100
    other = Caster(scene, "embreex").cast(cam, np.tile(pose, (1, cam.height, 1, 1)), right=True, stamps=stamps[None])
    assert_alike(rolling, other[0])
    for row in (3, 17, 40):
        still = caster.cast(cam, pose, right=True, stamps=stamps[row])
        same = still.face[row] == rolling.face[row]
        assert np.count_nonzero(~same) <= 1
        assert np.allclose(still.depth[row][same], rolling.depth[row][same], rtol=1e-5)


def test_one_pose_after_another_has_a_time_each() -> None:
    scene, cam = moving_scene(), camera()
    views = np.stack([look_at((2.5, 1, 1), (0, 0, 0))] * 3)
    together = Caster(scene).cast(cam, views, stamps=np.array([0.0, 0.4, 0.8]))
    for index, stamp in enumerate((0.0, 0.4, 0.8)):
        alone = Caster(scene).cast(cam, views[index], stamps=stamp)
        assert alone.depth.tobytes() == together[index].depth.tobytes()
    with pytest.raises(ValueError, match="stamps are"):
        Caster(scene).cast(cam, views, stamps=np.zeros(2))


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_make_no_difference(threads: int) -> None:
    scene, cam, pose = moving_scene(), camera(90, 70, 60, baseline=0.1), look_at((2.5, 1, 1), (0, 0, 0))
    first = Caster(scene).cast(cam, pose, right=True, stamps=0.3, threads=2)
    again = Caster(scene).cast(cam, pose, right=True, stamps=0.3, threads=threads)
    for name in PICTURES:
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()


@pytest.mark.parametrize("lanes", ["4", "8", "16"])
def test_packets_of_every_width_meet_the_same(lanes: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, cam, pose = moving_scene(), camera(61, 47, 40, baseline=0.1), look_at((2.5, 1, 1), (0, 0, 0))
    wide = Caster(scene).cast(cam, pose, right=True, stamps=0.3)
    monkeypatch.setenv("DEPTHSIM_PACKET", lanes)
    assert_alike(Caster(scene).cast(cam, pose, right=True, stamps=0.3), wide)


def test_an_object_round_the_camera_or_behind_it_is_seen_as_it_is() -> None:
    scene, cam = moving_scene(count=2), camera(64, 48, 20)  # 116 degrees wide
    for stamp in (0.0, 0.3, 0.7):
        place = poses(scene.movers, stamp)[0, 0, :3, 3]
        for eye in (place, place + np.array([0.35, 0.1, 0]), place + np.array([0, 0.5, 0.05])):
            pose = look_at(eye, eye + np.array([1.0, 0.2, 0.1]))
            moving = Caster(scene).cast(cam, pose, right=True, stamps=stamp)
            assert_alike(moving, Caster(scene.at(stamp)).cast(cam, pose, right=True))


def test_shadows_of_objects_fall_on_what_stands() -> None:
    scene, cam, pose = moving_scene(), camera(), look_at((2.5, 1, 1), (0, 0, 0))
    sun = np.array([0.3, 0.2, 0.93])
    sun /= np.linalg.norm(sun)
    met = Caster(scene).cast(cam, pose, stamps=0.3)
    found = Caster(scene).reached(cam, pose, met.depth, sun, stamps=0.3)
    posed = Caster(scene.at(0.3)).reached(cam, pose, met.depth, sun)
    embreex = Caster(scene, "embreex").reached(cam, pose, met.depth, sun, stamps=0.3)
    assert np.count_nonzero(found != posed) <= 2
    assert np.count_nonzero(found != embreex) <= 2


def test_motions_are_exchanged_without_building_anew() -> None:
    scene = moving_scene()
    caster = Caster(scene)
    later = scene.started(5.0)
    assert later.movers[0].begin == 0.0  # recorded paths have stamps of their own
    shifted = replace(scene, movers=tuple(replace(mover, begin=5.0) for mover in scene.movers))
    pose, cam = look_at((2.5, 1, 1), (0, 0, 0)), camera()
    here, there = caster.cast(cam, pose, stamps=0.3), caster.retagged(shifted).cast(cam, pose, stamps=5.3)
    assert np.allclose(here.depth, there.depth, atol=1e-6)
    with pytest.raises(ValueError, match="other faces move"):
        caster.retagged(replace(scene, movers=()))
    with pytest.raises(ValueError, match="everything moves"):
        Caster(replace(scene, movers=(replace(scene.movers[0], faces=(0, 12), vertices=(0, 8)),)))
