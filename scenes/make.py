"""Write the meshes of the scenes as OBJ, GLB or PLY for use in other tools.

    python scenes/make.py [NAME ...] --out DIR [--format obj|glb|ply]

NAME is a scene of this folder (all of them if none is given) or the path of a scene file. A material's name is its tag
in materials.yaml, so `depthsim` reads what this writes. OBJ and PLY are z up, GLB is y up as glTF wants it; metres.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.materials import Materials, load_materials
from depthsim.scene import Scene
from depthsim.scenefile import builtin_scenes, load_scene
from depthsim.scenefile.save import ply_bytes


def write_obj(scene: Scene, path: Path, materials: Materials) -> None:
    """NAME.obj with a `usemtl` a tag, and NAME.mtl with the tags' colours."""
    lines = [f"# {scene.name}: metres, z up", f"mtllib {path.stem}.mtl"]
    lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in scene.vertices.tolist()]
    for index, tag in enumerate(scene.tags):
        lines.append(f"usemtl {tag}")
        lines += [f"f {a} {b} {c}" for a, b, c in (scene.faces[scene.face_tags == index] + 1).tolist()]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    colours = [f"newmtl {tag}\nKd {r:.4f} {g:.4f} {b:.4f}\n" for tag in scene.tags for r, g, b in [rgb(materials, tag)]]
    path.with_suffix(".mtl").write_text("\n".join(colours), encoding="utf-8")


def write_glb(scene: Scene, path: Path, materials: Materials) -> None:
    """NAME.glb with one mesh and one material a tag, y up."""
    import trimesh

    y_up = scene.vertices[:, [0, 2, 1]] * (1, 1, -1)
    meshes = trimesh.Scene()
    for index, tag in enumerate(scene.tags):
        used, faces = np.unique(scene.faces[scene.face_tags == index], return_inverse=True)
        material = trimesh.visual.material.PBRMaterial(
            name=tag, baseColorFactor=[*rgb(materials, tag), 1.0], metallicFactor=0.0, doubleSided=True
        )
        visual = trimesh.visual.TextureVisuals(material=material)
        mesh = trimesh.Trimesh(y_up[used], faces.reshape(-1, 3), visual=visual, process=False)
        meshes.add_geometry(mesh, node_name=tag, geom_name=tag)
    path.write_bytes(meshes.export(file_type="glb"))


def write_ply(scene: Scene, path: Path, materials: Materials) -> None:
    """NAME.ply with a per-face `material`, whose numbers its header names."""
    path.write_bytes(ply_bytes(scene))


def rgb(materials: Materials, tag: str) -> tuple[float, float, float]:
    """The tag's colour from materials.yaml, or its albedo as a grey, in 0 to 1."""
    colour = getattr(materials[tag], "color", None)
    if not isinstance(colour, str):
        return (materials[tag].albedo,) * 3
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


WRITERS: dict[str, Callable[[Scene, Path, Materials], None]] = {"obj": write_obj, "glb": write_glb, "ply": write_ply}


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenes; all of this folder if none is given")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="where to write")
    parser.add_argument("--format", choices=WRITERS, default="obj")
    chosen = parser.parse_args(arguments)
    try:
        materials = load_materials()
        for name in chosen.names or builtin_scenes():
            scene = load_scene(name, materials=materials)
            chosen.out.mkdir(parents=True, exist_ok=True)
            path = chosen.out / f"{Path(name).stem}.{chosen.format}"
            WRITERS[chosen.format](scene, path, materials)
            print(f"{path}: {len(scene.faces):,} faces, {', '.join(scene.tags)}")
    except (InputError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
