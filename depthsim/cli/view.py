"""`depthsim view`: a scene, a run or a report in the browser."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.cli.options import MaterialsFile, Tags, Units, Up, parse_tags

if TYPE_CHECKING:
    from depthsim.scene import Scene
    from viewer import Stage


def view(
    what: Annotated[
        str, typer.Argument(help="A scene (name, scene file or mesh), the folder of a run, or that of a report.")
    ],
    trajectory: Annotated[str | None, typer.Option(help="For a scene: as in `depthsim generate`.")] = None,
    sensor: Annotated[
        str, typer.Option(help="The sensor profile to begin with; a report begins with its own.")
    ] = "paper",
    tag: Tags = None,
    units: Units = None,
    up: Up = None,
    materials: MaterialsFile = None,
    save_to: Annotated[Path, typer.Option(help="The one folder that the page may save files in.")] = Path(
        "viewer_files"
    ),
    port: Annotated[int, typer.Option(min=0, max=65535, help="The first free port from here is taken.")] = 8080,
) -> None:
    """Show a scene, a run or a report in the browser, and turn the sensor's knobs.

    The page is for this machine alone; from another one: ssh -L 8080:localhost:8080 THIS_MACHINE.
    """
    from depthsim.materials import load_materials
    from depthsim.scenefile import load_scene
    from viewer import Viewer, open_stage
    from viewer.opening import is_recorded

    known = load_materials(materials)

    def load(where: str | Path) -> "Scene":
        return load_scene(where, tags=parse_tags(tag), units=units, up=up, materials=known)

    def open_it() -> "Stage":
        return open_stage(what, trajectory=trajectory, sensor=sensor, materials=known, scene_loader=load)

    if not is_recorded(what):  # of a run or a report the page itself says what is wrong, so that it can be fixed
        stage = open_it()
        viewer = Viewer(lambda: stage, f"depthsim · {Path(what).name}", port, save_to)
    else:
        viewer = Viewer(open_it, f"depthsim · {Path(what).name}", port, save_to)
    if viewer.error is not None:
        print(viewer.error, file=sys.stderr, flush=True)
    viewer.run(f"{what} is shown at {viewer.url} (Ctrl-C ends it)")
    if viewer.error is not None:
        raise typer.Exit(2)
