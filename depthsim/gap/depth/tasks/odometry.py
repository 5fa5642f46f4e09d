"""Odometry and mapping on the recording, and on its simulations before and with the causes: is the drift predicted?

The first frames in a row, whole, as a robot's software gets them. A recording is one run of chance, so what is given of
a simulator is the geometric mean over some runs, and between which figures one more run would lie.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory
from threading import Thread
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from depthsim.draws import Seed
from depthsim.errors import InputError
from depthsim.extras import MissingExtra, need_extra
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.frames import CleanFrame, cast_clean
from depthsim.gap.depth.data.simulate import Replay
from depthsim.gap.depth.tasks.figures import ODOMETRY
from depthsim.gap.diagnosis import Task, rounded
from depthsim.odometry.score import STEP
from depthsim.odometry.worker import MASKS, SCENE
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


def odometry_tasks(
    evidence: Evidence, sensors: Sequence[Sequence[Effect]], systems: Sequence[str] = ("open3d",)
) -> tuple[Task, ...]:
    """The figures of the recording and of one or two sensors, see :meth:`Odometry.tasks`."""
    with Odometry(evidence, systems) as odometry:
        for effects in sensors:
            odometry.begin(effects, evidence.threads)
        return odometry.tasks()


class Odometry:
    """Odometry and mapping on a recording and its simulations, by processes that run beside the diagnosis.

    A context: whatever ends it ends them. systems: ``open3d`` and ``kiss_icp``, which takes twenty times as long.
    """

    def __init__(self, evidence: Evidence, systems: Sequence[str] = ("open3d",)) -> None:
        self._evidence, self._systems, self._way = evidence, systems, _way(evidence)
        self._why = "" if self._way is None or _is_installed() else "the extra `slam` is not installed"
        self._held = ExitStack()
        self._kept: Path | None = None
        self._runs: list[list[Path]] = []
        self._workers = _Workers(systems)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._held.close()

    def begin(self, effects: Sequence[Effect], processes: int) -> None:
        """Begin to measure a sensor, and with the first one the recording: first that before, then the one after."""
        if self._way is None or self._why:
            return
        with self._is_said():
            recording = []
            if self._kept is None:
                self._kept = Path(self._held.enter_context(TemporaryDirectory(prefix="depthsim_odometry_")))
                self._held.callback(self._workers.stop)
                recording = [_write_recording(self._evidence, self._way, self._kept)]
            runs = _write_runs(self._evidence, effects, self._way, self._kept / str(len(self._runs)))
            self._runs.append([*recording, *runs])
            self._workers.measure(self._runs[-1], processes)

    def hasten(self, processes: int) -> None:
        """Go on with more processes, as nothing else is to be done."""
        with self._is_said():
            self._workers.measure((), processes)

    def tasks(self) -> tuple[Task, ...]:
        """The figures of the recording and of one or two sensors, before and after; of one, after is as before.

        Nothing of a recording that goes no way to be measured.
        """
        if self._way is None:
            return ()
        names = [name for name in ODOMETRY if name.endswith((*self._systems, "error"))]
        figures: list[Figures] = []
        with self._is_said():
            found = self._workers.figures()
            figures = [[found[run] for run in runs] for runs in self._runs]
        if self._why:
            return _without(names, self._why)
        recording, before = figures[0][0], figures[0][1:]
        return tuple(_task(name, recording, before, figures[-1] if figures[1:] else before) for name in names)

    @contextmanager
    def _is_said(self) -> Iterator[None]:
        try:  # a full disk, too, shall not cost the diagnosis that is done
            yield
        except (subprocess.SubprocessError, ValueError, OSError, InputError) as error:
            self._why = f"odometry could not be run ({error})"


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


def _write_recording(evidence: Evidence, way: Trajectory, kept: Path) -> Path:
    """Write the recording on its way into a folder of ``kept``, and beside it what its map is compared with."""
    run, scene = evidence.run, evidence.scene
    folder = _write(evidence, way, [kept / "recording"], lambda index: [run.depth_raw(index)])[0]
    if not (scene.movers or is_fused(scene)):
        np.savez(kept / SCENE, vertices=scene.vertices.astype(np.float32), faces=scene.faces.astype(np.uint32))
        masks = [mask for index in range(len(way)) if (mask := run.mask(index)) is not None]
        if masks:  # then every frame has one
            np.save(kept / MASKS, np.stack(masks))
    return folder


def _write_runs(evidence: Evidence, effects: Sequence[Effect], way: Trajectory, name: Path) -> list[Path]:
    """Write the runs of a sensor into folders of that name and a number."""
    run, camera = evidence.run, evidence.camera
    ordered, replay = acting(effects), Replay(evidence.caster, evidence.materials, evidence.motion)
    none = np.empty(0, np.float32)

    def make(index: int) -> list[NDArray[np.uint16]]:
        pose, stamp, frame = run.poses[index], float(run.stamps[index]), evidence.frames.get(index)
        if frame is None or frame.camera != camera:  # of large frames bands of rows are known
            frame = CleanFrame(
                index, stamp, pose, camera, np.empty(0, np.intp), cast_clean(evidence.caster, camera, pose, stamp),
                none, none, np.empty((0, 0), np.uint16),
            )  # fmt: skip
        return [replay.measure(ordered, frame, Seed("odometry", n)) for n in range(RUNS)]

    return _write(evidence, way, [name.with_name(f"{name.name}_{n}") for n in range(RUNS)], make)


def _write(
    evidence: Evidence, way: Trajectory, folders: list[Path], make: Callable[[int], list[NDArray[np.uint16]]]
) -> list[Path]:
    """Write the pictures that are made of each frame, one into each of the folders, which are given back."""
    writers = [RunWriter(folder, evidence.camera, way, {}) for folder in folders]

    def write(index: int) -> None:
        for writer, picture in zip(writers, make(index), strict=True):
            writer.write_frame(index, {"depth": picture})

    evidence.each(write, range(len(way)))
    for writer in writers:
        writer.finish()
    return folders


class _Workers:
    """Processes that measure runs, each on a core of its own: the next run is for the first that is free."""

    def __init__(self, systems: Sequence[str]) -> None:
        self._systems = ",".join(systems)
        self._workers: list[tuple[subprocess.Popen[str], Thread]] = []
        self._waiting: SimpleQueue[Path | None] = SimpleQueue()
        self._given: dict[Path, Future[dict[str, float]]] = {}

    def measure(self, runs: Sequence[Path], processes: int) -> None:
        """Begin to measure runs, as soon as those are done that were asked for before."""
        for run in runs:
            self._given[run] = Future()
            self._waiting.put(run)
        for number in range(len(self._workers), min(processes, len(self._workers) + self._waiting.qsize())):
            worker = subprocess.Popen(
                [sys.executable, "-m", "depthsim.odometry.worker", self._systems, str(number)],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            )  # fmt: skip
            thread = Thread(target=self._serve, args=(worker,), daemon=True)
            self._workers.append((worker, thread))
            thread.start()

    def _serve(self, worker: subprocess.Popen[str]) -> None:
        """Give a process one run after the other."""
        assert worker.stdin and worker.stdout
        while (run := self._waiting.get()) is not None:
            try:
                worker.stdin.write(f"{run}\n")
                worker.stdin.flush()
                self._given[run].set_result(json.loads(worker.stdout.readline()))
            except (OSError, ValueError):  # it has ended
                worker.kill()
                self._given[run].set_exception(subprocess.CalledProcessError(worker.wait(), "odometry"))
        worker.communicate()

    def figures(self) -> dict[Path, dict[str, float]]:
        """Of each run, once they are all there."""
        return {run: future.result(_LONGEST) for run, future in self._given.items()}

    def stop(self) -> None:
        """End what still runs."""
        for worker, _ in self._workers:
            worker.kill()
            self._waiting.put(None)
        for _, thread in self._workers:
            thread.join()


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
