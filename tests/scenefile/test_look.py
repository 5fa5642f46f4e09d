"""Colours that mesh files have: read, kept through a run's own scene file, and seen by the camera."""

import json
import struct
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from commands import depthsim_here
from PIL import Image
from shapes import MATERIALS, Array, as_scene, camera, quad, wall

from depthsim.coloring import NONE, albedo_of, color_image
from depthsim.errors import InputError
from depthsim.intensity import intensity_image, light_on_faces
from depthsim.look import PLAIN, PROCEDURAL, Look, Texture
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.scenefile.save import save_scene

CORNERS = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], float)
PLACES = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
TEXTURE = np.random.default_rng(1).integers(30, 226, (48, 64, 3)).astype(np.uint8)
EYE = camera(64, 48, 64.0)
POSE = np.array([[1, 0, 0, 0], [0, 0, 1, -2], [0, -1, 0, 0], [0, 0, 0, 1]], float)
"""From y = -2 m along +y: 64 px across 2 m at 2 m, so a texel is a pixel across; down 48 texels are 64 px."""


def obj_file(folder: Path, faces: str = "f 1/1 2/2 3/3 4/4", map_kd: str = "map_Kd -s 1 1 1 paint here.png") -> Path:
    Image.fromarray(TEXTURE).save(folder / "paint here.png")
    (folder / "m.mtl").write_text(f"newmtl cement\nKd 0.2 0.2 0.2\n{map_kd}\n")
    rows = [f"v {x} {y} {z}" for x, y, z in CORNERS] + [f"vt {u} {v}" for u, v in PLACES]
    (folder / "m.obj").write_text("\n".join(["mtllib m.mtl", *rows, "usemtl cement", faces]) + "\n")
    return folder / "m.obj"


