"""How well a simulator predicts what a robot's software sees, before and after its diagnosis: the check of the measure.

    ./run python benchmarks/cost.py [--cases 6] [--skip 0] [--frames 18] [--size 240,136] [--effects ID,ID] [--run RUN]

Each case is a withheld recording by formulas that are not the bank's, diagnosed with the whole bank; ``--run`` adds
recordings of one's own, against the paper's sensor. The first table has, for every figure, the cases in which the
simulator before is off the recording by more than chance, and the median of how far it is off, before and after, as a
share of the recording's figure; then the same of those in which it was off by half or more. The second lists the
figures that a gap which is closed by four fifths or more did not bring nearer, or left off by more than 15 %.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.withheld_data.case import CannotBeSeen, draw_case, write_case
from benchmarks.withheld_score.plan import slice_cases
from depthsim.gap import Diagnosis, diagnose
from depthsim.gap.depth.tasks.figures import FIGURES
from depthsim.gap.diagnosis import Task

_AIM, _MUCH, _CLOSED = 0.15, 0.5, 0.8


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
    for name in FIGURES:
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
    wanted = [case for case in slice_cases() if case.tier in ("a", "c")]
    if options.effects:
        wanted = [case for case in wanted if set(case.effects) & set(options.effects.split(","))]
    for case in wanted[options.skip : options.skip + options.cases]:
        name = "+".join(case.effects)
        with tempfile.TemporaryDirectory(prefix="depthsim_cost_") as folder:
            try:
                write_case(draw_case(replace(case, frames=options.frames, size=options.size)), Path(folder))
            except CannotBeSeen as error:
                console.print(f"{name}: {error}")
                continue
            without = tuple(json.loads((Path(folder) / "case.json").read_text()).get("without") or ())
            sensor = Path(folder) / "sensor.yaml"
            yield name, diagnose(Path(folder) / "run", sensor=sensor, without=without, threads=options.threads)
    for run in options.run:
        yield run.name, diagnose(run, sensor="paper", threads=options.threads)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=6, help="withheld recordings")
    parser.add_argument("--skip", type=int, default=0, help="of them, before the first")
    parser.add_argument("--frames", type=int, default=18, help="of each")
    parser.add_argument("--size", type=lambda text: tuple(map(int, text.split(","))), default=(240, 136), help="px")
    parser.add_argument("--effects", help="cases of these effects alone")
    parser.add_argument("--run", type=Path, action="append", default=[], help="a recording of one's own")
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
