"""Small valid inputs of every kind: what the mutators begin with. Every function writes into a folder."""

import json
import struct
from pathlib import Path

import numpy as np
import yaml

from depthsim.camera import Camera
from depthsim.runs.png import encode_png

CAMERA = Camera(name="small", width=16, height=12, fx=11, fy=11, cx=7.5, cy=5.5, baseline=0.05, rate=10)
FRAMES = 3
START = 1_700_000_000.25
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], np.float64)
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
TRIANGLES = np.array([corner for a, b, c, d in QUADS for corner in ((a, b, c), (a, c, d))], np.uint32)


def obj(folder: Path) -> None:
    """A cube of two materials, one face concave, with an .mtl beside it."""
    lines = ["mtllib scene.mtl", "o cube", *(f"v {x} {y} {z}" for x, y, z in CUBE), "v 0.5 0.1 0", "vn 0 0 1", "vt 0 0"]
    lines += ["usemtl cement", *("f " + " ".join(f"{corner + 1}//1" for corner in face) for face in QUADS[:3])]
    lines += ["usemtl plastic", *("f " + " ".join(str(corner - 9) for corner in face) for face in QUADS[3:])]
    lines += ["f 1 3 9 7 5", "l 1 2", "f 1/1/1 2/1/1 \\", "3/1/1"]
    (folder / "scene.obj").write_text("\n".join(lines) + "\n")
    (folder / "scene.mtl").write_text("newmtl cement\nKd 0.5 0.5 0.5\nmap_Kd texture.png\nnewmtl plastic\n")


def _ply_head(kind: str, count: str) -> str:
    return (
        f"ply\nformat {kind} 1.0\ncomment material 0 cement\ncomment material 1 plastic\nelement vertex 8\n"
        "property double x\nproperty double y\nproperty double z\nproperty uchar red\n"
        f"element face 6\nproperty list {count} int vertex_indices\nproperty uchar material\nend_header\n"
    )


def ply_ascii(folder: Path) -> None:
    """A cube of quads as text."""
    rows = [f"{x} {y} {z} 9" for x, y, z in CUBE] + [
        f"4 {' '.join(map(str, face))} {k % 2}" for k, face in enumerate(QUADS)
    ]
    (folder / "scene.ply").write_text(_ply_head("ascii", "uchar") + "\n".join(rows) + "\n")


def ply_binary(folder: Path) -> None:
    """A cube, its faces of three and four corners."""
    body = b"".join(struct.pack("<3dB", *corner, 9) for corner in CUBE)
    body += b"".join(struct.pack("<B4iB", 4, *face, 1) for face in QUADS[:5]) + struct.pack(
        "<B3iB", 3, *QUADS[5][:3], 0
    )
    (folder / "scene.ply").write_bytes(_ply_head("binary_little_endian", "uchar").encode() + body)


def _gltf(**buffer: object) -> tuple[dict[str, object], bytes]:
    data = CUBE.astype("<f4").tobytes() + TRIANGLES.astype("<u2").tobytes()
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 0}, "indices": 1, "material": 0, "mode": 4}
    header = {
        "asset": {"version": "2.0", "generator": "fuzz"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "children": [1], "rotation": [0, 0, 0, 1]},
                  {"mesh": 1, "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 0, 0, 1]}],
        "meshes": [{"name": "a", "primitives": [primitive]},
                   {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 1}]}],
        "materials": [{"name": "cement"}, {"name": "plastic",
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0],
        "max": [1, 2, 3]},
                      {"bufferView": 1, "byteOffset": 0, "componentType": 5123, "count": 36, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 96, "byteStride": 12}, {"buffer": 0, "byteOffset": 96,
        "byteLength": 72}],
        "buffers": [{"byteLength": len(data), **buffer}],
        "textures": [{"source": 0}], "images": [{"uri": "texture.png"}],
    }  # fmt: skip
    return header, data


def gltf(folder: Path) -> None:
    """Two cubes; the buffer is a file beside."""
    header, data = _gltf(uri="scene.bin")
    (folder / "scene.gltf").write_text(json.dumps(header))
    (folder / "scene.bin").write_bytes(data)


def glb(folder: Path) -> None:
    """Two cubes in one file."""
    header, data = _gltf()
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    (folder / "scene.glb").write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body)


def stl(folder: Path) -> None:
    """A cube, binary, and another as text."""
    faces = [CUBE[list(face)] for face in TRIANGLES]
    body = b"".join(struct.pack("<12fH", 0, 0, 1, *face.ravel(), 0) for face in faces)
    (folder / "binary.stl").write_bytes(b"cube".ljust(80) + struct.pack("<I", len(faces)) + body)
    lines = ["solid cube"]
    for face in faces:
        lines += [
            "facet normal 0 0 1",
            "outer loop",
            *(f"vertex {x} {y} {z}" for x, y, z in face),
            "endloop",
            "endfacet",
        ]
    (folder / "text.stl").write_text("\n".join([*lines, "endsolid cube", ""]))


def off(folder: Path) -> None:
    """A cube of quads."""
    rows = [f"{x} {y} {z}" for x, y, z in CUBE] + [f"4 {' '.join(map(str, face))}" for face in QUADS]
    (folder / "scene.off").write_text("\n".join(["OFF", "# a cube", "8 6 0", *rows, ""]))


