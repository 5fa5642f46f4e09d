"""Writing a scene as it was loaded: one PLY with a material per face, and a scene file that places it."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import yaml

from depthsim.look import PROCEDURAL, Look
from depthsim.moving import Mover
from depthsim.runs.layout import OBJECTS
from depthsim.runs.png import encode_png
from depthsim.runs.storing import make_folder, write_whole
from depthsim.scene import Scene
from depthsim.trajectory.tum import tum_text


def save_scene(scene: Scene, folder: Path) -> None:
    """Write scene.ply and scene.yaml to ``folder``; reading them gives the same arrays, tags and trajectories.

    Each object that moves has its mesh in objects/, and its poses, where those are not made by a shape.
    Raises :class:`InputError` for a texture that cannot be read.
    """
    for name, data in mesh_files(scene).items():
        make_folder((folder / name).parent)
        write_whole(folder / name, data)
    write_whole(folder / "scene.yaml", scene_text(scene).encode())


def scene_text(scene: Scene, keys: Mapping[str, Any] = MappingProxyType({})) -> str:
    """The text of the scene.yaml beside :func:`mesh_files`. keys: more of them for each mesh."""
    meshes: list[dict[str, Any]] = [{"file": "scene.ply", **keys}]
    standing = scene.instances[: len(scene.instances) - len(scene.movers)]
    if standing:
        meshes[0]["parts"] = [[instance.name, instance.faces] for instance in standing]
    for mover in scene.movers:
        mesh: dict[str, Any] = {"name": mover.name, "file": f"{OBJECTS}/{mover.name}.ply", **keys}
        if mover.path is not None:
            mesh["moves"] = _moves(mover)
        if mover.parent is not None:
            mesh["parent"] = scene.movers[mover.parent].name
        meshes.append(mesh)
    entry = {"name": scene.name, "meshes": meshes, "trajectories": scene.trajectories}
    return yaml.safe_dump(entry, sort_keys=False, allow_unicode=True)


MOTION = ".motion.txt"
"""How the files end that hold the whole path of an object that does not follow a shape."""


def mesh_names(scene: Scene) -> list[str]:
    """The files of :func:`mesh_files`."""
    meshes = [f"{OBJECTS}/{mover.name}.ply" for mover in scene.movers]
    return ["scene.ply", *meshes, *(f"{OBJECTS}/{mover.name}{MOTION}" for mover in scene.movers if _is_free(mover))]


def _is_free(mover: Mover) -> bool:
    return mover.path is not None and not mover.spec.get("shape")


def mesh_files(scene: Scene) -> dict[str, bytes]:
    """By name in the folder, the meshes of a scene, and the poses of objects that do not follow a shape."""
    if not scene.movers:
        return {"scene.ply": ply_bytes(scene)}
    vertices, faces = scene.standing
    files = {"scene.ply": ply_bytes(_cut(scene, (0, vertices), (0, faces)))}
    for mover in scene.movers:
        files[f"{OBJECTS}/{mover.name}.ply"] = ply_bytes(_cut(scene, mover.vertices, mover.faces))
        if mover.path is not None and _is_free(mover):
            files[f"{OBJECTS}/{mover.name}{MOTION}"] = tum_text(mover.path).encode()
    return files


def _moves(mover: Mover) -> dict[str, Any]:
    """The `moves:` of an object whose run may have begun."""
    assert mover.path is not None
    when = {"begin": mover.delay} if mover.begin is None else {"stamp": mover.begin}
    if not _is_free(mover):
        return {**mover.spec, **when}
    if mover.begin == float(mover.path.stamps[0]):
        when = {}
    return {"file": f"{OBJECTS}/{mover.name}{MOTION}", **({"repeat": True} if mover.repeated else {}), **when}


def _cut(scene: Scene, vertices: tuple[int, int], faces: tuple[int, int]) -> Scene:
    """Some of a scene's faces as a scene of their own."""
    chosen, look = slice(*faces), scene.look
    if look is not None:
        own = Look(look.texture[chosen], look.uv[chosen], look.colors[chosen], look.textures).compact()
        look = None if (own.texture == PROCEDURAL).all() else own
    corners = scene.faces[chosen] - np.uint32(vertices[0])
    return Scene(scene.name, scene.vertices[slice(*vertices)], corners, scene.face_tags[chosen], scene.tags, look=look)


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
