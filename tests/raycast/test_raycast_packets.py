"""Packets of 16, 8 and 4 rays hit the same, for every size of picture and instruction set."""

import platform

import numpy as np
import pytest
from shapes import as_scene, box, camera, look_at, quad, random_poses, soup, sphere

from depthsim.errors import InputError
from depthsim.raycast import Caster, Geometry, embree
from depthsim.raycast.kernel import tile_rays
from depthsim.raycast.packet import ACROSS, PIXELS, TILE
from depthsim.scene import Scene

WIDTHS = sorted(ACROSS)
INSTRUCTIONS = ["isa=avx2", "isa=sse4.2"] if platform.machine() in ("x86_64", "AMD64") else []


def caster_of(scene: Scene, lanes: int, patch: pytest.MonkeyPatch) -> Caster:
    patch.setenv("DEPTHSIM_PACKET", str(lanes))
    return Caster(scene)


def assert_same_hits(one: Geometry, other: Geometry, ulps: int = 1) -> None:
    """The same but for rays that meet the edge of two faces, where either face may be the one."""
    assert np.array_equal(one.hit, other.hit)
    same = one.face == other.face
    assert np.count_nonzero(~same) <= 1 + 1e-4 * same.size
    away = np.abs(one.depth.view(np.int32) - other.depth.view(np.int32))
    assert away[same].max(initial=0) <= ulps - 1
    assert np.allclose(one.depth, other.depth, rtol=1e-6, atol=0)
    assert np.array_equal(one.tag[same], other.tag[same])
    assert np.allclose(one.cosine[same], other.cosine[same], rtol=0, atol=0 if ulps == 1 else 1e-3)
    if one.right_sees is not None and other.right_sees is not None:
        assert np.count_nonzero(one.right_sees != other.right_sees) <= 1 + 1e-4 * same.size


@pytest.fixture(scope="module")
def scene() -> Scene:
    return as_scene(soup(np.random.default_rng(2), 5000, size=0.2), sphere(4), tags=["plastic", "cement"])


