"""Tiny runs and recordings that the tests of import, export, reconstruct and slam share."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from depthsim.camera import Camera
from depthsim.flight.table import write_table
from depthsim.runs import Run, RunWriter
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import Trajectory, load_trajectory

CAMERA = Camera(name="D435", width=32, height=24, fx=21.5, fy=21.25, cx=15.25, cy=11.75, baseline=0.0499, rate=10)
START = 1_700_000_000.25
FRAMES = 6


def path_of(frames: int = FRAMES) -> Trajectory:
    """A curve with a turn about a skew axis; stamps are those of a clock of today."""
    t = np.arange(frames) / 10
    axis = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
    half = 0.3 * t[:, None] + 0.1
    quaternions = np.hstack([np.sin(half) * axis, np.cos(half)])
    return Trajectory(START + t, np.stack([t, np.sin(t), 1 + t**2], axis=1), quaternions)


def depth_of(index: int) -> np.ndarray:
    """Depth of all kinds: holes, saturated, near, far."""
    depth = np.random.default_rng(index).integers(200, 9000, CAMERA.shape).astype(np.uint16)
    depth[0, :3], depth[1, :2] = 0, 65535
    return depth


def write_run(folder: Path, camera: Camera = CAMERA, *, imu: bool = True, rgb: bool = True) -> Run:
    """A run of random pictures, with an imu.csv."""
    streams = ("depth", "clean", "rgb") if rgb else ("depth", "clean")
    with RunWriter(folder, camera, path_of(), {"scene": "none"}, streams) as writer:
        for index in writer.missing():
            grey = np.random.default_rng(100 + index).integers(0, 256, camera.shape).astype(np.uint8)
            pictures = {"depth": depth_of(index), "clean": depth_of(index), "rgb": grey}
            writer.write_frame(index, {stream: pictures[stream] for stream in streams})
        writer.finish()
    if imu:
        t = START + np.arange(101) / 200
        rng = np.random.default_rng(5)
        names = ("wx", "wy", "wz", "ax", "ay", "az")
        write_table({"t": t, **{name: rng.normal(size=len(t)) for name in names}}, folder / "imu.csv")
    return Run.open(folder)


ROOM_CAMERA = Camera(name="small", width=160, height=120, fx=90, fy=90, cx=79.5, cy=59.5, baseline=0.05, rate=20)


def box(low: tuple[float, ...], high: tuple[float, ...], first: int) -> str:
    """An OBJ box whose vertices are numbered from ``first``."""
    corners = [(x, y, z) for z in (low[2], high[2]) for x, y in
               ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]))]  # fmt: skip
    faces = [(1, 4, 3, 2), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    return "\n".join([*lines, *(f"f {' '.join(str(first + i - 1) for i in face)}" for face in faces), ""])


def write_room(file: Path) -> Path:
    """A room of 4 x 3 x 2.5 m with boxes of several sizes on the floor and the far wall."""
    boxes = [((-2, -1.5, 0), (2, 1.5, 2.5))]
    boxes += [((1.2, -1.1, 0), (1.7, -0.6, 0.9)), ((1.0, 0.3, 0), (1.6, 1.0, 0.5)), ((1.7, -0.3, 1.1), (2.0, 0.4, 1.5))]
    boxes += [((0.3, -1.4, 0), (0.7, -1.1, 1.6)), ((0.4, 1.1, 0), (0.8, 1.4, 1.3)), ((1.8, 0.8, 1.6), (2.0, 1.2, 2.1))]
    file.write_text("usemtl cement\n" + "".join(box(low, high, 8 * k + 1) for k, (low, high) in enumerate(boxes)))
    return file


def room_path(stamps: np.ndarray) -> Trajectory:
    """About the room's far corner with turns to all sides."""
    t = stamps - stamps[0]
    swing = np.stack([0.25 * np.sin(2.1 * t), 0.2 * np.sin(1.3 * t + 1), 0.15 * np.sin(2.9 * t)], axis=1)
    level = Rotation.from_matrix(np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]))
    turns = level * Rotation.from_rotvec(0.8 * swing[:, ::-1])
    return Trajectory(stamps, np.array([-1.2, 0, 1.2]) + swing, turns.as_quat())


def make_room_run(folder: Path, profile: str = "clean", frames: int = 20, camera: Camera = ROOM_CAMERA) -> Run:
    """A run through the room: sideways along an arc, looking at the far wall."""
    scene = load_scene(write_room(folder.with_suffix(".obj")))
    spec = "line:start=-1.2/-0.4/1.2,end=-0.8/0.4/1.4,speed=0.8,look_at=2/0/0.9"
    path = load_trajectory(spec, scene, camera.rate, frames)
    generate(scene, path, camera, load_profile(profile), folder, seed=3)
    return Run.open(folder)
