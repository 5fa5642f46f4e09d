"""How fast depthsim is, side by side with its peers and with itself: every figure is a ratio from one run.

    ./run python benchmarks/speed.py [--quick] [--processor-time] [--main CHECKOUT] [--parts cast,sensor,disk,...]

Peers that are not installed are left out, and said so. Absolute times hold for this machine alone. Times are medians of
turns on the wall clock, or with --processor-time the least processor time of all threads together, which other work on
the machine disturbs less; then hold everybody to one core (`taskset -c 0`), as threads that wait for work count too.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks import rough_tube
from benchmarks.measuring import Measure, Work, least_cpu, machine, milliseconds, ratio, side_by_side
from benchmarks.speed_cast import SHIPPED, cast_every_scene, embree_on, instruction_sets, views
from benchmarks.speed_disk import on_disk, whole_command
from depthsim.materials import load_materials
from depthsim.parallel import core_count
from depthsim.raycast import Caster
from depthsim.runs.generate import DEFAULT_STREAMS
from depthsim.scenefile import load_scene
from depthsim.sensor import Frame, Sensor, load_profile
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.motion import Motion
from depthsim.trajectory import load_trajectory

PAPER = (MaterialNoise(), FillRate())


class NoiseThatLooksRight(MaterialNoise):
    """The paper's noise, in a sensor that also asks what the right imager sees."""

    needs_right = True


class Results:
    """The table of the issue: what was measured, and what it should reach."""

    def __init__(self) -> None:
        self.table = Table("what", "ours ms", "other ms", "figure", "at least", "", title="depthsim's speed")

    def add(self, what: str, ours: float | None, other: float | None, figure: float, aim: float, more: bool) -> None:
        """A row; ``more`` says whether a larger figure is better."""
        times = ("" if value is None else f"{value:.2f}" for value in (ours, other))
        reached = figure >= aim if more else figure <= aim
        sign = "≥" if more else "≤"
        self.table.add_row(what, *times, f"{figure:.2f}", f"{sign} {aim}", "yes" if reached else "[red]no[/red]")

    def missing(self, what: str) -> None:
        """A row for a peer that is not here."""
        self.table.add_row(what, "", "", "", "", "not installed")


def against_peers(console: Console, results: Results, measure: Measure) -> None:
    """The clean cast, z, face, tag and cosine, of every scene: the worst and the median of them against the aims."""
    figures = cast_every_scene(measure)
    console.print(figures.table)
    for instructions in instruction_sets():
        where = instructions or "best instructions"
        for peer, worst, median in (("Open3D", 1 / 1.7, 1 / 2.0), ("Mitsuba", 1.0, 0.75), ("bare loop", 1.12, None)):
            ratios = figures.ratios.get((instructions, peer))
            if not ratios:
                results.missing(f"clean over {peer}, {where}")
                continue
            results.add(f"clean over {peer}, {where}, worst scene", None, None, max(ratios), round(worst, 2), False)
            if median is not None:
                middle = float(np.median(ratios))
                results.add(f"clean over {peer}, {where}, median of scenes", None, None, middle, median, False)


def sensor_over_clean(console: Console, results: Results, measure: Measure) -> None:
    """The paper's sensor and the D435's against the clean cast: every shipped scene, every set of instructions."""
    columns = ("clean", *(f"{name}, ratio" for name in SENSORS))
    table = Table("scene", "instructions", *columns, title="the sensor, ms a frame and over the clean cast")
    ratios: dict[tuple[str, str], list[float]] = {}
    for scene, pose in views():
        if scene.name not in SHIPPED:
            continue
        works = {}
        for instructions in instruction_sets():
            with embree_on(instructions):
                works |= {(instructions, name): work for name, work in _sensors(Caster(scene), pose).items()}
        seconds = measure({f"{one} {name}": work for (one, name), work in works.items()})
        for instructions in instruction_sets():
            clean = f"{instructions} clean"
            cells = [f"{milliseconds(seconds[clean]):.1f}"]
            for name in SENSORS:
                own = f"{instructions} {name}"
                figure = ratio(seconds, own, clean)
                ratios.setdefault((instructions, name), []).append(figure)
                cells.append(f"{milliseconds(seconds[own]):.1f}, {figure:.2f}")
            table.add_row(scene.name, instructions or "best", *cells)
    console.print(table)
    for (instructions, name), figures in ratios.items():
        what, aim = SENSORS[name]
        where = instructions or "best instructions"
        results.add(f"{what}, over clean, {where}, worst scene", None, None, max(figures), aim, False)
        results.add(f"{what}, over clean, {where}, median of scenes", None, None, float(np.median(figures)), aim, False)


