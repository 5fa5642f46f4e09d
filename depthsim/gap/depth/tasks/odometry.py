"""Odometry and mapping on the recording, and on its simulations before and with the causes: is the drift predicted?

The first frames in a row, whole, as a robot's software gets them. A recording is one run of chance, so what is given of
a simulator is the geometric mean over some runs, and between which figures one more run would lie.
"""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.special import stdtrit

from depthsim.draws import Seed
from depthsim.errors import InputError
from depthsim.extras import MissingExtra, need_extra
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.frames import CleanFrame, cast_clean
from depthsim.gap.depth.data.simulate import Replay
from depthsim.gap.depth.findings import Findings
from depthsim.gap.depth.tasks.figures import ODOMETRY
from depthsim.gap.depth.tasks.odometry_worker import MASKS, SCENE
from depthsim.gap.diagnosis import Task, rounded
from depthsim.odometry.score import STEP
from depthsim.reconstruction.reconstruct import is_fused
from depthsim.runs.writer import RunWriter
from depthsim.sensor.effect import Effect
from depthsim.sensor.pipeline import acting
from depthsim.trajectory import Trajectory

Figures = list[dict[str, float]]
RUNS = 5
"""Simulated runs of each sensor."""
SHARE = 4
"""How many times the pixels that the diagnosis looks at: it then takes less time than the diagnosis."""
LEAST = 20
"""Fewer frames are no way."""
_LONGEST = 1800.0
"""[s]"""


def odometry_of(found: Findings, evidence: Evidence, systems: Sequence[str] = ("open3d",)) -> tuple[Task, ...]:
    """:func:`odometry_tasks` of a recording that was diagnosed. evidence: its frames, as they were recorded."""
    sensors = [evidence.base, found.fixed.effects] if found.diagnosis.causes else [evidence.base]
    return odometry_tasks(evidence, sensors, systems)


def odometry_tasks(
    evidence: Evidence, sensors: Sequence[Sequence[Effect]], systems: Sequence[str] = ("open3d",)
) -> tuple[Task, ...]:
    """The figures of the recording and of one or two sensors, before and after; of one, after is as before.

    systems: ``open3d`` and ``kiss_icp``, which takes twenty times as long. Nothing of a recording that goes no way to
    be measured.
    """
    way = _way(evidence)
    if way is None:
        return ()
    names = [name for name in ODOMETRY if name.endswith((*systems, "error"))]
    if not _is_installed():
        return _without(names, "the extra `slam` is not installed")
    with TemporaryDirectory(prefix="depthsim_odometry_") as kept:
        try:  # a full disk, too, shall not cost the diagnosis that is done
            runs = _write_runs(evidence, sensors, way, Path(kept))
            figures = _figures(runs, systems, evidence.threads)
        except (subprocess.SubprocessError, ValueError, OSError, InputError) as error:
            return _without(names, f"odometry could not be run ({error})")
    simulated = [figures[1 + RUNS * k : 1 + RUNS * (k + 1)] for k in range(len(sensors))]
    return tuple(_task(name, figures[0], simulated[0], simulated[-1]) for name in names)


def _is_installed() -> bool:
    try:
        need_extra("slam")
    except MissingExtra:
        return False
    return all(map(find_spec, ("open3d", "kiss_icp", "evo")))


