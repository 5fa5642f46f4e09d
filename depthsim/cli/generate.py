"""`depthsim generate`: a run from a scene."""

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.cli.options import MaterialsFile, Tags, Units, Up, parse_resolution, parse_tags
from depthsim.errors import InputError

if TYPE_CHECKING:
    from depthsim.camera import Camera
    from depthsim.flight.spec import Ride
    from depthsim.runs import Run
    from depthsim.runs.generate import Generated
    from depthsim.scene import Scene
    from depthsim.sensor import Profile


def generate(
    out: Annotated[Path, typer.Option(help="The run's folder; the same command finishes a run that was broken off.")],
    scene: Annotated[
        str | None, typer.Argument(help="A built-in scene, a scene file, a mesh, or a folder with one.")
    ] = None,
    trajectory: Annotated[
        str | None, typer.Option(help="A name in the scene, TUM file, YAML file or shape:key=value,… [default: first]")
    ] = None,
    sensor: Annotated[str, typer.Option(help="A profile: paper, clean, active_stereo, or a YAML file.")] = "paper",
    like: Annotated[Path | None, typer.Option(help="Take scene, poses, stamps and camera from this run.")] = None,
    fly: Annotated[
        Path | None, typer.Option(help="Ride on a flight: the folder that `depthsim fly` wrote, or its YAML file.")
    ] = None,
    camera: Annotated[str | None, typer.Option(help="A preset such as d455, or a camera.yaml.")] = None,
    resolution: Annotated[str | None, typer.Option(metavar="WxH", help="Of a preset, such as 424x240.")] = None,
    rate: Annotated[float | None, typer.Option(help="Frames a second, in place of the camera's.")] = None,
    frames: Annotated[int | None, typer.Option(min=1, help="Stop after this many frames.")] = None,
    seed: Annotated[int, typer.Option(help="The same seed gives the same bytes.")] = 0,
    only_depth: Annotated[bool, typer.Option("--only-depth", help="No clean depth, materials and rgb.")] = False,
    normals: Annotated[bool, typer.Option("--normals", help="Surface normals too.")] = False,
    instances: Annotated[
        bool, typer.Option("--instances", help="Pictures of which object is where, too; made where objects move.")
    ] = False,
    ir: Annotated[bool, typer.Option("--ir", help="The two infrared images of active stereo, too.")] = False,
    tag: Tags = None,
    units: Units = None,
    up: Up = None,
    materials: MaterialsFile = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads. [default: all cores]")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace another run in the same folder.")] = False,
    preview: Annotated[bool, typer.Option("--preview", help="Write preview.png, the run at a glance, too.")] = False,
) -> None:
    """Make a run: depth images with poses, as TUM RGB-D."""
    from depthsim.materials import load_materials
    from depthsim.runs import Run
    from depthsim.runs.generate import DEFAULT_STREAMS, IR_STREAMS
    from depthsim.runs.generate import generate as make
    from depthsim.runs.pose_reference import with_poses_of_pictures
    from depthsim.scenefile import load_scene
    from depthsim.sensor import load_profile
    from depthsim.trajectory import load_trajectory

    known = load_materials(materials)
    model = None
    if like:
        model = Run.open(like)
        if model.camera.aligned:  # else the diagnosis need not be loaded
            from depthsim.gap.depth.data.left_imager import with_left_imager

            model = with_left_imager(model)
    profile = load_profile(sensor)
    eye = _camera(camera, parse_resolution(resolution), rate, profile, model)
    place = load_scene(_scene(scene, model), tags=parse_tags(tag), units=units, up=up, materials=known)
    ride = _ride(fly, trajectory, like, place)
    truth = None
    if ride:
        path = ride.camera.sampled(eye.rate, frames)
    elif model and trajectory is None:
        model = with_poses_of_pictures(model, place)
        path, truth = model.trajectory.head(frames), model.dense
        for remark in model.remarks:
            print(f"{like}: {remark}", file=sys.stderr)
    else:
        path = load_trajectory(trajectory, place, eye.rate, frames)
    with_objects = instances or (bool(place.movers) and not only_depth)
    extra = (*(("normal",) if normals else ()), *(("instance",) if with_objects else ()), *(IR_STREAMS if ir else ()))
    streams = (*(("depth",) if only_depth else DEFAULT_STREAMS), *extra)
    begin = time.monotonic()
    with _Progress() as progress:
        made = make(
            place, path, eye, profile, out, truth=truth, materials=known, seed=seed, streams=streams, threads=threads,
            overwrite=overwrite, progress=progress,
        )  # fmt: skip
    if ride:
        ride.write(out)
        if ride.contact:
            print(f"{out}: the flight {ride.contact}; it goes on as if nothing were there", file=sys.stderr)
    _show(made, time.monotonic() - begin, preview)