SENSORS = {
    "paper": ("paper noise, holes, 16 bit", 1.15),
    "right": ("and the right imager's view", 1.9),
    "d435": ("the d435 profile", 2.2),
}
TYPICAL = 2
"""A frame whose noise is made from three pictures of white noise, which is the mean; frame 0 needs one."""


def _sensors(caster: Caster, pose: NDArray[np.float64]) -> dict[str, Work]:
    camera, materials = rough_tube.camera(), load_materials()
    sensors = {
        "paper": Sensor(caster, camera, PAPER, materials),
        "right": Sensor(caster, camera, (NoiseThatLooksRight(), FillRate()), materials),
        "d435": Sensor(caster, camera, load_profile("d435").effects, materials),
    }
    works: dict[str, Work] = {"clean": partial(caster.cast, camera, pose, out=caster.cast(camera, pose))}
    for name, sensor in sensors.items():
        works[name] = partial(sensor.measure, pose, index=TYPICAL, out=sensor.measure(pose))
    return works


def noise_over_numpy(results: Results, measure: Measure) -> None:
    """The noise step of the paper's sensor against plain NumPy."""
    scene, camera, materials = load_scene("office"), rough_tube.camera(), load_materials()
    pose = load_trajectory(None, scene, 30).matrices()[0]
    out = Caster(scene).cast(camera, pose)
    frame = Frame(
        np.empty(camera.shape, np.float32), out, camera, scene, materials, Motion.still(pose), threads=core_count()
    )
    m_of_face = np.array([materials[tag].m for tag in scene.tags], np.float32)[scene.face_tags]
    m, z = m_of_face[np.maximum(out.face, 0)], out.depth
    random = np.random.default_rng(0)

    def noise_step() -> None:
        frame.depth[:] = z
        for effect in PAPER:
            effect.apply(frame)

    def plain_numpy() -> object:
        noisy = z + np.float32(0.005) * np.exp(m * z) * random.standard_normal(z.shape, dtype=np.float32)
        noisy[random.random(z.shape, dtype=np.float32) < np.float32(0.01)] = 0
        return noisy

    seconds = measure({"noise": noise_step, "numpy": plain_numpy})
    own, other = milliseconds(seconds["noise"]), milliseconds(seconds["numpy"])
    results.add("plain NumPy over the noise step", own, other, ratio(seconds, "numpy", "noise"), 4, True)


def to_disk(results: Results, measure: Measure) -> None:
    """Frames a second with and without writing."""
    for what, streams, aim in (
        ("depth alone", ("depth",), 0.9),
        ("depth, clean, material, rgb", DEFAULT_STREAMS, 0.8),
    ):
        seconds, frames = on_disk(measure, streams, 24), 24
        written, made = (milliseconds(seconds[name]) / frames for name in ("written", "made"))
        share = ratio(seconds, "made", "written")
        results.add(f"frames/s on disk over frames/s unwritten, {what}", written, made, share, aim, True)


def command(results: Results, frames: int, main: Path | None, processor_time: bool) -> None:
    """``generate office --only-depth``: how busy the cores are, and how much faster it is than another checkout."""
    trees = {"ours": Path(__file__).resolve().parents[1]} | ({} if main is None else {"main": main})
    few, many = whole_command(trees, 30), whole_command(trees, frames + 30)
    what, ours = f"generate office --only-depth --frames {frames}", many["ours"]
    results.add(f"{what}: user time over wall, start-up and all", None, None, ours.busy, 1.9, True)
    if main is None:
        results.missing(f"{what} against main (--main CHECKOUT)")
        return
    kind = "processor" if processor_time else "wall"
    last, first = ([getattr(times[name], kind) * 1e3 for name in ("ours", "main")] for times in (many, few))
    results.add(f"{what} against main, start-up and all", *last, last[1] / last[0], 2, True)
    own, other = ((late - early) / frames for late, early in zip(last, first, strict=True))
    results.add("the same, a frame once it runs", own, other, other / own, 2, True)


def growth(console: Console, measure: Measure, quick: bool) -> None:
    """How cost grows with faces and pixels."""
    table = Table("faces", *("424x240", "848x480", "1280x720"), title="clean / paper, ms a frame")
    scenes = [rough_tube.box(), rough_tube.tube(300_000)] + ([] if quick else [rough_tube.tube(3_000_000)])
    for scene in scenes:
        caster, cells = Caster(scene), []
        for width, height in ((424, 240), (848, 480), (1280, 720)):
            camera, pose = rough_tube.camera(width, height), rough_tube.view()
            clean, paper = Sensor(caster, camera, ()), Sensor(caster, camera, PAPER)
            seconds = measure({"clean": partial(clean.measure, pose), "paper": partial(paper.measure, pose)})
            cells.append(f"{milliseconds(seconds['clean']):.1f} / {milliseconds(seconds['paper']):.1f}")
        table.add_row(f"{len(scene.faces):,}", *cells)
    console.print(table)


