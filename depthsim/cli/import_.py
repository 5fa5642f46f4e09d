"""`depthsim import`: a recording of others as a run."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from depthsim.cli.flags import in_flags


def import_(
    source: Annotated[Path, typer.Argument(help="A .bag, .mcap, .db3, the folder of a bag, a TUM sequence, pictures.")],
    out: Annotated[Path, typer.Option(help="The run's folder, a new one.")],
    camera: Annotated[str | None, typer.Option(help="A camera.yaml or a preset, in place of the recording's.")] = None,
    depth: Annotated[str | None, typer.Option(metavar="TOPIC", help="Of the depth images.")] = None,
    poses: Annotated[str | None, typer.Option(help="A TUM file, or a topic of odometry or poses.")] = None,
    rate: Annotated[float | None, typer.Option(help="Frames a second of pictures without stamps.")] = None,
    depth_scale: Annotated[float | None, typer.Option(help="Metres per unit of 16-bit depth.")] = None,
    baseline: Annotated[float | None, typer.Option(help="Left to right imager [m].")] = None,
    mount: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z,QX,QY,QZ,QW",
            help="The camera (x right, y down, z forward) in the frame that the poses are of. [default: that frame]",
        ),
    ] = None,
) -> None:
    """Make a run of a recording: ROS 1 and 2 bags (RealSense Viewer's, too), TUM RGB-D, PNG or npy with a camera."""
    from depthsim.importing import ImportOptions, import_recording
    from depthsim.importing.options import read_mount

    fixed = read_mount(mount) if mount is not None else None
    options = ImportOptions(camera, depth, poses, rate, depth_scale, baseline, fixed)
    made = import_recording(source, out, options)
    print(f"{out}: {made.frames} frames, {'with' if made.posed else 'without'} poses")
    for note in made.notes:
        print(f"{out}: {in_flags(note)}", file=sys.stderr)
    if made.cut is not None:
        raise made.cut
