"""`depthsim report`: draw the page of a report again."""

from pathlib import Path
from typing import Annotated

import typer


def report(
    folder: Annotated[Path, typer.Argument(metavar="REPORT", help="A folder that diagnose has written.")],
) -> None:
    """Draw index.html of a report again, without simulating again."""
    from depthsim.gap.report.redraw import redraw

    print(redraw(folder))