def glb_file(folder: Path, picture: bytes | None, **more: Any) -> Path:
    """A GLB of the same wall, y up, by hand. more: of the material's pbrMetallicRoughness; ``colors``: of vertices."""
    positions = np.stack([CORNERS[:, 0], CORNERS[:, 2], -CORNERS[:, 1]], axis=1).astype("<f4")
    uv, index = (PLACES * [1, -1] + [0, 1]).astype("<f4"), np.array([0, 1, 2, 0, 2, 3], "<u2")
    colors = np.array(more.pop("colors", np.full((4, 4), 65535)), "<u2")
    parts = [positions.tobytes(), uv.tobytes(), index.tobytes(), colors.tobytes(), picture or b""]
    views, at = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(part)})
        at += len(part) + -len(part) % 4
    body = b"".join(part + b"\0" * (-len(part) % 4) for part in parts)
    kinds = [(5126, "VEC3"), (5126, "VEC2"), (5123, "SCALAR"), (5123, "VEC4")]
    accessors: list[dict[str, Any]] = [
        {"bufferView": k, "componentType": c, "type": t, "count": 6 if t == "SCALAR" else 4}
        for k, (c, t) in enumerate(kinds)
    ]
    accessors[3]["normalized"] = True
    attributes = {"POSITION": 0, "TEXCOORD_0": 1} | ({"COLOR_0": 3} if more.pop("with_colors", False) else {})
    textured = {"baseColorTexture": {"index": 0, **more.pop("texture", {})}} if picture is not None else {}
    header = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 2, "material": 0}]}],
        "materials": [{"name": "cement", "pbrMetallicRoughness": textured | more}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(body)}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 4, "mimeType": "image/png"}],
    }
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
    (folder / "m.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return folder / "m.glb"


def png(picture: Array | np.ndarray) -> bytes:
    return bytes(cv2.imencode(".png", np.ascontiguousarray(np.asarray(picture)[..., ::-1]))[1])


def painted(scene: Scene, eye: Any = EYE, pose: Array = POSE) -> np.ndarray:
    return color_image(Caster(scene).cast(eye, pose), eye, pose, scene, MATERIALS)


def expected(scene: Scene, eye: Any = EYE) -> np.ndarray:
    """The texture where the wall stands, 48 texels over 64 rows interpolated in light, in float64."""
    light = np.square(TEXTURE / 255.0)
    rows = (np.arange(eye.height) + 8.5) * 48 / 64 - 0.5
    first = np.floor(rows).astype(int)
    share = (rows - first)[:, None, None]
    along = (1 - share) * light[first % 48] + share * light[(first + 1) % 48]
    return np.sqrt(along * light_on_faces(scene)[0]) * 255


def test_a_texture_is_on_the_wall_as_it_is(tmp_path: Path) -> None:
    scene = load_scene(obj_file(tmp_path), materials=MATERIALS)
    seen = painted(scene)
    assert seen.shape == (48, 64, 3)
    assert np.abs(seen - expected(scene)).max() <= 0.6
    assert (
        painted(load_scene(obj_file(tmp_path, "f -4/-4 -3/-3 -2/-2\nf 1/1 3/3 4/4"), materials=MATERIALS)) == seen
    ).all()


def test_gltf_is_the_same_picture(tmp_path: Path) -> None:
    seen = painted(load_scene(obj_file(tmp_path), materials=MATERIALS))
    assert (painted(load_scene(glb_file(tmp_path, png(TEXTURE)), materials=MATERIALS)) == seen).all()
    half = load_scene(glb_file(tmp_path, png(TEXTURE), baseColorFactor=[0.25, 0.25, 0.25, 1]), materials=MATERIALS)
    np.testing.assert_allclose(painted(half), seen / 2.0, atol=1.2)  # a quarter of the light
    # A quarter turn and back by the extension for it.
    turned = png(np.rot90(TEXTURE))
    moved = {"extensions": {"KHR_texture_transform": {"rotation": np.pi / 2, "offset": [0, 1]}}}
    again = load_scene(glb_file(tmp_path, turned, texture=moved), materials=MATERIALS)
    assert np.abs(painted(again).astype(int) - seen).max() <= 1


def test_colours_of_vertices_are_interpolated_in_light(tmp_path: Path) -> None:
    linear = np.array([[0, 0.5, 1, 1], [1, 0.5, 1, 1], [1, 0.5, 0, 1], [0, 0.5, 0, 1]])
    gltf = load_scene(glb_file(tmp_path, None, with_colors=True, colors=np.rint(linear * 65535)), materials=MATERIALS)
    head = "ply\nformat ascii 1.0\nelement vertex 4\n" + "".join(f"property float {a}\n" for a in "xyz")
    head += "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
    head += "element face 1\nproperty list uchar int vertex_indices\nproperty int material\nend_header\n"
    head = head.replace("element vertex", "comment material 0 cement\nelement vertex", 1)
    rows = [[*p, *np.rint(255 * np.sqrt(c[:3])).astype(int)] for p, c in zip(CORNERS, linear, strict=True)]
    (tmp_path / "m.ply").write_text(head + "\n".join(" ".join(map(str, row)) for row in rows) + "\n4 0 1 2 3 0\n")
    met = Caster(gltf).cast(EYE, POSE)
    x = (np.arange(64) + 0.5) / 64
    for scene in (gltf, load_scene(tmp_path / "m.ply", materials=MATERIALS)):
        assert scene.look is not None and set(scene.look.texture) == {PLAIN}
        albedo = albedo_of(met, EYE, POSE, scene)
        np.testing.assert_allclose(albedo[10, :, 0], x, atol=0.01)
        np.testing.assert_allclose(albedo[..., 1], 0.5, atol=0.005)
        np.testing.assert_allclose(albedo[0, 5, 2] - albedo[-1, 5, 2], -47 / 64, atol=0.01)


def test_a_base_colour_alone_leaves_the_texture_of_the_material(tmp_path: Path) -> None:
    scene = load_scene(glb_file(tmp_path, None, baseColorFactor=[1, 0, 0, 1]), materials=MATERIALS)
    assert scene.look is None and painted(scene).ndim == 2


def test_what_has_no_colours_is_grey_beside_what_has() -> None:
    scene = two_walls()
    met = Caster(scene).cast(EYE, np.eye(4))
    seen, grey = (
        color_image(met, EYE, np.eye(4), scene, MATERIALS),
        intensity_image(met, EYE, np.eye(4), scene, MATERIALS),
    )
    behind = met.face >= 2
    assert behind.any() and (~behind).any()
    assert (seen[behind] == grey[behind][:, None]).all()
    albedo = albedo_of(met, EYE, np.eye(4), scene)
    assert (albedo[behind] == NONE).all() and (albedo[~behind][:, 0] > 0.9).all() and (albedo[~behind][:, 1] == 0).all()


def two_walls() -> Scene:
    near, far = quad((-0.5, -0.5, 1), (0, 1, 0), (0.3, 0, 0)), wall(3.0)
    plain = as_scene(near, far, tags=["plastic", "cement"])
    none = Look.none(4)
    red = none.colors.copy()
    red[:2] = [255, 0, 0]
    look = Look(np.array([PLAIN, PLAIN, PROCEDURAL, PROCEDURAL], np.int32), none.uv, red)
    return Scene(plain.name, plain.vertices, plain.faces, plain.face_tags, plain.tags, look=look)


def test_a_far_texture_has_its_mean_light(tmp_path: Path) -> None:
    scene = load_scene(obj_file(tmp_path), materials=MATERIALS)
    far = POSE.copy()
    far[1, 3] = -16.0  # 8 px across
    met = Caster(scene).cast(EYE, far)
    albedo = albedo_of(met, EYE, far, scene)[met.hit]
    mean = np.square(TEXTURE / 255.0).mean(axis=(0, 1))
    np.testing.assert_allclose(albedo.mean(axis=0), mean, rtol=0.03)
    assert albedo.std() < 0.25 * np.square(TEXTURE / 255.0).std()


def test_rgbd_systems_find_features_on_a_texture(tmp_path: Path) -> None:
    blocks = np.kron(np.random.default_rng(2).integers(0, 256, (16, 16, 3)), np.ones((8, 8, 1))).astype(np.uint8)
    scene = load_scene(glb_file(tmp_path, png(blocks)), materials=MATERIALS)
    eye = camera(320, 240, 320.0)
    orb = cv2.ORB.create(500)
    seen = cv2.cvtColor(painted(scene, eye), cv2.COLOR_RGB2GRAY)
    moved = POSE.copy()
    moved[0, 3] = 0.1  # 16 px
    other = cv2.cvtColor(painted(scene, eye, moved), cv2.COLOR_RGB2GRAY)
    (a, da), (b, db) = (orb.detectAndCompute(x, None) for x in (seen, other))
    matches = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(da, db)
    steps = np.array([np.subtract(b[m.trainIdx].pt, a[m.queryIdx].pt) for m in matches])
    right = np.abs(steps - [-16, 0]).max(axis=1) < 1.5
    assert len(a) > 200 and right.sum() > 100 and right.mean() > 0.6


def test_the_bytes_depend_on_no_thread(tmp_path: Path) -> None:
    scene = load_scene(obj_file(tmp_path), materials=MATERIALS)
    met = Caster(scene).cast(EYE, POSE)
    one, three = (albedo_of(met, EYE, POSE, scene, threads=threads) for threads in (1, 3))
    assert one.tobytes() == three.tobytes()


# Scenes in runs


def test_a_scene_is_kept_with_its_colours(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(
        "meshes: [{file: m.obj, scale: [-1, 1, 2], rotate: [10, 20, 30]}, {file: m.glb, translate: [5, 0, 0]}]\n"
    )
    obj_file(tmp_path), glb_file(tmp_path, png(TEXTURE[::2]), with_colors=True, colors=np.full((4, 4), 30000))
    scene = load_scene(tmp_path / "scene.yaml", materials=MATERIALS)
    (tmp_path / "run").mkdir()
    save_scene(scene, tmp_path / "run")
    again = load_scene(tmp_path / "run", materials=MATERIALS)
    assert again.look is not None and scene.look is not None and again.digest == scene.digest
    for name in ("texture", "uv", "colors"):
        assert (getattr(again.look, name) == getattr(scene.look, name)).all()
    plain = load_scene(wall_without(tmp_path), materials=MATERIALS)
    assert plain.look is None and plain.digest != load_scene(tmp_path / "m.obj", materials=MATERIALS).digest


def wall_without(folder: Path) -> Path:
    (folder / "plain.obj").write_text((folder / "m.obj").read_text().replace("mtllib", "# mtllib"))
    return folder / "plain.obj"


def test_a_mirrored_mesh_keeps_its_texture_in_place(tmp_path: Path) -> None:
    obj_file(tmp_path)
    (tmp_path / "scene.yaml").write_text("meshes: [{file: m.obj, scale: [-1, 1, 1]}]\n")
    mirrored = painted(load_scene(tmp_path / "scene.yaml", materials=MATERIALS))
    seen = painted(load_scene(tmp_path / "m.obj", materials=MATERIALS))
    assert np.abs(mirrored[:, ::-1].astype(int) - seen).max() <= 1


def test_a_run_has_colour_images(tmp_path: Path) -> None:
    obj_file(tmp_path)
    poses = "0 0 -2 0 -0.70710678 0 0 0.70710678\n"
    (tmp_path / "t.txt").write_text(poses)
    made = depthsim_here(
        "generate", tmp_path / "m.obj", "--trajectory", tmp_path / "t.txt", "--frames", 1, "--resolution", "160x120",
        "--out", tmp_path / "run",
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    picture = Run.open(tmp_path / "run").rgb(0)
    assert picture is not None and picture.shape == (120, 160, 3) and np.ptp(picture.astype(int), axis=2).mean() > 5


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda file: file.unlink(), "names the texture paint here.png, which is not there"),
        (lambda file: file.write_bytes(b"GIF89a"), "paint here.png is no readable picture"),
        (lambda file: file.write_bytes(file.read_bytes()[:80]), "paint here.png is no readable picture"),
        (lambda file: Image.new("1", (20_000, 1)).save(file), "is 20000x1, and at most 16384 px across are read"),
    ],
)
def test_a_texture_that_cannot_be_had_is_one_line_and_no_run(tmp_path: Path, spoil: Any, words: str) -> None:
    obj_file(tmp_path)
    spoil(tmp_path / "paint here.png")
    (tmp_path / "t.txt").write_text("0 0 -2 0 -0.70710678 0 0 0.70710678\n")
    command = ["generate", tmp_path / "m.obj", "--trajectory", tmp_path / "t.txt", "--resolution", "160x120"]
    made = depthsim_here(*command, "--out", tmp_path / "run")
    assert made.returncode == 2 and words in made.stderr and "m.mtl: line 3" in made.stderr
    assert made.stderr.count("\n") == 1 and not (tmp_path / "run").exists()
    if "not there" in words:
        assert "--only-depth" in made.stderr
        assert depthsim_here(*command, "--only-depth", "--out", tmp_path / "run").returncode == 0


