"""How far a sweep is: what `depthsim inspect` says of one."""

import random
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from depthsim.errors import InputError
from depthsim.runs import Run
from depthsim.sweep.manifest import FAILED, WHOLE, Manifest
from depthsim.sweep.measure import size_text
from depthsim.sweep.plan import Plan
from depthsim.sweep.target import PLAN, LocalTarget, Target, open_target
from depthsim.sweep.vary import values_in_use

_FAILURES = 10


@dataclass(frozen=True)
class State:
    """A sweep as it lies in a target, which a driver may be writing to."""

    target: Target
    plan: Plan
    manifest: Manifest

    @classmethod
    def read(cls, what: str) -> "State":
        """The state of the sweep at a path or URL."""
        target = open_target(what)
        text = target.read(PLAN)
        if text is None:
            raise InputError(what, "", "holds no sweep", "give the target of a `depthsim sweep`")
        plan = Plan.from_json(text.decode(errors="replace"), f"{target.url}/{PLAN}")
        return cls(target, plan, Manifest(target, plan))

    def of(self, state: str) -> list[int]:
        """The runs that are whole, failed or missing."""
        return [run for run in range(len(self.plan)) if self.manifest.state(run) == state]

    def is_whole(self, run: int) -> bool:
        """Whether there is such a run, and it is whole."""
        return run < len(self.plan) and self.manifest.state(run) == WHOLE

    def text(self) -> str:
        """Progress, rates and failures, for people."""
        plan, rows = self.plan, self.manifest.rows
        whole, failed = self.of(WHOLE), self.of(FAILED)
        frames = sum(rows[run]["frames"] or 0 for run in whole)
        size = sum(rows[run]["bytes"] or 0 for run in whole)
        lines = [
            f"{self.target.url}: sweep {plan.name}, {len(plan)} runs: {len(plan.scenes)} scenes, "
            f"{len(plan.profiles)} profiles, {len(plan.seeds)} seeds, {plan.draws} draws",
            f"{len(whole)} whole ({len(whole) / len(plan):.1%}), {len(failed)} failed, "
            f"{len(plan) - len(whole) - len(failed)} missing; {frames} frames, {size_text(size)}",
            *self._rates(whole),
        ]
        causes = Counter(str(rows[run].get("error")) for run in failed)
        for cause, count in causes.most_common(_FAILURES):
            first = next(run for run in failed if str(rows[run].get("error")) == cause)
            lines.append(f"failed, {count} runs, the first {plan.run(first).path}: {cause}")
        tried = sum((rows[run].get("attempts") or 1) > 1 for run in whole)
        if tried:
            lines.append(f"{tried} whole runs took more than one attempt")
        return "\n".join(lines)

    def _rates(self, whole: list[int]) -> list[str]:
        """Frames a second of one worker, by scene and profile, and of each worker."""
        seconds: dict[tuple[str, str], list[float]] = defaultdict(lambda: [0.0, 0.0, 0.0])
        workers: Counter[str] = Counter()
        for index in whole:
            row, run = self.manifest.rows[index], self.plan.run(index)
            if not row.get("made"):
                continue
            sums = seconds[self.plan.scenes[run.scene].name, self.plan.profiles[run.profile].name]
            for place, value in enumerate((row["made"], row["seconds"], row["bytes"] * row["made"] / row["frames"])):
                sums[place] += value
            workers[str(row.get("worker"))] += row["made"]
        lines = [
            f"{scene}, {profile}: {frames / time:.1f} frames/s a worker, {size_text(size / frames)} a frame"
            for (scene, profile), (frames, time, size) in seconds.items()
            if time > 0
        ]
        if workers:
            machines = {worker.partition(":")[0] for worker in workers}
            lines.append(f"made by {len(workers)} worker processes on {len(machines)} machine(s)")
        return lines

    def pick(self, seed: int | None = None) -> int | None:
        """A whole run at random, None where there is none."""
        whole = self.of(WHOLE)
        return random.Random(seed).choice(whole) if whole else None

    def draw_text(self, index: int) -> str:
        """What a run is, and what was drawn for it."""
        run = self.plan.run(index)
        scene = self.plan.scenes[run.scene]
        drawn = ", ".join(f"{path} {_shown(value)}" for path, value in values_in_use(self.plan, run).items())
        what = f"{scene.name}, {scene.trajectories[run.trajectory].name}, {self.plan.profiles[run.profile].name}"
        return f"{run.path}: {what}, seed {run.seed}, draw {run.draw}" + (f": {drawn}" if drawn else "")

    @contextmanager
    def open_run(self, index: int) -> Iterator[Run]:
        """A whole run; where the target is far away, a copy of it."""
        path = self.plan.run(index).path
        if isinstance(self.target, LocalTarget):
            yield Run.open(self.target.root / path)
            return
        with tempfile.TemporaryDirectory(prefix="depthsim-") as folder:
            self.target.copy_run(path, Path(folder))
            yield Run.open(Path(folder))


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
