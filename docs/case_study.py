"""Make docs/case_study.md and its pictures: `./run python docs/case_study.py [FOLDER]`, ten minutes on two cores.

FOLDER keeps the reports, and what is there is not made again. The real recordings lie beside the checkout, in
../shared/data. The page's commands are those that are run here.
"""

import argparse
import io
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from depthsim.gap import Diagnosis
from depthsim.gap.diagnosis import Cause, Task
from depthsim.gap.report import words
from depthsim.gap.report.figures import FIXED, REAL, SIMULATED, figure, png
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.runs.storing import write_whole
from depthsim.scenefile import load_scene
from depthsim.sensor import Sensor, load_profile
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import camera_for

OUT = Path(__file__).resolve().parent
ROOT = OUT.parent
COMMANDS = (
    "depthsim diagnose ../shared/data/d435_floor --sensor paper --out floor_report",
    "depthsim diagnose ../shared/data/aligned_table --sensor paper --out table_report",
    "depthsim import ../shared/data/rgbd_dataset_freiburg1_xyz --out desk",
    "depthsim reconstruct desk",
    "depthsim diagnose desk --sensor paper --out desk_report",
)
AFTERWARDS = "depthsim generate --like desk --sensor desk_report/sensor.yaml --out desk_simulated"
_WIDE = 4.0
"""Times its lower end: an interval with a higher upper end says little."""


@dataclass(frozen=True)
class Real:
    """A recording: its short name, its run, and what it is, for people."""

    name: str
    run: str
    about: str


SETS = (
    Real("floor", "../shared/data/d435_floor", "d435_floor, a RealSense D435 that is carried over a concrete floor"),
    Real("table", "../shared/data/aligned_table", "aligned_table, a RealSense that stands still before a table"),
    Real("desk", "desk", "freiburg1_xyz of TUM RGB-D, a first Kinect that is moved by hand over a desk"),
)


def run_commands(folder: Path) -> None:
    """The page's commands, but for what is there already."""
    for line in COMMANDS:
        program, *arguments = shlex.split(line)
        assert program == "depthsim"
        made = folder / arguments[-1] / "scene.yaml" if "reconstruct" in line else folder / arguments[-1]
        if not made.exists():
            print(line, file=sys.stderr, flush=True)
            placed = [str((ROOT / word).resolve()) if word.startswith("../") else word for word in arguments]
            subprocess.run(
                [sys.executable, "-m", "depthsim", *placed], cwd=folder, check=True, stdout=subprocess.DEVNULL
            )


def run_of(real: Real, folder: Path) -> Run:
    """The recording as a run."""
    return Run.open(ROOT / real.run if real.run.startswith("../") else folder / real.run)


# Pictures


def errors_of(run: Run, sensors: Sequence[str | Path]) -> list[NDArray[np.float64]]:
    """The errors [mm] of the frame in the middle, recorded and by each sensor; NaN in holes, and infinite outside."""
    index = len(run) // 2
    scene = load_scene(run.scene or "").started(float(run.stamps[0]))
    caster, pose, stamp = Caster(scene), run.poses[index], float(run.stamps[index])
    clean = caster.cast(run.camera, pose, stamps=stamp).depth
    found = [run.depth(index)]
    for name in sensors:
        profile = load_profile(name)
        sensor = Sensor(caster, camera_for(run.camera, profile.effects), profile)
        motion = Motion.along(run.trajectory, run.truth)
        depth = sensor.measure(pose, index=index, stamp=stamp, motion=motion).depth
        found.append(depth[: run.camera.height, : run.camera.width])
    mask = run.mask(index)
    outside = (clean <= 0) | (~mask if mask is not None else False)
    errors = [np.where(depth > 0, 1000.0 * (depth.astype(float) - clean), np.nan) for depth in found]
    return [np.where(outside, np.inf, error) for error in errors]


def errors_picture(folder: Path, found: dict[str, Diagnosis]) -> bytes:
    """A row for each recording: errors recorded, by the paper's sensor, and with the causes; holes black."""
    from matplotlib import colormaps

    with figure(9.6, 7.6) as drawn:
        panels = drawn.subplots(len(SETS), 3)
        for row, real in zip(panels, SETS, strict=True):
            errors = errors_of(run_of(real, folder), ("paper", folder / f"{real.name}_report" / "sensor.yaml"))
            size = np.abs(errors[1][np.isfinite(errors[1])])
            limit = float(np.percentile(size, 90)) if size.size else 1.0
            colours = colormaps["RdBu_r"].copy()
            colours.set_bad("black")
            last = "with the causes" if found[real.name].causes else "no cause was found"
            titles = ("recording", "simulated: paper", last)
            for axes, error, title in zip(row, errors, titles, strict=True):
                shown = axes.imshow(np.where(np.isinf(error), 0, error), cmap=colours, vmin=-limit, vmax=limit)
                veil = np.zeros((*error.shape, 4))
                veil[np.isinf(error)] = (0.85, 0.87, 0.9, 1)
                axes.imshow(veil)
                axes.set_title(f"{real.name}: {title}", fontsize=9)
                axes.set_axis_off()
            drawn.colorbar(shown, ax=list(row), shrink=0.8, label="error [mm]")
        return few_colours(png(drawn))


