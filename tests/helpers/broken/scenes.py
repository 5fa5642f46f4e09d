"""Broken scenes: what the file is called, what is in it, and words that its one-line error must have."""

import base64
import json
import struct
from dataclasses import dataclass, field

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
PLY = (
    "ply\nformat {0} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
)
MESH = {"box.obj": SQUARE + "usemtl cement\nf 1 2 3 4\n"}
SCENE = "meshes: [{file: box.obj}]\n"


@dataclass(frozen=True)
class Broken:
    name: str
    """the file that is loaded"""
    content: str | bytes | None
    words: tuple[str, ...]
    """in the message: the place, the problem and the fix"""
    beside: dict[str, str | bytes] = field(default_factory=dict)
    """other files in the same folder"""
    tells: str = ""
    """the file that the message names, if it is not the one that is loaded"""
    options: dict[str, object] = field(default_factory=dict)


def gltf(**changes: object) -> str:
    """A glTF of one triangle, with top-level keys replaced or, by None, left out."""
    data = struct.pack("<9f3H2x", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 2)
    header: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "buffers": [
            {"byteLength": 44, "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}
        ],
    }
    header.update(changes)
    return json.dumps({key: value for key, value in header.items() if value is not None})


def glb(text: str, chunk: bytes = b"") -> bytes:
    """A GLB with this JSON."""
    body = text.encode() + b" " * (-len(text) % 4)
    parts = struct.pack("<I4s", len(body), b"JSON") + body
    parts += struct.pack("<I4s", len(chunk), b"BIN\0") + chunk if chunk else b""
    return b"glTF" + struct.pack("<II", 2, 12 + len(parts)) + parts


def _stl(claimed: int, given: int) -> bytes:
    return b"\0" * 80 + struct.pack("<I", claimed) + (struct.pack("<12f", *range(12)) + b"\0\0") * given


def _ply(kind: str, body: bytes) -> bytes:
    return PLY.format(kind).encode() + body


def _accessor(**changes: object) -> list[dict[str, object]]:
    accessors: list[dict[str, object]] = json.loads(gltf())["accessors"]
    accessors[0].update(changes)
    return accessors


_TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
_DRACO = "KHR_draco_mesh_compression"

