"""The option ``--set`` of the benchmarks, which varies the thresholds of a diagnosis."""

from typing import Annotated

import typer

HELP = "A threshold of docs/thresholds.md in place of its default, such as select.most_causes=2."
Vary = Annotated[list[str] | None, typer.Option("--set", metavar="SECTION.NAME=VALUE", help=HELP)]
