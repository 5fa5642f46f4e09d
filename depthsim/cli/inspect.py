"""`depthsim inspect`: what a scene, a run or a sweep holds."""

import os
from pathlib import Path
from typing import Annotated

import typer

from depthsim.cli.options import MaterialsFile, Tags, Units, Up, parse_tags


def inspect(
    what: Annotated[str, typer.Argument(help="A scene (name, scene file or mesh), or the folder of a run or sweep.")],
    tag: Tags = None,
    units: Units = None,
    up: Up = None,
    materials: MaterialsFile = None,
    draw: Annotated[int | None, typer.Option(min=0, help="Of a sweep: show this run. [default: one at random]")] = None,
    preview: Annotated[Path | None, typer.Option(help="Of a sweep: write that run's pictures to this PNG.")] = None,
) -> None:
    """Show what a scene, a run or a sweep holds.

    Of a scene: materials, areas, sizes, holes and flipped faces. Of a run: camera, frames, depths and holes. Of a
    sweep: progress, rates, failures, and a run at random with what was drawn for it.
    """
    if "://" in what or (Path(what) / "plan.json").is_file():
        _inspect_sweep(what, draw, preview)
        return
    if any(os.path.isfile(Path(what) / name) for name in ("depth.txt", "run.yaml")):
        _inspect_run(Path(what))
        return
    from rich.console import Console

    from depthsim.cli.scene_tables import render
    from depthsim.materials import load_materials
    from depthsim.scenefile.inspect import inspect_scene

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
    for remark in run.remarks:
        print(remark)
    holes, depth = float((raw == 0).mean()), run.depth(middle)
    returns = depth[depth > 0]
    span = f"{np.min(returns):.3f} to {np.max(returns):.3f} m" if returns.size else "holes alone"
    print(f"frame {middle}: depth {span}, {holes:.2%} holes")
    if console.is_terminal:
        console.print(terminal_picture(depth, min(console.width, 100)))


def _inspect_sweep(what: str, draw: int | None, preview: Path | None) -> None:
    from rich.console import Console

    from depthsim.errors import InputError
    from depthsim.runs import preview as sheet
    from depthsim.runs.terminal import terminal_picture
    from depthsim.sweep.show import State

    state, console = State.read(what), Console()
    print(state.text())
    if draw is not None and not state.is_whole(draw):
        raise InputError(what, f"run {draw}", "is not whole", "leave out --draw for one that is")
    index = state.pick() if draw is None else draw
    if index is None:
        return
    print(state.draw_text(index))
    if console.is_terminal or preview is not None:
        with state.open_run(index) as run:
            if console.is_terminal:
                console.print(terminal_picture(run.depth(len(run) // 2), min(console.width, 100)))
            if preview is not None:
                sheet.preview(run, preview)
                print(f"{preview}: that run at a glance")
