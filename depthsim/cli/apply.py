"""`depthsim apply`: what a camera would store of clean depth from any simulator."""

from pathlib import Path
from typing import Annotated

import typer

from depthsim.cli.options import MaterialsFile


def apply(
    profile: Annotated[str, typer.Argument(help="A profile: d435, paper, d435_filtered, or a YAML file.")],
    source: Annotated[
        Path, typer.Argument(metavar="IN", help="A folder of clean depth: 16-bit .png in units, or .npy in metres.")
    ],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="A new folder, for files of the same names in units.")],
    camera: Annotated[
        str | None, typer.Option(help="A camera.yaml, or a preset such as d435. [default: IN/camera.yaml]")
    ] = None,
    material: Annotated[str, typer.Option(help="Of all surfaces: a tag of materials.yaml.")] = "cement",
    materials: MaterialsFile = None,
    seed: Annotated[int, typer.Option(help="The same seed gives the same bytes.")] = 0,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads. [default: all cores]")] = None,
) -> None:
    """Make measured depth of clean depth: the noise and the holes alone, for a simulator that you have."""
    from depthsim.runs.apply import apply_folder

    done = apply_folder(
        profile, source, out, camera=camera, material=material, materials=materials, seed=seed, threads=threads
    )
    print(f"{out}: {done} frames")