def memory(console: Console, frames: int) -> None:
    """Peak memory at 3M faces and growth over many frames, each in a process of its own."""
    here = Path(__file__).resolve()
    for what, arguments in (
        (f"over {frames:,} frames of 424x240", ["--memory-frames", str(frames)]),
        ("at 3M faces, 848x480", ["--memory-faces", "3000000"]),
    ):
        done = subprocess.run([sys.executable, str(here), *arguments], capture_output=True, text=True, check=True)
        console.print(f"memory {what}: {done.stdout.strip()}")


def resident() -> float:
    """Resident memory of this process now [MB]."""
    with open("/proc/self/statm", encoding="utf-8") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def peak() -> float:
    """Peak resident memory of this process [MB]; getrusage would count what its parent had."""
    with open("/proc/self/status", encoding="utf-8") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmHWM")) / 1e3


def memory_over_frames(frames: int) -> None:
    """Make frames and compare memory after a tenth of them with memory at the end."""
    sensor = Sensor(Caster(rough_tube.box()), rough_tube.camera(424, 240), PAPER)
    early = 0.0
    for index in range(frames):
        sensor.measure(rough_tube.view(), index=index)
        if index == frames // 10:
            early = resident()
    print(f"{early:.0f} MB after a tenth, {resident():.0f} MB at the end, peak {peak():.0f} MB")


def memory_at_faces(faces: int) -> None:
    """Build a scene and make one frame."""
    scene = rough_tube.tube(faces)
    made = peak()
    Sensor(Caster(scene), rough_tube.camera(), PAPER).measure(rough_tube.view())
    print(f"peak {peak():.0f} MB (of which making the mesh with NumPy {made:.0f} MB)")


def start_up(console: Console) -> None:
    """Whole processes with a warm cache: the help page, and a run of one frame."""
    depthsim = [sys.executable, "-m", "depthsim"]
    with tempfile.TemporaryDirectory() as folder:
        first = [*depthsim, "generate", "office", "--frames", "1", "--overwrite", "--out", f"{folder}/run"]
        for what, command, aim in ((" --help", [*depthsim, "--help"], 0.4), (" generate, one frame", first, 2.0)):
            seconds = []
            for _ in range(6):
                begin = time.perf_counter()
                subprocess.run(command, check=True, capture_output=True)
                seconds.append(time.perf_counter() - begin)
            console.print(f"depthsim{what}: {np.median(seconds[1:]):.2f} s, to be at most {aim} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer rounds, no 3M faces, no long memory run")
    parser.add_argument("--memory-frames", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--memory-faces", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--processor-time", action="store_true", help="least processor time, for a shared machine")
    parser.add_argument("--main", type=Path, help="another checkout, to compare the whole command with")
    parser.add_argument("--parts", help="some of cast,sensor,noise,disk,command,growth,start,memory")
    options = parser.parse_args()
    if options.memory_frames:
        memory_over_frames(options.memory_frames)
        return
    if options.memory_faces:
        memory_at_faces(options.memory_faces)
        return
    console, results = Console(width=None if sys.stdout.isatty() else 120), Results()
    console.print(machine())
    rounds = 7 if options.quick else 25

    def measure(works: Mapping[str, Work]) -> dict[str, list[float]]:
        if options.processor_time:
            return {name: [least] for name, least in least_cpu(works, rounds).items()}
        return side_by_side(works, rounds)

    parts: dict[str, Callable[[], None]] = {
        "cast": lambda: against_peers(console, results, measure),
        "sensor": lambda: sensor_over_clean(console, results, measure),
        "noise": lambda: noise_over_numpy(results, measure),
        "disk": lambda: to_disk(results, measure),
        "command": lambda: command(results, 120 if options.quick else 500, options.main, options.processor_time),
        "growth": lambda: growth(console, measure, options.quick),
        "start": lambda: start_up(console),
        "memory": lambda: memory(console, 500 if options.quick else 10_000),
    }
    for name in options.parts.split(",") if options.parts else parts:
        parts[name]()
    if results.table.row_count:
        console.print(results.table)


if __name__ == "__main__":
    main()
