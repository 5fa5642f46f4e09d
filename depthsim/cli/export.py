"""`depthsim export`: a run in the format of another program."""

from pathlib import Path
from typing import Annotated

import typer


def export(
    run: Annotated[Path, typer.Argument(help="The run's folder.")],
    to: Annotated[
        str,
        typer.Option(metavar="FORMAT", help="open3d (icl), euroc, ros2, ros2-sqlite3, ply, webdataset, lerobot."),
    ],
    out: Annotated[Path | None, typer.Option(help="A new folder. [default: RUN_FORMAT beside the run]")] = None,
    points: Annotated[bool, typer.Option("--points", help="ros2: point clouds, too.")] = False,
    metric: Annotated[bool, typer.Option("--metric/--no-metric", help="ros2: depth in metres, too.")] = True,
    shard: Annotated[int, typer.Option(min=1, help="webdataset: frames to a shard.")] = 500,
) -> None:
    """Write a run as others have it: Open3D and ICL-NUIM, EuRoC, ROS 2 bags, point clouds, WebDataset, LeRobot."""
    from depthsim.exporting import ExportOptions
    from depthsim.exporting import export as write
    from depthsim.runs import Run

    folder = out or run.absolute().with_name(f"{run.absolute().name}_{to.replace('-', '_')}")
    said = write(Run.open(run), to, folder, ExportOptions(points=points, metric=metric, shard=shard))
    print(f"{folder}: {said}")
