"""GLB and glTF 2.0 files, read by trimesh from a header that holds the geometry and nothing else.

Left as it is, the header would have trimesh load every texture, invent names for materials, drop what hangs below a
camera, and take positions for plain floats that are sparse or normalised integers.
"""

import base64
import json
import struct
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from depthsim.errors import InputError
from depthsim.look import Look, joined
from depthsim.scenefile import gltf_look
from depthsim.scenefile.raw import RawMesh, wound_outwards
from depthsim.yamlfile import beside

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_LARGEST = gltf_look.LARGEST
_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_PARTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_MOST_PLACED = 30_000_000
_DRACO = "KHR_draco_mesh_compression"
_UNREADABLE = ("EXT_meshopt_compression", "KHR_meshopt_compression", "EXT_mesh_gpu_instancing")


def read_gltf(path: Path, data: bytes) -> RawMesh:
    """The triangles of the default scene, node transforms and instances applied, with their material names.

    A material without a name is called ``material_N`` by its index N. Skins and morph targets stay at rest. Colours are
    those of the base colour's texture and of the vertices; a base colour alone is none, as it has nothing to see.
    """
    import trimesh

    header, chunk = _container(path, data)
    _refuse(path, header)
    buffers = {str(i): _buffer(path, i, entry, chunk) for i, entry in enumerate(header.get("buffers", []))}
    _check_nodes(path, header)
    paints = gltf_look.paints(path, header, buffers)
    names, largest = _keep_geometry(path, header, {key: len(found) for key, found in buffers.items()}, paints)
    scene = trimesh.load_scene(BytesIO(json.dumps(header).encode()), file_type="gltf", resolver=buffers, process=False)
    placed = []
    for node in scene.graph.nodes_geometry:
        matrix, key = scene.graph[node]
        part = scene.geometry[key]
        placed.append((int(part.visual.material.name), np.asarray(matrix, dtype=np.float64), part))
    _check_size(path, [len(part.faces) for _, _, part in placed])
    placed.sort(key=lambda entry: (entry[0], entry[1].tobytes()))  # trimesh draws names of nodes at random
    known = tuple(dict.fromkeys(names))
    looks: list[Look | None] = []
    vertices, faces, face_names, offset = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)], 0
    for primitive, matrix, part in placed:
        local = np.asarray(part.vertices, dtype=np.float64)
        if largest[primitive] > 1:
            local = np.maximum(local / largest[primitive], -1.0)
        vertices.append(local @ matrix[:3, :3].T + matrix[:3, 3])
        corners = wound_outwards(np.asarray(part.faces), matrix[:3, :3])
        looks.append(gltf_look.look(paints[primitive], part.vertex_attributes, corners))
        faces.append(corners + offset)
        face_names.append(np.full(len(part.faces), known.index(names[primitive])))
        offset += len(local)
    look = joined(looks, [len(part) for part in faces[1:]])
    return RawMesh(np.concatenate(vertices), np.concatenate(faces), known, np.concatenate(face_names), look)


def _check_size(path: Path, faces: list[int]) -> None:
    """An error where a few meshes placed in many nodes stand for more triangles than memory takes."""
    if len(faces) > 1 and sum(faces) > _MOST_PLACED + max(faces):
        problem = f"places its meshes {len(faces):,} times, which makes {sum(faces):,} triangles"
        raise InputError(path, "nodes", problem, f"export a part of it, of at most {_MOST_PLACED:,}")


