"""Make office.png and scenes.png of the pages: `./run python docs/pictures.py` writes docs/pictures/."""

import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from depthsim.intensity import intensity_image
from depthsim.materials import load_materials
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.preview import preview
from depthsim.runs.terminal import depth_span, turbo
from depthsim.scenefile import load_scene
from depthsim.sensor import Sensor, load_profile
from depthsim.trajectory import load_trajectory
from viewer.colours import material_colours

SCENES = ("office", "tunnel", "corridor", "race", "forest", "wall")
OUT = Path(__file__).resolve().parent / "pictures"
_MOMENT = {"office": 0.35, "tunnel": 0.3, "corridor": 0.2, "race": 0.1, "forest": 0.3, "wall": 0.4}


def one_of_each() -> Image.Image:
    """Every scene: intensity, materials, and depth as the paper's D435 measures it."""
    rows, known = [], load_materials()
    for name in SCENES:
        scene, camera = load_scene(name), preset("d435", 848, 480)
        poses = load_trajectory(None, scene, camera.rate).matrices()
        pose = poses[int(_MOMENT[name] * (len(poses) - 1))]
        sensor = Sensor(Caster(scene), camera, load_profile("paper").effects)
        measured = sensor.measure(pose)
        clean = measured.clean
        grey = intensity_image(clean, camera, pose, scene, known)
        materials = material_colours(scene.tags, known)[clean.tag]
        shaded = (materials * np.where(clean.hit, 0.45 + 0.55 * clean.cosine, 1)[..., None]).astype(np.uint8)
        rows.append((f"{name}, {len(scene.faces):,} faces", [_rgb(grey), shaded, _depth(measured.depth)]))
    width, height, gap, line = 424, 240, 8, 22
    sheet = Image.new("RGB", (2 * (3 * width // 2 + gap) + gap, 3 * (height // 2 + line + gap) + gap), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(14)
    for place, (caption, pictures) in enumerate(rows):
        left, top = gap + place % 2 * (3 * width // 2 + gap), gap + place // 2 * (height // 2 + line + gap)
        draw.text((left, top), caption, fill="#222222", font=font)
        for column, picture in enumerate(pictures):
            small = Image.fromarray(picture).resize((width // 2, height // 2), Image.Resampling.LANCZOS)
            sheet.paste(small, (left + column * width // 2, top + line))
    return sheet


def _rgb(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.repeat(grey[..., None], 3, axis=-1)


def _depth(depth: NDArray[np.float32]) -> NDArray[np.uint8]:
    near, far = depth_span(depth)
    share = np.log(np.clip(depth, near, far) / near) / np.log(far / near)
    return np.where((depth > 0)[..., None], turbo(share), np.uint8(0)).astype(np.uint8)


def main() -> None:
    """Write the pictures."""
    OUT.mkdir(exist_ok=True)
    one_of_each().save(OUT / "scenes.png", optimize=True)
    with tempfile.TemporaryDirectory() as folder:
        scene, profile, camera = load_scene("office"), load_profile("paper"), preset("d435")
        path = load_trajectory(None, scene, camera.rate, 300)
        generate(scene, path, camera, profile, Path(folder) / "office")
        preview(Run.open(Path(folder) / "office"), OUT / "office.png")
    print(f"{OUT}: scenes.png and office.png", file=sys.stderr)


if __name__ == "__main__":
    main()
