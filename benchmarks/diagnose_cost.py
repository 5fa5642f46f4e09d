"""What a diagnosis takes: wall clock, processor time and peak memory of `depthsim diagnose`, as it is called.

    ./run python benchmarks/diagnose_cost.py [--rows small,large] [--keep FOLDER]

The recordings are of the office by the profile d435, one with another baseline and noise, which are explained, one with
waves over its rows that wander, which no effect of the bank has. Kernels are compiled before. The wall clock says
something only where nobody else is on the machine; processor time over the number of cores is its bound from below.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.measuring import machine
from depthsim.gap import Diagnosis
from depthsim.parallel import core_count
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.png import encode_png
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effects.calibration import BaselineScale
from depthsim.sensor.effects.noise import DisparityNoise
from depthsim.trajectory import load_trajectory

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Row:
    """A recording, and what its diagnosis may take: seconds by the wall clock, and GB."""

    name: str
    frames: int
    size: tuple[int, int]
    known: bool
    seconds: float
    memory: float


ROWS = (
    Row("small", 40, (424, 240), True, 30, 1.5),
    Row("small", 40, (424, 240), False, 60, 1.5),
    Row("large", 300, (1280, 720), True, 120, 1.5),
    Row("large", 300, (1280, 720), False, 120, 1.5),
)


def record(row: Row, folder: Path) -> Path:
    """The recording of a row; one that is there already is not made again."""
    run = folder / f"{row.name}_{'known' if row.known else 'unknown'}"
    if run.exists():
        return run
    scene, camera, profile = load_scene("office"), preset("d435", *row.size), load_profile("d435")
    camera = camera.model_copy(update={"rate": row.frames / 17.5})  # the tour takes 17.7 s
    if row.known:
        kept = tuple(effect for effect in profile.effects if not isinstance(effect, DisparityNoise))
        profile = profile.model_copy(
            update={"effects": (BaselineScale(scale=1.012), DisparityNoise(sigma=0.12), *kept)}
        )
    path = load_trajectory("tour", scene, camera.rate, row.frames)
    part = run.with_suffix(".part")
    generate(scene, path, camera, profile, part, seed=7, streams=("depth",))
    if not row.known:
        _wave(Run.open(part))
    return part.rename(run)


def _wave(run: Run) -> None:
    """The disparity goes up and down by 0.3 px over the rows, by other rows in every frame."""
    camera = run.camera
    for index, file in enumerate(run.files):
        units = run.depth_raw(index)
        wave = 0.3 * np.sin(2 * np.pi * (6 * np.arange(camera.height) / camera.height + 0.37 * index))
        disparity = camera.focal_baseline / np.maximum(units * camera.depth_scale, 1e-3) + wave[:, None]
        moved = np.round(camera.focal_baseline / np.maximum(disparity, 0.1) / camera.depth_scale)
        file.write_bytes(encode_png(np.where(units > 0, np.minimum(moved, 65535), 0).astype(np.uint16)))


def cost(run: Path, out: Path) -> tuple[float, float, float, str]:
    """Wall clock [s], processor time [s], peak memory [GB] and verdict of the command."""
    command = [sys.executable, "-m", "depthsim", "diagnose", str(run), "--sensor", "d435", "--out", str(out)]
    begin = time.perf_counter()
    with (out.parent / "log.txt").open("w") as log:
        child = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(child.pid, 0)
    seconds = time.perf_counter() - begin
    if status:
        raise SystemExit((out.parent / "log.txt").read_text())
    scale = 1e9 if sys.platform == "darwin" else 1e6
    return seconds, used.ru_utime + used.ru_stime, used.ru_maxrss / scale, Diagnosis.read(out).verdict


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", default="small,large", help="which recordings")
    parser.add_argument("--keep", type=Path, help="a folder for the recordings, which are made once")
    options = parser.parse_args()
    console = Console()
    console.print(f"{machine()}; load {os.getloadavg()[0]:.1f}")
    table = Table("recording", "gap", "wall s", "CPU s", f"CPU / {core_count()}", "aim s", "GB", "aim GB")
    with tempfile.TemporaryDirectory(prefix="depthsim_cost_") as name:
        folder = options.keep or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        warm = record(Row("warm", 6, (106, 60), True, 0, 0), folder)
        cost(warm, Path(name) / "report")
        for row in (row for row in ROWS if row.name in options.rows.split(",")):
            wall, cpu, memory, verdict = cost(record(row, folder), Path(name) / "report")
            what = f"{row.frames} of {row.size[0]}x{row.size[1]}"
            figures = (f"{wall:.0f}", f"{cpu:.0f}", f"{cpu / core_count():.0f}", f"{row.seconds:.0f}", f"{memory:.2f}")
            table.add_row(what, verdict, *figures, f"{row.memory}")
    console.print(table)


if __name__ == "__main__":
    main()