BROKEN: dict[str, Broken] = {
    # OBJ
    "no such file": Broken("gone.obj", None, ("no such scene", "give a file")),
    "empty file": Broken("empty.obj", b"", ("is empty", "export")),
    "blank file": Broken("blank.ply", b"\n  \n", ("is empty", "export")),
    "only points": Broken("points.obj", SQUARE, ("has no faces", "export triangles")),
    "only lines": Broken("lines.obj", SQUARE + "l 1 2 3\n", ("has no faces", "export triangles")),
    "NaN vertex": Broken(
        "nan.obj", SQUARE.replace("1 1 0", "1 nan 0") + "f 1 2 3\n", ("vertex 3", "not finite", "correct")
    ),
    "infinite vertex": Broken(
        "inf.obj", "v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n", ("vertex 2", "not finite", "correct")
    ),
    "vertex of two numbers": Broken("two.obj", "v 0 0\nf 1 1 1\n", ("line 1", "'v 0 0'", "correct that line")),
    "vertex is a word": Broken("word.obj", "v 0 0 zero\n", ("line 1", "'v 0 0 zero'", "correct that line")),
    "index too large": Broken(
        "large.obj", SQUARE + "f 1 2 3\nf 1 2 5\n", ("line 6", "vertex 5", "there are 4", "correct")
    ),
    "index zero": Broken("zero.obj", SQUARE + "f 0 1 2\n", ("line 5", "vertex 0", "correct")),
    "index too negative": Broken("negative.obj", SQUARE + "f -1 -2 -5\n", ("line 5", "vertex 0", "correct")),
    "index is a word": Broken("index.obj", SQUARE + "f 1 2 x\n", ("line 5", "'f 1 2 x'", "correct that line")),
    "no face has an area": Broken("flat.obj", SQUARE + "f 1 1 2\nf 1 2 2\n", ("2 faces has an area", "export")),
    "binary rubbish": Broken("rubbish.obj", bytes(range(256)) * 9, ("has no faces", "export")),
    "too large": Broken("huge.obj", "v 0 0 0\nv 1e7 0 0\nv 0 1 0\nf 1 2 3\n", ("1e+07 m wide", "`units`", "scale")),
    "too small": Broken("tiny.obj", "v 0 0 0\nv 1e-6 0 0\nv 0 1e-6 0\nf 1 2 3\n", ("1e-06 m wide", "`units`", "scale")),
    "LFS pointer": Broken("lfs.glb", "version https://git-lfs.github.com/spec/v1\n", ("Git LFS", "git lfs pull")),
    "unknown kind": Broken("scene.fbx", b"Kaydara FBX", (".fbx", ".obj", ".glb", ".yaml")),
    "no ending": Broken("scene", b"v 0 0 0", ("no ending", ".obj")),
    # names and tags
    "unknown names": Broken(
        "names.obj",
        SQUARE + "usemtl lambert1\nf 1 2 3\nusemtl phong\nf 1 3 4\nf 1 2 4\n",
        ("phong (2 faces), lambert1 (1 face)", "`tags` NAME=TAG", "tags:", "cement"),
    ),
    "no material": Broken("bare.obj", SQUARE + "f 1 2 3\n", ("(none) (1 face)", "`tags` NAME=TAG")),
    "unknown tag by option": Broken(
        "box.obj",
        MESH["box.obj"],
        ("`tags` cement=lava", "no tag 'lava'", "cement"),
        options={"tags": {"cement": "lava"}},
    ),
    "unknown tag of a scene": Broken("s.yaml", SCENE + "tags: {x: lava}\n", ("tags.x", "'lava'", "cement"), MESH),
    "unknown tag of a mesh": Broken(
        "s.yaml", "meshes: [{file: box.obj, tags: {x: lava}}]\n", ("meshes.0.tags.x", "'lava'", "cement"), MESH
    ),
    "unknown unit": Broken("box.obj", MESH["box.obj"], ("`units` yard", "m, cm"), options={"units": "yard"}),
    "unknown axis": Broken("box.obj", MESH["box.obj"], ("`up` x", "z, y"), options={"up": "x"}),
    # PLY
    "not a PLY": Broken("rubbish.ply", bytes(range(256)), ("not a PLY", "end_header")),
    "PLY without format": Broken("f.ply", PLY.format("ascii").replace("format ascii 1.0\n", ""), ("format", "again")),
    "PLY of an unknown type": Broken(
        "t.ply", PLY.format("ascii").replace("float x", "real x"), ("line 4", "real x", "correct")
    ),
    "PLY cut off": Broken("c.ply", PLY.format("ascii") + "0 0 0 1 0 0 0 1 0\n3 0 1\n", ("element face", "ends before")),
    "binary PLY cut off": Broken(
        "b.ply", _ply("binary_little_endian", _TRIANGLE + b"\3\0"), ("element face", "ends before", "again")
    ),
    "PLY with more than reported": Broken(
        "m.ply",
        PLY.format("ascii") + "0 0 0 1 0 0 0 1 0\n3 0 1 2\n3 0 1 2\n",
        ("more than its header says", "correct"),
    ),
    "PLY index out of range": Broken(
        "i.ply", PLY.format("ascii") + "0 0 0 1 0 0 0 1 0\n3 0 1 7\n", ("face 1", "vertex 7", "there are 3", "export")
    ),
    "PLY with words": Broken("w.ply", PLY.format("ascii") + "0 0 zero\n", ("not a readable PLY", "export")),
    # STL, OFF
    "STL cut off": Broken("cut.stl", _stl(4, 2), ("cut off", "again")),
    "ASCII STL cut off": Broken("cut.stl", "solid a\nfacet normal 0 0 1\nvertex 0 0 0\n", ("cut off", "again")),
    "STL of nothing": Broken("none.stl", _stl(0, 0), ("has no faces", "export")),
    "OFF without counts": Broken("none.off", "OFF\n", ("not a readable OFF", "export")),
    "OFF index out of range": Broken("i.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 9\n", ("range", "export")),
    # glTF
    "glTF is no JSON": Broken("j.gltf", "{", ("not a readable GLTF", "export")),
    "glTF 1.0": Broken("one.gltf", gltf(asset={"version": "1.0"}), ("glTF 1.0", "glTF 2.0")),
    "GLB cut off": Broken("cut.glb", glb(gltf())[:-40], ("cut off", "again")),
    "GLB of rubbish": Broken("r.glb", b"glTF" + b"\2\0\0\0" + b"\xff" * 40, ("cut off", "again")),
    "glTF without scenes": Broken("s.gltf", gltf(scenes=None), ("scenes", "has no scene", "export")),
    "glTF of lines": Broken(
        "l.gltf", gltf(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": 1}]}]), ("no faces", "triangles")
    ),
    "glTF fan": Broken(
        "f.gltf",
        gltf(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}]),
        ("triangle fan", "export"),
    ),
    "glTF sparse": Broken(
        "p.gltf", gltf(accessors=_accessor(sparse={})), ("meshes.0.primitives.0", "sparse", "export")
    ),
    "glTF too short": Broken(
        "b.gltf", gltf(buffers=[{"byteLength": 44, "uri": "data:,"}]), ("buffers.0", "0 bytes", "44")
    ),
    "glTF buffer gone": Broken(
        "g.gltf", gltf(buffers=[{"byteLength": 44, "uri": "a.bin"}]), ("buffers.0", "no such file: a.bin", "beside")
    ),
    "glTF buffer outside": Broken(
        "o.gltf", gltf(buffers=[{"byteLength": 44, "uri": "../a.bin"}]), ("buffers.0", "leaves the folder", "inside")
    ),
    "Draco": Broken("d.gltf", gltf(extensionsRequired=[_DRACO]), ("Draco", "DracoPy", "without compression")),
    "meshopt": Broken("m.gltf", gltf(extensionsRequired=["EXT_meshopt_compression"]), ("meshopt", "without")),
    "glTF wrong types": Broken("w.gltf", gltf(accessors=7), ("not a readable GLTF", "export")),
    # scene files
    "scene is a list": Broken("s.yaml", "- file: box.obj\n", ("list", "key: value"), MESH),
    "scene is no YAML": Broken("s.yaml", "meshes: [\n", ("line 2", "not YAML", "syntax")),
    "scene without meshes": Broken("s.yaml", "name: void\n", ("meshes", "required", "the keys are")),
    "scene of no mesh": Broken("s.yaml", "meshes: []\n", ("meshes", "at least 1", "correct")),
    "key misspelt": Broken("s.yaml", SCENE.replace("file:", "fiel:"), ("meshes.0.fiel", "the keys are", "file"), MESH),
    "file and builder": Broken("s.yaml", "meshes: [{file: box.obj, build: office}]\n", ("meshes.0", "either"), MESH),
    "parameters of a file": Broken(
        "s.yaml", "meshes: [{file: box.obj, parameters: {n: 1}}]\n", ("meshes.0", "parameters are for"), MESH
    ),
    "scale of zero": Broken(
        "s.yaml", "meshes: [{file: box.obj, scale: [1, 0, 1]}]\n", ("meshes.0", "scale is zero"), MESH
    ),
    "translate of two": Broken(
        "s.yaml", "meshes: [{file: box.obj, translate: [1, 2]}]\n", ("meshes.0.translate.2",), MESH
    ),
    "rotate of NaN": Broken(
        "s.yaml", "meshes: [{file: box.obj, rotate: [0, 0, .nan]}]\n", ("rotate.2", "finite"), MESH
    ),
    "units of a scene": Broken("s.yaml", SCENE + "units: parsec\n", ("units", "'parsec'", "correct"), MESH),
    "trajectory is a word": Broken(
        "s.yaml", SCENE + "trajectories: {fly: away}\n", ("trajectories.fly", "correct"), MESH
    ),
    "mesh gone": Broken("s.yaml", SCENE, ("meshes.0.file", "no such file: box.obj", "correct its name")),
    "mesh above": Broken("s.yaml", "meshes: [{file: ../box.obj}]\n", ("meshes.0.file", "leaves the folder", "inside")),
    "mesh anywhere": Broken(
        "s.yaml", "meshes: [{file: /etc/hosts}]\n", ("meshes.0.file", "leaves the folder", "inside")
    ),
    "mesh of an unknown kind": Broken(
        "s.yaml", "meshes: [{file: a.txt}]\n", ("no known kind (.txt)", ".obj"), {"a.txt": "x"}, "a.txt"
    ),
    "mesh broken": Broken("s.yaml", SCENE, ("has no faces", "export"), {"box.obj": SQUARE}, "box.obj"),
    "unknown builder": Broken("s.yaml", "meshes: [{build: castle}]\n", ("meshes.0", "castle", "the builders are")),
    "unknown parameter": Broken(
        "s.yaml", "meshes: [{build: office, parameters: {moat: 1}}]\n", ("meshes.0", "moat", "parameters are")
    ),
}


def table() -> list[tuple[str, Broken]]:
    """The table, for ``pytest.mark.parametrize``."""
    return list(BROKEN.items())
