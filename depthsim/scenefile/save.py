"""Writing a scene as it was loaded: one PLY with a material per face, and a scene file that places it."""

from pathlib import Path

import numpy as np
import yaml

from depthsim.runs.png import encode_png
from depthsim.runs.storing import write_whole
from depthsim.scene import Scene


def save_scene(scene: Scene, folder: Path) -> None:
    """Write scene.ply and scene.yaml to ``folder``; reading them gives the same arrays, tags and trajectories.

    Raises :class:`InputError` for a texture that cannot be read.
    """
    entry = {"name": scene.name, "meshes": [{"file": "scene.ply"}], "trajectories": scene.trajectories}
    write_whole(folder / "scene.ply", ply_bytes(scene))
    write_whole(folder / "scene.yaml", yaml.safe_dump(entry, sort_keys=False, allow_unicode=True).encode())


_LOOK = (
    "property list uchar float texcoord",
    "property int texnumber",
    "property list uchar uchar corner_colors",
)
"""As MeshLab writes places in textures, and a list of our own."""


def ply_bytes(scene: Scene) -> bytes:
    """A binary PLY with the per-face property ``material``, whose numbers the header names.

    Each texture is an element with one row and one list, the bytes of a PNG: other programs pass them over.
    """
    pictures = [np.frombuffer(encode_png(picture), np.uint8) for picture in scene.look.pictures] if scene.look else []
    textures = [f"element texture_{k} 1\nproperty list uint uchar png" for k in range(len(pictures))]
    look = scene.look
    names = [f"comment material {index} {tag}" for index, tag in enumerate(scene.tags)]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *names,
        f"element vertex {len(scene.vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {len(scene.faces)}",
        "property list uchar uint vertex_indices",
        "property uchar material",
        *(_LOOK if look else ()),
        *textures,
        "end_header",
    ]
    colored: list[tuple] = [("u", "u1"), ("uv", "<f4", (3, 2)), ("texture", "<i4"), ("c", "u1"), ("colors", "u1", 9)]
    plain: list[tuple] = [("count", "u1"), ("corners", "<u4", 3), ("material", "u1")]
    faces = np.empty(len(scene.faces), [*plain, *(colored if look else ())])
    if look is not None:
        faces["u"], faces["texture"], faces["c"] = 6, look.texture, 9
        faces["uv"] = look.uv
        faces["colors"] = look.colors.reshape(-1, 9)
    faces["count"], faces["corners"], faces["material"] = 3, scene.faces, scene.face_tags
    packed = b"".join(np.uint32(picture.size).astype("<u4").tobytes() + picture.tobytes() for picture in pictures)
    return "\n".join([*header, ""]).encode() + scene.vertices.astype("<f8").tobytes() + faces.tobytes() + packed