def few_colours(picture: bytes) -> bytes:
    """A PNG with 48 colours, a quarter as large: noise does not compress."""
    small = io.BytesIO()
    Image.open(io.BytesIO(picture)).convert("RGB").quantize(48).save(small, "PNG", optimize=True)
    return small.getvalue()


def costs_picture(found: dict[str, Diagnosis]) -> bytes:
    """How many times the recording's each simulated figure is, before and after."""
    names = list(
        dict.fromkeys(task.name for one in found.values() for task in one.tasks if task.recording and task.before)
    )
    with figure(9.6, 0.26 * len(names) + 1.0) as drawn:
        panels = drawn.subplots(1, len(found), sharey=True)
        for axes, (name, one) in zip(panels, found.items(), strict=True):
            axes.axvline(1, color=REAL, lw=1)
            for task in one.tasks:
                for value, colour, size in ((task.before, SIMULATED, 7), (task.after, FIXED, 5)):
                    if value and task.recording:
                        axes.plot(value / task.recording, names[::-1].index(task.name), "o", color=colour, ms=size)
            axes.set_xscale("log")
            axes.xaxis.set_major_formatter("{x:g}")
            axes.set_title(name, fontsize=10)
            axes.set_xlabel("times the recording's")
        panels[0].set_yticks(range(len(names)), [words.task_name(name) for name in names[::-1]])
        return png(drawn)


# Text


def wrong(real: Real, one: Diagnosis) -> str:
    """What was wrong with the paper's sensor, in a line or two."""
    gap = one.gap
    head = f"- **{real.name}**, {gap.before:.2g} bits per pixel"
    if one.verdict == "no_gap":
        return f"{head}: no more than two runs of one sensor differ by."
    if not one.causes:
        return f"{head}: no effect was found to be the cause."
    head += f"; {words.percent(gap.closed_fraction)} is closed, and {gap.after:.2g} are left:"
    return "\n".join([head, *(f"  - {cause_text(cause)}" for cause in one.causes)])


def cause_text(cause: Cause) -> str:
    """A cause with its share of the gap and its parameters, those that were fitted first."""
    some = [one for one in words.parameters(cause) if one.low is not None or float(one.value)][:5]
    values = ", ".join(f"{p.name.replace('_', ' ')} {p.value} {p.unit}".strip() for p in some)
    share = words.percent(cause.closed_fraction)
    return f"`{cause.effect}` ({share}{'; ' if values else ''}{values}): {words.about(cause.effect)}."


def left(real: Real, one: Diagnosis) -> str:
    """What stays unexplained."""
    rest = one.unexplained
    if rest is None:
        return f"- **{real.name}**: nothing that stands out from chance."
    return f"- **{real.name}**: {words.percent(rest.fraction)} of the gap. {words.sentence(rest.description)}"


def costs(found: dict[str, Diagnosis]) -> str:
    """The table of all figures."""
    names = list(dict.fromkeys(task.name for one in found.values() for task in one.tasks))
    lines = [f"| figure | {' | '.join(found)} |", "| --- |" + " --- |" * len(found)]
    for name in names:
        cells = [next((task for task in one.tasks if task.name == name), None) for one in found.values()]
        if all(task is None or task.recording is None for task in cells):
            continue
        unit = next(task.unit for task in cells if task is not None)
        lines.append(f"| {words.task_name(name)} [{unit}] | {' | '.join(map(cell, cells))} |")
    return "\n".join(lines)


def cell(task: Task | None) -> str:
    """Recording, before and after; a star as in the report."""
    if task is None or task.recording is None:
        return "-"
    parts = [f"**{words.figure(task.recording)}**"]
    for value, name in ((task.before, "before_off"), (task.after, "after_off")):
        low, high = task.ci95.get(name, (0.0, 0.0))
        parts.append(("-" if value is None else words.figure(value)) + ("" if low <= 0 <= high else " *"))
    return ", ".join(parts)