SCENE: dict[str, object] = {
    "name": "workshop", "up": "z", "units": "m", "tags": {"lambert1": "cement", "*": "plastic"},
    "meshes": [
        {"file": "scene.obj", "units": "mm", "translate": [2.0, 0.5, 0.0], "rotate": [0, 0, 90], "scale": 500,
        "up": "y"},
        {"file": "scene.glb", "tags": {"cement": "formboard"}, "scale": [1, -1, 2]},
        {"build": "wall", "translate": [0, 0, 1]},
        {"build": "drone", "name": "a", "moves": {"file": "poses.txt", "begin": 0.5, "repeat": True}},
        {"build": "person", "parameters": {"part": "arm"}, "name": "b", "parent": "a",
        "moves": {"shape": "swing", "position": [0, 0, 1], "axis": [0, 1, 0], "angles": [-20, 20], "period": 1.1}},
    ],
    "trajectories": {
        "tour": {"shape": "waypoints", "speed": 0.8, "points": [[0, 0, 1.2], [2, -1, 1.4], [4, 0, 1.2]],
        "look_at": [2, 0.5, 0.8]},
        "given": {"file": "poses.txt"},
    },
}  # fmt: skip


def scene(folder: Path) -> None:
    """A scene file with two meshes, a builder and two trajectories."""
    obj(folder)
    glb(folder)
    poses(folder, "poses.txt")
    (folder / "scene.yaml").write_text(yaml.safe_dump(SCENE, sort_keys=False))


def poses(folder: Path, name: str = "groundtruth.txt") -> None:
    """A TUM file."""
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for k in range(FRAMES):
        half = 0.1 * k
        lines.append(f"{START + k / 10:.6f} {k / 10} 0.2 {1 + k / 5} 0 {np.sin(half)} 0 {np.cos(half)}")
    (folder / name).write_text("\n".join(lines) + "\n")


def pictures(folder: Path, **streams: np.ndarray) -> None:
    """Pictures of every frame in folders by their stream, and the list of each."""
    for stream, picture in streams.items():
        (folder / stream).mkdir()
        lines = ["# timestamp filename"]
        for k in range(FRAMES):
            name = f"{stream}/{START + k / 10:.6f}.png"
            (folder / name).write_bytes(encode_png(picture))
            lines.append(f"{START + k / 10:.6f} {name}")
        (folder / f"{stream}.txt").write_text("\n".join(lines) + "\n")


def depth() -> np.ndarray:
    """Depth with holes and saturated pixels."""
    picture = np.random.default_rng(1).integers(500, 4000, CAMERA.shape).astype(np.uint16)
    picture[0, :3], picture[1, :2] = 0, 65535
    return picture


def run(folder: Path) -> None:
    """A run with all that a run may hold."""
    grey = np.arange(CAMERA.width * CAMERA.height, dtype=np.uint8).reshape(CAMERA.shape)
    normal = np.full((*CAMERA.shape, 3), 127, np.uint8)
    pictures(
        folder,
        depth=depth(),
        clean=depth(),
        rgb=np.stack([grey] * 3, axis=2),
        material=grey % 2,
        normal=normal,
        mask=grey,
    )
    for name in ("material", "normal", "mask"):
        (folder / f"{name}.txt").unlink()
    (folder / "camera.yaml").write_text(CAMERA.to_yaml())
    poses(folder)
    obj(folder)
    record = {"frames": FRAMES, "streams": ["depth"], "tags": ["cement", "plastic"], "scene": "office", "seed": 1,
              "profile": {"name": "paper", "effects": ["fill_rate"]}}  # fmt: skip
    (folder / "run.yaml").write_text(yaml.safe_dump(record, sort_keys=False))


def tum_sequence(folder: Path) -> None:
    """A TUM RGB-D sequence with a camera file."""
    grey = np.zeros((*CAMERA.shape, 3), np.uint8)
    pictures(folder, depth=depth(), rgb=grey)
    poses(folder)
    keys = yaml.safe_load(CAMERA.to_yaml())
    keys |= {"model": "brown_conrady", "distortion": [0.01, 0, 0.001, 0, 0]}
    (folder / "camera.yaml").write_text(yaml.safe_dump(keys, sort_keys=False))


def picture_folder(folder: Path) -> None:
    """Depth as PNG and npy, colour beside, stamps in associations.txt."""
    (folder / "depth").mkdir()
    (folder / "image").mkdir()
    (folder / "depth" / "0.png").write_bytes(encode_png(depth()))
    np.save(folder / "depth" / "1.npy", depth())
    np.save(folder / "depth" / "10.npy", depth() * 0.001)
    (folder / "image" / "0.png").write_bytes(encode_png(np.zeros(CAMERA.shape, np.uint8)))
    (folder / "associations.txt").write_text("0.1 depth/0.png 0.1 image/0.png\n0.2 depth/1.npy\n0.35 depth/10.npy\n")
    (folder / "camera.yaml").write_text(CAMERA.to_yaml())


def captures(folder: Path) -> None:
    """Folders of a wall by distance, and their list."""
    lines = ["folder,distance_m"]
    for name in ("0.50m", "150cm"):
        (folder / name).mkdir()
        (folder / name / "0.png").write_bytes(encode_png(depth()))
    (folder / "distances.csv").write_text("\n".join([*lines, "0.50m,0.5", "150cm,1.5", ""]))
    (folder / "camera.yaml").write_text(CAMERA.to_yaml())