def pixel_order(lanes: int) -> list[tuple[int, int]]:
    """(row, column) in the tile of each of its 16 lanes, packet after packet."""
    across = ACROSS[lanes]
    down, beside = lanes // across, TILE // across
    return [
        (packet // beside * down + lane // across, packet % beside * across + lane % across)
        for packet in range(PIXELS // lanes)
        for lane in range(lanes)
    ]


@pytest.mark.parametrize("lanes", WIDTHS)
def test_a_tile_holds_every_pixel_once_and_a_packet_is_a_rectangle(lanes: int) -> None:
    order = np.array(pixel_order(lanes))
    assert sorted(map(tuple, order.tolist())) == [(v, u) for v in range(TILE) for u in range(TILE)]
    for packet in order.reshape(-1, lanes, 2):
        assert np.prod(np.ptp(packet, axis=0) + 1) == lanes


@pytest.mark.parametrize("lanes", WIDTHS)
def test_tiles_over_the_border_repeat_the_last_pixels(lanes: int) -> None:
    rays = np.arange(2 * 6 * 9, dtype=np.float32).reshape(2, 6, 9)
    tiles = tile_rays(rays, lanes)
    assert tiles.shape == (2, 2, 3, PIXELS)
    for k, (v, u) in enumerate(pixel_order(lanes)):
        assert np.array_equal(tiles[..., k], rays[:, np.minimum([v, v + 4], 5)][..., np.minimum([u, u + 4, u + 8], 8)])


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (5, 7), (16, 1), (1, 18), (203, 149)])
@pytest.mark.parametrize("rolling", [False, True])
def test_every_width_hits_the_same(
    size: tuple[int, int], rolling: bool, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    cam = camera(*size, 150, baseline=0.1)
    poses = np.array([look_at((2.5, 0.4 + 0.001 * row, 0.9), (0, 0, 0)) for row in range(cam.height)])
    poses = poses[None] if rolling else poses[:1]
    seen = {lanes: caster_of(scene, lanes, monkeypatch).cast(cam, poses, right=True) for lanes in WIDTHS}
    assert seen[16].hit.any()
    for lanes in WIDTHS:
        assert_same_hits(seen[16], seen[lanes])
    monkeypatch.delenv("DEPTHSIM_PACKET")
    theirs = Caster(scene, "embreex").cast(cam, poses, right=True)
    assert np.array_equal(seen[16].hit, theirs.hit)
    assert np.allclose(seen[16].depth, theirs.depth, rtol=1e-6, atol=0)


@pytest.mark.parametrize("lanes", WIDTHS)
def test_every_width_reaches_the_light_the_same(lanes: int, scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    cam, pose, light = camera(61, 47, 40), look_at((2.5, 0.4, 0.9), (0, 0, 0)), np.array([0.8, 0.0, 0.6])
    depth = Caster(scene).cast(cam, pose).depth
    expected = Caster(scene, "embreex").reached(cam, pose, depth, light)
    assert 0.1 < expected.mean() < 0.9
    assert np.array_equal(caster_of(scene, lanes, monkeypatch).reached(cam, pose, depth, light), expected)


@pytest.mark.parametrize("backend", ["embree", "embreex"])
def test_light_passes_what_is_named(backend: str) -> None:
    """A pane over a floor, and a board beside it: of the one there is a shadow unless it lets light through."""
    sheets = ((-9, 0, 18, 9), (-1, 1, 1, 1), (0, 1, 1, 1))
    floor, pane, board = (quad((x, -h, z), (w, 0, 0), (0, 2 * h, 0)) for x, z, w, h in sheets)
    scene = as_scene(floor, pane, board, tags=["cement", "glass", "formboard"])
    cam, pose = camera(81, 61, 20), look_at((0, 0, 0.9), (0, 0.01, 0))
    caster = Caster(scene, backend)
    depth = caster.cast(cam, pose).depth
    shares = [
        caster.reached(cam, pose, depth, np.array([0.0, 0.0, 1.0]), through=through).mean()
        for through in ((), ("glass",), ("formboard",), ("glass", "formboard"), ("cement",))
    ]
    none, glass, formboard, both, floor_alone = shares
    assert none == floor_alone < glass < both == (depth > 0).mean()
    assert glass == pytest.approx(formboard, abs=0.02)


@pytest.mark.parametrize("lanes", WIDTHS)
def test_the_number_of_threads_makes_no_difference(lanes: int, scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    caster, cam, pose = caster_of(scene, lanes, monkeypatch), camera(203, 149, 150), look_at((2.5, 0.4, 0.9), (0, 0, 0))
    one, many = (caster.cast(cam, pose, right=True, threads=threads) for threads in (1, 5))
    for name in ("depth", "face", "cosine", "tag", "right_sees"):
        assert getattr(one, name).tobytes() == getattr(many, name).tobytes(), name


@pytest.mark.parametrize("lanes", WIDTHS)
def test_no_width_lets_a_ray_through_a_closed_mesh(lanes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    cuts = np.random.default_rng(1).uniform(-1, 1, (3, 25))
    caster = caster_of(as_scene(box((-1, -1, -1), (1, 1, 1), cuts)), lanes, monkeypatch)
    for pose in random_poses(np.random.default_rng(2), 4, 0.6):
        assert caster.cast(camera(401, 301, 150), pose).hit.all()


@pytest.mark.parametrize("instructions", INSTRUCTIONS)
def test_other_instructions_hit_the_same_but_for_the_last_bits(
    instructions: str, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    cam, pose = camera(203, 149, 150, baseline=0.1), look_at((2.5, 0.4, 0.9), (0, 0, 0))
    native = Caster(scene).cast(cam, pose, right=True)
    monkeypatch.setenv("DEPTHSIM_EMBREE_CONFIG", instructions)
    assert embree.packet_lanes() == {"isa=avx2": 8, "isa=sse4.2": 4}[instructions]
    assert_same_hits(native, Caster(scene).cast(cam, pose, right=True), ulps=100)


@pytest.mark.parametrize(
    ("name", "value", "problem"),
    [("DEPTHSIM_PACKET", "5", "no packets of '5'"), ("DEPTHSIM_EMBREE_CONFIG", "threads=x", "refuses 'threads=x'")],
)
def test_a_setting_that_is_wrong_is_named(
    name: str, value: str, problem: str, scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(InputError, match=f"{name}.*{problem}"):
        Caster(scene)
