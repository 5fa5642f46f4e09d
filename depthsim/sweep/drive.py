"""The driver: gives the runs of a plan to workers, tries again what failed, and keeps the manifest."""

import heapq
import itertools
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from depthsim.errors import InputError
from depthsim.extras import load_extra
from depthsim.scene import Scene
from depthsim.scenefile.save import save_scene
from depthsim.sweep.events import Event, Job, Makers
from depthsim.sweep.manifest import FAILED, WHOLE, Manifest
from depthsim.sweep.plan import Plan, PlannedScene, refuse_changed
from depthsim.sweep.resolve import resolve_sweep
from depthsim.sweep.target import PLAN, SWEEP, Target

ATTEMPTS = 3
"""How often a run may fail in turn, without a new frame in between, before it counts as failed."""
_FLUSH = 2.0
"""[s] How long what is finished may wait for the journal."""


@dataclass
class Progress:
    """How far a sweep is. runs_made and frames_made: by this call; lost: workers that died; again: runs tried again."""

    runs: int
    whole: int
    failed: int = 0
    runs_made: int = 0
    frames_made: int = 0
    lost: int = 0
    again: int = 0
    repaired: int = 0
    first_error: str = ""


Show = Callable[[Progress], None]


def run_sweep(
    file: Path,
    target: Target,
    start: Callable[[Plan], Makers],
    *,
    check: bool = False,
    show: Show = lambda progress: None,
) -> Progress:
    """Make the runs of a SWEEP.yaml that ``target`` does not hold yet.

    start: begins the workers, once it is known that there is something to do. check: look through the runs that are
    whole, too, and make again what is damaged. Raises :class:`InputError` where the target holds another sweep, where
    another driver writes into it, and where it cannot be written; a run that fails by itself is so in the manifest.
    """
    load_extra("pyarrow.parquet", "sweep")  # refused before anything is made
    with target.lock() as hold:
        plan = begin(file, target)
        manifest = Manifest(target, plan)
        jobs = [Job(run) for run in range(len(plan)) if not _is_there(manifest, target, plan, run)]
        missing = len(jobs)
        if check:
            whole = sorted({*range(len(plan))} - {job.run for job in jobs})
            jobs += [Job(run, manifest.rows[run]["sha256"]) for run in whole]
        progress = Progress(len(plan), len(plan) - missing)
        show(progress)
        try:
            if jobs:
                makers = start(plan)
                try:
                    _Driver(manifest, makers, hold, show, progress).drive(jobs)
                finally:
                    makers.close()
        finally:
            manifest.flush()
        manifest.compact()
        target.finish()
    return progress


def begin(file: Path, target: Target) -> Plan:
    """The plan of ``file``, which ``target`` holds from then on, with the scenes. Refuses one that has changed."""
    there = target.read(PLAN)
    if there is not None:
        plan = resolve_sweep(file)
        refuse_changed(Plan.from_json(there.decode(errors="replace"), f"{target.url}/{PLAN}"), plan, target.url)
        return plan
    target.check_new()
    with tempfile.TemporaryDirectory(prefix="depthsim-") as name:
        folders: list[tuple[str, Path]] = []

        def keep(planned: PlannedScene, scene: Scene) -> None:
            folder = Path(name) / planned.folder
            folder.mkdir(parents=True)
            save_scene(scene, folder)
            folders.append((planned.folder, folder))

        plan = resolve_sweep(file, keep)
        for place, folder in folders:
            for path in sorted(path for path in folder.rglob("*") if path.is_file()):
                target.write(f"{place}/{path.relative_to(folder).as_posix()}", path.read_bytes())
    target.write(SWEEP, file.read_bytes())
    target.write(PLAN, plan.to_json().encode())  # last: from now on the target is this sweep
    return plan


def _is_there(manifest: Manifest, target: Target, plan: Plan, run: int) -> bool:
    """Whether a run is whole, as the manifest says and, where that costs nothing, a look at its last file agrees."""
    return manifest.state(run) == WHOLE and (not target.near or target.is_whole(plan.run(run).path))


class _Driver:
    """One pass over the jobs."""

    def __init__(
        self, manifest: Manifest, makers: Makers, hold: Callable[[], None], show: Show, progress: Progress
    ) -> None:
        self._manifest, self._makers, self._hold = manifest, makers, hold
        self._show, self._progress = show, progress
        self._later: list[tuple[float, int, Job]] = []
        self._order = itertools.count()
        self._failures: dict[int, int] = {}
        self._tries: dict[int, int] = {}
        self._jobs: dict[int, Job] = {}
        self._frames: dict[int, int] = {}
        self._last_flush = time.monotonic()

    def drive(self, jobs: list[Job]) -> None:
        """Until all jobs are done or have failed."""
        waiting = iter(jobs)
        again: list[Job] = []
        empty = False
        while True:
            self._hold()
            now = time.monotonic()
            while self._later and self._later[0][0] <= now:
                again.append(heapq.heappop(self._later)[2])
            for _ in range(self._makers.free()):
                job = again.pop(0) if again else next(waiting, None)
                if job is None:
                    empty = True
                    break
                self._jobs[job.run] = job
                self._makers.submit(job)
            if empty and not (self._jobs or again or self._later):
                return
            for event in self._makers.wait(0.2):
                again += self._take(event)
            if self._manifest.waits and time.monotonic() - self._last_flush > _FLUSH:
                self._manifest.flush()
                self._last_flush = time.monotonic()
            self._show(self._progress)

    def _take(self, event: Event) -> list[Job]:
        """What an event changes; the jobs to give out again at once."""
        run, progress = event.run, self._progress
        if event.kind == "frame":
            done = event.row["done"]
            if done > self._frames.setdefault(run, done):  # the first says what was there before
                progress.frames_made += done - self._frames[run]
                self._frames[run] = done
                self._failures.pop(run, None)
            return []
        job = self._jobs.pop(run)
        if event.kind == "done":
            counted = self._frames.pop(run, None)
            if counted is None:  # from workers that do not report frames
                progress.frames_made += event.row["made"]
            self._failures.pop(run, None)
            self._manifest.put({**event.row, "attempts": self._tries.pop(run, 0) + 1})
            progress.runs_made += event.row["made"] > 0
            progress.repaired += job.expect is not None and event.row["made"] > 0
            progress.whole += job.expect is None
            return []
        if event.kind == "back":
            return [job]
        if event.fatal:
            raise InputError(*event.parts)
        progress.lost += event.kind == "lost"
        self._tries[run] = self._tries.get(run, 0) + 1
        self._failures[run] = failures = self._failures.get(run, 0) + 1
        if failures < ATTEMPTS:
            progress.again += 1
            if not event.wait:
                return [job]
            heapq.heappush(self._later, (time.monotonic() + failures**2, next(self._order), job))
            return []
        progress.failed += 1
        progress.whole -= job.expect is not None
        progress.first_error = progress.first_error or f"run {run}: {event.text}"
        self._manifest.put({"run": run, "state": FAILED, "error": event.text, "attempts": self._tries.pop(run)})
        return []