def _way(evidence: Evidence) -> Trajectory | None:
    """The poses of the frames that are taken; None where they go no way."""
    run, camera = evidence.run, evidence.camera
    looked = sum(map(len, evidence.blocks)) * evidence.rows * camera.width
    count = min(len(run), SHARE * looked // (camera.width * camera.height))
    way = run.trajectory
    way = Trajectory(way.stamps[:count], way.positions[:count], way.quaternions[:count], way.name)
    long_enough = np.linalg.norm(np.diff(way.positions, axis=0), axis=1).sum() >= STEP
    return way if count >= LEAST and long_enough else None


def _write_runs(evidence: Evidence, sensors: Sequence[Sequence[Effect]], way: Trajectory, kept: Path) -> list[Path]:
    """Write the recording and the runs of each sensor on its way into folders of ``kept``, and what goes with them."""
    run, camera, scene = evidence.run, evidence.camera, evidence.scene
    # A sensor that looks back keeps the frames before.
    replays = [(acting(effects), Replay(evidence.caster, evidence.materials, evidence.motion)) for effects in sensors]
    folders = [kept / "recording", *(kept / f"{k}_{n}" for k in range(len(sensors)) for n in range(RUNS))]
    writers = [RunWriter(folder, camera, way, {}) for folder in folders]
    none = np.empty(0, np.float32)

    def make(index: int) -> None:
        pose, stamp = run.poses[index], float(run.stamps[index])
        frame = CleanFrame(
            index, stamp, pose, camera, np.empty(0, np.intp), cast_clean(evidence.caster, camera, pose, stamp),
            none, none, np.empty((0, 0), np.uint16),
        )  # fmt: skip
        pictures = [run.depth_raw(index)]
        pictures += [
            replay.measure(effects, frame, Seed("odometry", n)) for effects, replay in replays for n in range(RUNS)
        ]
        for writer, picture in zip(writers, pictures, strict=True):
            writer.write_frame(index, {"depth": picture})

    evidence.each(make, range(len(way)))
    for writer in writers:
        writer.finish()
    if not (scene.movers or is_fused(scene)):
        np.savez(kept / SCENE, vertices=scene.vertices.astype(np.float32), faces=scene.faces.astype(np.uint32))
        masks = [mask for index in range(len(way)) if (mask := run.mask(index)) is not None]
        if masks:  # then every frame has one
            np.save(kept / MASKS, np.stack(masks))
    return folders


def _figures(runs: Sequence[Path], systems: Sequence[str], threads: int) -> Figures:
    """The figures of each run, by processes side by side."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    shares = [list(runs[k::threads]) for k in range(min(threads, len(runs)))]
    workers = [
        subprocess.Popen(
            [sys.executable, "-m", "depthsim.gap.depth.tasks.odometry_worker", ",".join(systems), *map(str, share)],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment, text=True,
        )
        for share in shares
    ]  # fmt: skip
    found: dict[Path, dict[str, float]] = {}
    try:
        for worker, share in zip(workers, shares, strict=True):
            text, _ = worker.communicate(timeout=_LONGEST)
            if worker.returncode:
                raise subprocess.CalledProcessError(worker.returncode, "odometry")
            found |= zip(share, map(json.loads, text.splitlines()), strict=True)
    finally:
        for worker in workers:
            worker.kill()
            worker.communicate()
    return [found[run] for run in runs]


def _task(name: str, recorded: dict[str, float], before: Figures, after: Figures) -> Task:
    recording, figure = recorded.get(name), ODOMETRY[name]
    values, intervals = {"recording": recording}, {}
    for label, runs in (("before", before), ("after", after)):
        if not all(name in run for run in runs):
            values[label] = None
            continue
        values[label], low, high = one_more([run[name] for run in runs])
        intervals[label] = low, high
        if recording is not None:
            intervals[f"{label}_off"] = low - recording, high - recording
    return Task(
        name=name,
        unit=figure.unit,
        **{label: None if value is None else rounded(value) for label, value in values.items()},
        ci95={label: rounded(ends) for label, ends in intervals.items()},
        reason=figure.none if None in values.values() else "",
    )


def one_more(values: Sequence[float]) -> tuple[float, float, float]:
    """The geometric mean, and between which figures one more run would lie, at 95 %, by Student's t of logarithms."""
    logs = np.log(np.maximum(values, 1e-9))
    count, middle = len(logs), float(logs.mean())
    half = float(stdtrit(count - 1, 0.975) * logs.std(ddof=1) * np.sqrt(1 + 1 / count))
    low, high = np.exp([middle - half, middle + half])
    return float(np.exp(middle)), float(low), float(high)


def _without(names: Sequence[str], reason: str) -> tuple[Task, ...]:
    units = [ODOMETRY[name].unit for name in names]
    return tuple(
        Task(name=name, unit=unit, recording=None, before=None, after=None, reason=reason)
        for name, unit in zip(names, units, strict=True)
    )
