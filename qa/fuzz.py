"""Broken inputs for every reader: each must end in a value or in one line, within 10 s and 2 GB.

    ./run python qa/fuzz.py [--reader run --reader PNG] [--inputs 100000] [--seconds 600] [--seed 1]
    ./run python qa/fuzz.py guided --keep DIR [--reader run] [--inputs 10000]    steered by atheris
    ./run python qa/fuzz.py show --reader run --number 17 --keep DIR      one input again, with its traceback

The same seed gives the same inputs. Exit status 1 where an input ended in a traceback, a hang, or out of memory.
"""

import sys
import time
import warnings
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from qa.fuzzing.guided import missing, run_guided
from qa.fuzzing.inputs import Corpus
from qa.fuzzing.readers import READERS
from qa.fuzzing.worker import OUTCOMES, Tally, limit_memory, outcome, random_of, run_inputs

app = typer.Typer(add_completion=False)
Names = Annotated[list[str] | None, typer.Option("--reader", help="By default all.")]


@app.callback(invoke_without_command=True)
def fuzz(
    context: typer.Context,
    reader: Names = None,
    inputs: Annotated[int, typer.Option(min=1, help="For each reader.")] = 2000,
    first: Annotated[int, typer.Option(min=0, help="The number of the first input.")] = 0,
    seconds: Annotated[float | None, typer.Option(help="For each reader, at most.")] = None,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Run inputs through the readers, and count."""
    if context.invoked_subcommand is not None:
        return
    tallies: dict[str, Tally] = {}
    for name in _chosen(reader):
        tally = tallies[name] = run_inputs(READERS[name], seed, range(first, first + inputs), seconds)
        _tell(name, tally)
    _print(tallies)
    raise SystemExit(any(tally.failed for tally in tallies.values()))


@app.command()
def guided(
    keep: Annotated[Path, typer.Option(help="A folder, for the inputs that end badly.")],
    reader: Names = None,
    inputs: Annotated[int, typer.Option(min=1, help="For each reader.")] = 2000,
    seconds: Annotated[float | None, typer.Option(help="For each reader, at most.")] = None,
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Let libFuzzer choose inputs by what they reach in our code; needs atheris, which is not locked."""
    if why := missing():
        raise SystemExit(why)
    tallies: dict[str, Tally] = {}
    for name in _chosen(reader):
        tallies[name] = run_guided(READERS[name], seed, inputs, seconds, keep)
        _tell(name, tallies[name])
    _print(tallies)
    raise SystemExit(any(tally.failed for tally in tallies.values()))


@app.command()
def show(
    reader: Annotated[str, typer.Option()],
    number: Annotated[int, typer.Option()],
    keep: Annotated[Path, typer.Option(help="An empty folder, for the input.")],
    seed: Annotated[int, typer.Option()] = 1,
) -> None:
    """Make one input again, keep a copy, and show what comes of it."""
    import shutil
    import tempfile

    warnings.simplefilter("ignore")
    made = READERS[reader]
    with tempfile.TemporaryDirectory() as home:
        corpus = Corpus(made, Path(home))
        made.read(corpus.folder, corpus.out)
        shutil.rmtree(corpus.out, ignore_errors=True)
        with corpus.broken(random_of(made, seed, number)) as folder:
            shutil.copytree(folder, keep, symlinks=True, dirs_exist_ok=True)
            limit_memory()
            began = time.monotonic()
            kind, key, text = outcome(lambda: made.read(folder, corpus.out))
            print(f"{kind} {key} in {time.monotonic() - began:.2f} s\n{text}")


def _chosen(names: list[str] | None) -> list[str]:
    for name in names or ():
        if name not in READERS:
            raise SystemExit(f"no reader {name!r}; the readers are {', '.join(READERS)}")
    return names or list(READERS)


def _tell(name: str, tally: Tally) -> None:
    counts = ", ".join(f"{tally.counts[kind]:,} {kind}" for kind in OUTCOMES)
    print(f"{name}: {tally.inputs:,} inputs in {tally.seconds:.0f} s: {counts}", flush=True)
    for key, (number, text) in tally.bad.items():
        last = text.strip().splitlines()[-1:] or [""]
        print(f"    input {number}: {key}: {last[0][:200]}", flush=True)


def _print(tallies: dict[str, Tally]) -> None:
    table = Table("reader", *(f"[right]{name}" for name in ("inputs", *OUTCOMES, "slowest [s]", "peak [MB]")), box=None)
    for column in table.columns[1:]:
        column.justify = "right"
        column.header = str(column.header).removeprefix("[right]")
    for name, tally in tallies.items():
        counts = [f"{count:,}" for count in (tally.inputs, *(tally.counts[kind] for kind in OUTCOMES))]
        table.add_row(name, *counts, f"{tally.slowest[0]:.2f}", f"{tally.peak / 2**20:.0f}")
    Console(width=130).print(table)


if __name__ == "__main__":
    app()
