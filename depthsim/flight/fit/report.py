"""What a fit is written as: vehicle.yaml, all coefficients as CSV, a picture."""

import csv
import io
from pathlib import Path

import numpy as np

from depthsim.flight.fit.fit import DragFit
from depthsim.flight.vehicle import ThrustCurve, Vehicle
from depthsim.runs.storing import make_folder, write_whole

VEHICLE, TABLE, PICTURE = "vehicle.yaml", "drag_fit.csv", "drag_fit.png"


def fitted_vehicle(fit: DragFit, mass_from: str, law: str | None = None) -> Vehicle:
    """The vehicle with the drag of ``law``, the best one by default, and the thrust map. Negative drag becomes none."""
    chosen = fit.law(law or fit.best)
    figures = ", ".join(
        f"{name} {value:.4g} (95 %: {low:.4g} to {high:.4g})"
        for name, value, low, high, known in zip(
            chosen.law.names, chosen.values, chosen.low, chosen.high, chosen.known, strict=True
        )
        if known
    )
    names = ", ".join(Path(part.source).name for part in fit.per_flight if not part.tested)
    judgement = chosen.judgement
    sources = {
        **fit.vehicle.sources,
        "mass": mass_from,
        "drag": f"depthsim fit-drag on {names}: {figures}; lateral RMSE on unseen flights {judgement.removed.mean:.4f} "
        f"m/s², offset removed, {fit.cutoff:g} Hz",
    }
    curve = fit.vehicle.thrust_curve
    if fit.thrust_map is not None:
        kind, full, coefficients = fit.thrust_map.curve(fit.vehicle.mass)
        curve = ThrustCurve(input=kind, full_scale=full, coefficients=tuple(_rounded(value) for value in coefficients))
        given = fit.thrust_map.input.formula
        sources["thrust_curve"] = f"the same flights, input {given}; thrust over mass times the mass above"
    keys = {
        **fit.vehicle.model_dump(),
        "name": f"{fit.vehicle.name}, fitted",
        "drag": chosen.law.make([_rounded(max(value, 0.0)) for value in chosen.values]).model_dump(),
        "thrust_curve": None if curve is None else curve.model_dump(),
        "sources": sources,
    }
    return Vehicle.model_validate(keys)


def coefficients_csv(fit: DragFit) -> str:
    """One row for each coefficient of each law; what is not known is left empty."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    head = ["law", "coefficient", "unit", "value", "low95", "high95"]
    writer.writerow([*head, "rmse_removed", "rmse_removed_worst", "rmse_start", "rmse_kept", "best_or_tied"])
    for law in fit.laws:
        judged = law.judgement
        start = judged.start.mean if judged.start else np.nan
        errors = [judged.removed.mean, judged.removed.worst, start, judged.kept.mean]
        tail = [*map(_cell, errors), "yes" if law.law.name in (fit.best, *fit.ties) else "no"]
        rows = zip(law.law.names, law.values, law.low, law.high, law.known, strict=True)
        for name, value, low, high, known in rows:
            figures = (value, low, high) if known else (np.nan,) * 3
            writer.writerow([law.law.name, name, law.law.unit, *map(_cell, figures), *tail])
        if not law.law.names:
            writer.writerow([law.law.name, "", "", "", "", "", *tail])
    return out.getvalue()


def write_report(folder: Path, fit: DragFit, vehicle: Vehicle) -> None:
    """Write the three files into ``folder``; each appears whole or not at all."""
    from depthsim.flight.fit.plot import plot_png

    contents = {
        PICTURE: plot_png(fit),
        TABLE: coefficients_csv(fit).encode(),
        VEHICLE: vehicle.to_yaml().encode(),
    }
    make_folder(folder)
    for name, content in contents.items():
        write_whole(folder / name, content)


def _cell(value: float) -> str:
    return f"{value:.6g}" if np.isfinite(value) else ""


def _rounded(value: float) -> float:
    return float(f"{value:.5g}")
