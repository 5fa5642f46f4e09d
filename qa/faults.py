"""Faults of a sweep, tried and counted: `./run python qa/faults.py --moments 100`.

Every fault ends in the same check: the same command finishes the sweep, and the target holds the bytes of one that
nothing happened to. Disks that are full or read-only are small tmpfs, which want root; without, they are left out and
that is said.
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.measuring import machine
from depthsim.errors import InputError
from depthsim.runs.png import decode_png
from qa.trees import WHO, tree

SWEEP = """
name: faults
scenes: [wall, tunnel]
profiles: [paper, d435]
seeds: 3
draws: 2
frames: 6
camera: {name: small, width: 212, height: 120, fx: 106, fy: 106, cx: 105.5, cy: 59.5, baseline: 0.05, rate: 30}
random:
  trajectory: {speed: {range: [0.5, 1.5]}}
  surfaces: {cement: {m: {range: [0.3, 0.5]}}}
"""
RUNS, FRAMES = 24, 144
BACKWARDS = """
import random, time
_real, _rng = time.time, random.Random(1)
time.time = lambda: _real() - _rng.uniform(0, 1e6)
time.time_ns = lambda: int(time.time() * 1e9)
"""
"""A sitecustomize.py: every look at the clock is earlier than the last, as often as not."""


def command(file: Path, out: Path, *words: str) -> list[str]:
    return [sys.executable, "-m", "depthsim", "sweep", str(file), "--out", str(out), "--workers", "2", *words]


def call(file: Path, out: Path, *words: str, env: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(file, out, *words), capture_output=True, text=True, check=False, env=env)


def pictures(out: Path) -> dict[Path, int]:
    """The pictures that are there, with the number that a file gets when it is written anew."""
    return {path: path.stat().st_ino for path in out.glob("runs/*/*/*/[!.]*.png")}


def frames(out: Path) -> dict[Path, int]:
    """The same of depth alone, which is the last that is written of a frame: where it is, the frame is whole."""
    return {path: inode for path, inode in pictures(out).items() if path.parent.name == "depth"}


def half_written(out: Path) -> int:
    """Pictures that are there under their own name and yet are not whole."""
    count = 0
    for path in pictures(out):
        try:
            decode_png(path)
        except InputError:
            count += 1
    return count


class Trial:
    """The reference, and what has been counted."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.random = folder, random.Random(seed)
        self.file = folder / "spec" / "sweep.yaml"
        self.file.parent.mkdir()
        self.file.write_text(SWEEP)
        done = call(self.file, folder / "reference")
        if done.returncode:
            raise SystemExit(done.stderr)
        self.reference = tree(folder / "reference", WHO)

    def is_same(self, out: Path) -> bool:
        """Whether a target is what it should be."""
        return tree(out, WHO) == self.reference

    def is_wrong(self, driver: "subprocess.Popen[bytes]", out: Path) -> bool:
        """Whether a driver that has ended left something else than it should; what, is printed."""
        found = tree(out, WHO)
        names = sorted(name for name in {*found, *self.reference} if found.get(name) != self.reference.get(name))
        if driver.returncode or names:
            shown = ", ".join(f"{name} ({'changed' if found.get(name) else 'missing'})" for name in names[:6])
            print(f"  wrong: exit status {driver.returncode}; {len(names)} files: {shown}", flush=True)
            print((self.folder / "driver.log").read_text(errors="replace")[-2000:], flush=True)
            for name in [name for name in names if name.endswith(".png") and name in found][:6]:
                files = [folder / name for folder in (out, self.folder / "reference")]
                one, other = (decode_png(file) for file in files)
                sizes = " and ".join(str(file.stat().st_size) for file in files)
                print(f"    {name}: {(one != other).sum()} pixels differ, {sizes} bytes", flush=True)
        return bool(driver.returncode or names)

    def finishes(self, out: Path, *words: str) -> bool:
        """Whether the same command makes the target what it should be."""
        return call(self.file, out, *words).returncode == 0 and self.is_same(out)


