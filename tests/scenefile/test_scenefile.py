"""Scenes from scene files: placement, tags, units, built-in scenes and run folders; and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from broken.scenes import Broken, table
from numpy.testing import assert_allclose, assert_array_equal

from depthsim.errors import InputError
from depthsim.materials import Materials
from depthsim.scene import Scene
from depthsim.scenefile import builtin_scenes, load_scene

MATERIALS = Materials.model_validate({tag: {"m": 0.5} for tag in ("cement", "formboard", "plastic")})
TRIANGLE = "v 1 0 0\nv 0 2 0\nv 0 0 3\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "t.obj").write_text(TRIANGLE + "usemtl cement\nf 1 2 3\n")
    (tmp_path / "two.obj").write_text(
        TRIANGLE + "v 1 2 3\nusemtl lambert1\nf 1 2 3\nusemtl phong 2\nf 2 3 4\nf 1 3 4\n"
    )
    return tmp_path


def load(folder: Path, text: str, **options: object) -> Scene:
    (folder / "s.yaml").write_text(text)
    return load_scene(folder / "s.yaml", materials=MATERIALS, **options)


def corners(scene: Scene) -> np.ndarray:
    return scene.vertices[scene.faces]


def tags_of(scene: Scene) -> list[str]:
    return [scene.tags[tag] for tag in scene.face_tags]


@pytest.mark.parametrize(("name", "broken"), table(), ids=lambda value: value if isinstance(value, str) else "")
def test_a_broken_scene_gets_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, broken: Broken
) -> None:
    for file, content in {**broken.beside, broken.name: broken.content}.items():
        if content is not None:
            (tmp_path / file).write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(InputError) as caught:
        load_scene(tmp_path / broken.name, materials=MATERIALS, **broken.options)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(tmp_path / (broken.tells or broken.name)) + ": ")
    for word in broken.words:
        assert word in message
    reported = capfd.readouterr()
    assert reported.out == reported.err == ""


def test_a_folder_without_a_scene_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"has no scene; put one of scene.yaml, scene.obj"):
        load_scene(tmp_path, materials=MATERIALS)


def test_a_link_may_not_lead_out_of_the_folder(folder: Path) -> None:
    inner = folder / "inner"
    inner.mkdir()
    (inner / "link.obj").symlink_to(folder / "t.obj")
    with pytest.raises(InputError, match="leaves the folder"):
        load(inner, "meshes: [{file: link.obj}]")


def test_more_tags_than_fit(tmp_path: Path) -> None:
    names = [f"m{i}" for i in range(256)]
    (tmp_path / "m.obj").write_text(TRIANGLE + "".join(f"usemtl {name}\nf 1 2 3\n" for name in names))
    many = Materials.model_validate({name: {"m": 1} for name in names})
    with pytest.raises(InputError, match="uses 256 tags, at most 255 fit"):
        load_scene(tmp_path / "m.obj", materials=many)
    assert len(load_scene(tmp_path / "m.obj", materials=many, tags={"m0": "m1"}).tags) == 255


def test_many_unknown_names_are_cut_short(tmp_path: Path) -> None:
    faces = "".join(f"usemtl n{i:02}\n" + "f 1 2 3\n" * (i + 1) for i in range(30))
    (tmp_path / "m.obj").write_text(TRIANGLE + faces)
    with pytest.raises(InputError) as caught:
        load_scene(tmp_path / "m.obj", materials=MATERIALS)
    assert "n29 (30 faces), n28 (29 faces)" in str(caught.value)
    assert "n20 (21 faces) and 20 more" in str(caught.value)


def test_transforms_against_hand_computed(folder: Path) -> None:
    text = "meshes: [{file: t.obj, scale: [2, 3, 4], rotate: [90, 0, 90], translate: [10, 20, 30]}]"
    # scaled: (2,0,0) (0,6,0) (0,0,12); roll 90° takes y to z and z to -y: (2,0,0) (0,0,6) (0,-12,0);
    # yaw 90° then takes x to y and y to -x: (0,2,0) (0,0,6) (12,0,0).
    assert_allclose(corners(load(folder, text))[0], [[10, 22, 30], [10, 20, 36], [22, 20, 30]], atol=1e-12)


def test_pitch_comes_between_roll_and_yaw(folder: Path) -> None:
    # roll 90°: (1,0,0) (0,0,2) (0,-3,0); pitch 90° takes z to x and x to -z: (0,0,-1) (2,0,0) (0,-3,0);
    # yaw 90°: (0,0,-1) (0,2,0) (3,0,0).
    scene = load(folder, "meshes: [{file: t.obj, rotate: [90, 90, 90]}]")
    assert_allclose(corners(scene)[0], [[0, 0, -1], [0, 2, 0], [3, 0, 0]], atol=1e-12)


@pytest.mark.parametrize("scale", [-1, [-2, 1, 1], [1, -1, 3], [-1, -1, 1], 0.5])
def test_a_mirroring_scale_keeps_outside_outside(folder: Path, scale: object) -> None:
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box().export(folder / "box.ply")
    scene = load(folder, f"meshes: [{{file: box.ply, tags: {{'*': cement}}, scale: {scale}}}]")
    a, b, c = np.moveaxis(corners(scene), 1, 0)
    factors = np.broadcast_to(np.array(scale, dtype=float), 3)
    assert np.einsum("fi,fi->", a, np.cross(b, c)) / 6 == pytest.approx(abs(np.prod(factors)))


@pytest.mark.parametrize(
    ("top", "entry", "option", "metres"),
    [
        ("", "", None, 1),
        ("units: cm\n", "", None, 0.01),
        ("units: cm\n", ", units: in", None, 0.0254),
        ("units: cm\n", ", units: in", "mm", 0.001),
        ("", "", "ft", 0.3048),
    ],
)
def test_units_of_the_command_line_come_first(
    folder: Path, top: str, entry: str, option: str | None, metres: float
) -> None:
    scene = load(folder, f"{top}meshes: [{{file: t.obj, translate: [5, 0, 0]{entry}}}]", units=option)
    assert_allclose(corners(scene)[0] - [5, 0, 0], np.diag([1, 2, 3]) * metres, atol=1e-15)


def test_y_up_is_turned_upright(folder: Path) -> None:
    upright = [[1, 0, 0], [0, 0, 2], [0, -3, 0]]
    assert_allclose(corners(load(folder, "meshes: [{file: t.obj}]", up="y"))[0], upright)
    assert_allclose(corners(load(folder, "{meshes: [{file: t.obj}], up: y}"))[0], upright)
    assert_allclose(corners(load(folder, "meshes: [{file: t.obj, up: y}]"))[0], upright)
    assert_allclose(corners(load(folder, "meshes: [{file: t.obj, up: y}]", up="z"))[0], np.diag([1, 2, 3]))


def test_meshes_are_joined_with_their_own_tags(folder: Path) -> None:
    scene = load(
        folder,
        "tags: {lambert1: formboard, '*': plastic}\n"
        "meshes:\n"
        "- {file: two.obj, tags: {'*': cement}}\n"
        "- {file: t.obj}\n"
        "- {file: two.obj}\n",
    )
    assert scene.tags == ("cement", "formboard", "plastic")
    assert tags_of(scene) == ["cement"] * 3 + ["plastic"] + ["formboard", "plastic", "plastic"]
    assert_array_equal(corners(scene)[3], corners(scene)[0])
    assert scene.faces.dtype == np.uint32 and scene.face_tags.dtype == np.uint8


@pytest.mark.parametrize(
    ("option", "mesh", "top", "expected"),
    [
        ({}, {}, {"lambert1": "cement", "phong 2": "plastic"}, ["cement", "plastic", "plastic"]),
        ({}, {"lambert1": "plastic"}, {"lambert1": "cement", "*": "cement"}, ["plastic", "cement", "cement"]),
        ({}, {"*": "plastic"}, {"lambert1": "cement"}, ["plastic"] * 3),
        ({"*": "formboard"}, {"lambert1": "plastic"}, {"phong 2": "cement"}, ["formboard"] * 3),
        ({"phong 2": "formboard"}, {"*": "plastic"}, {}, ["plastic", "formboard", "formboard"]),
        ({"*": "formboard", "lambert1": "cement"}, {}, {}, ["cement", "formboard", "formboard"]),
    ],
)
def test_which_tag_map_wins(
    folder: Path, option: dict[str, str], mesh: dict[str, str], top: dict[str, str], expected: list[str]
) -> None:
    scene = load(folder, f"{{tags: {top!r}, meshes: [{{file: two.obj, tags: {mesh!r}}}]}}", tags=option)
    assert tags_of(scene) == expected
    assert scene.tags == tuple(sorted(set(expected)))


@pytest.mark.parametrize("key", ["(none)", "*", ""])
def test_faces_without_a_material_can_be_mapped(tmp_path: Path, key: str) -> None:
    (tmp_path / "m.obj").write_text(TRIANGLE + "f 1 2 3\nusemtl cement\nf 3 2 1\n")
    scene = load_scene(tmp_path / "m.obj", tags={key: "plastic", "cement": "cement"}, materials=MATERIALS)
    assert tags_of(scene) == ["plastic", "cement"]


def test_numbers_as_names_in_a_tag_map(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(TRIANGLE + "usemtl 7\nf 1 2 3\n")
    assert tags_of(load(tmp_path, "{tags: {7: cement}, meshes: [{file: m.obj}]}")) == ["cement"]


def test_trajectories_are_kept_in_order(folder: Path) -> None:
    scene = load(folder, "name: hall\nmeshes: [{file: t.obj}]\ntrajectories: {b: {shape: line}, a: {file: a.txt}}\n")
    assert scene.name == "hall"
    assert list(scene.trajectories.items()) == [("b", {"shape": "line"}), ("a", {"file": "a.txt"})]
    assert scene.source == folder / "s.yaml"


def test_a_run_folder_has_its_scene_file_before_its_mesh(tmp_path: Path) -> None:
    run = tmp_path / "flight7"
    run.mkdir()
    (run / "scene.obj").write_text(TRIANGLE + "usemtl cement\nf 1 2 3\n")
    assert load_scene(run, materials=MATERIALS).name == "flight7"
    (run / "scene.yaml").write_text("{name: other, meshes: [{file: scene.obj, translate: [1, 0, 0]}]}")
    scene = load_scene(run, materials=MATERIALS)
    assert scene.name == "other" and scene.vertices[:, 0].max() == 2


def test_the_recorded_floor() -> None:
    run = Path(__file__).parents[3] / "shared/data/d435_floor"
    if not run.is_dir():
        pytest.skip("the shared data is not beside the repository")
    scene = load_scene(run, materials=MATERIALS)
    assert scene.tags == ("cement",)
    assert scene.areas.sum() == 6400
    assert_array_equal(scene.normals, [[0, 0, 1]] * 2)


def test_unused_and_flat_things_are_left_out(tmp_path: Path) -> None:
    stray = "v nan 0 0\nv 1e9 0 0\n"
    (tmp_path / "m.obj").write_text(stray + TRIANGLE + "usemtl cement\nf 3 4 5\nf 3 3 4\nf 5 4 3\n")
    scene = load_scene(tmp_path / "m.obj", materials=MATERIALS)
    assert_array_equal(scene.vertices, np.diag([1, 2, 3]))
    assert_array_equal(scene.faces, [[0, 1, 2], [2, 1, 0]])


def test_builtin_scenes_load_by_name_and_the_same_twice() -> None:
    if not builtin_scenes():
        pytest.skip("no scenes beside the package")
    name = builtin_scenes()[0]
    first, second = (load_scene(name, tags={"*": "plastic"}, materials=MATERIALS) for _ in range(2))
    assert first.trajectories
    assert first.vertices.tobytes() == second.vertices.tobytes()
    assert first.face_tags.tobytes() == second.face_tags.tobytes()


def test_an_unknown_name_lists_the_builtin_scenes() -> None:
    with pytest.raises(InputError, match="no such scene; give a file, a run folder or one of"):
        load_scene("castle", materials=MATERIALS)
