"""Frames a second of the viewer, measured in Chromium: `./run python benchmarks/viewer.py`.

The page plays 848x480 frames of the office as the sensor measures them. A frame counts when Chromium's WebGL draws
points that were uploaded since the last draw, so what the server sends too fast, or the browser drops, does not count.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.chromium import chromium, missing
from benchmarks.measuring import machine
from viewer import Viewer, open_stage

AIM = 10.0
"""[frames/s]"""
_COUNT = """
window.drawn = {frames: 0, points: 0, draws: 0};
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
  GL[name] = function (mode, first, count) {
    if (fresh) { fresh = false; drawn.frames += 1; if (mode === this.POINTS) drawn.points += count; }
    return draw.apply(this, arguments);
  };
}
const clear = GL.clear;
GL.clear = function (...given) { drawn.draws += 1; return clear.apply(this, given); };
"""


def measure(profile: str, points: str, seconds: float) -> tuple[float, float, str]:
    """Frames a second, points in a frame, and what the page tells of its points, after it has found its pace."""
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        stage = open_stage("office", sensor=profile)
        viewer = Viewer(lambda: stage, "benchmark", port=0, folder=Path(folder))
        try:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.add_init_script(_COUNT)
            page.goto(viewer.url)
            page.wait_for_function("window.drawn.frames > 0", timeout=300_000)
            session = next(iter(viewer.sessions.values()))
            session.look.points.value = points
            session.playback.toggle()
            time.sleep(12)
            begin, before = time.perf_counter(), page.evaluate("drawn")
            time.sleep(seconds)
            after, end = page.evaluate("drawn"), time.perf_counter()
            frames = after["frames"] - before["frames"]
            told = page.get_by_text("points,").first.inner_text().splitlines()
            line = next(line for line in told if "points," in line)
            return frames / (end - begin), (after["points"] - before["points"]) / max(frames, 1), line
        finally:
            viewer.stop()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="of measuring, each row")
    seconds = parser.parse_args().seconds
    if why := missing():
        sys.exit(why)
    table = Table("848x480, office", "points", "frames/s", "over the aim", "points a frame", "the page tells")
    for profile, points in (("paper", "as many as keep up"), ("d435", "as many as keep up"), ("paper", "all")):
        rate, count, told = measure(profile, points, seconds)
        table.add_row(profile, points, f"{rate:.1f}", f"{rate / AIM:.2f}", f"{count:,.0f}", told)
    console = Console(width=150)
    console.print(machine())
    console.print(table)


if __name__ == "__main__":
    main()