def kills(trial: Trial, moments: int, minutes: float) -> list[str]:
    """kill -9 at ``moments`` random moments, of a worker and of the driver in turn, within ``minutes``."""
    until = time.monotonic() + 60 * minutes
    counts: Counter[str] = Counter()
    again: set[Path] = set()
    number, out = 0, trial.folder / "kills-0"
    driver, known = _start(trial, out), frames(out)
    while counts["worker"] + counts["driver"] < moments and time.monotonic() < until:
        wait = trial.random.uniform(0, 3)
        if trial.random.random() < 0.8:  # the others fall into the start and the planning
            _await_frame(driver, out, len(pictures(out)))
        ended = _sleep(driver, wait)
        if ended:
            counts["wrong"] += trial.is_wrong(driver, out)
            counts["sweeps"] += 1
            shutil.rmtree(out)
            number += 1
            out = trial.folder / f"kills-{number}"
            driver, known = _start(trial, out), {}
            continue
        now = frames(out)
        again |= {path for path, inode in known.items() if path in now and now[path] != inode}
        known |= now
        workers = [child.pid for child in _children(driver.pid)]
        if (counts["worker"] + counts["driver"]) % 2 == 0 and workers:
            os.kill(trial.random.choice(workers), signal.SIGKILL)
            counts["worker"] += 1
        else:
            driver.kill()
            driver.wait()
            counts["driver"] += 1
            counts["half"] += half_written(out)
            driver = _start(trial, out)
    driver.wait()
    counts["wrong"] += trial.is_wrong(driver, out)
    counts["sweeps"] += 1
    now = frames(out)
    again |= {path for path, inode in known.items() if path in now and now[path] != inode}
    return [
        f"kill -9 at random moments: {counts['worker']} times of a worker, {counts['driver']} times of the driver",
        f"  sweeps finished by the same command: {counts['sweeps']}, of them with wrong bytes: {counts['wrong']}",
        f"  pictures found half written: {counts['half']}; whole frames that were made twice: {len(again)}",
    ]


def _children(pid: int) -> list[psutil.Process]:
    try:
        return psutil.Process(pid).children()
    except psutil.NoSuchProcess:
        return []


def _start(trial: Trial, out: Path) -> "subprocess.Popen[bytes]":
    with (trial.folder / "driver.log").open("wb") as log:
        return subprocess.Popen(command(trial.file, out), stdout=log, stderr=log)


def _await_frame(driver: "subprocess.Popen[bytes]", out: Path, before: int) -> None:
    while driver.poll() is None and len(pictures(out)) <= before:
        time.sleep(0.02)


def _sleep(driver: "subprocess.Popen[bytes]", seconds: float) -> bool:
    """Whether the driver has ended within so long."""
    try:
        driver.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


@contextmanager
def small_disk(folder: Path, options: str) -> Iterator[Callable[[str], None] | None]:
    """A tmpfs, and how to mount it anew with other options; None where this user may not mount."""
    folder.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)], capture_output=True, check=False
    )
    try:
        yield (
            None
            if made.returncode
            else lambda more: subprocess.run(["mount", "-o", f"remount,{more}", str(folder)], check=True) and None
        )
    finally:
        if not made.returncode:
            subprocess.run(["umount", "-l", str(folder)], check=True)


