"""`depthsim diagnose`: where recording and simulation differ, and why."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.cli.options import MaterialsFile, Tags, Units, Up, parse_tags
from depthsim.errors import InputError

if TYPE_CHECKING:
    from depthsim.gap.depth.findings import Findings
    from depthsim.gap.depth.report.write import Drawn
    from depthsim.materials import Materials
    from depthsim.scene import Scene


def diagnose(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN [OTHER]", help="A recording; or two of one scene, to be compared.")
    ],
    out: Annotated[Path, typer.Option(help="The report's folder; an earlier report there is replaced.")],
    scene: Annotated[str | None, typer.Option(help="Scene of the recording. [default: the run's own]")] = None,
    sensor: Annotated[
        str | None, typer.Option(help="The profile to be compared with. [default: the run's own sensor.yaml, or paper]")
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(metavar="EFFECT", help="Leave an effect out of the bank; may come several times."),
    ] = None,
    only: Annotated[
        list[str] | None, typer.Option("--object", metavar="NAME", help="Look at this object alone; several times.")
    ] = None,
    hide: Annotated[
        list[str] | None, typer.Option("--without-object", metavar="NAME", help="Leave this object out; several times.")
    ] = None,
    tasks: Annotated[
        bool,
        typer.Option(
            "--tasks/--no-tasks", help="Measure what the gap costs a robot's software; not of two recordings."
        ),
    ] = True,
    tag: Tags = None,
    units: Units = None,
    up: Up = None,
    materials: MaterialsFile = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads. [default: all cores]")] = None,
) -> None:
    """Say where a recording and its simulation differ, which effects cause it, and how far they close the gap."""
    from depthsim.gap.report.folder import check_report_folder
    from depthsim.materials import load_materials
    from depthsim.sensor.effect import effect_ids

    if len(runs) > 2:
        raise InputError("diagnose", "", f"has {len(runs)} runs", "give a recording, or two to be compared")
    for name in without or []:
        if name not in effect_ids():
            problem, fix = f"there is no effect {name!r}", f"the effects are {', '.join(effect_ids())}"
            raise InputError("--without", name, problem, fix)
    check_report_folder(out)
    known = load_materials(materials)
    place = _scene(scene, runs[0], parse_tags(tag), units, up, known)
    if len(runs) == 2:
        for option, given in (("--object", only or hide), ("--no-tasks", not tasks)):
            if given:
                raise InputError("diagnose", option, "is of no use with two recordings", "give one recording")
        _compare(runs[0], runs[1], out, place, sensor, without, known, threads)
    else:
        _one(runs[0], out, place, sensor, without or [], only or [], hide or [], materials, known, threads, tasks)


def _one(
    path: Path,
    out: Path,
    scene: "str | Scene | None",
    sensor: str | None,
    without: list[str],
    only: list[str],
    hide: list[str],
    file: Path | None,
    materials: "Materials",
    threads: int | None,
    tasks: bool,
) -> None:
    from rich.console import Console

    from depthsim.gap import investigate
    from depthsim.gap.report.terminal import show

    drawn: list[Drawn] = []
    with _Progress() as say:

        def draw(found: "Findings") -> None:
            from depthsim.gap.depth.report.write import Named, draw_report  # loads what draws

            say("drawing the report")
            drawn.append(draw_report(found, out, Named(scene, sensor, file)))

        found = investigate(
            path, scene=scene, sensor=sensor, without=without, objects=only, without_objects=hide, threads=threads,
            materials=materials, say=say, tasks=tasks, meanwhile=draw,
        )  # fmt: skip
        from depthsim.gap.depth.report.write import write_report

        origin = write_report(found, out, drawn=drawn[0])
    show(Console(highlight=False), found.diagnosis, origin)


def _compare(
    first: Path,
    second: Path,
    out: Path,
    scene: "str | Scene | None",
    sensor: str | None,
    without: list[str] | None,
    materials: "Materials",
    threads: int | None,
) -> None:
    from rich.console import Console

    from depthsim.gap.depth.compare import compare_runs
    from depthsim.gap.depth.report.compare import show_comparison, write_comparison

    if sensor is not None or without:
        option = "--sensor" if sensor is not None else "--without"
        raise InputError("diagnose", option, "is of no use with two recordings", "leave it out, or give one recording")
    with _Progress() as say:
        compared = compare_runs(first, second, scene=scene, threads=threads, materials=materials, say=say)
        say("drawing the report")
        write_comparison(compared, out)
    show_comparison(Console(highlight=False), compared, out)


def _scene(
    choice: str | None, run: Path, tags: dict[str, str], units: str | None, up: str | None, materials: "Materials"
) -> "str | Scene | None":
    """The scene, loaded here where there is more to give of it than its name."""
    from depthsim.runs import Run
    from depthsim.scenefile import load_scene

    if not (tags or units or up):
        return choice
    own = choice or Run.open(run).scene
    if own is None:
        raise InputError(run, "", "holds no scene", "put scene.obj or scene.yaml there, or give --scene")
    return load_scene(own, tags=tags, units=units, up=up, materials=materials)


class _Progress:
    """What is being done, and for how long, on a terminal; nothing elsewhere."""

    def __enter__(self) -> "_Progress":
        from rich.console import Console
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        console = Console(stderr=True)
        self._bar = Progress(
            SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False),
            console=console, disable=not console.is_terminal, transient=True,
        )  # fmt: skip
        self._task = self._bar.add_task("reading", total=None)
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def __call__(self, text: str) -> None:
        self._bar.update(self._task, description=text)
