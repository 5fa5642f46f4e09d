"""One call from a run to the score of a system on it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.odometry.results import row_of, write_results
from depthsim.odometry.score import Score, score
from depthsim.odometry.systems import estimate as track
from depthsim.runs.folder import Run, open_run
from depthsim.runs.layout import GROUND_TRUTH
from depthsim.runs.storing import make_folder, write_whole
from depthsim.trajectory import Trajectory, read_tum, tum_text


@dataclass(frozen=True)
class Tracked:
    """What a system made of a run.

    trajectory: the estimate. frames: those that the system was given. seconds: the time it took, None for an estimate
    that was given. score: None for a run without true poses. row: the line of results.csv, of a score.
    """

    system: str
    trajectory: Trajectory
    frames: int
    seconds: float | None
    score: Score | None
    row: dict[str, str] | None


def slam(
    run: str | Path | Run,
    system: str = "open3d-odometry",
    *,
    estimate: str | Path | Trajectory | None = None,
    out: str | Path | None = None,
) -> Tracked:
    """Run a system on a run and score what it estimates against the run's poses, by evo.

    system: open3d-slam, open3d-odometry or kiss-icp. estimate: the trajectory of any other system, to be scored in its
    place. out: a folder for the estimate, plots and results.csv. A run without groundtruth.txt is tracked and not
    scored. Raises :class:`InputError` for an unknown system, a missing extra, and an estimate without a truth.
    """
    opened = open_run(run, posed=False)
    posed, name = (opened.path / GROUND_TRUTH).exists(), opened.path.absolute().name
    if estimate is None:
        found = track(opened, system)
        trajectory, frames, seconds, truth = found.trajectory, found.frames, found.seconds, opened.trajectory
    else:
        if not posed:
            problem = "is missing, so that nothing can be scored"
            raise InputError(opened.path / GROUND_TRUTH, "", problem, "write the true poses there")
        trajectory = estimate if isinstance(estimate, Trajectory) else read_tum(Path(estimate))
        system = Path(trajectory.name).stem if isinstance(estimate, Trajectory) else Path(estimate).stem
        frames, seconds = len(opened), None
        # Other systems stamp their poses by other pictures, too: denser poses of the truth have some nearer to those.
        truth = opened.truth.at(np.union1d(opened.truth.stamps, opened.stamps))
    figures = score(truth, trajectory) if posed else None
    row = None if figures is None else row_of(name, system, frames, figures, seconds)
    if out is not None and row is not None:
        write_results(Path(out), row, trajectory, truth)
    elif out is not None:
        make_folder(Path(out))
        write_whole(Path(out) / f"{system}.txt", tum_text(trajectory).encode())
    return Tracked(system, trajectory, frames, seconds, figures, row)
