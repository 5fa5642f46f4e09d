"""What active stereo takes: a frame rendered and matched, and `depthsim match` as it is called, beside OpenCV.

    ./run python benchmarks/stereo_speed.py [--rounds 11] [--scene office]

The pairs are rendered in the scene, by night with the projector's dots. `Sensor.measure` and the matchers are timed in
this process, after a call that is not counted; `depthsim match` is a process of its own, from the shell and back. The
wall clock says something only where nobody else is on the machine; processor time is of all threads together.
OpenCV's StereoSGBM in its fastest mode, 3-way, gets 128 columns more, as it leaves so many empty: then it finds as many
disparities. It is left out where it is missing.
"""

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.measuring import machine
from benchmarks.stereo_matching import pairs
from depthsim.presets import preset
from depthsim.runs.png import encode_png
from depthsim.sensor import Sensor
from depthsim.stereo.matcher import Matcher
from depthsim.trajectory import load_trajectory

SIZES = {848: 480, 1280: 720}


def timed(work: Callable[[], object], rounds: int) -> list[tuple[float, float]]:
    """(seconds by the wall, of the processor) of each of some calls, after one that is not counted."""
    found = []
    for _ in range(rounds + 1):
        before, begin = _processor_time(), time.perf_counter()
        work()
        found.append((time.perf_counter() - begin, _processor_time() - before))
    return found[1:]


def _processor_time() -> float:
    """Of this process and of those that it has waited for [s]."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def works(scene: str, width: int, folder: Path) -> dict[str, Callable[[], object]]:
    """What is timed at one size, by name."""
    camera = preset("d435", width, SIZES[width])
    sensor = Sensor(scene, camera=camera, profile="active_stereo")
    pose = load_trajectory(None, sensor.caster.scene, 30.0).matrices()[0]
    _, pair, _, _ = next(pairs(camera, 1, (scene,)))
    left, right = (np.clip(image + 0.5, 0, 255).astype(np.uint8) for image in pair)
    files = [folder / f"left_{width}.png", folder / f"right_{width}.png", folder / f"camera_{width}.yaml"]
    for file, image in zip(files, (left, right), strict=False):
        file.write_bytes(encode_png(image))
    camera.write(files[2])
    command = [sys.executable, "-m", "depthsim", "match", *map(str, files[:2]), "--camera", str(files[2])]
    command += ["--out", str(folder / "depth.png")]

    def match() -> None:
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)

    matcher = Matcher()
    found: dict[str, Callable[[], object]] = {"Sensor.measure": lambda: sensor.measure(pose), "depthsim match": match}
    found["matching alone"] = lambda: matcher.match(left, right)
    try:
        import cv2
    except ImportError:
        return found
    three_way = cv2.StereoSGBM.create(0, 128, 5, 200, 800, 1, 31, 10, 100, 2, cv2.STEREO_SGBM_MODE_SGBM_3WAY)
    wide = [cv2.copyMakeBorder(image, 0, 0, 128, 0, cv2.BORDER_REPLICATE) for image in (left, right)]
    return found | {"OpenCV alone, 3-way": lambda: three_way.compute(*wide)}


def main(
    rounds: Annotated[int, typer.Option(min=1)] = 11,
    scene: Annotated[str, typer.Option()] = "office",
) -> None:
    """Print seconds: least, middle and most by the wall, and the middle of the processor's."""
    console = Console(width=120)
    console.print(machine())
    table = Table("", "", "least s", "middle s", "most s", "processor s")
    with tempfile.TemporaryDirectory() as folder:
        for width, height in SIZES.items():
            for name, work in works(scene, width, Path(folder)).items():
                wall, used = np.array(timed(work, rounds)).T
                shown = (wall.min(), np.median(wall), wall.max(), np.median(used))
                table.add_row(f"{width}x{height}", name, *(f"{one:.3f}" for one in shown))
    console.print(table)


if __name__ == "__main__":
    typer.run(main)
