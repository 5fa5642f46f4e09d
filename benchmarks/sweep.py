"""What sweeps cost: workers side by side, planning and manifest, frames and bytes.

    ./run python benchmarks/sweep.py [--rounds 3] [--runs 24]

Rates are taken between a fifth and nine tenths of the frames, so that starting processes is not in them, and the ways
take turns. Beside the rates by the wall stands the processor time of a frame, which other work on the machine moves
less.
"""

import argparse
import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.measuring import machine
from depthsim.parallel import core_count
from depthsim.sweep.drive import Progress, run_sweep
from depthsim.sweep.drive import begin as begin_plan
from depthsim.sweep.events import Event, Job, Makers
from depthsim.sweep.measure import measured
from depthsim.sweep.plan import Plan
from depthsim.sweep.pool import Pool
from depthsim.sweep.target import LocalTarget

RATES = """
scenes: [office]
profiles: [d435]
draws: {runs}
frames: {frames}
random: {{trajectory: {{speed: {{range: [0.4, 0.8]}}}}}}
"""
MANY = """
scenes: [wall]
draws: 10000
frames: 1
random: {trajectory: {speed: {range: [0.4, 0.8]}}, surfaces: {cement: {m: {range: [0.3, 0.5]}}}}
"""


class Clock:
    """When how many frames were there."""

    def __init__(self) -> None:
        self.seen: list[tuple[float, int]] = []

    def __call__(self, progress: Progress) -> None:
        """Look."""
        if not self.seen or progress.frames_made != self.seen[-1][1]:
            self.seen.append((time.perf_counter(), progress.frames_made))

    def rate(self) -> float:
        """Frames a second between a fifth and nine tenths of them."""
        times, frames = np.array(self.seen).T
        low, high = 0.2 * frames[-1], 0.9 * frames[-1]
        inside = (frames >= low) & (frames <= high)
        return float(np.ptp(frames[inside]) / np.ptp(times[inside]))


class Instant:
    """Workers that have always made their run already: what is left is the driver's own work."""

    def __init__(self) -> None:
        self._jobs: list[Job] = []

    def free(self) -> int:
        """A few, as of real ones."""
        return 4 - len(self._jobs)

    def submit(self, job: Job) -> None:
        """Take a job."""
        self._jobs.append(job)

    def wait(self, seconds: float) -> list[Event]:
        """One frame and one run each."""
        events = []
        for job in self._jobs:
            row = {"run": job.run, "state": "whole", "frames": 1, "made": 1, "bytes": 450_000, "sha256": "0" * 64}
            row |= {"seconds": 0.05, "built": 1, "worker": "host:1"}
            events += [Event("frame", job.run, row={"done": done, "total": 1}) for done in (0, 1)]
            events.append(Event("done", job.run, row=row))
        self._jobs.clear()
        return events

    def close(self) -> None:
        """Nothing to end."""


def rates(folder: Path, rounds: int, runs: int, frames: int) -> None:
    """One worker, two, and Ray's local cluster with two."""
    file = folder / "rates.yaml"
    file.write_text(RATES.format(runs=runs, frames=frames))
    ways: dict[str, Callable[[Plan, str], Makers]] = {
        "1 worker": lambda plan, url: Pool(url, 1),
        "2 workers": lambda plan, url: Pool(url, 2),
    }
    if find_spec("ray"):
        from depthsim.sweep.rayrun import RayMakers

        ways["Ray, local, 2 cores"] = lambda plan, url: RayMakers(plan, url, "local", 2)
    else:
        print("Ray is not installed and left out")
    found: dict[str, list[float]] = {way: [] for way in ways}
    for turn in range(rounds + 1):
        for way, start in list(ways.items())[:: 1 if turn % 2 else -1]:
            target, clock = LocalTarget(folder / "out"), Clock()
            before = _children()
            run_sweep(file, target, lambda plan, start=start, target=target: start(plan, target.url), show=clock)
            spent = (_children() - before) / (runs * frames)
            shutil.rmtree(target.root)
            if turn:  # the first compiles and fills caches
                found[way].append(clock.rate())
            print(
                f"  round {turn}, {way}: {clock.rate():.1f} frames/s, {spent * 1e3:.0f} ms of processor a frame",
                flush=True,
            )
    one, two = np.array(found["1 worker"]), np.array(found["2 workers"])
    print(f"2 workers against 1: {np.median(two / one):.2f} (aim 1.8)")
    if "Ray, local, 2 cores" in found:
        print(
            f"Ray against our own 2 workers: {np.median(np.array(found['Ray, local, 2 cores']) / two):.2f} (aim 0.85)"
        )


def _children() -> float:
    """Processor seconds of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def overhead(folder: Path) -> None:
    """The driver's own work at 10,000 runs of one frame, against making them on all cores."""
    file = folder / "many.yaml"
    file.write_text(MANY)
    target = LocalTarget(folder / "many")
    begin, cpu = time.perf_counter(), time.process_time()
    run_sweep(file, target, lambda plan: Instant())
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    plan = Plan.from_json((target.root / "plan.json").read_text(), target.root)
    cost = measured(plan, target, 1, time.process_time)
    making = cost.core_seconds / core_count()
    print(f"planning, journal and manifest of 10,000 runs: {cpu:.1f} s of processor ({wall:.1f} s by the wall)")
    share = f"overhead {cpu / making:.1%} (aim under 10 %)"
    print(f"making them: {cost.core_seconds:.0f} s of processor, {making:.0f} s on {core_count()} cores: {share}")
    print(cost.text())
    for profile in ("paper", "d435", "active_stereo"):
        file.write_text(f"scenes: [office, tunnel]\nprofiles: [{profile}]\nframes: 100\n")
        with tempfile.TemporaryDirectory() as name:
            there = LocalTarget(Path(name))
            several = measured(begin_plan(file, there), there, 1, time.process_time)
        print(several.text())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--runs", type=int, default=24)
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--no-rates", action="store_true", help="planning, frames and bytes alone")
    given = parser.parse_args()
    load = Path("/proc/loadavg").read_text(encoding="ascii").split()[0] if Path("/proc/loadavg").exists() else "?"
    print(f"{machine()}; load before: {load}")
    with tempfile.TemporaryDirectory(prefix="depthsim-sweep-") as name:
        overhead(Path(name))
        if not given.no_rates:
            rates(Path(name), given.rounds, given.runs, given.frames)


if __name__ == "__main__":
    main()
