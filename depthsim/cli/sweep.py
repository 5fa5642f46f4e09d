"""`depthsim sweep`: thousands of runs from one file."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.errors import InputError

if TYPE_CHECKING:
    from depthsim.sweep.drive import Progress
    from depthsim.sweep.events import Makers
    from depthsim.sweep.plan import Plan


def sweep(
    file: Annotated[Path, typer.Argument(metavar="SWEEP.yaml", help="Scenes, trajectories, profiles, seeds, draws.")],
    out: Annotated[
        str | None, typer.Option(help="A folder or a URL (s3://…); the same command finishes what is missing.")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes. [default: all cores]")] = None,
    ray: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Ray cluster: host:port, auto, or local for this machine's.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="State runs, frames, bytes and time.")] = False,
    check: Annotated[bool, typer.Option("--check", help="Look through whole runs, too, and repair them.")] = False,
    lerobot: Annotated[
        Path | None, typer.Option(help="Then write all runs as one LeRobot data set to this new folder.")
    ] = None,
) -> None:
    """Make every scene x trajectory x profile x seed x draw of a file as a run.

    Runs that are there are kept, and those that were broken off are finished.
    """
    from depthsim.extras import need_extra
    from depthsim.parallel import core_count
    from depthsim.runs.whole import refuse_taken
    from depthsim.sweep.drive import run_sweep
    from depthsim.sweep.target import open_target

    count = workers or core_count()
    if dry_run:
        from depthsim.sweep.measure import estimate

        print(estimate(file, count).text())
        return
    if out is None:
        raise InputError("sweep", "", "does not say where to", "add --out FOLDER or --out URL, or --dry-run")
    if ray is not None:
        need_extra("ray")  # which has what a URL needs, too
    target = open_target(out)

    def start(plan: "Plan") -> "Makers":
        if ray is not None:
            from depthsim.sweep.rayrun import RayMakers

            return RayMakers(plan, target.url, ray, workers)
        from depthsim.sweep.pool import Pool

        return Pool(target.url, count)

    if lerobot is not None:
        need_extra("lerobot")
        refuse_taken(lerobot)
        if "://" in out:
            raise InputError("sweep", "--lerobot", "needs the runs in a folder", "give --out a folder, not a URL")
    begin = time.monotonic()
    with _Bar() as bar:
        done = run_sweep(file, target, start, check=check, show=bar)
    print(_told(out, done, time.monotonic() - begin))
    if done.failed:
        problem = f"{done.failed} of {done.runs} runs failed, the first: {done.first_error}"
        raise InputError(out, "", problem, "the same command tries them again")
    if lerobot is not None:
        _write_lerobot(Path(out), lerobot)


def _write_lerobot(folder: Path, out: Path) -> None:
    from depthsim.exporting import export_together
    from depthsim.runs import Run
    from depthsim.sweep.plan import Plan
    from depthsim.sweep.target import PLAN

    plan = Plan.from_json((folder / PLAN).read_text(), str(folder / PLAN))
    said = export_together((Run.open(folder / plan.run(index).path) for index in range(len(plan))), out)
    print(f"{out}: {said}")


def _told(out: str, done: "Progress", seconds: float) -> str:
    rate = f" in {seconds:.1f} s, {done.frames_made / seconds:.1f} frames/s" if done.frames_made else ""
    repaired = f"; {done.repaired} were damaged and are repaired" if done.repaired else ""
    lost = f"; {done.lost} workers died and were replaced" if done.lost else ""
    made = f"{done.runs_made} made now ({done.frames_made} frames{rate})"
    return f"{out}: {done.whole} of {done.runs} runs are whole, {made}{repaired}{lost}"


class _Bar:
    """A bar of runs with the rate of frames on a terminal; nothing elsewhere."""

    def __enter__(self) -> "_Bar":
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        console = Console(stderr=True)
        self._bar = Progress(
            TextColumn("runs"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[state]}"),
            TimeRemainingColumn(), console=console, disable=not console.is_terminal, transient=True,
        )  # fmt: skip
        self._task = self._bar.add_task("", total=None, state="")
        self._bar.start()
        self._begin = time.monotonic()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def __call__(self, progress: "Progress") -> None:
        rate = progress.frames_made / max(time.monotonic() - self._begin, 1e-9)
        failed = f", {progress.failed} failed" if progress.failed else ""
        state = f"{rate:.1f} frames/s{failed}"
        self._bar.update(self._task, completed=progress.whole + progress.failed, total=progress.runs, state=state)
