"""A ROS 2 bag in MCAP, chunks compressed by zstd."""

from pathlib import Path

from depthsim.exporting.options import ExportOptions
from depthsim.exporting.ros2 import write_bag
from depthsim.runs import Run


def write(run: Run, out: Path, options: ExportOptions) -> str:
    """Write the bag; says what is in it."""
    return write_bag(run, out, options, "MCAP")
