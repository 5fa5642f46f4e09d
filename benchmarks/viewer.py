"""Frames a second of the viewer, measured in Chromium: `./run python benchmarks/viewer.py`.

The page plays 848x480 frames of the office as the sensor measures them. A frame counts when Chromium's WebGL draws
points, or a picture of the view, that were uploaded since the last draw, so what the server sends too fast, or the
browser drops, does not count. Beside it stands the processor time of a frame, which says more on a machine that others
use: ten frames a second on two cores leave 200 ms for each.
"""

import argparse
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import psutil
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.chromium import chromium, missing
from benchmarks.measuring import machine
from viewer import Viewer, open_stage
from viewer.controls.look import AUTOMATIC

AIM = 10.0
"""[frames/s]"""
_COUNT = """
window.drawn = {frames: 0, draws: 0};
const GL = WebGL2RenderingContext.prototype;
const known = new WeakSet();
let fresh = false;
for (const name of ['bufferData', 'bufferSubData', 'texImage2D', 'texSubImage2D']) {
  const plain = GL[name];
  GL[name] = function (...given) {
    const points = given.find(item => item instanceof Float32Array && item.byteLength > 60000);
    const picture = given.find(item => item instanceof HTMLImageElement && item.width > 600);
    const frame = points || picture;
    if (frame && !known.has(frame)) { known.add(frame); fresh = true; }
    return plain.apply(this, given);
  };
}
for (const name of ['drawArrays', 'drawElements']) {
  const draw = GL[name];
  GL[name] = function () {
    if (fresh) { fresh = false; drawn.frames += 1; }
    return draw.apply(this, arguments);
  };
}
const clear = GL.clear;
GL.clear = function (...given) { drawn.draws += 1; return clear.apply(this, given); };
"""


@dataclass(frozen=True)
class Rates:
    """rate: [frames/s]. server, page, drawing: processor time of a frame [ms]. draws: of the 3D view, a frame.

    said: what the page says of its points.
    """

    rate: float
    server: float
    page: float
    drawing: float
    draws: float
    said: str


def _processor_time() -> dict[str, float]:
    """Processor seconds of this process, which is the server, and of Chromium's below it, by their type."""
    seconds = {"server": time.process_time(), "gpu-process": 0.0, "page": 0.0}
    for process in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            line = " ".join(process.cmdline())
            if "chrom" in line:  # the others are the driver's
                kind = "gpu-process" if "--type=gpu-process" in line else "page"
                seconds[kind] += sum(process.cpu_times()[:2])
    return seconds


def measure(profile: str, points: str, seconds: float) -> Rates:
    """What a frame takes, after the page has found its pace."""
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        stage = open_stage("office", sensor=profile)
        viewer = Viewer(lambda: stage, "benchmark", port=0, folder=Path(folder))
        try:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.add_init_script(_COUNT)
            page.goto(viewer.url)
            page.get_by_text("points,").first.wait_for(timeout=300_000)
            session = next(iter(viewer.sessions.values()))
            session.look.points.value = points
            session.playback.toggle()
            time.sleep(12)
            begin, spent, before = time.perf_counter(), _processor_time(), page.evaluate("drawn")
            time.sleep(seconds)
            after, spent_then, end = page.evaluate("drawn"), _processor_time(), time.perf_counter()
            frames = max(after["frames"] - before["frames"], 1)
            cost = {kind: 1000 * (spent_then[kind] - spent[kind]) / frames for kind in spent}
            said = page.get_by_text("points,").first.inner_text().splitlines()
            return Rates(
                (after["frames"] - before["frames"]) / (end - begin),
                cost["server"],
                cost["page"],
                cost["gpu-process"],
                (after["draws"] - before["draws"]) / frames,
                next(line for line in said if "points," in line),
            )
        finally:
            viewer.stop()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="of measuring, each row")
    parser.add_argument("--rounds", type=int, default=1, help="of all rows, on a machine that others use")
    given = parser.parse_args()
    if why := missing():
        sys.exit(why)
    table = Table("848x480, office", "points", "frames/s", "over the aim", "server, ms", "page", "WebGL", "all")
    table.add_column("over what two cores have")
    table.add_column("draws a frame")
    table.add_column("the page says")
    for profile, points in given.rounds * [("paper", AUTOMATIC), ("d435", AUTOMATIC), ("paper", "1 in 16")]:
        one = measure(profile, points, given.seconds)
        whole = one.server + one.page + one.drawing
        table.add_row(
            profile, points, f"{one.rate:.1f}", f"{one.rate / AIM:.2f}", f"{one.server:.0f}", f"{one.page:.0f}",
            f"{one.drawing:.0f}", f"{whole:.0f}", f"{whole / (2000 / AIM):.2f}", f"{one.draws:.1f}", one.said,
        )  # fmt: skip
    console = Console(width=180)
    console.print(machine())
    console.print(table)


if __name__ == "__main__":
    main()
