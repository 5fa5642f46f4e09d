"""One trajectory through several sensors and speeds: how the error of a system follows the noise of its input."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.odometry.results import RESULTS, put_row, row_of
from depthsim.odometry.score import Score, score
from depthsim.odometry.sweep_plot import picture
from depthsim.odometry.systems import DEPTH_MAX, estimate
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.storing import write_whole
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import Trajectory
from depthsim.trajectory.poses import TOLERANCE, frame_count

PROFILES = ("clean", "paper", "d435", "active_stereo")
FRAMES_OF_NOISE = 8
"""Frames that the noise of a run is measured on."""


@dataclass(frozen=True)
class Case:
    """One run of a sweep under one system. noise: see :func:`noise_of`. score is None for a track lost at once."""

    profile: str
    speed: float
    system: str
    noise: float
    frames: int
    score: Score | None


def sweep(
    run: Run,
    out: Path,
    systems: Sequence[str],
    profiles: Sequence[str] = PROFILES,
    speeds: Sequence[float] = (1.0,),
    seed: int = 0,
    report: Callable[[str], None] = lambda line: None,
) -> list[Case]:
    """Make a run for each profile and speed along the poses of ``run``, and score each system on each.

    Writes out/runs/PROFILE_SPEEDx/, out/results.csv and out/sweep.png. Runs that are there already are kept, so that a
    sweep that was broken off goes on. A speed of 2 takes the same way in half the time, at the same frame rate.
    Raises :class:`InputError` where the run has no scene, and for profiles and systems that do not exist.
    """
    if run.scene is None:
        raise InputError(run.path, "", "holds no scene", "sweep over a run that `depthsim generate` made")
    scene = load_scene(run.scene)
    cases = []
    for profile in profiles:
        sensor = load_profile(profile)
        for speed in speeds:
            path, truth = faster(run, speed)
            name = f"{Path(profile).stem}_{speed:g}x"
            generate(scene, path, run.camera, sensor, out / "runs" / name, truth=truth, seed=seed)
            made = Run.open(out / "runs" / name)
            noise = noise_of(made)
            for system in systems:
                found = estimate(made, system)
                try:
                    figures = score(made.trajectory, found.trajectory)
                except InputError:
                    report(f"{name}: {system} lost its track at once")
                    cases.append(Case(profile, speed, system, noise, len(made), None))
                    continue
                put_row(out / RESULTS, row_of(name, system, found.frames, figures, found.seconds))
                cases.append(Case(profile, speed, system, noise, found.frames, figures))
                report(f"{name}: {system} ATE {100 * figures.ate:.2f} cm, {figures.matched} of {found.frames} frames")
    write_whole(out / "sweep.png", picture(cases, run.path.name))
    return cases


def faster(run: Run, speed: float) -> tuple[Trajectory, Trajectory | None]:
    """The way of a run ``speed`` times as fast: its frames at the camera's rate, and its poses if they are denser.

    At speed 1 both are as they are.
    """
    if not (np.isfinite(speed) and speed > 0):
        raise InputError("`speeds`", str(speed), "is no speed", "give factors such as 0.5,1,2")
    if speed == 1:
        return run.trajectory, run.dense
    start = float(run.stamps[0])
    stamps = start + (run.truth.stamps - start) / speed
    truth = Trajectory(stamps, run.truth.positions, run.truth.quaternions, run.truth.name)
    length = (float(run.stamps[-1]) - start) / speed
    count = frame_count(length + TOLERANCE, run.camera.rate, run.truth.name)
    return truth.at(start + np.arange(count) / run.camera.rate), None if run.dense is None else truth


def noise_of(run: Run) -> float:
    """The median of |depth - clean| over the pixels nearer than the systems look, as a standard deviation [m].

    1.4826 times the median, which is the deviation of normal noise and is not moved by a few pixels at edges.
    """
    errors = []
    for index in np.unique(np.linspace(0, len(run) - 1, FRAMES_OF_NOISE).astype(int)):
        depth, clean = run.depth(index), run.clean(index)
        if clean is None:
            raise InputError(run.path, "clean", "is not there", "make the run with its clean depth")
        both = (depth > 0) & (clean > 0) & (clean < DEPTH_MAX)
        errors.append(np.abs(depth[both] - clean[both]))
    every = np.concatenate(errors)
    return float(1.4826 * np.median(every)) if every.size else float("nan")
