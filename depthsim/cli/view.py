"""`depthsim view`: a scene or a run in the browser."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.cli.options import MaterialsFile, Tags, Units, Up, parse_tags

if TYPE_CHECKING:
    from depthsim.scene import Scene


def view(
    what: Annotated[str, typer.Argument(help="A scene (name, scene file or mesh), or the folder of a run.")],
    trajectory: Annotated[str | None, typer.Option(help="For a scene: as in `depthsim generate`.")] = None,
    sensor: Annotated[str, typer.Option(help="For a scene: a sensor profile.")] = "paper",
    tag: Tags = None,
    units: Units = None,
    up: Up = None,
    materials: MaterialsFile = None,
    host: Annotated[str, typer.Option(help="127.0.0.1 keeps the page on this machine.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="The first free port from here is taken.")] = 8080,
) -> None:
    """Show a scene or a run in the browser."""
    from depthsim.generate import open_sensor
    from depthsim.materials import load_materials
    from depthsim.presets import preset
    from depthsim.raycast import Caster
    from depthsim.runs import Run
    from depthsim.scenefile import load_scene
    from depthsim.sensor import load_profile
    from depthsim.trajectory import resolve_trajectory
    from viewer import RunSource, SceneSource, Viewer

    known = load_materials(materials)

    def load(where: str | Path) -> "Scene":
        return load_scene(where, tags=parse_tags(tag), units=units, up=up, materials=known)

    source: RunSource | SceneSource
    if (Path(what) / "depth.txt").is_file() or (Path(what) / "run.yaml").is_file():
        run = Run.open(Path(what))
        source = RunSource(run, load(run.scene) if run.scene else None)
    else:
        scene, profile = load(what), load_profile(sensor)
        camera = profile.camera or preset("d435")
        path = resolve_trajectory(trajectory, scene, camera.rate)
        source = SceneSource(open_sensor(profile, Caster(scene), camera, known), path)
    viewer = Viewer(source, f"depthsim: {Path(what).name}", host, port, known)
    print(f"{what} is shown at {viewer.url} (Ctrl-C ends it)", flush=True)
    viewer.run()
