"""`depthsim fit-material`: the m of a material from recorded depth."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.cli.flags import in_flags
from depthsim.cli.options import MaterialsFile, Units, Up, parse_tags
from depthsim.errors import InputError

if TYPE_CHECKING:
    from depthsim.material_fit import Curve, MaterialFit

_MOST_ROWS = 24


class _Spread(StrEnum):
    spatial = "spatial"
    temporal = "temporal"


def fit_material(
    paths: Annotated[
        list[Path],
        typer.Argument(
            help="Folders of depth PNGs of a flat wall, named by distance (0.50m, 150cm), or of such; or a run."
        ),
    ],
    tag: Annotated[
        list[str] | None,
        typer.Option("--tag", help="Walls: the wall's material. A run: NAME=TAG, as for generate."),
    ] = None,
    scene: Annotated[str | None, typer.Option(help="The scene of the run. By default the one in its folder.")] = None,
    camera: Annotated[
        str | None, typer.Option(help="Walls: a preset or camera.yaml. By default the camera.yaml there.")
    ] = None,
    depth_scale: Annotated[float | None, typer.Option(help="Walls: metres per unit of the 16-bit depth.")] = None,
    roi: Annotated[float, typer.Option(help="Walls: the central share of the image to look at.")] = 0.5,
    spread: Annotated[
        _Spread, typer.Option(help="Walls: fit the std over the image, or over the frames.")
    ] = _Spread.spatial,
    width: Annotated[float, typer.Option("--bin", help="Run: width of a step of range, in metres.")] = 0.1,
    max_incidence: Annotated[
        float, typer.Option(help="Run: leave out surfaces more tilted than this, in degrees.")
    ] = 70.0,
    fit_floor: Annotated[bool, typer.Option("--fit-floor", help="Fit the 0.005 m at zero range too.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="A folder for the entry, the curve (CSV) and its picture (PNG).")
    ] = None,
    materials: MaterialsFile = None,
    units: Units = None,
    up: Up = None,
) -> None:
    """Find m of std = 0.005 m · exp(m·d) from recordings of a wall, or from a run with its scene."""
    from depthsim.material_fit.fit import PAPER_FLOOR
    from depthsim.material_fit.material import fit_curves, is_run
    from depthsim.material_fit.report import ENTRIES, PICTURE, TABLE, entry, write_report

    if not (depth_scale is None or 0 < depth_scale < 1):
        raise InputError("--depth-scale", "", f"is {depth_scale:g}", "give metres per unit, such as 0.001")
    if scene is not None or any(map(is_run, paths)):
        measured = _from_run(paths, scene, tag, width, max_incidence, materials, units, up)
    else:
        measured = [_from_walls(paths, tag, camera, depth_scale, roi)]
    pairs, faults = fit_curves(measured, floor=None if fit_floor else PAPER_FLOOR, spread=spread.value)
    curves, fits = [curve for curve, _ in pairs], [fit for _, fit in pairs]
    for curve, fit in pairs:
        _show(curve, fit)
    for fault in faults:
        print(f"no fit: {fault}")
    entries = "".join(filter(None, (entry(fit, curve) for fit, curve in zip(fits, curves, strict=True))))
    if entries:
        print(f"\nfor materials.yaml:\n{entries}", end="")
    if out is not None:
        write_report(out, entries or "{}\n", curves, fits, spread.value)
        print(f"\nwritten to {out}: {ENTRIES}, {TABLE}, {PICTURE}")


def _from_walls(
    paths: list[Path], tag: list[str] | None, camera: str | None, depth_scale: float | None, roi: float
) -> "Curve":
    from depthsim.material_fit import measure_wall
    from depthsim.presets import resolve_camera

    if not tag or len(tag) > 1 or "=" in tag[0] or not tag[0].strip():
        given = ", ".join(tag) if tag else "not given"
        raise InputError("--tag", "", f"is {given}", "name the one material of the wall, such as --tag cement")
    eye = resolve_camera(camera) if camera else None
    return measure_wall(paths, tag[0], camera=eye, depth_scale=depth_scale, roi=roi)


def _from_run(
    paths: list[Path], scene: str | None, tag: list[str] | None, width: float, max_incidence: float,
    materials: Path | None, units: str | None, up: str | None,
) -> "list[Curve]":  # fmt: skip
    from depthsim.material_fit import measure_run
    from depthsim.materials import load_materials
    from depthsim.runs import Run
    from depthsim.scenefile import load_scene

    if len(paths) > 1:
        raise InputError(paths[1], "", "is given beside a run", "give one run, or folders of wall captures")
    run = Run.open(paths[0])
    place: str | Path | None = scene or run.scene
    if place is None:
        raise InputError(run.path, "", "holds no scene", "name it with --scene")
    loaded = load_scene(place, tags=parse_tags(tag), units=units, up=up, materials=load_materials(materials))
    return measure_run(run, loaded, width=width, most_incidence=max_incidence)


def _show(curve: "Curve", fit: "MaterialFit") -> None:
    """The points as a table, evenly thinned out, and the result in words."""
    import numpy as np
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from depthsim.material_fit import words

    columns = {
        "distance [m]": (curve.column("distance"), "{:.2f}"),
        "std [mm]": (curve.column("std") * 1000, "{:.2f}"),
        "1.48 MAD [mm]": (curve.column("robust_std") * 1000, "{:.2f}"),
        "temporal [mm]": (curve.column("temporal_std") * 1000, "{:.2f}"),
        "law [mm]": (fit.law.curve * 1000, "{:.2f}"),
        "mean error [mm]": (curve.column("bias") * 1000, "{:+.2f}"),
        "incidence [°]": (curve.column("incidence"), "{:.0f}"),
        "holes": (curve.column("holes"), "{:.1%}"),
        "outliers": (curve.column("outliers"), "{:.2%}"),
        "depths": (curve.column("pixels"), "{:.0f}"),
        "independent": (curve.column("count"), "{:.0f}"),
    }
    columns = {name: column for name, column in columns.items() if np.isfinite(column[0]).any()}
    table = Table(title=escape(f"{curve.tag}, from {curve.source}"))
    for name in columns:
        table.add_column(escape(name), justify="right")
    for row in np.unique(np.linspace(0, fit.n - 1, min(fit.n, _MOST_ROWS)).round().astype(int)):
        table.add_row(*(form.format(values[row]) for values, form in columns.values()))
    console = Console()
    (console if console.is_terminal else Console(width=150)).print(table)
    print(words.result(fit))
    print(words.comparison(fit, curve.focal_baseline))
    for warning in words.warnings(curve, fit):
        print(f"note: {in_flags(warning)}")
