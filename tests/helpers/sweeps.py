"""A small sweep to try things on, and workers of the test's own process."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from rooms import ROOM

from depthsim.sweep.events import Event, Job, event_of
from depthsim.sweep.plan import Plan
from depthsim.sweep.target import Target
from depthsim.sweep.work import Maker
from depthsim.sweep.worker import outcome
from qa import trees

CAMERA = "{name: small, width: 106, height: 60, fx: 53, fy: 53, cx: 52.5, cy: 29.5, baseline: 0.05, rate: 30}"
SWEEP = f"""
name: small
scenes: [room.obj, hall.obj]
trajectories: ["circle:center=0/0/1.2,radius=0.5,speed=1,heading=outward"]
profiles: [paper, d435]
seeds: 2
draws: 2
frames: 3
camera: {CAMERA}
random:
  trajectory: {{speed: {{range: [0.5, 2.0]}}, radius: {{choice: [0.4, 0.6]}}}}
  materials: {{plastic: [formboard, plastic]}}
  surfaces: {{cement: {{m: {{range: [0.3, 0.5]}}}}}}
  effects: {{disparity_noise: {{sigma: {{log_range: [0.02, 0.1]}}}}}}
"""


def write_sweep(folder: Path, text: str = SWEEP) -> Path:
    """A folder with two scenes and a sweep of 16 runs of 3 frames over them; the path of the sweep."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "room.obj").write_text(ROOM)
    (folder / "hall.obj").write_text(ROOM.replace("2.5", "3.5"))
    (folder / "sweep.yaml").write_text(text)
    return folder / "sweep.yaml"


tree = partial(trees.tree, without=trees.WHO)


class Here:
    """One worker in this process. spoil: is asked before each job; an event that it gives stands for the job's."""

    def __init__(self, plan: Plan, target: Target, spoil: Callable[[Job], Event | None] = lambda job: None) -> None:
        self.maker, self._spoil = Maker(plan, target), spoil
        self._jobs: list[Job] = []
        self.made: list[int] = []

    def free(self) -> int:
        return 2 - len(self._jobs)

    def submit(self, job: Job) -> None:
        self._jobs.append(job)

    def wait(self, seconds: float) -> list[Event]:
        if not self._jobs:
            return []
        job = self._jobs.pop(0)
        spoilt = self._spoil(job)
        if spoilt is not None:
            return [spoilt]
        frames: list[dict[str, int]] = []

        def progress(done: int, total: int) -> None:
            frames.append({"kind": "frame", "run": job.run, "done": done, "total": total})

        message = outcome(self.maker, {"run": job.run, "expect": job.expect}, progress)
        self.made.append(job.run)
        return [*map(event_of, frames), event_of(message)]

    def close(self) -> None:
        self._jobs.clear()
