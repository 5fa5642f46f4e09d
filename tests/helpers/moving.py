"""A small scene in which something moves."""

from pathlib import Path

import yaml

from depthsim.camera import Camera

CAMERA = Camera.model_validate(
    {"width": 64, "height": 48, "fx": 50, "fy": 50, "cx": 31.5, "cy": 23.5, "baseline": 0.05, "rate": 30}
)


def write_scene(folder: Path, **moves: object) -> Path:
    """A wall across x = 3 m and a box that goes along y before it."""
    corners = [(x, y, z) for x in (-0.2, 0.2) for y in (-0.3, 0.3) for z in (-0.3, 0.3)]
    quads = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += ["usemtl plastic", *(f"f {a} {b} {c} {d}" for a, b, c, d in quads)]
    (folder / "box.obj").write_text("\n".join(lines) + "\n")
    (folder / "wall.obj").write_text("v 3 -9 -9\nv 3 9 -9\nv 3 9 9\nv 3 -9 9\nusemtl cement\nf 4 3 2 1\n")
    spec = moves or {"shape": "waypoints", "points": [[2, -0.5, 0], [2, 0.5, 0]], "speed": 2.0}
    entries = [{"file": "wall.obj"}, {"name": "parcel", "file": "box.obj", "moves": spec}]
    trajectory = {"shape": "hover", "position": [0, 0, 0], "look_at": [3, 0, 0], "duration": 0.5}
    file = folder / "scene.yaml"
    file.write_text(yaml.safe_dump({"name": "parcel", "meshes": entries, "trajectories": {"stand": trajectory}}))
    return file
