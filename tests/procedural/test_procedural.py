"""The procedural scenes, the builders below them, and the materials that they use."""

import hashlib
import importlib.util
import math
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.materials import load_materials
from depthsim.procedural import BUILDERS, Part, build
from depthsim.procedural import primitives as solids
from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.drift import Drift
from depthsim.procedural.ground import slab
from depthsim.procedural.noise import Stream, facets, smooth
from depthsim.procedural.part import copies, join, rotation, spin
from depthsim.procedural.sweep import circle, frame, leaves, ribbons, sweep, tube
from depthsim.raycast import Caster
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.trajectory import load_trajectory

Floats = NDArray[np.float64]
NAMES = sorted(BUILDERS)
INDOOR = ("corridor", "office", "race", "tunnel")
FACES = {
    "corridor": (20_000, 120_000),
    "forest": (100_000, 450_000),
    "office": (20_000, 110_000),
    "race": (20_000, 200_000),
    "tunnel": (300_000, 900_000),
    "wall": (12, 12),
}
GOLDEN_STREAM, GOLDEN_SMOOTH, GOLDEN_FACETS = (
    [0.2996269638247443, 0.0739441105013603, 0.7351056094783414],
    [0.07758267968893051],
    [-0.06647180020809174],
)
"""What the generators gave when they were written; scenes and the runs made in them hang on these."""


@cache
def built(name: str) -> Part:
    return build(name)


@cache
def scene(name: str) -> Scene:
    return load_scene(name)


def digest(part: Part) -> str:
    arrays = (part.vertices, part.faces, part.face_tags)
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays) + repr(part.tags).encode()).hexdigest()


def is_closed(part: Part) -> bool:
    """Every directed edge of a face has its reverse in exactly one other face."""
    edges = part.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    forward, backward = edges @ (10**7, 1), edges @ (1, 10**7)
    return len(np.unique(forward)) == len(forward) and np.array_equal(np.sort(forward), np.sort(backward))


def lattice_slab() -> Part:
    x, y = np.linspace(0, 3, 4), np.linspace(0, 2, 3)
    return slab(x, y, np.ones((3, 4)), np.zeros((2, 3, 2), int), ("soil",), 0.0)


BENT = [(0, 0, 0), (1, 0, 0), (1.5, 0.5, 0.2), (1.5, 1, 2)]
SOLIDS: dict[str, tuple[Callable[[], Part], float | None]] = {
    "box": (lambda: solids.box((1, 2, 3), "a"), 6.0),
    "boxes": (lambda: solids.boxes([(1, 2, 3), (1, 1, 1)], [(0, 0, 0), (5, 0, 0)], "a", rotation(yaw=[30, 60])), 7.0),
    "cylinder": (lambda: solids.cylinder(1, 2, "a", 96), 2 * math.pi),
    "cone": (lambda: solids.cone(1, 0, 3, "a", 96), math.pi),
    "stump": (lambda: solids.cone(2, 1, 3, "a", 96), 7 * math.pi),
    "torus": (lambda: solids.torus(1, 0.2, "a", 96, 48), 2 * math.pi**2 * 0.04),
    "sphere": (lambda: solids.sphere(1, "a", 96, 48), 4 / 3 * math.pi),
    "icosphere": (lambda: solids.icosphere(4, "a"), 4 / 3 * math.pi),
    "cushion": (lambda: solids.cushion((1, 1, 1), "a", 1.0, 96, 48), math.pi / 6),
    "lying": (lambda: solids.lying(solids.cylinder(1, 2, "a", 96)), 2 * math.pi),
    "upright tube": (lambda: tube([(0, 0, 0), (0, 0, 2)], 0.5, "a", 96), math.pi / 2),
    "bent tube": (lambda: tube(BENT, [0.1, 0.2, 0.1, 0.05], "a"), None),
    "tubes": (lambda: sweep([BENT, BENT[::-1]], 0.1, circle(7), "a"), None),
    "frame": (lambda: frame(4, 3, 0.1, "a", 0.01), 0.14),
    "blocks": (
        lambda: blocks(
            Block("a", (0, 1), (0, 1), (0, 1)),
            Block("b", (1, 2), (0, 1), (0, 0.5)),
            Block(None, (0.2, 0.4), (0.2, 0.4), (0.5, 1)),
        ),
        1.48,
    ),
    "slab": (lattice_slab, 6.0),
}  # fmt: skip


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_look_outward_and_hold_their_volume(name: str) -> None:
    make, volume = SOLIDS[name]
    part = make()
    assert is_closed(part)
    assert part.areas.min() > 1e-9
    assert part.volume > 0
    if volume is not None:
        assert part.volume == pytest.approx(volume, rel=0.012)