def _container(path: Path, data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON header and the binary chunk (empty if none)."""
    if not data.startswith(b"glTF"):
        return json.loads(data.decode("utf-8-sig")), b""
    if (version := struct.unpack_from("<I", data, 4)[0]) != 2:
        raise InputError(path, "", f"is glTF {version}", "export it as glTF 2.0")
    chunks: dict[bytes, bytes] = {}
    at = 12
    total = struct.unpack_from("<I", data, 8)[0]
    while at + 8 <= min(total, len(data)):
        length, kind = struct.unpack_from("<I4s", data, at)
        chunks.setdefault(kind, data[at + 8 : at + 8 + length])
        at += 8 + length
    if max(at, total) > len(data):
        raise InputError(path, "", "is cut off", "export or copy the file again")
    return json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b"")


def _refuse(path: Path, header: dict[str, Any]) -> None:
    """An error for what would be read wrongly or not at all."""
    version = str(header.get("asset", {}).get("version", "2.0"))
    if not version.startswith("2"):
        raise InputError(path, "", f"is glTF {version}", "export it as glTF 2.0")
    if not header.get("scenes"):
        raise InputError(path, "scenes", "has no scene that places its meshes", "export a scene, not a library")
    required = header.get("extensionsRequired", [])
    for name in _UNREADABLE:
        if name in required or (name == "EXT_mesh_gpu_instancing" and name in header.get("extensionsUsed", [])):
            raise InputError(path, "", f"uses {name}, which is not read", "export it without (gltf-transform can)")
    if _DRACO in required and find_spec("DracoPy") is None:
        fix = "install DracoPy, or export without compression"
        raise InputError(path, "", f"is Draco-compressed ({_DRACO})", fix)


def _buffer(path: Path, index: int, entry: dict[str, Any], chunk: bytes) -> bytes:
    """The bytes of one buffer: the chunk of a GLB, a data URI, or a file beside the glTF."""
    place = f"buffers.{index}"
    uri = entry.get("uri")
    if uri is None:
        found = chunk
    elif uri.startswith("data:"):
        found = base64.b64decode(uri.partition(",")[2])
    else:
        file = beside(path, unquote(uri), place)
        if not file.is_file():
            raise InputError(path, place, f"no such file: {uri}", "put it beside the glTF, or export a GLB")
        found = file.read_bytes()
    if len(found) < entry["byteLength"]:
        problem = f"has {len(found)} bytes where {entry['byteLength']} are promised"
        raise InputError(path, place, problem, "export or copy the file again")
    return found


def _check_nodes(path: Path, header: dict[str, Any]) -> None:
    """An error where a node is placed twice or below itself: a few such lists stand for a billion nodes."""
    nodes = header.get("nodes", [])
    placed = [child for node in nodes for child in node.get("children", ())]
    twice = [child for child, count in Counter(placed).items() if count > 1]
    roots = set(header["scenes"][header.get("scene", 0)].get("nodes", ()))
    twice += sorted(roots & set(placed))
    if twice:
        problem = "has more than one parent" if twice[0] not in roots else "is both a root of the scene and a child"
        raise InputError(path, f"nodes.{twice[0]}", problem, "export the scene again as a tree of nodes")


def _check_accessor(path: Path, header: dict[str, Any], index: int, sizes: Mapping[str, int]) -> None:
    """An error where an accessor lies outside its buffer; trimesh would make room for whatever count it names."""
    accessor = header["accessors"][index]
    view = header["bufferViews"][accessor["bufferView"]]
    row = _BYTES[accessor["componentType"]] * _PARTS[accessor["type"]]
    begin, count, stride = accessor.get("byteOffset", 0), accessor["count"], view.get("byteStride", row)
    offset, length = view.get("byteOffset", 0), view["byteLength"]
    whole = all(type(value) is int and value >= 0 for value in (begin, count, stride, offset, length))
    inside = whole and offset + length <= sizes[str(view["buffer"])]
    if not inside or (count and begin + (count - 1) * stride + row > length) or (count > 1 and stride < row):
        problem = f"{count} values do not fit in the buffer"
        raise InputError(path, f"accessors.{index}", problem, "export or copy the file again")


def _keep_geometry(
    path: Path, header: dict[str, Any], sizes: Mapping[str, int], paints: Sequence[gltf_look.Paint | None]
) -> tuple[list[str], list[int]]:
    """Take all but the triangles, and what their colours need, out of the header.

    Returns per primitive its material name, and the integer that stands for 1 in its positions. Each primitive gets a
    material of its own, named by its number, by which it is found again after trimesh renamed meshes and nodes.
    """
    materials = [entry.get("name") or f"material_{i}" for i, entry in enumerate(header.get("materials", []))]
    accessors = header.get("accessors", [])
    names: list[str] = []
    largest: list[int] = []
    used: set[int | None] = set()
    for m, mesh in enumerate(header.get("meshes", [])):
        kept = []
        for p, primitive in enumerate(mesh["primitives"]):
            mode = primitive.get("mode", _TRIANGLES)
            if mode == _FAN:
                raise InputError(path, f"meshes.{m}.primitives.{p}", "is a triangle fan", "export plain triangles")
            if mode not in (_TRIANGLES, _STRIP):
                continue
            accessor = accessors[primitive["attributes"]["POSITION"]]
            if "sparse" in accessor:
                raise InputError(path, f"meshes.{m}.primitives.{p}", "has sparse positions", "export plain positions")
            lean = {
                "attributes": {"POSITION": primitive["attributes"]["POSITION"]},
                "mode": mode,
                "material": len(names),
            }
            lean |= {"indices": primitive["indices"]} if "indices" in primitive else {}
            if (paint := paints[len(names)]) is not None:
                lean["attributes"] |= paint.attributes
            if "bufferView" not in accessor:  # only then is the compressed geometry the only one
                lean["extensions"] = {_DRACO: primitive["extensions"][_DRACO]}
            for index in (*lean["attributes"].values(), lean.get("indices")):
                if index is not None and "extensions" not in lean:
                    _check_accessor(path, header, index, sizes)
                used.add(index)
            names.append(materials[primitive["material"]] if "material" in primitive else "")
            largest.append(_LARGEST[accessor["componentType"]] if accessor.get("normalized") else 1)
            kept.append(lean)
        header["meshes"][m] = {"name": f"mesh_{m}", "primitives": kept}
    header["materials"] = [{"name": str(i)} for i in range(len(names))]
    header["accessors"] = [
        accessor if i in used else {"componentType": 5126, "type": "SCALAR", "count": 0}
        for i, accessor in enumerate(accessors)
    ]
    header["buffers"] = [{**entry, "uri": str(i)} for i, entry in enumerate(header.get("buffers", []))]
    header["nodes"] = [
        {key: node[key] for key in ("children", "mesh", "matrix", "translation", "rotation", "scale") if key in node}
        for node in header.get("nodes", [])
    ]
    for unwanted in ("images", "textures", "samplers", "animations", "skins", "cameras", "extensions"):
        header.pop(unwanted, None)
    return names, largest
