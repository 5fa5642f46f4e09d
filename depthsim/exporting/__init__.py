"""Runs in the formats that other programs read: one file a format, each with a function ``write``."""

import importlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from depthsim.errors import InputError
from depthsim.exporting.options import ExportOptions
from depthsim.runs import Run
from depthsim.runs.whole import whole_folder


@dataclass(frozen=True)
class Format:
    """An export format: the module that writes it, and what it is."""

    module: str
    about: str


FORMATS = {
    "open3d": Format("open3d_folder", "depth/, color/, intrinsic.json and trajectory.log, as Open3D and ICL-NUIM have"),
    "icl": Format("open3d_folder", "the same"),
    "euroc": Format("euroc", "mav0/ with cam0, depth0, imu0 and the ground truth, as EuRoC MAV has"),
    "ros2": Format("ros2_mcap", "a ROS 2 bag in MCAP, with the topics of the RealSense wrapper"),
    "ros2-sqlite3": Format("ros2_sqlite3", "the same in sqlite3"),
    "ply": Format("ply", "a point cloud for each frame"),
    "lerobot": Format("lerobot", "a LeRobot data set (v3), which is Parquet that `datasets` reads, too"),
    "webdataset": Format("webdataset", "tar shards for training"),
}
"""By the name that :func:`export` takes."""


def export(run: Run, form: str, out: Path, options: ExportOptions | None = None) -> str:
    """Write ``run`` in the format ``form`` to the folder ``out``, whole or not at all; says what was written.

    Raises :class:`InputError` for an unknown format, a folder that holds something, a missing extra and a run whose
    pictures are damaged.
    """
    if form not in FORMATS:
        raise InputError("`form`", form, "is no format", f"give one of {', '.join(FORMATS)}")
    module = importlib.import_module(f"depthsim.exporting.{FORMATS[form].module}")
    with whole_folder(out) as folder:
        return str(module.write(run, folder, options or ExportOptions()))


def export_together(runs: Iterable[Run], out: Path) -> str:
    """Write several runs as one LeRobot data set, an episode each; as :func:`export`.

    Raises :class:`InputError` for runs whose cameras or kinds of pictures differ, too.
    """
    from depthsim.exporting.lerobot import write_runs

    with whole_folder(out) as folder:
        return write_runs(runs, folder)


__all__ = ["FORMATS", "ExportOptions", "Format", "export", "export_together"]
