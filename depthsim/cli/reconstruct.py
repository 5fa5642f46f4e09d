"""`depthsim reconstruct`: a scene from a recording that has none."""

import sys
from pathlib import Path
from typing import Annotated

import typer


def reconstruct(
    run: Annotated[Path, typer.Argument(help="The recording's folder, a run.")],
    out: Annotated[
        Path | None, typer.Option(help="A new folder with a copy of the run. [default: into the run]")
    ] = None,
    poses: Annotated[
        str | None, typer.Option(help="A TUM file, or 'odometry'. [default: groundtruth.txt, else odometry]")
    ] = None,
    voxel: Annotated[float, typer.Option(min=0.001, help="Edge of a voxel [m].")] = 0.02,
    depth_max: Annotated[float, typer.Option(min=0.1, help="What is farther is not fused [m].")] = 4.0,
    least_views: Annotated[int, typer.Option(min=1, help="Frames that must have seen a surface.")] = 5,
    tag: Annotated[str, typer.Option(help="Material of the mesh, of materials.yaml.")] = "cement",
) -> None:
    """Fuse a recording into a mesh, with masks of where it may be trusted: for `diagnose` without a CAD model."""
    from depthsim.reconstruction.reconstruct import reconstruct as make
    from depthsim.runs import Run

    there = Run.open(run, posed=False)
    for remark in there.remarks if poses is None else ():
        print(f"{run}: {remark}", file=sys.stderr)
    made = make(
        there,
        out,
        poses=poses,
        voxel=voxel,
        depth_max=depth_max,
        least_views=least_views,
        tag=tag,
        say=lambda text: print(text, file=sys.stderr),
    )
    faces = len(made.scene.faces)
    print(f"{out or run}: {faces:,} faces; trusted at {100 * made.trusted:.0f} % of the pixels with depth")
    hidden = "a bias that all views share, such as a wrong baseline, is in the mesh too and cannot be found by it"
    print(f"{out or run}: {hidden}", file=sys.stderr)