def _ride(fly: Path | None, trajectory: str | None, like: Path | None, scene: "Scene") -> "Ride | None":
    """The flight that carries the camera."""
    if fly is None:
        return None
    from depthsim.flight.spec import open_ride

    if trajectory is not None or like is not None:
        raise InputError("generate", "", "has --fly and another trajectory", "leave out --trajectory and --like")
    return open_ride(fly, scene)


def _scene(scene: str | None, like: "Run | None") -> str | Path:
    if scene is not None:
        return scene
    if like is None:
        raise InputError("generate", "", "no scene is given", "name one, such as `depthsim generate office --out RUN`")
    if like.scene is None:
        raise InputError(like.path, "", "holds no scene", "name one: `depthsim generate SCENE --like RUN --out SIM`")
    return like.scene


def _camera(
    choice: str | None, size: tuple[int, int] | None, rate: float | None, profile: "Profile", like: "Run | None"
) -> "Camera":
    """The camera that is asked for, or the one that stores the other run's pictures, or the profile's, or the D435."""
    from depthsim.presets import preset, resolve_camera
    from depthsim.sensor.pipeline import camera_for

    if choice is None and like is not None:
        camera = camera_for(like.camera, profile.effects)
    elif choice is None:
        camera = profile.camera or preset("d435")
    else:
        camera = resolve_camera(choice)
    if size is not None:
        known = preset(camera.name, *size)
        camera = known.aligned_to_color() if camera.aligned else known
    return camera if rate is None else camera.model_copy(update={"rate": rate})


class _Progress:
    """A bar with rate and time left on a terminal; nothing elsewhere."""

    def __enter__(self) -> "_Progress":
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        console = Console(stderr=True)
        rate = TextColumn("{task.fields[rate]:.1f} frames/s")
        self._bar = Progress(
            TextColumn("frames"), BarColumn(), MofNCompleteColumn(), rate, TimeRemainingColumn(),
            console=console, disable=not console.is_terminal, transient=True,
        )  # fmt: skip
        self._task = self._bar.add_task("", total=None, rate=0.0)
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def __call__(self, done: int, total: int) -> None:
        if self._bar.tasks[0].total is None:
            self._first, self._begin = done, time.monotonic()
        rate = (done - self._first) / max(time.monotonic() - self._begin, 1e-9)
        self._bar.update(self._task, completed=done, total=total, rate=rate)


def _show(made: "Generated", seconds: float, preview: bool) -> None:
    """One line of what was done, and the pictures that are asked for; on a terminal, one frame of the run."""
    from depthsim.runs import Run

    speed = f" in {seconds:.1f} s, {made.made / seconds:.1f} frames/s" if made.made else ""
    print(f"{made.path}: {made.frames} frames, {made.made} made now{speed}")
    if preview:
        from depthsim.runs import preview as sheet

        sheet.preview(Run.open(made.path), made.path / "preview.png")
        print(f"{made.path / 'preview.png'}: the run at a glance")
    if sys.stdout.isatty():
        from rich.console import Console

        from depthsim.runs.terminal import terminal_picture

        run, console = Run.open(made.path), Console()
        middle = len(run) // 2
        console.print(terminal_picture(run.depth(middle), min(console.width, 100)))
        print(f"depth of frame {middle}; look closer with `depthsim view {made.path}`")
