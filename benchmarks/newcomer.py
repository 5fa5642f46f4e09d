"""Every command line of README and docs, in order: `./run python benchmarks/newcomer.py [--whole] [PAGE ...]`.

By itself it is short: small pictures, few frames, and what this environment has installed; the tests do the same. With
`--whole` it is what a newcomer does: a fresh clone of what is committed, an environment that `./run` sets up from
nothing, and each line in full. The table of exceptions is benchmarks/documented/table.py.
"""

import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.documented.clone import ROOT, Clone, pages
from benchmarks.documented.lines import command_lines, is_mention


def main(
    page: Annotated[list[Path] | None, typer.Argument(help="Some of the pages; all if none is given.")] = None,
    whole: Annotated[
        bool, typer.Option("--whole", help="A fresh clone and environment, and nothing shortened.")
    ] = False,
) -> None:
    """Run them, print a line for each, and end by 1 if any went wrong."""
    console, faults = Console(highlight=False, width=160), 0
    with tempfile.TemporaryDirectory() as folder:
        clone = Clone(Path(folder), Path(folder) / "venv" if whole else None)
        for line in (line for file in pages() if not page or file.resolve() in map(Path.resolve, page)
                     for line in command_lines(file, ROOT)):  # fmt: skip
            try:
                if is_mention(line):
                    continue
            except typer.BadParameter as error:
                faults += 1
                console.print(f"{line}\n  {error}", markup=False)
                continue
            console.print(f"{line}", markup=False)
            done = clone.run(line)
            faults += bool(done.fault)
            why = ", ".join(done.step.why)
            result = done.fault or f"{done.seconds:.1f} s of processor time, run {done.step.how.value}"
            console.print(f"  {result}" + (f"; {why}: {done.step.text}" if why else ""), markup=False)
    console.print(f"{faults} went wrong")
    sys.exit(bool(faults))


if __name__ == "__main__":
    typer.run(main)
