"""Writing a scene as it was loaded: one PLY with a material per face, and a scene file that places it."""

from pathlib import Path

import numpy as np
import yaml

from depthsim.runs.storing import write_whole
from depthsim.scene import Scene


def save_scene(scene: Scene, folder: Path) -> None:
    """Write scene.ply and scene.yaml to ``folder``; reading them gives the same arrays, tags and trajectories."""
    entry = {"name": scene.name, "meshes": [{"file": "scene.ply"}], "trajectories": scene.trajectories}
    write_whole(folder / "scene.ply", ply_bytes(scene))
    write_whole(folder / "scene.yaml", yaml.safe_dump(entry, sort_keys=False, allow_unicode=True).encode())


def ply_bytes(scene: Scene) -> bytes:
    """A binary PLY with the per-face property ``material``, whose numbers the header names."""
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
        "end_header",
    ]
    faces = np.empty(len(scene.faces), [("count", "u1"), ("corners", "<u4", 3), ("material", "u1")])
    faces["count"], faces["corners"], faces["material"] = 3, scene.faces, scene.face_tags
    return "\n".join([*header, ""]).encode() + scene.vertices.astype("<f8").tobytes() + faces.tobytes()
