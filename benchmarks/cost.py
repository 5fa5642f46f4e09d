"""How well a simulator predicts what a robot's software sees, before and after its diagnosis: the check of the measure.

    ./run python benchmarks/cost.py [--cases 6] [--skip 0] [--frames 18] [--size 240,136] [--effects ID,ID] [--run RUN]
                                    [--moving] [--kiss-icp] [--no-real] [--pixels 3e6]

Each case is a withheld recording by formulas that are not the bank's, diagnosed with the whole bank; with ``--moving``
one that goes far enough for an odometry, so that its drift is there, too. Then come the real recordings beside the
checkout, with a third of the usual pixels looked at, and with ``--run`` recordings of one's own, against the paper's
sensor. KISS-ICP takes as long as all else and is run where it is asked for.

The first table has, for every figure, the cases in which the simulator before is off the recording by more than chance,
and the median of how far it is off, before and after, as a share of the recording's figure; then the same of those in
which it was off by half or more. The second lists the figures that a gap which is closed by four fifths or more did not
bring nearer, or left off by more than 15 %.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.real_sets import DATA, real_sets
from benchmarks.withheld_data.case import CannotBeSeen, Case, Wanted, draw_case, write_case
from benchmarks.withheld_score.plan import planned, slice_cases
from depthsim.gap import Diagnosis, Findings, investigate
from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.tasks.figures import FIGURES, ODOMETRY
from depthsim.gap.depth.tasks.odometry import odometry_tasks
from depthsim.gap.diagnosis import Task
from depthsim.odometry.score import STEP
from depthsim.runs import Run

_AIM, _MUCH, _CLOSED = 0.15, 0.5, 0.8
_TRIES = 10
"""Seeds that are tried for a case that moves."""


@dataclass(frozen=True)
class Off:
    """How far one figure of one case is off the recording's, as a share of it. closed: of the gap."""

    case: str
    task: Task
    before: float
    after: float
    closed: float

    @property
    def matters(self) -> bool:
        """Whether the simulator before is off by more than chance."""
        low, high = self.task.ci95.get("before_off", (0.0, 0.0))
        return not low <= 0 <= high


def off_recording(case: str, found: Diagnosis) -> list[Off]:
    """The figures of a diagnosis that all three have, and whose share makes sense."""
    offs = []
    for task in found.tasks:
        if task.before is not None and task.after is not None and task.recording:
            before, after = (abs(value / task.recording - 1) for value in (task.before, task.after))
            offs.append(Off(case, task, before, after, found.gap.closed_fraction))
    return offs


def by_figure(offs: list[Off], least: float = 0.0) -> Iterator[tuple[str, int, float, float, int]]:
    """Name, cases where it matters, median off before and after in these, and in how many it is nearer after.

    least: how far before is off in these.
    """
    for name in (*FIGURES, *ODOMETRY):
        own = [off for off in offs if off.task.name == name and off.matters and off.before >= least]
        if own:
            before, after = (float(np.median([getattr(off, when) for off in own])) for when in ("before", "after"))
            yield name, len(own), before, after, sum(off.after < off.before for off in own)


def not_nearer(offs: list[Off]) -> list[Off]:
    """Where the gap is closed and the figure is not right, by more than chance."""
    found = []
    for off in offs:
        low, high = off.task.ci95.get("after_off", (0.0, 0.0))
        wrong = off.after > max(_AIM, off.before) or (off.matters and off.after > _AIM)
        if off.closed >= _CLOSED and wrong and not low <= 0 <= high:
            found.append(off)
    return found


def diagnosed(options: argparse.Namespace, console: Console) -> Iterator[tuple[str, Diagnosis]]:
    """The cases and recordings, one after the other."""
    for case in islice(_cases(options), options.skip, options.skip + options.cases):
        name = "+".join(case.effects)
        with tempfile.TemporaryDirectory(prefix="depthsim_cost_") as folder:
            try:
                write_case(drawn(case, moving=options.moving), Path(folder))
            except CannotBeSeen as error:
                console.print(f"{name}: {error}")
                continue
            without = tuple(json.loads((Path(folder) / "case.json").read_text()).get("without") or ())
            yield name, _diagnosis(Path(folder) / "run", Path(folder) / "sensor.yaml", without, options)
    with tempfile.TemporaryDirectory(prefix="depthsim_cost_") as folder:
        config = DepthConfig.varied((f"data.pixels={options.pixels:.0f}",))
        for real in real_sets(DATA, Path(folder)) if options.real else ():
            yield real.path.name, _diagnosis(real, "paper", (), options, config)
    for run in options.run:
        yield run.name, _diagnosis(run, "paper", (), options)


