"""What is reported of a scene, on meshes whose holes, flips and sizes are known."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from depthsim.cli.scene_tables import render
from depthsim.materials import Materials
from depthsim.scenefile import load_scene
from depthsim.scenefile.hints import origin_hint, size_hint
from depthsim.scenefile.inspect import SceneReport, inspect_scene
from depthsim.scenefile.topology import Topology, topology

trimesh = pytest.importorskip("trimesh")
MATERIALS = Materials.model_validate({tag: {"m": 0.5} for tag in ("cement", "plastic")})
BOX, BALL = trimesh.creation.box(), trimesh.creation.icosphere(subdivisions=2)


def of(mesh: object) -> Topology:
    return topology(np.asarray(mesh.vertices), np.asarray(mesh.faces))  # type: ignore[attr-defined]


def box_without(*faces: int) -> np.ndarray:
    return np.delete(BOX.faces, faces, axis=0)


def text_of(report: SceneReport, width: int = 200) -> str:
    console = Console(width=width, color_system=None)
    with console.capture() as capture:
        console.print(render(report))
    return capture.get()


def write(folder: Path, faces: np.ndarray, vertices: np.ndarray, name: str = "m.obj", head: str = "") -> Path:
    text = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in vertices.tolist()) + head
    (folder / name).write_text(text + "".join(f"f {a} {b} {c}\n" for a, b, c in (faces + 1).tolist()))
    return folder / name


def test_a_closed_box() -> None:
    assert of(BOX) == Topology(0, 0, 0, 0, 0, 0, bodies=1, closed_bodies=1, inside_out_bodies=0)


def test_a_box_without_one_side_has_one_loop_of_four_edges() -> None:
    top = np.flatnonzero(BOX.face_normals[:, 2] > 0.5)
    found = topology(BOX.vertices, box_without(*top))
    assert (found.boundary_edges, found.boundary_loops, found.closed_bodies) == (4, 1, 0)


def test_a_box_without_two_opposite_sides_has_two_loops() -> None:
    ends = np.flatnonzero(np.abs(BOX.face_normals[:, 2]) > 0.5)
    found = topology(BOX.vertices, box_without(*ends))
    assert (found.boundary_edges, found.boundary_loops) == (8, 2)


def test_a_soup_of_triangles_is_merged_where_they_meet() -> None:
    corners = BALL.triangles.reshape(-1, 3)
    corners = np.where(corners == 0, np.tile([0.0, -0.0], corners.size // 2).reshape(corners.shape), corners)
    assert topology(corners, np.arange(len(corners)).reshape(-1, 3)) == of(BALL)


def test_one_flipped_face() -> None:
    faces = BALL.faces.copy()
    faces[7] = faces[7, ::-1]
    found = topology(BALL.vertices, faces)
    assert (found.flipped_faces, found.flipped_edges, found.inside_out_bodies, found.closed_bodies) == (1, 3, 0, 1)


@settings(max_examples=40)
@given(st.sets(st.integers(0, len(BALL.faces) - 1), max_size=len(BALL.faces)), st.booleans())
def test_any_flipped_faces_are_counted_in_each_body(flips: set[int], inwards: bool) -> None:
    faces = BALL.faces.copy()
    faces[list(flips)] = faces[list(flips), ::-1]
    both = np.concatenate([faces, (BALL.faces[:, ::-1] if inwards else BALL.faces) + len(BALL.vertices)])
    found = topology(np.concatenate([BALL.vertices, BALL.vertices + 5]), both)
    assert found.flipped_faces == min(len(flips), len(faces) - len(flips))
    assert (found.bodies, found.closed_bodies) == (2, 2)
    if 2 * len(flips) != len(faces):
        assert found.inside_out_bodies == (2 * len(flips) > len(faces)) + inwards
    turned = np.zeros(len(faces), dtype=bool)
    turned[list(flips)] = True
    pairs = BALL.face_adjacency
    assert found.flipped_edges == (turned[pairs[:, 0]] != turned[pairs[:, 1]]).sum()


def test_two_boxes_apart_and_touching() -> None:
    apart = of(trimesh.util.concatenate([BOX, BOX.copy().apply_translation([3, 0, 0])]))
    assert (apart.bodies, apart.closed_bodies, apart.non_manifold_edges) == (2, 2, 0)
    # Side by side they share four edges, of two faces on each side (and the side between them, given twice).
    touching = of(trimesh.util.concatenate([BOX, BOX.copy().apply_translation([1, 0, 0])]))
    assert touching.boundary_edges == 0
    assert touching.non_manifold_edges >= 4


def test_duplicate_faces_whatever_their_winding() -> None:
    faces = np.concatenate([BOX.faces, BOX.faces[:2, ::-1], BOX.faces[3:4, [1, 2, 0]]])
    found = topology(BOX.vertices, faces)
    assert found.duplicate_faces == 3
    assert found.closed_bodies == 0 and found.boundary_edges == 0


def test_a_moebius_strip_has_one_side_and_one_rim() -> None:
    n = 12
    angle = np.arange(n) * 2 * np.pi / n
    across = np.stack([np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], axis=1)
    centre = 3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    faces = []
    for i in range(n):
        a, b = i, i + n
        c, d = (i + 1, i + 1 + n) if i < n - 1 else (n, 0)
        faces += [[a, b, c], [c, b, d]]
    found = topology(np.concatenate([centre + across, centre - across]), np.array(faces))
    assert (found.boundary_loops, found.boundary_edges, found.flipped_faces) == (1, 2 * n, 0)
    assert found.flipped_edges == 1 and found.closed_bodies == 0


def test_against_trimesh_on_random_holes() -> None:
    rng = np.random.default_rng(3)
    for _ in range(10):
        mesh = BALL.copy()
        mesh.update_faces(rng.random(len(mesh.faces)) < 0.8)
        found = of(mesh)
        unique, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
        assert len(unique) == (counts == 2).sum() + found.boundary_edges
        groups = trimesh.graph.connected_components(mesh.face_adjacency, nodes=np.arange(len(mesh.faces)))
        assert found.bodies == len(groups)
        assert found.flipped_edges == 0 and mesh.is_winding_consistent


def test_names_areas_and_what_is_not_mapped(tmp_path: Path) -> None:
    square = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 2 2 3\n"
    faces = "f 1 2 3\nusemtl cement\nf 1 3 4\nusemtl big lamp\nf 2 3 5\n"
    faces += "usemtl unused\nusemtl PlasticBox\nf 1 1 2\nf 2 5 3\n"
    (tmp_path / "m.obj").write_text(square + faces)
    report = inspect_scene(tmp_path / "m.obj", tags={"(none)": "plastic"}, materials=MATERIALS)
    (mesh,) = report.meshes
    assert {entry.name: (entry.tag, entry.faces, entry.area) for entry in mesh.names} == {
        "": ("plastic", 1, 2.0),
        "cement": ("cement", 1, 2.0),
        "big lamp": (None, 1, 3.0),
        "PlasticBox": (None, 1, 3.0),
    }
    assert mesh.zero_area == 1 and mesh.topology.duplicate_faces == 1
    assert report.unmapped == ("PlasticBox", "big lamp")
    assert report.tag_guesses == {"PlasticBox": "plastic", "big lamp": "plastic"}
    text = text_of(report)
    for word in (
        "not mapped",
        "(none)",
        "big lamp",
        "--tag 'big lamp=plastic'",
        "faces without area, left out: 1",
        "m, z up",
    ):
        assert word in text


def test_the_tag_guesses_work_as_they_stand(tmp_path: Path) -> None:
    faces = "".join(f"usemtl n{i}\nf 1 2 3\n" for i in range(40)) + "usemtl cement\nf 1 2 3\n"
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" + faces)
    report = inspect_scene(tmp_path / "m.obj", materials=MATERIALS)
    assert len(report.unmapped) == 41 and len(report.tag_guesses) == 12
    assert load_scene(tmp_path / "m.obj", tags=report.tag_guesses, materials=MATERIALS).tags == ("plastic",)


def test_a_scene_file_with_several_meshes(tmp_path: Path) -> None:
    write(tmp_path, BOX.faces, BOX.vertices, "a.obj", "usemtl cement\n")
    write(tmp_path, box_without(0), BOX.vertices, "b.obj")
    (tmp_path / "s.yaml").write_text(
        "meshes: [{file: a.obj, scale: 2}, {file: b.obj, tags: {'*': plastic}, translate: [5, 0, 0], units: cm}]\n"
        "trajectories: {tour: {shape: line}, back: {shape: line}}\n"
    )
    report = inspect_scene(tmp_path / "s.yaml", materials=MATERIALS)
    assert [mesh.label for mesh in report.meshes] == ["a.obj", "b.obj"]
    assert [mesh.names[0].area for mesh in report.meshes] == [pytest.approx(24), pytest.approx(5.5e-4)]
    assert [mesh.topology.boundary_edges for mesh in report.meshes] == [0, 3]
    assert [mesh.read_as for mesh in report.meshes] == ["m, z up", "cm, z up"]
    assert report.trajectories == ("tour", "back")
    assert report.bounds[1] == pytest.approx([5.005, 1, 1])
    assert "trajectories: tour, back" in text_of(report)


@pytest.mark.parametrize(
    ("width", "words"),
    [
        (4000, "4,000 m wide: is the file in other units? `units` mm or"),
        (9e4, "`units` mm"),
        (0.05, "0.05 m"),
    ],
)
def test_a_strange_size_is_reported(width: float, words: str) -> None:
    assert words in str(size_hint(np.array([[0, 0, 0], [width, 1e-3, 1e-3]])))
    assert ("cm" in str(size_hint(np.array([[0, 0, 0], [width, 0, 0]])))) == (width == 4000)


def test_a_plain_room_gets_no_hint(tmp_path: Path) -> None:
    report = inspect_scene(write(tmp_path, BOX.faces[:, ::-1], BOX.vertices * [8, 5, 3]), materials=MATERIALS)
    assert report.hints == ()
    assert report.meshes[0].topology.inside_out_bodies == 1
    assert "look inwards (right for a room): 1" in text_of(report)


def test_far_from_the_origin_is_reported() -> None:
    assert origin_hint(np.array([[0, 0, 0], [9.0, 9, 9]])) is None
    assert "steps of 31 mm" in str(origin_hint(np.array([[5e5, 5e5, 0], [5.0001e5, 5.001e5, 9]])))


def test_a_floor_across_y_is_reported(tmp_path: Path) -> None:
    floor = np.array([[-5, 0, -5], [5, 0, -5], [5, 0, 5], [-5, 0, 5], [0, 3, 0], [1, 3, 0]], dtype=float)
    path = write(tmp_path, np.array([[0, 2, 1], [0, 3, 2], [0, 4, 5]]), floor)
    assert any("`up` y" in hint for hint in inspect_scene(path, materials=MATERIALS).hints)
    assert not any("`up` y" in hint for hint in inspect_scene(path, up="y", materials=MATERIALS).hints)
    assert not any("`up` y" in hint for hint in inspect_scene(path, up="z", materials=MATERIALS).hints)


def test_markup_in_names_is_text(tmp_path: Path) -> None:
    path = write(tmp_path, BOX.faces, BOX.vertices, head="usemtl [red]oak[/]\n")
    assert "[red]oak[/]" in text_of(inspect_scene(path, materials=MATERIALS))