def test_all_textures_together_have_a_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthsim.look.MOST_TEXELS", 5000)
    names = ("a.png", "b.png")
    for name in names:
        Image.fromarray(TEXTURE).save(tmp_path / name)
    textures = tuple(Texture(tmp_path / "m.obj", f"line {k}", name) for k, name in enumerate(names))
    none = Look.none(2)
    with pytest.raises(InputError, match="line 1: this texture, 64x48, and the others have over 5,000 px"):
        _ = Look(np.array([0, 1], np.int32), none.uv, none.colors, textures).pictures
    # One that no face has is not read.
    assert Look(np.array([0, 0], np.int32), none.uv, none.colors, textures).pictures[1].size == 3


@pytest.mark.parametrize("name", ["../m.png", "/etc/hosts", "C:\\paint.png"])
def test_a_texture_elsewhere_is_refused_when_colours_are_asked_for(tmp_path: Path, name: str) -> None:
    scene = load_scene(obj_file(tmp_path, map_kd=f"map_Kd {name}"), materials=MATERIALS)
    with pytest.raises(InputError, match=r"m\.mtl: line 3"):
        painted(scene)


def test_infrared_images_have_the_texture(tmp_path: Path) -> None:
    from depthsim.sensor import Sensor

    dark = np.full((16, 16, 3), 255, np.uint8)
    dark[:, :8] = 60
    scene = load_scene(glb_file(tmp_path, png(dark)), materials=MATERIALS)
    left = Sensor(scene, camera(160, 120, 160.0), "active_stereo", MATERIALS).measure(POSE).left
    assert left is not None
    row = left[40:80].astype(float).mean(axis=0)
    assert row[20:70].mean() < 0.3 * row[90:140].mean()
