"""Runs of the office whose pictures are changed after they are made, by what no effect is, and their diagnosis."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.gap import Diagnosis, diagnose
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.png import encode_png
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import Effect, effect_ids
from depthsim.trajectory import Trajectory, load_trajectory

Change = Callable[[list[NDArray[np.uint16]]], list[NDArray[np.uint16]]]
FRAMES = 12
Array = NDArray[np.float64]
SHAPE = (60, 106)
SIGMA = 0.1
"""[px]"""


def recorded(folder: Path, change: Change, sensor: str = "paper", still: bool = False, frames: int = FRAMES) -> Path:
    """A run of the office whose pictures are changed after they are made."""
    scene, camera = load_scene("office"), preset("d435", SHAPE[1], SHAPE[0])
    path = load_trajectory("tour", scene, camera.rate, frames)
    if still:
        first = np.zeros(frames, np.intp)
        path = Trajectory(path.stamps, path.positions[first], path.quaternions[first], path.name)
    generate(scene, path, camera, load_profile(sensor), folder, streams=("depth",), seed=3, threads=1)
    run = Run.open(folder)
    pictures = change([run.depth_raw(index) for index in range(frames)])
    for file, picture in zip(run.files, pictures, strict=True):
        file.write_bytes(encode_png(picture))
    return folder


def diagnosed(run: Path, sensor: str | Sequence[Effect], *bank: str) -> Diagnosis:
    without = [name for name in effect_ids() if name not in bank]
    return diagnose(run, sensor=sensor, without=without, threads=1, tasks=False)


def noise(seed: int = 0, frames: int = 12) -> Array:
    return np.random.default_rng(seed).standard_normal((frames, *SHAPE))


def noisy(folder: Path, errors: Array) -> Path:
    """The office with noise of the disparity, of which the simulator has as much that goes together with no other."""
    focal_baseline = preset("d435", SHAPE[1], SHAPE[0]).focal_baseline

    def change(pictures: list[NDArray[np.uint16]]) -> list[NDArray[np.uint16]]:
        units, changed = 1000 * focal_baseline, []
        for raw, own in zip(pictures, errors, strict=True):
            disparity = units / np.maximum(raw, 1) + SIGMA * own
            changed.append(np.where(raw > 0, np.rint(units / np.maximum(disparity, 0.1)), 0).astype(np.uint16))
        return changed

    return recorded(folder, change, "clean", frames=len(errors))