def test_a_room_looks_inward() -> None:
    room = blocks(Block(None, (0, 4), (0, 3), (0, 2)), Block("wood", (1, 2), (1, 2), (0, 1)), around="plaster")
    assert is_closed(room)
    assert room.volume == pytest.approx(-(24 - 1))
    wood = room.areas[room.face_tags == room.tags.index("wood")].sum()
    assert wood == pytest.approx(5.0)


@settings(max_examples=30)
@given(st.lists(st.tuples(*[st.integers(0, 4)] * 6, st.booleans()), min_size=1, max_size=8))
def test_blocks_hold_what_a_count_of_cells_holds(items: list[tuple[int, int, int, int, int, int, bool]]) -> None:
    cells = np.zeros((6, 6, 6), bool)
    chosen = [Block("a", (0, 1), (0, 1), (0, 1))]
    cells[0, 0, 0] = True
    for x, y, z, a, b, c, solid in items:
        chosen.append(Block("a" if solid else None, (x, x + 1 + a % 2), (y, y + 1 + b % 2), (z, z + 1 + c % 2)))
        cells[x : x + 1 + a % 2, y : y + 1 + b % 2, z : z + 1 + c % 2] = solid
    if not cells.any():
        return
    part = blocks(*chosen)
    assert part.volume == pytest.approx(cells.sum())
    assert part.areas.sum() == pytest.approx(
        sum(np.abs(np.diff(np.pad(cells, 1).astype(int), axis=i)).sum() for i in range(3))
    )


