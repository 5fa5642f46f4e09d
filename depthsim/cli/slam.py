"""`depthsim slam`: odometry and SLAM on a run, scored."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.errors import InputError

if TYPE_CHECKING:
    from depthsim.runs import Run


def slam(
    run: Annotated[Path, typer.Argument(help="The run's folder.")],
    system: Annotated[
        list[str] | None,
        typer.Option(
            "--with", metavar="SYSTEM", help="open3d-slam, open3d-odometry or kiss-icp; may come several times."
        ),
    ] = None,
    estimate: Annotated[Path | None, typer.Option(help="Score this TUM trajectory of any other system.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Where estimate, plots and results.csv go. [default: RUN/slam]")
    ] = None,
    sweep: Annotated[bool, typer.Option("--sweep", help="Make the run again with other sensors and speeds.")] = False,
    profiles: Annotated[str, typer.Option(help="Of a sweep.")] = "clean,paper,d435,active_stereo",
    speeds: Annotated[str, typer.Option(help="Of a sweep: factors of the run's speed.")] = "1,2",
) -> None:
    """Run a SLAM system on a run and score it by evo: ATE, RPE, drift per metre."""
    from depthsim.runs import Run

    there = Run.open(run, posed=False)
    posed = (run / "groundtruth.txt").exists()
    folder = out or run / "slam"
    if estimate is not None:
        if system or sweep:
            raise InputError("slam", "", "has --estimate and a system to run", "give one of them")
        _score_file(there, posed, estimate, folder)
    elif sweep:
        _sweep(there, posed, system, profiles, speeds, folder)
    elif system:
        for name in system:
            _run(there, posed, name, folder)
    else:
        mend = "add --with open3d-slam, open3d-odometry or kiss-icp, or --estimate FILE"
        raise InputError("slam", "", "does not say which system", mend)


def _need_poses(run: "Run", posed: bool) -> None:
    if not posed:
        problem = "is missing, so that nothing can be scored"
        raise InputError(run.path / "groundtruth.txt", "", problem, "write the true poses there")


def _score_file(run: "Run", posed: bool, file: Path, out: Path) -> None:
    import numpy as np

    from depthsim.odometry import score
    from depthsim.odometry.results import row_of, write_results
    from depthsim.trajectory import read_tum

    _need_poses(run, posed)
    found = read_tum(file)
    # Other systems stamp their poses by other pictures, too: denser poses of the truth have some nearer to those.
    truth = run.truth.at(np.union1d(run.truth.stamps, run.stamps))
    row = row_of(run.path.absolute().name, file.stem, len(run), score(truth, found), None)
    write_results(out, row, found, truth)
    _show(row, out)


def _run(run: "Run", posed: bool, system: str, out: Path) -> None:
    from depthsim.odometry import estimate, score
    from depthsim.odometry.results import row_of, write_results
    from depthsim.runs.storing import make_folder, write_whole
    from depthsim.trajectory import tum_text

    found = estimate(run, system)
    if len(found.trajectory) < found.frames:
        print(f"{system}: lost its track after {len(found.trajectory)} of {found.frames} frames", file=sys.stderr)
    if not posed:
        make_folder(out)
        write_whole(out / f"{system}.txt", tum_text(found.trajectory).encode())
        print(f"{out / f'{system}.txt'}: {len(found.trajectory)} poses; not scored, as the run has no groundtruth.txt")
        return
    row = row_of(run.path.absolute().name, system, found.frames, score(run.trajectory, found.trajectory), found.seconds)
    write_results(out, row, found.trajectory, run.trajectory)
    _show(row, out)


def _sweep(run: "Run", posed: bool, systems: list[str] | None, profiles: str, speeds: str, out: Path) -> None:
    from depthsim.odometry import SYSTEMS
    from depthsim.odometry.sweep import sweep

    _need_poses(run, posed)
    try:
        factors = [float(word) for word in speeds.split(",")]
    except ValueError:
        raise InputError("--speeds", speeds, "are no numbers", "give factors such as 0.5,1,2") from None
    names = [name for name in profiles.split(",") if name]
    sweep(run, out, systems or list(SYSTEMS), names, factors, tell=print)
    print(f"{out}: results.csv and sweep.png")


def _show(row: dict[str, str], out: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{row['system']} on {row['run']}, {row['tracked']} of {row['frames']} frames")
    for name in ("path", "ATE", "ATE max", "RPE a frame", "RPE a frame", "drift", "drift"):
        table.add_column(name, justify="right")
    figures = [("path_m", 1, "m"), ("ate_m", 100, "cm"), ("ate_max_m", 100, "cm"), ("rpe_m", 1000, "mm")]
    figures += [("rpe_deg", 1, "°"), ("drift_m_per_m", 100, "%"), ("drift_deg_per_m", 1, "°/m")]
    table.add_row(*(f"{scale * float(row[key]):.3g} {unit}" if row[key] else "-" for key, scale, unit in figures))
    Console().print(table)
    print(f"{out}: {row['system']}.txt, {row['system']}.png and results.csv")
