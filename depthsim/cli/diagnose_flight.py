"""`depthsim diagnose-flight`: where logged forces differ from the model's, and which effects cause it."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.errors import InputError

if TYPE_CHECKING:
    from depthsim.gap.diagnosis import Diagnosis


def diagnose_flight(
    logs: Annotated[list[Path], typer.Argument(help="Flights: flight.csv files, or logs of NanoBench.")],
    vehicle: Annotated[str, typer.Option(help="f450, hummingbird, racer250, crazyflie, or a vehicle.yaml.")],
    out: Annotated[Path, typer.Option(help="A folder for diagnosis.json, vehicle.yaml and index.html.")],
    without: Annotated[
        list[str] | None, typer.Option(help="An effect to leave out of the bank, may be repeated.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the resampling; the same seed gives the same bytes.")] = 0,
) -> None:
    """Diagnose the gap between flights and the model of their vehicle."""
    from rich.console import Console

    from depthsim.flight.nanobench import read_any
    from depthsim.flight.vehicle import load_vehicle
    from depthsim.gap.flight import investigate, write_report
    from depthsim.gap.report.folder import check_report_folder

    seen: set[Path] = set()
    for path in logs:
        if path.resolve() in seen:
            raise InputError(path, "", "is given twice", "give each flight once")
        seen.add(path.resolve())
    check_report_folder(out)
    craft = load_vehicle(vehicle)
    flights = [read_any(path, drop_unmeasured=True) for path in logs]
    with Console(stderr=True).status("reading forces") as status:
        found = investigate(flights, craft, without or (), seed, status.update)
        status.update("pictures")
        write_report(out, found)
    _show(found.diagnosis)
    print(f"\nwritten to {out}: diagnosis.json, vehicle.yaml, index.html")


def _show(diagnosis: "Diagnosis") -> None:
    from rich.console import Console
    from rich.table import Table

    from depthsim.gap.flight.report import words

    console = Console()
    colour = {"no_gap": "green", "explained": "green", "partly_explained": "yellow", "unexplained": "red"}
    console.print(f"[bold {colour[diagnosis.verdict]}]{words.VERDICTS[diagnosis.verdict]}[/]", highlight=False)
    console.print(f"Gap: {words.gap_line(diagnosis)}", highlight=False)
    if diagnosis.causes:
        table = Table(
            "cause", "closes", "fitted (95 %)", "indistinguishable from", title="Causes, the one to act on first"
        )
        for cause in diagnosis.causes:
            closes = f"{cause.closed_fraction:.0%}"
            table.add_row(cause.effect, closes, words.parameters(cause), ", ".join(cause.indistinguishable_from) or "-")
        console.print(table)
    for title, cuts in (
        ("Where the forces differ", diagnosis.where),
        ("What is left", diagnosis.unexplained.where if diagnosis.unexplained else ()),
    ):
        if cuts:
            table = Table("axis", "most of it at", "share", "kind", title=title)
            for cut in cuts:
                table.add_row(cut.axis.replace("_", " "), words.place(cut), f"{cut.share_of_gap:.0%}", cut.what)
            console.print(table)
    if diagnosis.unexplained is not None:
        console.print(diagnosis.unexplained.description, highlight=False)
    for step in words.next_steps(diagnosis):
        console.print(f"next: {step}", highlight=False)
    for note in diagnosis.notes:
        console.print(f"note: {note}", highlight=False)
