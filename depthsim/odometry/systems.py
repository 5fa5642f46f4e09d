"""The systems that `depthsim slam` runs, by name; each is one file with a function ``track``."""

import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.runs import Run
from depthsim.trajectory import Trajectory

DEPTH_MAX = 8.0
"""[m] No system looks farther. Open3D drifts more with less: on clean runs twice as much at 4 m as at 8 m."""

SYSTEMS = {"open3d-slam": "open3d_slam", "open3d-odometry": "open3d_odometry", "kiss-icp": "kiss_icp"}
"""The module of each system, by the name that :func:`estimate` takes."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Estimate:
    """What a system made of a run.

    trajectory: poses of the optical frame in that of the first frame, at the stamps of the frames that it tracked.
    frames: those it was given, which may be fewer than the run has. seconds: the time it took, reading the pictures
    included.
    """

    system: str
    trajectory: Trajectory
    frames: int
    seconds: float


def estimate(run: Run, system: str, progress: Progress = lambda done, total: None) -> Estimate:
    """Run a system on all frames of a run.

    A system that loses track, or raises, stops there: the poses up to that frame are the estimate.
    Raises :class:`InputError` for an unknown system, a missing extra and a run of fewer than two frames.
    """
    if system not in SYSTEMS:
        raise InputError("`system`", system, "is no system", f"give one of {', '.join(SYSTEMS)}")
    if len(run) < 2:
        raise InputError(run.path, "", "has one frame", "give a run of two frames or more")
    module = importlib.import_module(f"depthsim.odometry.{SYSTEMS[system]}")
    begin = time.monotonic()
    poses: list[NDArray[np.float64]] = []
    given, skipped = [], 0
    for index, pose in enumerate(module.track(run)):
        progress(index + 1, len(run))
        if pose is None:
            skipped += 1
            continue
        if not np.isfinite(pose).all():
            break
        poses.append(np.array(pose, np.float64))
        given.append(index)
    seconds = time.monotonic() - begin
    trajectory = Trajectory.of_matrices(run.stamps[given], np.array(poses), f"estimate of {system}")
    return Estimate(system, trajectory, len(run) - skipped, seconds)
