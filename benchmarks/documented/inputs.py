"""Files that the pages take for granted, such as `recording`, each made when a line first names it."""

import io
import re
import shutil
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import trimesh

from depthsim.cli import app
from depthsim.exporting import export
from depthsim.presets import preset
from depthsim.resources import resource
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.png import encode_png
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory

FRAMES, SIZE, LARGER = 9, (104, 64), (208, 120)  # multiples of 8: in others, Open3D's SLAM now and then never ends
DISTANCES = (0.5, 1.0, 1.5, 2.0, 2.5)
SPEEDS = {"log1.csv": 3, "log2.csv": 5, "log3.csv": 4}


def recording(path: Path, size: tuple[int, int] = SIZE) -> None:
    """What the paper's sensor sees in the office, so that a diagnosis is soon done."""
    scene, camera = load_scene("office"), preset("d435", *size)
    way = load_trajectory(None, scene, camera.rate, FRAMES)
    generate(scene, way, camera, load_profile("paper"), path, seed=7)


def office(path: Path) -> None:
    """What README makes: large enough for every SLAM system to keep its track."""
    recording(path, LARGER)


def bag(path: Path) -> None:
    """The same as a bag, with its poses."""
    recording(path.with_name(".bagged"))
    export(Run.open(path.with_name(".bagged")), "ros2", path)


def estimate(path: Path) -> None:
    """The poses of the first frames of the office's way, as another SLAM system may have written them."""
    recording(path.with_name(".estimated"))
    shutil.copy(path.with_name(".estimated") / "groundtruth.txt", path)


def mesh(path: Path, walls: str = "bricks", furniture: str = "fabric_a") -> None:
    """A hall of 8 x 3 x 8 m, y up, of two materials."""
    hall, table = trimesh.creation.box((8, 3, 8)), trimesh.creation.box((1, 1, 1))
    hall.invert()
    hall.apply_translation((0, 1.5, 0))
    table.apply_translation((3, 0.5, 0))
    for part, name in ((hall, walls), (table, furniture)):
        part.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.PBRMaterial(name=name))
    path.parent.mkdir(exist_ok=True)
    trimesh.Scene([hall, table]).export(path)


def captures(path: Path) -> None:
    """A wall at five distances, with noise that grows with them."""
    camera, random = preset("d435", *SIZE), np.random.default_rng(1)
    for distance in DISTANCES:
        (path / f"{distance:.2f}m").mkdir(parents=True)
        for index in range(6):
            depth = distance + 0.005 * np.exp(0.35 * distance) * random.standard_normal(camera.shape)
            picture = encode_png(np.rint(1000 * depth).astype(np.uint16))
            (path / f"{distance:.2f}m" / f"{index}.png").write_bytes(picture)
    camera.write(path / "camera.yaml")


def clean_depth(path: Path) -> None:
    """A slope, as another simulator has it: a picture in units and an array in metres."""
    path.mkdir()
    slope = np.linspace(1, 3, SIZE[0] * SIZE[1]).reshape(SIZE[::-1])
    (path / "0.png").write_bytes(encode_png(np.rint(1000 * slope).astype(np.uint16)))
    np.save(path / "1.npy", np.stack([slope, slope + 0.01]))


def log(path: Path) -> None:
    """A flight of an F450."""
    _fly(path.parent / f".{path.stem}", SPEEDS.get(path.name, 4))
    shutil.copy(path.parent / f".{path.stem}" / "flight.csv", path)


def vehicle(path: Path) -> None:
    """What flew."""
    shutil.copy(resource("depthsim", "flight", "vehicles", "f450.yaml"), path)


def _fly(out: Path, speed: float) -> None:
    words = ["fly", "lemniscate:size=20/10,center=0/0/3", "--vehicle", "f450", "--speed", str(speed), "--out", str(out)]
    with redirect_stdout(io.StringIO()):
        app(words, standalone_mode=False)


def view_of_pair(path: Path) -> None:
    """One of two rectified pictures of a textured wall, 12 px apart."""
    texture = np.random.default_rng(2).integers(0, 256, (SIZE[1], SIZE[0] + 12)).astype(np.uint8)
    left = path.name.startswith("LEFT")
    path.write_bytes(encode_png(np.ascontiguousarray(texture[:, :-12] if left else texture[:, 12:])))


def camera(path: Path) -> None:
    """The camera of all these."""
    preset("d435", *SIZE).write(path)


INPUTS: dict[str, Callable[[Path], None]] = {
    r"recording(_[ab])?|RUN|A|B": recording,
    r"office_run": office,
    r"viewer\.bag": bag,
    r"CameraTrajectory\.txt|FILE": estimate,
    r"sponza\.glb": mesh,
    r"captures": captures,
    r"clean_depth": clean_depth,
    r"log\d\.csv|LOG\.csv": log,
    r"vehicle\.yaml|VEHICLE\.yaml": vehicle,
    r"(LEFT|RIGHT)\.png": view_of_pair,
    r"CAMERA\.yaml": camera,
}
"""Who makes a file, by its name."""
FILES = {r"scenes:": "sweep.yaml", r"name: mine\b": "mine.yaml", r"name: workshop\b": "halls/workshop.yaml"}
"""Names of the pages' own YAML, by how a block begins."""
SMALLER = {
    r"office, race": "office",
    r"seeds: \d+": "seeds: 1",
    r"draws: \d+": "draws: 1",
    r"frames: \d+": "frames: 1\nresolution: [106, 60]",
}
"""What is shortened in a sweep, which takes days as it is written."""


def write_yaml(text: str, home: Path) -> None:
    """Write a YAML block of a page under its name, if it has one, with the meshes that a scene places."""
    for begin, name in FILES.items():
        if re.match(begin, text):
            for key, value in SMALLER.items() if name == "sweep.yaml" else ():
                text = re.sub(key, value, text)
            (home / name).parent.mkdir(exist_ok=True)
            (home / name).write_text(text)
            for placed in re.findall(r"file: (\S+)", text):
                mesh((home / name).with_name(placed), "lambert1", "table")


def make_inputs(text: str, home: Path) -> None:
    """Make what a line reads and is not there; what comes behind --out it makes by itself."""
    for word in re.sub(r"--out \S+", "", text).split()[1:]:
        name = word.rstrip("/")
        for pattern, make in INPUTS.items():
            if re.fullmatch(pattern, name) and not (home / name).exists():
                make(home / name)
