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
    from depthsim.extras import load_extra
    from depthsim.runs import Run

    there = Run.open(run, posed=False)
    posed = (run / "groundtruth.txt").exists()
    if posed:
        load_extra("evo.core.metrics", "slam")  # refused before a system runs for minutes, not when it is to be scored
    folder = out or run / "slam"
    if estimate is not None:
        if system or sweep:
            raise InputError("slam", "", "has --estimate and a system to run", "give one of them")
        _score_file(there, estimate, folder)
    elif sweep:
        _sweep(there, posed, system, profiles, speeds, folder)
    elif system:
        for name in system:
            _run(there, name, folder)
    else:
        fix = "add --with open3d-slam, open3d-odometry or kiss-icp, or --estimate FILE"
        raise InputError("slam", "", "does not say which system", fix)


def _score_file(run: "Run", file: Path, out: Path) -> None:
    from depthsim.odometry.slam import slam as score

    made = score(run, estimate=file, out=out)
    assert made.row is not None
    _show(made.row, out)


def _run(run: "Run", system: str, out: Path) -> None:
    from depthsim.odometry.slam import slam as track

    made = track(run, system, out=out)
    tracked = len(made.trajectory)
    if tracked < made.frames:
        print(f"{system}: lost its track after {tracked} of {made.frames} frames", file=sys.stderr)
    if made.row is None:
        print(f"{out / f'{system}.txt'}: {tracked} poses; not scored, as the run has no groundtruth.txt")
    else:
        _show(made.row, out)


def _sweep(run: "Run", posed: bool, systems: list[str] | None, profiles: str, speeds: str, out: Path) -> None:
    from depthsim.odometry import SYSTEMS
    from depthsim.odometry.sweep import sweep

    if not posed:
        problem = "is missing, so that nothing can be scored"
        raise InputError(run.path / "groundtruth.txt", "", problem, "write the true poses there")
    try:
        factors = [float(word) for word in speeds.split(",")]
    except ValueError:
        raise InputError("--speeds", speeds, "are no numbers", "give factors such as 0.5,1,2") from None
    names = [name for name in profiles.split(",") if name]
    sweep(run, out, systems or list(SYSTEMS), names, factors, report=print)
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
