"""Drag fitted to real flights: every six of NanoBench's eight, tested on the other two, beside its README's figures.

./run python benchmarks/flight_fit.py
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from depthsim.flight.fit import craft_of, fit_drag
from depthsim.flight.fit.fit import DragFit
from depthsim.flight.fit.words import offsets, residual, thrust_map
from depthsim.flight.log import FlightLog
from depthsim.flight.nanobench import read_any

FLIGHTS = Path(__file__).resolve().parents[2] / "shared" / "data" / "flight_nanobench"
AIM = 0.045
_README = {"none": "0.22", "linear": "0.036 to 0.039"}


def main() -> None:
    """Print the rows, or that the flights are not there."""
    console = Console(width=None if sys.stdout.isatty() else 120)
    files = sorted(FLIGHTS.glob("*.csv"))
    if len(files) < 8:
        console.print(f"NanoBench: left out, the flights are not in {FLIGHTS.parent.name}/{FLIGHTS.name}")
        return
    logs = [read_any(file) for file in files]
    craft = craft_of(logs)
    fit = fit_drag(logs, craft.vehicle)
    console.print(_errors(fit))
    console.print(_figures(fit))
    print(f"What is compared: {residual(fit)}; {len(fit.speed)} samples. {offsets(fit)}")
    print(thrust_map(fit.thrust_map) if fit.thrust_map else "no thrust map")
    print(_worst(fit, logs))


def _errors(fit: DragFit) -> Table:
    splits = fit.laws[0].judgement.splits
    table = Table(
        title=f"NanoBench, lateral specific force, 4 Hz, RMSE in m/s² on two unseen flights, all {splits} splits"
    )
    table.add_column("law")
    for name in ("removed: mean", "worst", "from start: mean", "worst", "kept: mean", "worst", "its README", "aim"):
        table.add_column(name, justify="right")
    for law in fit.laws:
        judged = law.judgement
        scores = [judged.removed, judged.start or judged.removed, judged.kept]
        cells = [f"{value:.4f}" for score in scores for value in (score.mean, score.worst)]
        name = law.law.name
        aim = "" if name in ("none", "airsim_quadratic") else f"< {AIM} {'yes' if judged.removed.mean < AIM else 'no'}"
        table.add_row(name, *cells, _README.get(name, ""), aim)
    return table


def _figures(fit: DragFit) -> Table:
    mass = fit.vehicle.mass
    linear = fit.law("linear")
    scales = np.array([part.scale for part in fit.per_flight])
    table = Table("what", "here", "its README", title="What the flights show")
    for index, (name, theirs) in enumerate((("x", "0.39 and 0.40"), ("y", ""))):
        value, low, high = (bound[index] / mass for bound in (linear.values, linear.low, linear.high))
        table.add_row(f"D/m along {name}, 1/s", f"{value:.3f} (95 %: {low:.3f} to {high:.3f})", theirs)
    if fit.exponent is not None:
        span = f"T^{fit.exponent.value:.2f} (95 %: {fit.exponent.low:.2f} to {fit.exponent.high:.2f})"
        table.add_row("drag ∝", span, "")
        table.add_row("thrust varies by", f"{fit.exponent.variation:.1%}", "2.4 %")
    table.add_row("laws that tie", ", ".join((fit.best, *fit.ties)), "kT + b and linear")
    table.add_row("thrust scale from flight to flight", f"{scales.std(ddof=1):.1%}", "1.2 %")
    rows = {
        "offset, accelerometer against model, m/s²": ([part.offset for part in fit.per_flight], ""),
        "offset, accelerometer against velocities, m/s²": (
            [part.against_velocity for part in fit.per_flight if part.against_velocity is not None],
            "(0.15, 0.03), or (0.4, -0.3)",
        ),
    }
    for what, (offsets_found, theirs) in rows.items():
        low, high = np.min(offsets_found, axis=0), np.max(offsets_found, axis=0)
        table.add_row(what, f"x {low[0]:.2f} to {high[0]:.2f}, y {low[1]:.2f} to {high[1]:.2f}", theirs)
    return table


def _worst(fit: DragFit, logs: list[FlightLog]) -> str:
    by_split = fit.law("linear").judgement.by_split
    under = sum(error < AIM for error in by_split.values())
    pair = [logs[index] for index in max(by_split, key=lambda split: by_split[split])]
    own = float((fit_drag(pair, fit.vehicle).residuals["linear"] ** 2).mean() ** 0.5)
    names = " and ".join(Path(log.source).name for log in pair)
    return (
        f"Linear drag is under {AIM} m/s² in {under} of {len(by_split)} splits. The worst is {names}: even fitted to "
        f"these two themselves it leaves {own:.4f} m/s²."
    )


if __name__ == "__main__":
    main()
