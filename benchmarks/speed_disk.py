"""Runs on disk: what writing adds to making, how busy ``depthsim generate`` keeps the cores, and another checkout."""

import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from benchmarks.measuring import Measure
from depthsim.parallel import core_count
from depthsim.runs.generate import FrameMaker
from depthsim.runs.writer import RunWriter
from depthsim.scenefile import load_scene
from depthsim.sensor import Sensor
from depthsim.trajectory import load_trajectory


def on_disk(measure: Measure, streams: tuple[str, ...], frames: int = 24) -> dict[str, list[float]]:
    """Seconds of so many frames, ``made`` alone and ``written`` too, side by side as `depthsim generate` makes them."""
    scene = load_scene("office")
    trajectory = load_trajectory(None, scene, 30, frames)
    sensor = Sensor(scene, "d435", "paper")
    maker = FrameMaker(sensor, trajectory, 0, streams)
    with (
        tempfile.TemporaryDirectory() as folder,
        ThreadPoolExecutor(core_count()) as pool,
        RunWriter(Path(folder) / "run", sensor.stored_camera, trajectory, {}, streams) as writer,
    ):

        def write(index: int) -> None:
            writer.write_frame(index, maker(index))

        return measure(
            {
                "made": lambda: list(pool.map(maker, range(frames))),
                "written": lambda: list(pool.map(write, range(frames))),
            }
        )


@dataclass
class Command:
    """The least seconds that a process took, and its user time in the turn that kept the cores busiest."""

    wall: float = float("inf")
    processor: float = float("inf")
    busy: float = 0.0


def whole_command(trees: dict[str, Path], frames: int, turns: int = 3) -> dict[str, Command]:
    """``generate office --only-depth`` in each checkout, in turns: the whole process, start-up and all.

    The other checkout has no settings that ours has, so both run with the processor's best instructions.
    """
    found = {name: Command() for name in trees}
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(turns + 1):  # the first compiles
            for name, tree in trees.items():
                command = [sys.executable, "-m", "depthsim", "generate", "office", "--only-depth", "--overwrite"]
                before = os.times()
                subprocess.run(
                    [*command, "--frames", str(frames if turn else 4), "--out", f"{folder}/{name}"],
                    check=True, capture_output=True, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree)},
                )  # fmt: skip
                after = os.times()
                wall, user = after.elapsed - before.elapsed, after.children_user - before.children_user
                one = found[name]
                if turn:
                    one.wall, one.busy = min(one.wall, wall), max(one.busy, user / wall)
                    one.processor = min(one.processor, user + after.children_system - before.children_system)
    return found
