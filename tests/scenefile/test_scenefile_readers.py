"""OBJ, PLY, glTF, STL and OFF as their writers make them: triangles and material names, face by face."""

import base64
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from broken.scenes import glb, gltf
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from depthsim.errors import InputError
from depthsim.scenefile.mesh import Mesh, read_mesh
from depthsim.scenefile.polygons import triangulate

trimesh = pytest.importorskip("trimesh")
QUICK = settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
NAMES = st.sampled_from(["cement", "lambert1", "Material.001", "brick wall", "µ"])


def read(folder: Path, name: str, content: str | bytes) -> Mesh:
    (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    return read_mesh(folder / name)


def named(mesh: Mesh) -> list[str]:
    return [mesh.names[i] for i in mesh.face_names]


def corners(mesh: Mesh) -> np.ndarray:
    return mesh.vertices[mesh.faces]


def volume(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)


# OBJ


@QUICK
@given(st.lists(NAMES, min_size=1, max_size=80))
def test_obj_keeps_the_name_of_every_face(tmp_path: Path, names: list[str]) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=1)
    text = "mtllib gone.mtl\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in sphere.vertices.tolist())
    last = None
    for i, name in enumerate(names):
        a, b, c = sphere.faces[i] + 1
        text += f"o part{i}\n" * (i % 3 == 0) + f"usemtl {name}\n" * (name != last) + f"g x\ns off\nf {a} {b} {c}\n"
        last = name
    mesh = read(tmp_path, "m.obj", text)
    assert named(mesh) == names
    assert_array_equal(corners(mesh), sphere.triangles[: len(names)])


CORNERS = ["1 2 3", "1/1 2/2 3/3", "1//1 2//2 3//3", "1/1/1 2/2/2 3/3/3", "-3 -2 -1", "-3/1 -2/1 -1/1", "1 2 3 # note"]


@pytest.mark.parametrize("face", CORNERS)
def test_obj_corners_in_all_their_forms(tmp_path: Path, face: str) -> None:
    mesh = read(tmp_path, "m.obj", f"v 1 0 0\nv 0 2 0 1.0\nv 0 0 3 .5 .5 .5\nvn 0 0 1\nvt 0 0\nf {face}\n")
    assert_array_equal(corners(mesh), [np.diag([1, 2, 3])])
    assert named(mesh) == [""]


def test_obj_negative_indices_count_from_their_line(tmp_path: Path) -> None:
    mesh = read(tmp_path, "m.obj", "v 1 0 0\nv 0 2 0\nv 0 0 3\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n")
    assert_array_equal(mesh.faces, [[0, 1, 2], [3, 4, 5]])


def test_obj_mixed_polygons_and_forms(tmp_path: Path) -> None:
    ring = "".join(f"v {np.cos(t)} {np.sin(t)} 0\n" for t in np.arange(6) * np.pi / 3)
    text = ring + "vn 0 0 1\nusemtl hexagon\nf 1 2 3 4 5 6\nusemtl triangle\nf 1//1 2//1 3//1\nusemtl quad\nf 1 2 4 5\n"
    mesh = read(tmp_path, "m.obj", text)
    assert named(mesh) == ["hexagon"] * 4 + ["triangle"] + ["quad"] * 2
    areas = np.bincount(mesh.face_names, mesh.areas)
    assert_allclose(areas, [1.5 * np.sqrt(3), np.sqrt(3) / 4, np.sqrt(3)], rtol=1e-9)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_obj_encodings_line_ends_and_continued_lines(tmp_path: Path, encoding: str, newline: str) -> None:
    text = "# Größe\n\n  v 0 0 0\nv\t1 0 0\nv 0 1 0\nusemtl Wände\nf 1 2 \\\n 3"
    mesh = read(tmp_path, "m.obj", text.replace("\n", newline).encode(encoding))
    assert named(mesh) == ["Wände"]
    assert_array_equal(mesh.faces, [[0, 1, 2]])