def full_disk(trial: Trial, times: int) -> list[str]:
    """A disk that fills up at several fillings, and is enlarged."""
    sizes = [trial.random.uniform(0.02, 0.98) for _ in range(times)]
    states = [path.stat() for path in (trial.folder / "reference").rglob("*") if path.is_file()]
    pages = {state.st_ino: -(-state.st_size // 4096) for state in states}  # a mesh has many names
    whole = 4096 * sum(pages.values())
    counts: Counter[str] = Counter()
    for number, share in enumerate(sizes):
        with small_disk(trial.folder / f"full-{number}", f"size={int(share * whole)}") as remount:
            if remount is None:
                return ["disk full: not tried, mounting a tmpfs wants root"]
            out = trial.folder / f"full-{number}" / "out"
            done = call(trial.file, out)
            lines = done.stderr.strip().splitlines()
            reported = done.returncode == 2 and len(lines) == 1 and "free some space" in lines[0]
            counts["reported"] += reported
            if not reported:
                print(f"  filling {share:.0%}: exit status {done.returncode}: {done.stderr.strip()[-300:]}")
            counts["half"] += half_written(out)
            remount("size=1g")
            counts["same"] += trial.finishes(out)
    return [
        f"disk full at {times} fillings of 2 to 98 %: reported in one line with exit status 2: {counts['reported']}",
        f"  pictures found half written: {counts['half']}; finished to the same bytes given space: {counts['same']}",
    ]


def read_only(trial: Trial) -> list[str]:
    """A target that may not be written: an empty one, one that is half done, and one that is done."""
    counts: Counter[str] = Counter()
    for state in ("empty", "half", "done"):
        with small_disk(trial.folder / f"ro-{state}", "size=1g") as remount:
            if remount is None:
                return ["read-only target: not tried, mounting a tmpfs wants root"]
            out = trial.folder / f"ro-{state}" / "out"
            if state == "empty":
                out.mkdir()
            else:
                shutil.copytree(trial.folder / "reference", out)
            if state == "half":
                shutil.rmtree(out / "runs/000/000007")
            remount("ro")
            done = call(trial.file, out)
            lines = done.stderr.strip().splitlines()
            counts["reported"] += done.returncode == 2 and len(lines) == 1 and "read-only file system" in lines[0]
            remount("rw")
            counts["same"] += trial.finishes(out)
    return [f"read-only target, 3 states, in one line: {counts['reported']}; finished once writable: {counts['same']}"]


def corrupt(trial: Trial, times: int) -> list[str]:
    """One byte of a picture turned, anywhere in the file; and files cut off, emptied and taken away."""
    out = trial.folder / "corrupt"
    shutil.copytree(trial.folder / "reference", out)
    chosen = trial.random.sample(sorted(pictures(out)), times)
    for number, path in enumerate(chosen):
        data = bytearray(path.read_bytes())
        if number % 4 < 2:
            data[trial.random.randrange(len(data))] ^= 1 << trial.random.randrange(8)
        path.write_bytes(data[: len(data) // 2] if number % 4 == 2 else b"" if number % 4 == 3 else data)
    runs = {path.parts[-3] for path in chosen}
    done = call(trial.file, out, "--check")
    same = trial.is_same(out)
    reported = done.stdout.partition(": ")[2].strip()
    return [
        f"{times} pictures in {len(runs)} runs damaged (a bit turned, cut off, emptied): {reported}",
        f"  same bytes afterwards: {same}",
    ]


def changed_scene(trial: Trial) -> list[str]:
    """A mesh that is edited between two calls."""
    folder = trial.folder / "changed"
    folder.mkdir()
    mesh = folder / "room.obj"
    mesh.write_text("usemtl cement\nv -3 -3 0\nv 3 -3 0\nv 0 3 0\nv 0 0 3\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    file = folder / "sweep.yaml"
    path = "hover:position=0/-0.5/1,look_at=0/0/0,duration=0.1"
    file.write_text(SWEEP.replace("[wall, tunnel]", f'[room.obj]\ntrajectories: ["{path}"]').split("random:")[0])
    first = call(file, folder / "out")
    mesh.write_text(mesh.read_text().replace("v 0 0 3", "v 0 0 2.9"))
    second = call(file, folder / "out")
    reported = second.stderr.strip().replace(f"{folder}/", "")
    return [
        f"a scene changed between two calls: exit status {first.returncode}, then {second.returncode}:",
        f"  {reported}",
    ]


def backwards(trial: Trial) -> list[str]:
    """A clock that jumps back by up to eleven days at every look, in driver and workers."""
    folder = trial.folder / "clock"
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(BACKWARDS)
    paths = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = call(trial.file, trial.folder / "clock-out", env={**os.environ, "PYTHONPATH": paths})
    same = trial.is_same(trial.folder / "clock-out")
    return [f"clock going backwards: exit status {done.returncode}, same bytes: {same}"]


def two_drivers(trial: Trial, times: int) -> list[str]:
    """A second driver at random moments of the first."""
    refused = same = 0
    for number in range(times):
        out = trial.folder / f"two-{number}"
        first = _start(trial, out)
        _await_frame(first, out, 0)
        time.sleep(trial.random.uniform(0, 1))
        alive = first.poll() is None
        second = call(trial.file, out)
        refused += second.returncode == 2 and "is being written by another process" in second.stderr
        refused += not alive
        same += first.wait() == 0 and trial.is_same(out)
    return [f"two drivers on one target, {times} times: the second refused {refused}, the first's bytes right {same}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moments", type=int, default=100, help="of kill -9")
    parser.add_argument("--minutes", type=float, default=1e6, help="after which no more of them are tried")
    parser.add_argument("--times", type=int, default=8, help="of the other faults")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only-kills", action="store_true", help="None of the other faults.")
    given = parser.parse_args()
    print(machine())
    with tempfile.TemporaryDirectory(prefix="depthsim-faults-") as name:
        trial = Trial(Path(name), given.seed)
        print(f"each sweep: {RUNS} runs, {FRAMES} frames of 212x120, 2 workers", flush=True)
        tries: list[Callable[[], list[str]]] = [
            lambda: full_disk(trial, given.times),
            lambda: read_only(trial),
            lambda: corrupt(trial, 5 * given.times),
            lambda: changed_scene(trial),
            lambda: backwards(trial),
            lambda: two_drivers(trial, given.times // 2),
            lambda: kills(trial, given.moments, given.minutes),
        ]
        for attempt in tries[-1:] if given.only_kills else tries:
            begin = time.monotonic()
            for line in attempt():
                print(line, flush=True)
            print(f"  ({time.monotonic() - begin:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
