"""`depthsim fit-drag`: the drag of a vehicle from its flights."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.cli.flags import in_flags
from depthsim.errors import InputError

if TYPE_CHECKING:
    from depthsim.flight.fit import DragFit, LawFit
    from depthsim.flight.vehicle import Vehicle


def fit_drag(
    logs: Annotated[list[Path], typer.Argument(help="Flights to fit: flight.csv files, or logs of NanoBench.")],
    out: Annotated[Path, typer.Option(help="A folder for vehicle.yaml, the table (CSV) and the picture (PNG).")],
    test: Annotated[
        list[Path] | None, typer.Option(help="A flight to judge on, may be repeated. [default: all take turns]")
    ] = None,
    vehicle: Annotated[str | None, typer.Option(help="A vehicle by name, or a vehicle.yaml.")] = None,
    mass: Annotated[float | None, typer.Option(help="Mass [kg]. [default: the vehicle's, or the log's]")] = None,
    law: Annotated[str | None, typer.Option(help="The drag law to write. [default: the best one]")] = None,
    cutoff: Annotated[float, typer.Option(help="Low-pass of both sides [Hz].")] = 4.0,
    from_velocity: Annotated[
        bool, typer.Option("--from-velocity", help="Take the force from velocities, not from the accelerometer.")
    ] = False,
) -> None:
    """Fit every drag law and the thrust map to flights, and judge them on flights they have not seen."""
    from depthsim.flight.fit import craft_of, words
    from depthsim.flight.fit import fit_drag as fit_all
    from depthsim.flight.fit.candidates import CANDIDATES
    from depthsim.flight.fit.report import PICTURE, TABLE, VEHICLE, fitted_vehicle, write_report
    from depthsim.flight.nanobench import read_any

    names = [candidate.name for candidate in CANDIDATES]
    if law is not None and law not in names:
        raise InputError("--law", law, "is no drag law", f"name one of {', '.join(names)}")
    if not 0.1 <= cutoff <= 50:
        raise InputError("--cutoff", "", f"is {cutoff:g}", "give a frequency from 0.1 to 50 Hz")
    _check_once([*logs, *(test or [])])
    train, tests = [read_any(path) for path in logs], [read_any(path) for path in test or []]
    craft = craft_of([*train, *tests], vehicle, mass)
    fit = fit_all(train, craft.vehicle, tests, cutoff=cutoff, from_velocity=from_velocity)
    mass_from = in_flags(craft.mass_from)
    fitted = fitted_vehicle(fit, mass_from, law)
    write_report(out, fit, fitted)
    _show(fit)
    print(f"mass: {craft.vehicle.mass:.4g} kg ({mass_from})")
    for note in (*craft.notes, *words.notes(fit, [*train, *tests])):
        print(f"note: {in_flags(note)}")
    print(f"\nwritten to {out}: {VEHICLE} ({fitted.drag.law}), {TABLE}, {PICTURE}")


def _check_once(paths: list[Path]) -> None:
    seen: set[Path] = set()
    for path in paths:
        if path.resolve() in seen:
            raise InputError(path, "", "is given twice", "give each flight once, to fit or to test")
        seen.add(path.resolve())


def _show(fit: "DragFit") -> None:
    from rich.console import Console
    from rich.table import Table

    from depthsim.flight.fit import words

    console = Console()
    split = fit.laws[0].judgement.splits
    table = Table(title=f"{fit.vehicle.name}: RMSE on unseen flights, m/s², {split} split{'s' * (split > 1)}")
    table.add_column("law")
    for name in ("coefficient", "95 % interval", "at 1 m/s"):
        table.add_column(name, justify="right")
    for name in ("removed", "worst", "start", "kept"):
        table.add_column(name, justify="right")
    for law in fit.laws:
        mark = " ◀" if law.law.name == fit.best else " =" if law.law.name in fit.ties else ""
        judged = law.judgement
        start = f"{judged.start.mean:.4f}" if judged.start else ""
        errors = (f"{judged.removed.mean:.4f}", f"{judged.removed.worst:.4f}", start, f"{judged.kept.mean:.4f}")
        table.add_row(law.law.name + mark, *_figures(law, fit.vehicle), *errors)
    console.print(table)
    print("◀ the best, = tied with it. " + words.residual(fit) + ".")
    print(words.offsets(fit))
    if fit.thrust_map is not None:
        print(words.thrust_map(fit.thrust_map))


def _figures(law: "LawFit", vehicle: "Vehicle") -> tuple[str, str, str]:
    """Coefficients, intervals and the drag over mass at 1 m/s in a hover [m/s²], a line for each that is known."""
    import numpy as np

    hover = np.full((1, vehicle.rotors.count), vehicle.weight / vehicle.rotors.count)
    rows = []
    for index, name in enumerate(law.law.names):
        if not law.known[index]:
            continue
        along = np.eye(3)[[law.law.along[index] or 0]]
        unit = law.law.make(np.eye(len(law.law.names))[index].tolist())
        force = -float(np.sum(unit.force(vehicle, along, np.zeros((1, 3)), hover) * along)) * law.values[index]
        coefficient = f"{name} {law.values[index]:.4g} {law.law.unit}"
        rows.append((coefficient, f"{law.low[index]:.4g} to {law.high[index]:.4g}", f"{force / vehicle.mass:.3f}"))
    first, second, third = ("\n".join(column) for column in zip(*rows, strict=True)) if rows else ("", "", "")
    return first, second, third