def counted(found: dict[str, Diagnosis]) -> str:
    """How far the figures are off before and after, over all recordings, where they matter."""
    offs = []
    for one in found.values():
        for task in one.tasks:
            low, high = task.ci95.get("before_off", (0.0, 0.0))
            if task.recording and task.before is not None and task.after is not None and not low <= 0 <= high:
                offs.append([abs(value / task.recording - 1) for value in (task.before, task.after)])
    before, after = (float(middle) for middle in np.median(offs, axis=0))
    nearer = sum(b > a for b, a in offs)
    return (
        f"In {len(offs)} figures the paper's sensor is off by more than chance, by {words.percent(before)} in the "
        f"middle; with the causes that is {words.percent(after)}, and {nearer} of them are nearer."
    )


def drift(one: Diagnosis) -> str:
    """Whether the drift is predicted."""
    tasks = {task.name: task for task in one.tasks}
    found = tasks.get("drift_open3d")
    if found is None or found.recording is None or found.before is None or found.after is None:
        return "The drift was not measured."
    (low, high), (low_after, high_after) = found.ci95["before"], found.ci95["after"]
    text = (
        f"Odometry (Open3D's, on depth alone) drifts by {found.recording:.2g} % of the way on the desk's recording. By "
        f"the paper's sensor one would expect {found.before:.2g} % (one more run: {low:.2g} to {high:.2g})"
    )
    if not one.causes:
        return f"{text}. As no cause was found, nothing predicts it better."
    if not low_after <= found.recording <= high_after:
        hit = "the simulator then does not predict it"
    elif high_after > _WIDE * low_after:
        hit = "the recording's is among them, as many another would be"
    else:
        hit = "the simulator then predicts it"
    return f"{text}, with the causes {found.after:.2g} % ({low_after:.2g} to {high_after:.2g}): {hit}."


def page(found: dict[str, Diagnosis]) -> str:
    """The page's text."""
    named = {real.name: real for real in SETS}
    commands = "\n".join(f"    {line}" for line in COMMANDS)
    table = "\n".join(f"| {real.name} | {real.about} |" for real in SETS)
    return f"""# A case study: three real recordings

Made by `docs/case_study.py`; do not edit the figures.

A robot that is developed in simulation meets its real depth camera late, and the camera is not like the simulated one.
Here three recordings of real cameras are compared with what a simulator makes of the same scenes at the same poses:
first with the noise law of a paper (error growing exponentially with range, 1 % holes), then with what a diagnosis
found to be missing or wrong.

| | recording |
| --- | --- |
{table}

{commands}

The scene of the first two is a plane that is known to be there; that of the desk is fused from the recording itself.
Each `diagnose` writes a page with pictures (`floor_report/index.html`) and a sensor to go on with:

    {AFTERWARDS}

![Errors of the depth: recorded, by the paper's sensor, and with the causes](pictures/case_study_errors.png)

One frame of each: how far its depth is off the scene. Holes are black, grey is where the scene is not known.

## What was wrong

The gap is what one look at a pixel says, on average, of whether it is real or simulated: 0 bits if they are alike, 1 if
they never overlap. Each cause has its share of the gap, on frames that nothing was fitted to.

{chr(10).join(wrong(named[name], one) for name, one in found.items())}

## What it cost

What the software of a robot sees: **the recording's**, by the paper's sensor, with the causes. A star is where the
simulated figure is off by more than chance. [Diagnose](diagnose.md#what-it-costs) says what each figure is.

{costs(found)}

![Figures as multiples of the recording's: paper's sensor orange, with the causes blue](pictures/case_study_costs.png)

{counted(found)}

{drift(found["desk"])}

## What is left

{chr(10).join(left(named[name], one) for name, one in found.items())}
"""


def main() -> None:
    """Run the commands, and write the page and its pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition(":")[0])
    parser.add_argument("folder", nargs="?", metavar="FOLDER", help="for the reports; what is there is not made again")
    given = parser.parse_args().folder
    with tempfile.TemporaryDirectory() as passing:
        folder = Path(given or passing).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        run_commands(folder)
        found = {real.name: Diagnosis.read(folder / f"{real.name}_report") for real in SETS}
        write_whole(OUT / "pictures" / "case_study_errors.png", errors_picture(folder, found))
        write_whole(OUT / "pictures" / "case_study_costs.png", costs_picture(found))
        write_whole(OUT / "case_study.md", page(found).encode())
        print(page(found))


if __name__ == "__main__":
    main()
