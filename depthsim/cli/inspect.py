"""`depthsim inspect`: what a scene or a run holds."""

from pathlib import Path
from typing import Annotated

import typer

from depthsim.cli.options import MaterialsFile, Tags, Units, Up, parse_tags


def inspect(
    what: Annotated[str, typer.Argument(help="A scene (name, scene file or mesh), or the folder of a run.")],
    tag: Tags = None,
    units: Units = None,
    up: Up = None,
    materials: MaterialsFile = None,
) -> None:
    """Show what a scene or a run holds.

    Of a scene: materials, areas, sizes, holes and flipped faces. Of a run: camera, frames, depths and holes.
    """
    if (Path(what) / "depth.txt").is_file() or (Path(what) / "run.yaml").is_file():
        _inspect_run(Path(what))
        return
    from rich.console import Console

    from depthsim.materials import load_materials
    from depthsim.scenefile.inspect import inspect_scene
    from depthsim.scenefile.render import render

    report = inspect_scene(what, tags=parse_tags(tag), units=units, up=up, materials=load_materials(materials))
    Console().print(render(report))


def _inspect_run(path: Path) -> None:
    import numpy as np
    from rich.console import Console

    from depthsim.runs import Run
    from depthsim.runs.terminal import terminal_picture

    run = Run.open(path)
    camera, console = run.camera, Console()
    middle = len(run) // 2
    raw = run.depth_raw(middle)
    print(
        f"{path}: {len(run)} frames over {run.trajectory.duration:.2f} s, {camera.name} {camera.width}x{camera.height}"
    )
    holes, depth = float((raw == 0).mean()), run.depth(middle)
    returns = depth[depth > 0]
    span = f"{np.min(returns):.3f} to {np.max(returns):.3f} m" if returns.size else "no return"
    print(f"frame {middle}: depth {span}, {holes:.2%} holes")
    if console.is_terminal:
        console.print(terminal_picture(depth, min(console.width, 100)))
