"""What a fit is written as: the entries for materials.yaml, the curve as CSV, a picture."""

import csv
import io
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import yaml
from pydantic import ValidationError

from depthsim.material_fit.curve import Curve, Point
from depthsim.material_fit.fit import MaterialFit, SpreadKind
from depthsim.materials import Material
from depthsim.runs.storing import make_folder, write_whole

ENTRIES, TABLE, PICTURE = "fitted_materials.yaml", "fitted_materials.csv", "fitted_materials.png"


def entry(fit: MaterialFit, curve: Curve) -> str | None:
    """The entry for materials.yaml, or None where m is no value that it may hold, such as one below 0."""
    try:
        Material.model_validate({"m": fit.m})
    except ValidationError:
        return None
    m, low, high = fit.m_text
    source = (
        f"depthsim fit-material on {curve.source}: {fit.n} distances from {fit.span[0]:.2f} to {fit.span[1]:.2f} m, "
        f"95 % interval {low} to {high}, floor {fit.floor:.4g} m"
        f"{' fitted too' if fit.floor_ci95 else ''}, R² {fit.r2:.2f}, RMSE {fit.rmse * 1000:.3g} mm"
        f"{'; std ∝ d² fits better' if fit.better == 'quadratic' else ''}"
    )
    text = yaml.safe_dump({fit.tag: {"m": float(m), "source": source}}, allow_unicode=True, width=110)
    if fit.floor_ci95:
        text = f"# The profile needs this floor too: material_noise: {{floor: {fit.floor:.4g}}}\n{text}"
    return str(text)


def curve_csv(curves: Sequence[Curve], fits: Sequence[MaterialFit]) -> str:
    """All points of some curves and the laws there, one row each; lengths in metres."""
    out = io.StringIO()
    names = [field.name for field in fields(Point)]
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["tag", *names, "law_std", "quadratic_std"])
    for curve, fit in zip(curves, fits, strict=True):
        for point, law, quadratic in zip(curve.points, fit.law.curve, fit.quadratic.curve, strict=True):
            values = [getattr(point, name) for name in names]
            writer.writerow([curve.tag, *(f"{value:.6g}" for value in (*values, law, quadratic))])
    return out.getvalue()


def write_report(
    folder: Path, entries: str, curves: Sequence[Curve], fits: Sequence[MaterialFit], spread: SpreadKind = "spatial"
) -> None:
    """Write the three files into ``folder``; each appears whole or not at all."""
    from depthsim.material_fit.plot import plot_png

    contents = {
        PICTURE: plot_png(curves, fits, spread),
        TABLE: curve_csv(curves, fits).encode(),
        ENTRIES: entries.encode(),
    }
    make_folder(folder)
    for name, content in contents.items():
        write_whole(folder / name, content)
