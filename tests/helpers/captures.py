"""Recordings to measure materials from: captures of a wall, and a run towards a wall of two materials."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.materials import Material, Materials
from depthsim.raycast import Caster
from depthsim.runs.png import encode_png
from depthsim.scene import Scene
from depthsim.sensor import Sensor
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.material_noise import MaterialNoise

KEYS = {"width": 128, "height": 96, "fx": 90.0, "fy": 90.0, "cx": 63.5, "cy": 47.5, "baseline": 0.05}
CAMERA = Camera.model_validate(KEYS)
DISTANCES = np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0])


def smooth(noise: NDArray, size: int) -> NDArray:
    """Noise correlated over ``size`` pixels in the last two axes, of the same std; edges wrap round."""
    out = noise
    for axis in (-1, -2):
        out = sum(np.roll(out, shift, axis) for shift in range(size)) / np.sqrt(size)  # type: ignore[assignment]
    return np.asarray(out)


def tilted_wall(distance: float, degrees: float) -> NDArray:
    """Depth of a wall that is turned about the vertical, through the point at ``distance`` on the axis."""
    x = (np.arange(CAMERA.width) - CAMERA.cx) / CAMERA.fx
    depth = distance / (1 + np.tan(np.radians(degrees)) * x)
    return np.broadcast_to(depth, CAMERA.shape)


def write_captures(
    root: Path,
    std: Callable[[float], float],
    *,
    frames: int = 6,
    degrees: float = 0.0,
    size: int = 1,
    fixed: bool = False,
    spoil: bool = False,
) -> Path:
    """Captures at DISTANCES with a noise of ``std``; ``fixed``: the same in every frame; ``spoil``: holes and more."""
    rng = np.random.default_rng(5)
    for distance in DISTANCES:
        folder = root / f"{distance:.2f}m"
        folder.mkdir(parents=True)
        noise = smooth(rng.standard_normal((1 if fixed else frames, *CAMERA.shape)), size)
        for index in range(frames):
            depth = tilted_wall(distance, degrees) + std(distance) * noise[0 if fixed else index]
            units = np.rint(depth * 1000).astype(np.uint16)
            if spoil:
                lot = rng.random(CAMERA.shape)
                units[lot < 0.1] = 0
                units[lot > 0.95] = 65535
                units[(lot > 0.10) & (lot < 0.12)] += 2000  # flying pixels
            (folder / f"{index:03}.png").write_bytes(encode_png(units))
    CAMERA.write(root / "camera.yaml")
    return root


def two_walls() -> Scene:
    """The plane x = 0 of tag a for y > 0 and of tag b for y < 0."""
    corners = [[0, 0, -9], [0, 9, -9], [0, 9, 9], [0, 0, 9], [0, -9, -9], [0, 0, -9], [0, 0, 9], [0, -9, 9]]
    faces = np.array([[0, 2, 1], [0, 3, 2], [4, 6, 5], [4, 7, 6]], np.uint32)
    return Scene("two walls", np.array(corners, np.float64), faces, np.array([0, 0, 1, 1], np.uint8), ("a", "b"))


def write_run(folder: Path, *, masks: bool = False, tilt: float = 0.0) -> Path:
    """A run towards two_walls, m 0.4 and 0.9; ``masks``: the left is spoilt and masked; ``tilt``: poses off [deg]."""
    values = Materials({tag: Material.model_validate({"m": m}) for tag, m in (("a", 0.4), ("b", 0.9))})
    sensor = Sensor(Caster(two_walls()), CAMERA, [MaterialNoise(floor=0.005), FillRate(rate=0.01)], values)
    folder.mkdir()
    CAMERA.write(folder / "camera.yaml")
    depth, truth = ["# timestamp filename"], []
    half = np.radians(tilt) / 2
    for index, distance in enumerate(np.linspace(0.5, 3, 40)):
        pose = np.array([[0, 0, 1, -distance], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]], np.float64)
        units = sensor.measure(pose, index=index, seed=3, threads=1).depth_raw.copy()
        name, stamp = f"{index / 10:.6f}.png", f"{index / 10:.6f}"
        if masks:
            units[:, :20] = 700
            mask = np.full(CAMERA.shape, 255, np.uint8)
            mask[:, :20] = 0
            (folder / "mask").mkdir(exist_ok=True)
            (folder / "mask" / name).write_bytes(encode_png(mask))
        (folder / "depth").mkdir(exist_ok=True)
        (folder / "depth" / name).write_bytes(encode_png(units))
        depth.append(f"{stamp} depth/{name}")
        q = np.array([-0.5, 0.5, -0.5, 0.5]) * np.cos(half) + np.array([0.5, 0.5, 0.5, 0.5]) * np.sin(half)
        truth.append(f"{stamp} {-distance} 0 0 " + " ".join(map(str, q)))
    (folder / "depth.txt").write_text("\n".join(depth) + "\n")
    (folder / "groundtruth.txt").write_text("\n".join(truth) + "\n")
    vertices = "\n".join(f"v {x} {y} {z}" for x, y, z in two_walls().vertices)
    (folder / "scene.obj").write_text(f"{vertices}\nusemtl a\nf 1 3 2\nf 1 4 3\nusemtl b\nf 5 7 6\nf 5 8 7\n")
    return folder
