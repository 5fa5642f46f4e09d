"""The withheld benchmark: diagnoses of runs whose cause is known, made by formulas that depthsim's effects do not have.

    ./run python benchmarks/withheld.py run --tier a --tier d --cases 93 --out RESULTS [--jobs 2]
    ./run python benchmarks/withheld.py tables --out RESULTS
    ./run python benchmarks/withheld.py make --tier a --effect min_range --strength medium --seed 3 --out DIR

`run` goes on where it was: a case whose result lies in RESULTS/cases is not done again, if it was made by the same
thresholds, which `--set` varies.
"""

import itertools
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.thresholds import Vary
from benchmarks.withheld_data.case import CannotBeSeen, Wanted, draw_case, write_case
from benchmarks.withheld_score.plan import TIERS, planned
from benchmarks.withheld_score.runner import D435, Settings, run_cases, run_d435
from benchmarks.withheld_score.tables import print_all
from depthsim.gap.config import DepthConfig

app = typer.Typer(add_completion=False, no_args_is_help=True)
_LIMITED = {"speed": 3}
"""Tiers that have only so many cases."""


@app.callback()
def _main() -> None:
    """Make cases, diagnose them, and count."""


@app.command()
def make(
    out: Annotated[Path, typer.Option(help="The folder of the case: run/, sensor.yaml, case.json.")],
    tier: Annotated[str, typer.Option(help="a, b, c, d or e.")] = "a",
    effect: Annotated[list[str] | None, typer.Option(help="What the simulator lacks; several for tier c.")] = None,
    strength: Annotated[str, typer.Option(help="weak, medium or strong.")] = "medium",
    seed: Annotated[int, typer.Option()] = 0,
    frames: Annotated[int | None, typer.Option(help="In place of a random number.")] = None,
    size: Annotated[str | None, typer.Option(help="WIDTHxHEIGHT in place of a random one.")] = None,
    against: Annotated[str, typer.Option(help="For tier e: paper or d435.")] = "paper",
) -> None:
    """Write one case."""
    effects = tuple(effect or ())
    wanted = _as_asked(Wanted(tier, effects, (strength,) * len(effects), against=against), frames, size, seed)
    try:
        case = draw_case(wanted)
    except CannotBeSeen as error:
        raise SystemExit(str(error)) from None
    write_case(case, out)
    print(out / "run")


@app.command()
def run(
    out: Annotated[Path, typer.Option(help="The folder of the results.")],
    tier: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join(TIERS)}; all if none is given.")] = None,
    cases: Annotated[int, typer.Option(min=1, help="How many of each tier.")] = 93,
    skip: Annotated[int, typer.Option(min=0, help="Of each tier, first: a seed changes no case's effects.")] = 0,
    effect: Annotated[list[str] | None, typer.Option(help="Only cases with one of these.")] = None,
    strength: Annotated[list[str] | None, typer.Option(help="Only cases of these strengths.")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Cases side by side.")] = 1,
    keep: Annotated[bool, typer.Option(help="Leave runs and reports in RESULTS/work.")] = False,
    rivals: Annotated[bool, typer.Option(help="Ask the two rivals too.")] = True,
    remeasure: Annotated[bool, typer.Option(help="Measure the closed fraction again on fresh frames.")] = True,
    apart: Annotated[bool, typer.Option(help="Ask an independent test what an explained case leaves.")] = True,
    alone: Annotated[bool, typer.Option(help="Of tier c diagnose what is not named by itself, too.")] = True,
    own: Annotated[bool, typer.Option(help="Look for a case's own effects alone: for the intervals.")] = False,
    frames: Annotated[int | None, typer.Option(help="In place of a random number.")] = None,
    size: Annotated[str | None, typer.Option(help="WIDTHxHEIGHT in place of a random one.")] = None,
    seed: Annotated[int, typer.Option(help="Added to the seeds of the plan.")] = 0,
    vary: Vary = None,
) -> None:
    """Diagnose the cases of some tiers, and print the tables."""
    console = Console()
    DepthConfig.varied(vary or [])  # refused here, not case by case
    settings = Settings(out.resolve(), jobs, keep, rivals, remeasure, apart, alone, own, tuple(vary or ()))
    wanted: list[Wanted] = []
    for name in tier or list(TIERS):
        if name != "f":
            fits = (w for w in itertools.islice(planned(name), 200 * (skip + cases)) if _fits(w, effect, strength))
            some = itertools.islice(fits, skip, skip + min(cases, _LIMITED.get(name, cases)))
            wanted += (_as_asked(w, frames, size, seed) for w in some)
    with Progress(console=console) as progress:
        task = progress.add_task("cases", total=len(wanted))

        def report(result: dict[str, Any]) -> None:
            progress.advance(task)
            if "error" in result:
                progress.console.print(f"[red]{result['stage']}[/red]: {result['error']}", highlight=False)

        run_cases(wanted, settings, report)
    if "f" in (tier or TIERS) and run_d435(settings) is None:
        console.print(f"tier f is left out: {D435} is not there")
    print_all(settings.folder, console)


@app.command()
def tables(out: Annotated[Path, typer.Option(help="The folder of the results.")]) -> None:
    """Print the tables of what is done so far."""
    print_all(out.resolve(), Console())


def _as_asked(wanted: Wanted, frames: int | None, size: str | None, seed: int) -> Wanted:
    width, height = (int(word) for word in (size or "0x0").split("x"))
    own = (width, height) if size else wanted.size
    return replace(wanted, frames=frames or wanted.frames, size=own, seed=wanted.seed + seed)


def _fits(wanted: Wanted, effects: list[str] | None, strengths: list[str] | None) -> bool:
    return (not effects or bool(set(effects) & set(wanted.effects))) and (
        not strengths or bool(set(strengths) & set(wanted.strengths))
    )


if __name__ == "__main__":
    app()
