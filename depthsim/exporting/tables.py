"""What several exporters take from a run besides its pictures."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.flight.table import read_table
from depthsim.runs import Run

Floats = NDArray[np.float64]

_FINE = 4e6
"""[s] Below that a double holds nanoseconds."""
IMU_COLUMNS = ("t", "wx", "wy", "wz", "ax", "ay", "az")


def nanoseconds(stamp: float) -> int:
    """A stamp [s] in whole nanoseconds; of a clock of today in whole microseconds, as a double holds no more."""
    return round(stamp * 1e9) if abs(stamp) < _FINE else round(stamp * 1e6) * 1000


def imu_columns(run: Run) -> Mapping[str, Floats] | None:
    """The columns of imu.csv, in the camera's optical frame [s, rad/s, m/s²]; None for a run without one."""
    file = run.path / "imu.csv"
    if not file.exists():
        return None
    table = read_table(file, "an imu.csv", lambda name: name in IMU_COLUMNS)
    missing = [name for name in IMU_COLUMNS if name not in table.columns]
    if missing:
        raise InputError(file, "header", f"has no column {missing[0]}", f"write the columns {' '.join(IMU_COLUMNS)}")
    return table.columns


def colour(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(height, width, 3) of a grey or colour image."""
    return image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=-1)


def points_of(run: Run, index: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """The (N, 3) points of a frame in the optical frame [m], and the (height, width) pixels that have one."""
    depth = run.depth(index)
    seen = depth > 0
    z = depth[seen]
    x, y = (ray[seen] for ray in run.camera.rays)
    return np.stack([x * z, y * z, z], axis=1), seen
