"""The colours of glTF meshes: the texture of the base colour and the colours of vertices, times the base colour."""

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from depthsim.look import PLAIN, Look, Texture

LARGEST = {5120: 127, 5121: 255, 5122: 32767, 5123: 65535}
"""The whole number that stands for 1, by the type of a normalized accessor's values."""
_UV, _COLOR = "_UV", "_COLOR"
"""What the attributes are called for trimesh, which leaves those with an underscore as they are."""
_MODES = (4, 5)
_DRACO = "KHR_draco_mesh_compression"


@dataclass(frozen=True)
class Paint:
    """What one primitive is coloured by. attributes: accessors by the name that trimesh keeps them by. scales: what
    their values are divided by. factor: base colour, linear. transform: (3, 3) of texture coordinates."""

    attributes: dict[str, int]
    scales: dict[str, int]
    factor: NDArray[np.float64]
    texture: Texture | None
    transform: NDArray[np.float64]


def paints(path: Path, header: Mapping[str, Any], buffers: Mapping[str, bytes]) -> list[Paint | None]:
    """For each primitive of triangles, in the order of the file; None for one without texture and colours."""
    found = []
    for mesh in header.get("meshes", []):
        for primitive in mesh["primitives"]:
            if primitive.get("mode", 4) in _MODES:
                found.append(_paint(path, header, buffers, primitive))
    return found


def _paint(
    path: Path, header: Mapping[str, Any], buffers: Mapping[str, bytes], primitive: Mapping[str, Any]
) -> Paint | None:
    if _DRACO in primitive.get("extensions", {}):
        return None
    given, accessors = primitive["attributes"], header.get("accessors", [])
    material = header["materials"][primitive["material"]] if "material" in primitive else {}
    metallic = material.get("pbrMetallicRoughness", {})
    named = metallic.get("baseColorTexture")
    attributes = {_COLOR: given["COLOR_0"]} if "COLOR_0" in given else {}
    texture, transform = None, np.eye(3)
    if named is not None:
        moved = named.get("extensions", {}).get("KHR_texture_transform", {})
        coordinates = f"TEXCOORD_{moved.get('texCoord', named.get('texCoord', 0))}"
        if coordinates in given:
            attributes[_UV] = given[coordinates]
            texture, transform = _texture(path, header, buffers, named["index"]), _transform(moved)
    attributes = {name: index for name, index in attributes.items() if "sparse" not in accessors[index]}
    if not attributes:
        return None
    scales = {
        name: LARGEST[accessors[index]["componentType"]] if accessors[index].get("normalized") else 1
        for name, index in attributes.items()
    }
    factor = np.array(metallic.get("baseColorFactor", (1.0, 1.0, 1.0)), np.float64)[:3]
    return Paint(attributes, scales, factor, texture if _UV in attributes else None, transform)


def _texture(path: Path, header: Mapping[str, Any], buffers: Mapping[str, bytes], index: int) -> Texture:
    texture = header["textures"][index]
    webp = texture.get("extensions", {}).get("EXT_texture_webp", {}).get("source")
    source, place = texture.get("source", webp), f"textures.{index}"
    if source is None:
        return Texture(path, place, problem="the texture is of a kind that is not read")
    image, place = header["images"][source], f"images.{source}"
    uri = image.get("uri")
    if uri is None:
        view = header["bufferViews"][image["bufferView"]]
        begin = view.get("byteOffset", 0)
        return Texture(path, place, data=buffers[str(view["buffer"])][begin : begin + view["byteLength"]])
    if uri.startswith("data:"):
        return Texture(path, place, data=base64.b64decode(uri.partition(",")[2]))
    return Texture(path, place, unquote(uri))


def _transform(moved: Mapping[str, Any]) -> NDArray[np.float64]:
    """KHR_texture_transform: scaled, turned, moved."""
    (u, v), turn, (x, y) = moved.get("offset", (0, 0)), moved.get("rotation", 0), moved.get("scale", (1, 1))
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c * x, s * y, u], [-s * x, c * y, v], [0, 0, 1]], np.float64)


def look(paint: Paint | None, attributes: Mapping[str, NDArray], corners: NDArray[np.int64]) -> Look | None:
    """The look of one primitive's faces, (F, 3) indices into its vertices, whose attributes these are."""
    if paint is None:
        return None
    plain = Look.none(len(corners))
    texture, uv, textures = np.full_like(plain.texture, PLAIN), plain.uv, ()
    light = np.broadcast_to(paint.factor, plain.colors.shape)
    if _COLOR in paint.attributes:
        light = light * np.asarray(attributes[_COLOR], np.float64)[corners, :3] / paint.scales[_COLOR]
    colors = np.rint(255 * np.sqrt(np.clip(light, 0, 1))).astype(np.uint8)
    if paint.texture is not None:
        at = np.asarray(attributes[_UV], np.float64)[corners] / paint.scales[_UV]
        uv = (at @ paint.transform[:2, :2].T + paint.transform[:2, 2]).astype(np.float32)
        uv[..., 1] = 1 - uv[..., 1]  # glTF counts from the upper left corner
        return Look(np.zeros_like(texture), uv, colors, (paint.texture,))
    return Look(texture, uv, colors, textures)
