"""Timing side by side, and what machine it was on."""

import os
import platform
import time
from collections.abc import Callable, Mapping
from datetime import date
from importlib.metadata import PackageNotFoundError, version

import numpy as np

Work = Callable[[], object]
Measure = Callable[[Mapping[str, Work]], dict[str, list[float]]]
"""Seconds of each work in each round; or the least of each alone."""


def side_by_side(works: Mapping[str, Work], rounds: int = 25, rest: float = 0.01) -> dict[str, list[float]]:
    """Seconds of each work in each of ``rounds`` rounds; in a round they run one after the other.

    The order turns from round to round. Before each there is a ``rest`` [s], because the thread pools of some libraries
    go on spinning for a while after their work and would slow down whoever comes next; and then an untimed call of the
    same work, because a virtual machine's sleeping cores take a few milliseconds to come back.
    """
    names = list(works)
    for work in works.values():
        work()
    seconds: dict[str, list[float]] = {name: [] for name in names}
    for turn in range(rounds):
        for name in names[turn % len(names) :] + names[: turn % len(names)]:
            time.sleep(rest)
            works[name]()
            begin = time.perf_counter()
            works[name]()
            seconds[name].append(time.perf_counter() - begin)
    return seconds


def least_cpu(works: Mapping[str, Work], rounds: int = 25) -> dict[str, float]:
    """Least processor seconds of each work, all threads together: comparable even on a machine that others use."""
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            work()
            begin = time.process_time()
            work()
            seconds[name].append(time.process_time() - begin)
    return {name: min(own) for name, own in seconds.items()}


def ratio(seconds: Mapping[str, list[float]], over: str, under: str) -> float:
    """The median over the rounds of one work's time over another's."""
    return float(np.median(np.array(seconds[over]) / np.array(seconds[under])))


def milliseconds(seconds: list[float]) -> float:
    """The median [ms]."""
    return float(np.median(seconds)) * 1e3


def machine() -> str:
    """One line on processor, system and versions."""
    model = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            model = next(line.split(":", 1)[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    packages = []
    for package in ("numpy", "numba", "embreex", "open3d-cpu", "mitsuba"):
        try:
            packages.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            packages.append(f"{package} not installed")
    return (
        f"{model}, {cores} cores, {platform.system()}, Python {platform.python_version()}, "
        f"{', '.join(packages)}; {date.today().isoformat()}"
    )