def test_obj_as_trimesh_writes_it(tmp_path: Path) -> None:
    box, ball = trimesh.creation.box(), trimesh.creation.icosphere()
    for part, name, grey in ((box, "lambert1", 100), (ball, "phong1", 200)):
        material = trimesh.visual.material.SimpleMaterial(name=name, diffuse=[grey, grey, grey])
        part.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(part.vertices), 2)), material=material)
    trimesh.Scene([box, ball]).export(tmp_path / "m.obj")
    mesh = read_mesh(tmp_path / "m.obj")
    count = dict(zip(mesh.names, np.bincount(mesh.face_names), strict=True))
    assert count == {"lambert1": 12, "phong1": 1280}
    assert volume(mesh) == pytest.approx(box.volume + ball.volume, rel=1e-6)


# Polygons


@QUICK
@given(st.lists(st.floats(0.2, 3.0), min_size=4, max_size=14), st.integers(0, 2**32 - 1))
def test_polygons_that_are_not_convex_keep_their_area(radii: list[float], seed: int) -> None:
    angles = np.arange(len(radii)) * 2 * np.pi / len(radii)
    x, y = np.array(radii) * [np.cos(angles), np.sin(angles)]
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    ring = np.stack([x, y, 0 * x], axis=1) @ turn.T
    faces, polygon = triangulate(ring, np.array([len(ring)]), np.arange(len(ring)))
    assert_array_equal(polygon, [0] * (len(ring) - 2))
    a, b, c = np.moveaxis(ring[faces], 1, 0)
    signed = np.cross(b - a, c - a) @ np.cross(turn[:, 0], turn[:, 1]) / 2
    assert signed.min() > -1e-9
    assert signed.sum() == pytest.approx((x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


# PLY


def ply(order: str, polygons: list[list[int]], materials: list[int], comments: str = "") -> bytes:
    vertices = trimesh.creation.icosphere(subdivisions=1).vertices.astype(np.float32)
    kind = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    header = (
        f"ply\nformat {kind} 1.0\n{comments}element vertex {len(vertices)}\nproperty float x\nproperty float y\n"
        f"property float z\nproperty uchar red\nelement face {len(polygons)}\nproperty uchar flags\n"
        f"property list uchar int vertex_indices\nproperty short material\nelement edge 1\nproperty int a\nend_header\n"
    )
    rows = [("3fB", *vertex.tolist(), 7) for vertex in vertices]
    rows += [(f"BB{len(p)}ih", 1, len(p), *p, m) for p, m in zip(polygons, materials, strict=True)] + [("i", 3)]
    if order:
        return header.encode() + b"".join(struct.pack(order + row[0], *row[1:]) for row in rows)
    return header.encode() + "\n".join(" ".join(str(value) for value in row[1:]) for row in rows).encode() + b"\n"


@pytest.mark.parametrize("order", ["", "<", ">"])
@QUICK
@given(st.lists(st.tuples(st.integers(3, 5), st.integers(0, 3)), min_size=1, max_size=12))
def test_ply_keeps_the_material_of_every_face(tmp_path: Path, order: str, faces: list[tuple[int, int]]) -> None:
    polygons = [list(range(i, i + n)) for i, (n, _) in enumerate(faces)]
    comments = "comment made by hand\ncomment material 0 cement\ncomment material 2 brick wall\n"
    mesh = read(tmp_path, "m.ply", ply(order, polygons, [m for _, m in faces], comments))
    known = {0: "cement", 1: "1", 2: "brick wall", 3: "3"}
    assert named(mesh) == [known[m] for n, m in faces for _ in range(n - 2)]
    vertices = trimesh.creation.icosphere(subdivisions=1).vertices.astype(np.float32)
    first = 0
    for ring in polygons:
        used = corners(mesh)[first : first + len(ring) - 2].reshape(-1, 3)
        assert {tuple(v) for v in used} == {tuple(v) for v in vertices[ring].astype(float)}
        first += len(ring) - 2


def test_ply_as_trimesh_writes_it(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere()
    ball.face_attributes["material"] = np.arange(len(ball.faces), dtype=np.int32) % 3
    for encoding in ("ascii", "binary"):
        ball.export(tmp_path / "m.ply", encoding=encoding, include_attributes=True)
        mesh = read_mesh(tmp_path / "m.ply")
        assert named(mesh) == [str(i % 3) for i in range(len(ball.faces))]
        assert_allclose(corners(mesh), ball.triangles, atol=1e-6)


def test_ply_without_materials_and_with_other_lists(tmp_path: Path) -> None:
    text = (
        "ply\r\nformat ascii 1.0\r\nelement vertex 3\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\n"
        "element face 2\r\nproperty list uchar int vertex_index\r\nproperty list uchar float texcoord\r\nend_header\r\n"
        "1 0 0\r\n0 2 0\r\n0 0 3\r\n3 0 1 2 6 0 0 0 0 0 0\r\n3 2 1 0 0\r\n"
    )
    mesh = read(tmp_path, "m.ply", text)
    assert named(mesh) == ["", ""]
    assert_array_equal(mesh.faces, [[0, 1, 2], [2, 1, 0]])


def test_ply_triangle_strips_wind_alternately(tmp_path: Path) -> None:
    header = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element tristrips 2\nproperty list int int vertex_indices\nend_header\n"
    points = "0 0 0 1 0 0 0 1 0 1 1 0 0 2 0\n"
    mesh = read(tmp_path, "m.ply", header + points + "9 0 1 2 3 4 -1 0 1 2\n3 1 3 2\n")
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    assert_array_equal(np.cross(b - a, c - a)[:, 2], [1] * 5)


# glTF


@QUICK
@given(
    st.lists(st.sampled_from(["cement", "lambert1", "", None]), min_size=1, max_size=5),
    st.sampled_from(["glb", "gltf"]),
)
def test_gltf_keeps_the_material_of_every_primitive(tmp_path: Path, names: list[str | None], kind: str) -> None:
    header = json.loads(gltf())
    header["materials"] = [{} if name is None else {"name": name} for name in names]
    one = header["meshes"][0]["primitives"][0]
    header["meshes"][0]["primitives"] = [{**one, "material": i} for i in range(len(names))] + [one]
    mesh = read(tmp_path, f"m.{kind}", glb(json.dumps(header)) if kind == "glb" else json.dumps(header))
    assert named(mesh) == [name or f"material_{i}" for i, name in enumerate(names)] + [""]


def test_gltf_transforms_instances_and_mirrors(tmp_path: Path) -> None:
    header = json.loads(gltf())
    header["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]
    header["nodes"] = [
        {"translation": [10, 0, 0], "children": [1, 2], "camera": 0},
        {"mesh": 0, "rotation": [0, 0, np.sqrt(0.5), np.sqrt(0.5)], "scale": [2, 2, 2]},
        {"mesh": 0, "scale": [-1, 1, 1]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1]},
        {"mesh": 0},
    ]
    header["scenes"] = [{"nodes": [4]}, {"nodes": [0, 3]}]
    header["scene"] = 1
    mesh = read(tmp_path, "m.gltf", json.dumps(header))
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    centre_and_side = np.column_stack([(a + b + c)[:, :2], np.cross(b - a, c - a)[:, 2]])
    turned, mirrored, moved = [28, 2, 4], [29, 1, 1], [1, 16, 1]
    assert_allclose(sorted(centre_and_side.tolist()), [moved, turned, mirrored], atol=1e-6)


def test_a_mesh_in_too_many_nodes_is_refused_before_it_fills_the_memory(tmp_path: Path) -> None:
    header = json.loads(gltf())
    nodes, triangles = 1001, 40_000
    data = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<3H", 0, 1, 2) * triangles
    header["buffers"][0] = {
        "byteLength": len(data),
        "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
    }
    header["bufferViews"][1] = {"buffer": 0, "byteOffset": 36, "byteLength": len(data) - 36}
    header["accessors"][1]["count"] = 3 * triangles
    header["nodes"] = [{"mesh": 0} for _ in range(nodes)]
    header["scenes"] = [{"nodes": list(range(nodes))}]
    with pytest.raises(InputError, match=r"m\.gltf: nodes: places its meshes 1,001 times, .* 40,040,000 triangles"):
        read(tmp_path, "m.gltf", json.dumps(header))


def test_gltf_normalized_integers_are_shares_of_one(tmp_path: Path) -> None:
    data = struct.pack("<12h", 0, 0, 0, 0, 32767, 0, 0, 0, 0, -16384, 0, 0)
    accessors = [{"bufferView": 0, "componentType": 5122, "count": 3, "type": "VEC3", "normalized": True}]
    primitive = {"attributes": {"POSITION": 0}}
    header = gltf(
        accessors=accessors,
        bufferViews=[{"buffer": 0, "byteLength": 24, "byteStride": 8}],
        buffers=[{"byteLength": 24}],
        meshes=[{"primitives": [primitive]}],
        nodes=[{"mesh": 0, "scale": [4, 4, 4]}],
    )
    mesh = read(tmp_path, "m.glb", glb(header, data))
    assert_allclose(mesh.vertices, [[0, 0, 0], [4, 0, 0], [0, -2, 0]], atol=1e-3)


def test_gltf_buffer_beside_it_with_an_escaped_name(tmp_path: Path) -> None:
    (tmp_path / "my box.bin").write_bytes(struct.pack("<9f3H2x", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 2))
    mesh = read(tmp_path, "m.gltf", gltf(buffers=[{"byteLength": 44, "uri": "my%20box.bin"}]))
    assert_array_equal(corners(mesh), [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])


def test_glb_as_trimesh_writes_it_and_the_same_twice(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for i, name in enumerate(["lambert1", "phong1", "lambert1"]):
        ball = trimesh.creation.icosphere(subdivisions=i)
        material = trimesh.visual.material.PBRMaterial(name=name)
        ball.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(ball.vertices), 2)), material=material)
        scene.add_geometry(ball, transform=trimesh.transformations.translation_matrix([3 * i, 0, 0]))
    (tmp_path / "m.glb").write_bytes(scene.export(file_type="glb"))
    first, second = read_mesh(tmp_path / "m.glb"), read_mesh(tmp_path / "m.glb")
    count = dict(zip(first.names, np.bincount(first.face_names), strict=True))
    assert count == {"lambert1": 20 + 320, "phong1": 80}
    assert volume(first) == pytest.approx(sum(g.volume for g in scene.geometry.values()), rel=1e-5)
    assert first.vertices.tobytes() + first.faces.tobytes() == second.vertices.tobytes() + second.faces.tobytes()


# STL, OFF


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "off"])
def test_shapes_without_materials(tmp_path: Path, kind: str) -> None:
    ball = trimesh.creation.icosphere()
    ball.export(tmp_path / f"m.{kind[:3]}", file_type=kind)
    mesh = read_mesh(tmp_path / f"m.{kind[:3]}")
    assert mesh.names == ("",)
    assert_allclose(corners(mesh), ball.triangles, atol=1e-6)


# Anything


@pytest.fixture(scope="module")
def whole() -> dict[str, bytes]:
    ball = trimesh.creation.icosphere(subdivisions=0)
    files = {kind: ball.export(file_type=kind) for kind in ("obj", "glb", "ply", "stl", "off")}
    files["gltf"] = gltf()
    return {kind: data.encode() if isinstance(data, str) else data for kind, data in files.items()}


@pytest.mark.parametrize("kind", ["obj", "glb", "gltf", "ply", "stl", "off"])
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_file_is_a_mesh_or_one_line(
    tmp_path: Path, whole: dict[str, bytes], kind: str, data: st.DataObject
) -> None:
    content = bytearray(whole[kind])
    for at in data.draw(st.lists(st.integers(0, len(content) - 1), max_size=3)):
        content[at] = data.draw(st.integers(0, 255))
    end = data.draw(st.one_of(st.just(len(content)), st.integers(0, len(content))))
    try:
        mesh = read(tmp_path, f"m.{kind}", bytes(content[:end]))
    except InputError as error:
        assert "\n" not in str(error) and f"m.{kind}: " in str(error)
    else:
        assert np.isfinite(mesh.vertices).all() and len(mesh.faces) and mesh.faces.max() < len(mesh.vertices)
