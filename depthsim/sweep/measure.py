"""What a sweep will cost, from a few of its frames made in a folder that is removed again."""

import shutil
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from depthsim.scene import Scene
from depthsim.scenefile.save import save_scene
from depthsim.sweep.plan import Plan, PlannedScene
from depthsim.sweep.resolve import resolve_sweep
from depthsim.sweep.target import SCENES, LocalTarget
from depthsim.sweep.vary import planned_frames
from depthsim.sweep.work import Maker

FRAMES = 4
"""Frames that a tried run has after its first."""
_REPEATS = 3
"""How often each is made; the shortest time counts, as other work on the machine only ever adds."""
_TRIED = 6
"""Runs that are tried, at least one of each profile."""


@dataclass(frozen=True)
class Cost:
    """Of one profile's runs, one core. run: [s] beside its frames; frame: [s] each; bytes likewise."""

    run: float
    frame: float
    run_bytes: float
    frame_bytes: float


@dataclass(frozen=True)
class Estimate:
    """What :func:`estimate` found. core_seconds: of work. scene_bytes: of the meshes, which lie there once."""

    name: str
    runs: int
    frames: int
    bytes: int
    scene_bytes: int
    core_seconds: float
    workers: int
    tried: int
    costs: dict[str, Cost]

    @property
    def seconds(self) -> float:
        """By the wall, were nothing else running."""
        return self.core_seconds / min(self.workers, self.runs)

    def text(self) -> str:
        """For people."""
        lines = [
            f"{self.name}: {self.runs} runs, {self.frames} frames",
            f"  {size_text(self.bytes)}, {time_text(self.core_seconds)} of one core, "
            f"{time_text(self.seconds)} with {self.workers} workers",
            f"  scenes: {size_text(self.scene_bytes)} once; at a URL a copy in every run, unless with_scene is false",
            f"  measured on {self.tried} runs of up to {FRAMES + 1} frames, one core:",
        ]
        for profile, cost in self.costs.items():
            lines.append(
                f"  {profile}: {1 / cost.frame:.1f} frames/s, {size_text(cost.frame_bytes)} a frame, "
                f"{cost.run * 1e3:.0f} ms and {size_text(cost.run_bytes)} a run beside its frames"
            )
        return "\n".join(lines)


def estimate(file: Path, workers: int) -> Estimate:
    """Count the runs and frames of a SWEEP.yaml, and measure what they cost on some of them."""
    with tempfile.TemporaryDirectory(prefix="depthsim-dry-") as name:
        target = LocalTarget(Path(name))

        def keep(planned: PlannedScene, scene: Scene) -> None:
            folder = target.root / planned.folder
            folder.mkdir(parents=True)
            save_scene(scene, folder)

        plan = resolve_sweep(file, keep)
        return measured(plan, target, workers)


def measured(plan: Plan, target: LocalTarget, workers: int, clock: Callable[[], float] = time.perf_counter) -> Estimate:
    """The estimate of a plan whose scenes are in ``target``, in seconds of ``clock``."""
    maker, tried = Maker(plan, target), _choose(plan)
    costs: dict[str, list[Cost]] = {}
    for index in tried:
        planned = plan.run(index)
        folder = target.root / planned.path
        maker.make(index, frames=1)  # compiles kernels, reads the scene, fills caches
        one, one_bytes = _timed(maker, index, 1, folder, clock)
        count = min(planned_frames(plan, planned), FRAMES + 1)
        many, many_bytes = _timed(maker, index, count, folder, clock) if count > 1 else (2 * one, 2 * one_bytes)
        frame = max(many - one, 1e-6) / max(count - 1, 1)
        frame_bytes = (many_bytes - one_bytes) / max(count - 1, 1)
        cost = Cost(max(one - frame, 0.0), frame, max(one_bytes - frame_bytes, 0), frame_bytes)
        costs.setdefault(plan.profiles[planned.profile].name, []).append(cost)
    means = {profile: _mean(several) for profile, several in costs.items()}
    frames, size, seconds = 0, 0.0, 0.0
    counted: dict[str, int] = {}
    for index in range(len(plan)):
        run = plan.run(index)
        drawn = [value for path, value in run.values.items() if path.startswith("trajectory.")]
        same = f"{run.scene} {run.trajectory} {run.profile} {drawn}"
        if same not in counted:
            counted[same] = planned_frames(plan, run)
        cost, count = means[plan.profiles[run.profile].name], counted[same]
        frames += count
        size += cost.run_bytes + count * cost.frame_bytes
        seconds += cost.run + count * cost.frame
    scenes = sum(path.stat().st_size for path in (target.root / SCENES).rglob("*") if path.is_file())
    return Estimate(plan.name, len(plan), frames, round(size), scenes, seconds, workers, len(tried), means)


def _choose(plan: Plan) -> list[int]:
    """Runs of every profile, spread over the scenes."""
    each = max(1, _TRIED // len(plan.profiles))
    found = []
    for profile in range(len(plan.profiles)):
        for turn in range(each):
            scene = turn * len(plan.scenes) // each
            index = next((i for i in plan.runs_of(scene) if plan.run(i).profile == profile), None)
            found += [index] if index is not None and index not in found else []
    return found


def _timed(maker: Maker, index: int, frames: int, folder: Path, clock: Callable[[], float]) -> tuple[float, int]:
    """The least seconds, and the bytes, of a run of ``frames`` frames."""
    seconds, size = [], 0
    for _ in range(_REPEATS):
        shutil.rmtree(folder, ignore_errors=True)
        begin = clock()
        row = maker.make(index, frames=frames)
        seconds.append(clock() - begin)
        size = int(row["bytes"])
    return min(seconds), size


def _mean(costs: list[Cost]) -> Cost:
    count = len(costs)
    return Cost(
        sum(cost.run for cost in costs) / count,
        sum(cost.frame for cost in costs) / count,
        sum(cost.run_bytes for cost in costs) / count,
        sum(cost.frame_bytes for cost in costs) / count,
    )


def size_text(size: float) -> str:
    """Bytes for people."""
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if abs(size) < 1000 or unit == "TB":
            return f"{size:.0f} {unit}" if unit == "B" or size >= 100 else f"{size:.1f} {unit}"
        size /= 1000
    raise AssertionError


def time_text(seconds: float) -> str:
    """Seconds for people."""
    if seconds < 120:
        return f"{seconds:.1f} s"
    if seconds < 7200:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