def _cases(options: argparse.Namespace) -> Iterator[Wanted]:
    wanted = planned("a") if options.moving else (case for case in slice_cases() if case.tier in ("a", "c"))
    for case in wanted:
        if not options.effects or set(case.effects) & set(options.effects.split(",")):
            yield replace(case, frames=options.frames, size=options.size)


def drawn(wanted: Wanted, *, moving: bool) -> Case:
    """The case; one that goes as far as a drift needs where it has to."""
    for seed in range(wanted.seed, wanted.seed + _TRIES) if moving else (wanted.seed,):
        case = draw_case(replace(wanted, seed=seed))
        way = case.film.told(case.film.stamps).positions
        if not moving or np.linalg.norm(np.diff(way, axis=0), axis=1).sum() > STEP:
            return case
    raise CannotBeSeen(f"stays within {STEP:g} m in {_TRIES} scenes")


def _diagnosis(
    run: Path | Run,
    sensor: str | Path,
    without: tuple[str, ...],
    options: argparse.Namespace,
    config: DepthConfig = DepthConfig(),  # noqa: B008 - frozen
) -> Diagnosis:
    found: Findings = investigate(run, sensor=sensor, without=without, threads=options.threads, config=config)
    if not options.kiss_icp:
        return found.diagnosis
    evidence, _ = load_evidence(run, None, sensor, threads=options.threads, config=config)
    sensors = [evidence.base, found.fixed.effects] if found.diagnosis.causes else [evidence.base]
    more = [task for task in odometry_tasks(evidence, sensors, ("kiss_icp",)) if task.name.endswith("kiss_icp")]
    return found.diagnosis.model_copy(update={"tasks": (*found.diagnosis.tasks, *more)})


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=6, help="withheld recordings")
    parser.add_argument("--skip", type=int, default=0, help="of them, before the first")
    parser.add_argument("--frames", type=int, default=18, help="of each")
    parser.add_argument("--size", type=lambda text: tuple(map(int, text.split(","))), default=(240, 136), help="px")
    parser.add_argument("--effects", help="cases of these effects alone")
    parser.add_argument("--run", type=Path, action="append", default=[], help="a recording of one's own")
    parser.add_argument("--moving", action="store_true", help="cases that go a metre or more; of 20 frames or more")
    parser.add_argument("--kiss-icp", action="store_true", help="KISS-ICP besides Open3D's odometry")
    parser.add_argument("--real", action=argparse.BooleanOptionalAction, default=True, help="the real recordings")
    parser.add_argument("--pixels", type=float, default=3e6, help="of each of these, spread over it as always")
    parser.add_argument("--threads", type=int, default=None)
    options, console = parser.parse_args(), Console(markup=False, highlight=False)
    offs: list[Off] = []
    for name, found in diagnosed(options, console):
        own = off_recording(name, found)
        offs += own
        causes = ", ".join(cause.effect for cause in found.causes) or "none"
        console.print(f"{name}: {found.verdict}, closed {found.gap.closed_fraction:.0%}, causes {causes}")
        for off in own:
            task = off.task
            console.print(
                f"  {task.name} [{task.unit}] {task.recording:.3g} | {task.before:.3g} | {task.after:.3g}"
                f"{'' if off.matters else '  (before is not off by more than chance)'}"
            )
    for least, title in ((0.0, "Median off the recording's figure"), (_MUCH, "Where it was off by half or more")):
        table = Table("figure", "cases", "off before", "off after", "nearer", title=title)
        for figure, count, before, after, nearer in by_figure(offs, least):
            table.add_row(figure, str(count), f"{before:.1%}", f"{after:.1%}", f"{nearer} of {count}")
        console.print(table)
    table = Table("case", "figure", "off before", "off after", title="Not right though the gap is closed")
    for off in not_nearer(offs):
        table.add_row(off.case, off.task.name, f"{off.before:.1%}", f"{off.after:.1%}")
    console.print(table)


if __name__ == "__main__":
    main()
