"""Trajectories of the camera: recorded (TUM files) or made (named shapes and way-points)."""

from depthsim.trajectory.poses import Trajectory
from depthsim.trajectory.resolve import load_trajectory, make_trajectory
from depthsim.trajectory.spec import SHAPES, parse_spec
from depthsim.trajectory.tum import read_tum, tum_text, write_tum

__all__ = [
    "SHAPES",
    "Trajectory",
    "load_trajectory",
    "make_trajectory",
    "parse_spec",
    "read_tum",
    "tum_text",
    "write_tum",
]