def test_transforms_follow_their_formulas() -> None:
    part = solids.box((1, 2, 3), "a", (0.5, 1, 1.5))
    turned = part.turned(yaw=90).moved(1, 2, 3)
    np.testing.assert_allclose([turned.vertices.min(0), turned.vertices.max(0)], [(-1, 2, 3), (1, 3, 6)], atol=1e-12)
    # Fixed axes: x, then y, then z.
    np.testing.assert_allclose(rotation(90, 90, 0) @ (0, 1, 0), (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(
        rotation(10, 20, 30), rotation(yaw=30) @ rotation(pitch=20) @ rotation(roll=10), atol=1e-12
    )
    assert part.scaled(2).volume == pytest.approx(48)
    many = copies(part, [(0, 0, 0), (9, 0, 0), (18, 0, 0)], spin([0, 45, 90], [1, 1, 2]))
    assert many.volume == pytest.approx(6 + 6 + 48)
    both = join([part, solids.box((1, 1, 1), "b"), solids.box((1, 1, 1), "a")])
    assert both.tags == ("a", "b")
    np.testing.assert_array_equal(both.face_tags, np.repeat([0, 1, 0], 12))


def test_open_shapes_have_the_area_they_should() -> None:
    assert solids.plane((2, 3), (4, 5), "a").areas.sum() == pytest.approx(6)
    path = np.array([[(0, 0, 0), (1, 0, 0), (2, 0, 0)]], float)
    assert ribbons(path, np.broadcast_to((0, 0.1, 0), (1, 3, 3)), "a").areas.sum() == pytest.approx(0.4)
    leaf = leaves(np.zeros((1, 3)), np.array([[1.0, 0, 0]]), np.array([[0, 0.2, 0]]), [0.0], "a")
    assert leaf.areas.sum() == pytest.approx(0.2)


@pytest.mark.parametrize("noise", [smooth, facets])
def test_noise_is_bounded_continuous_and_centred(noise: Callable[[Floats, int], Floats]) -> None:
    points = Stream(3).uniform(-50, 50, (20_000, 3))
    values = noise(points, 7)
    assert np.abs(values).max() <= 1
    assert abs(values.mean()) < 0.02
    assert values.std() > 0.25
    assert np.abs(noise(points + 1e-4, 7) - values).max() < 2e-3
    assert np.abs(noise(points, 8) - values).max() > 0.5


def test_facets_are_flat() -> None:
    """Along a short line the second difference vanishes, but where the line crosses an edge."""
    start = Stream(4).uniform(-20, 20, (5000, 3))
    step = Stream(5).directions(5000) * 0.01
    low, middle, high = (facets(start + k * step, 1) for k in (-1, 0, 1))
    bend = np.abs(low - 2 * middle + high)
    assert np.mean(bend < 2e-6) > 0.8
    assert bend.max() > 1e-3


def test_random_numbers_are_the_ones_they_have_always_been() -> None:
    np.testing.assert_array_equal(Stream(1, 2).uniform(size=3), GOLDEN_STREAM)
    np.testing.assert_allclose(smooth(np.array([[0.3, -7.7, 2.2]]), 5), GOLDEN_SMOOTH, rtol=1e-6)
    np.testing.assert_allclose(facets(np.array([[0.3, -7.7, 2.2]]), 5), GOLDEN_FACETS, rtol=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_scenes_are_built_the_same_each_time(name: str) -> None:
    assert digest(built(name)) == digest(build(name))


@pytest.mark.parametrize("name", [name for name in NAMES if name != "wall"])
def test_another_seed_is_another_scene(name: str) -> None:
    assert digest(build(name, seed=2)) != digest(built(name))


@pytest.mark.parametrize("name", NAMES)
def test_scenes_are_sound_meshes(name: str) -> None:
    part = built(name)
    assert (part.vertices.dtype, part.faces.dtype, part.face_tags.dtype) == (np.float64, np.uint32, np.uint8)
    low, high = FACES[name]
    assert low <= len(part.faces) <= high
    assert np.isfinite(part.vertices).all()
    assert part.faces.max() < len(part.vertices)
    assert len(np.unique(part.faces)) == len(part.vertices), "a vertex that no face uses"
    longest = np.linalg.norm(part.corners - np.roll(part.corners, 1, axis=1), axis=2).max(axis=1)
    assert (2 * part.areas / longest).min() > 1e-5, "a face that is no more than a line"
    single = part.corners.astype(np.float32).astype(np.float64)
    area = np.linalg.norm(np.cross(single[:, 1] - single[:, 0], single[:, 2] - single[:, 0]), axis=1)
    assert area.min() > 0, "a face that float32, which the ray caster works in, makes a line"
    corners = np.sort(part.corners.round(6).view([("x", float), ("y", float), ("z", float)])[..., 0], axis=1)
    assert len(np.unique(corners.view(np.float64).reshape(len(corners), 9), axis=0)) == len(corners), "a face twice"
    assert set(np.unique(part.face_tags)) == set(range(len(part.tags))), "a tag that no face has"
    assert set(part.tags) <= set(load_materials().tags)


@pytest.mark.parametrize("name", NAMES)
def test_the_default_trajectory_keeps_its_distance(name: str) -> None:
    from trimesh.triangles import closest_point

    path = load_trajectory(None, scene(name), rate=10.0)
    assert 8 <= path.stamps[-1] <= 30
    corners = scene(name).vertices[scene(name).faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    for point in path.positions[:: max(1, len(path.positions) // 25)]:
        near = corners[((low <= point + 0.3) & (high >= point - 0.3)).all(axis=1)]
        if len(near):
            away = np.linalg.norm(closest_point(near, np.repeat(point[None], len(near), axis=0)) - point, axis=1)
            assert away.min() >= 0.25


def all_round() -> tuple[Camera, Floats]:
    """A camera of 90 degrees, and the rotations (6, 3, 3) that take it to the sides of a cube."""
    camera = Camera(width=44, height=44, fx=22, fy=22, cx=21.5, cy=21.5, baseline=0.05)
    axes = np.eye(3)
    turns = [np.stack([axes[i - 2] * s, axes[i - 1], axes[i] * s], axis=1) for i in range(3) for s in (1, -1)]
    return camera, np.array(turns)


@pytest.mark.parametrize("name", INDOOR)
def test_indoors_every_ray_hits(name: str) -> None:
    """From each of twelve places along every trajectory, 11,616 rays to all sides."""
    camera, turns = all_round()
    caster = Caster(scene(name))
    for trajectory in scene(name).trajectories:
        path = load_trajectory(trajectory, scene(name), rate=5.0)
        places = path.positions[np.linspace(0, len(path.positions) - 1, 12).astype(int)]
        poses = np.tile(np.eye(4), (len(places), 6, 1, 1))
        poses[..., :3, :3], poses[..., :3, 3] = turns, places[:, None]
        seen = caster.cast(camera, poses.reshape(-1, 4, 4))
        assert (seen.depth > 0).all()


THIN = ("foliage", "needles", "grass", "leaf_litter", "fabric")
"""Tags of leaves, blades and flags, which have no inside and are seen from both sides."""


@pytest.mark.parametrize("name", NAMES)
def test_what_is_seen_looks_at_the_camera(name: str) -> None:
    """No face is flipped, and the camera is inside of nothing; a ray along an edge may get the face behind it."""
    camera, turns = all_round()
    path = load_trajectory(None, scene(name), rate=2.0)
    tags = scene(name).tags
    caster = Caster(scene(name))
    away = []
    for place in path.positions[:: max(1, len(path.positions) // 8)]:
        for turn in turns:
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = turn, place
            seen = caster.cast(camera, pose)
            rays = np.stack([*camera.rays, np.ones(camera.shape)], axis=-1) @ turn.T
            solid = seen.hit & ~np.isin(seen.tag, [tags.index(tag) for tag in THIN if tag in tags])
            away.append(np.einsum("hwi,hwi->hw", rays, seen.normals(scene(name)))[solid] >= 0)
    assert np.mean(np.concatenate(away)) < 5e-5


def test_outdoors_the_sky_is_open_and_the_ground_is_not() -> None:
    camera, turns = all_round()
    path = load_trajectory(None, scene("forest"), rate=5.0)
    pose = np.tile(np.eye(4), (6, 1, 1))
    pose[:, :3, :3], pose[:, :3, 3] = turns, path.positions[0]
    depth = Caster(scene("forest")).cast(camera, pose).depth
    down, up = (int(np.argmax(turns[:, 2, 2] == side)) for side in (-1, 1))
    assert (depth[down] > 0).all()
    assert np.mean(depth[up] == 0) > 0.3


def test_the_wall_fills_a_view_of_90_degrees_all_along_its_rail() -> None:
    camera = Camera(width=64, height=64, fx=32, fy=32, cx=31.5, cy=31.5, baseline=0.05)
    path = load_trajectory("rail", scene("wall"), rate=10.0)
    np.testing.assert_allclose(path.positions[[0, -1], 0], [-0.5, -8.0], atol=1e-9)
    seen = Caster(scene("wall")).cast(camera, path.matrices())
    np.testing.assert_allclose(
        seen.depth, np.broadcast_to(-path.positions[:, 0, None, None], seen.depth.shape), rtol=1e-5
    )
    assert build("wall", material="plastic").tags == ("plastic",)


def test_the_drift_is_closed_and_looks_inward() -> None:
    drift = Drift(12.0)
    shell = drift.shell(drift.surface(120, 90, 1), 1)
    assert is_closed(shell)
    assert shell.volume == pytest.approx(-12 * 12.5, rel=0.3)
    assert len(build("tunnel", rows=300, around=100).faces) < len(built("tunnel").faces)


@pytest.mark.parametrize(
    ("name", "parameters", "reported"),
    [
        ("castle", {}, "the builders are corridor, door_leaf, drone, forest"),
        ("wall", {"colour": "red"}, "its parameters are material, width, height"),
        ("wall", {"width": True}, "give a finite number such as 20.0"),
        ("wall", {"width": float("nan")}, "give a finite number"),
        ("wall", {"height": -2}, "height is -2 m; give 0.01 to 1000"),
        ("office", {"seed": 1.5}, "give a whole number such as 1"),
        ("wall", {"height": 1 << 20000}, "height is a number of 20001 bits; give a finite number"),
        ("office", {"seed": -(1 << 20000)}, "seed is a number of 20001 bits; give a whole number"),
        ("tunnel", {"rows": 5}, "rows is 5; give 100 to 4000"),
    ],
)
def test_wrong_parameters_are_reported_in_one_line(name: str, parameters: dict[str, object], reported: str) -> None:
    with pytest.raises(ValueError, match=reported) as caught:
        build(name, **parameters)
    assert "\n" not in str(caught.value)


def test_every_value_of_materials_yaml_has_a_source() -> None:
    materials = load_materials()
    for tag in materials.tags:
        entry = materials[tag].model_dump()
        assert entry["source"], tag
        clear = {"transmission"} if entry["transmission"] else set()
        assert set(entry["sources"]) == {"ir_reflectance", "gloss", "albedo", "texture"} | clear, tag
        assert all(
            source.startswith(("assumed", "as ", "ECOSTRESS: ", "Fresnel")) for source in entry["sources"].values()
        ), tag
        assert len(entry["color"]) == 7


def test_the_papers_materials_are_the_texts_and_keep_table_1() -> None:
    materials = load_materials()
    for tag, m, table in (("cement", 0.35, 0.50), ("formboard", 0.50, 0.55), ("plastic", 0.85, 0.85)):
        entry = materials[tag].model_dump()
        assert entry["m"] == m
        assert [(other["m"], "Table 1" in other["source"]) for other in entry["also"]] == [(table, True)]


@cache
def make_script() -> ModuleType:
    path = Path(__file__).parents[2] / "scenes" / "make.py"
    spec = importlib.util.spec_from_file_location("scenes_make", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("kind", ["obj", "glb", "ply"])
def test_written_meshes_read_back(kind: str, tmp_path: Path) -> None:
    assert make_script().main(["corridor", "--out", str(tmp_path), "--format", kind]) == 0
    back = load_scene(tmp_path / f"corridor.{kind}")
    whole = scene("corridor")
    assert back.tags == whole.tags
    np.testing.assert_allclose(back.bounds, whole.bounds, atol=1e-5)
    for index in range(len(whole.tags)):
        area = whole.areas[whole.face_tags == index].sum()
        assert back.areas[back.face_tags == index].sum() == pytest.approx(area, rel=1e-4)


def test_an_unknown_scene_writes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert make_script().main(["castle", "--out", str(tmp_path / "new")]) == 2
    assert "castle" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_a_scene_file_reports_a_wrong_parameter(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_text("meshes: [{build: wall, parameters: {colour: red}}]")
    with pytest.raises(InputError, match="its parameters are material"):
        load_scene(path)
