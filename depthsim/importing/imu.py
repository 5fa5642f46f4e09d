"""IMU messages as the columns of imu.csv."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.importing.messages import stamp_of
from depthsim.importing.transforms import seconds


class ImuStreams:
    """Samples of one unified stream, or of a gyroscope and an accelerometer that each have their own stamps."""

    def __init__(self) -> None:
        self._samples: dict[str, dict[int, list[float]]] = {"both": {}, "gyro": {}, "accel": {}}

    def add(self, kind: str, message: Any) -> None:
        """Take a message of ``both``, ``gyro`` or ``accel``."""
        w, a = message.angular_velocity, message.linear_acceleration
        self._samples[kind][stamp_of(message)] = [w.x, w.y, w.z, a.x, a.y, a.z]

    def columns(self) -> Mapping[str, NDArray[np.float64]] | None:
        """t [s], wx wy wz [rad/s], ax ay az [m/s²]; the accelerometer is brought to the gyroscope's stamps by lines."""
        if self._samples["both"]:
            stamps, values = self._table("both")
        elif self._samples["gyro"] and self._samples["accel"]:
            stamps, gyro = self._table("gyro")
            when, accel = self._table("accel")
            inside = (stamps >= when[0]) & (stamps <= when[-1])
            stamps, gyro = stamps[inside], gyro[inside]
            force = [np.interp(stamps, when, column) for column in accel.T[3:]]
            values = np.column_stack([gyro[:, :3], *force])
        else:
            return None
        if not len(stamps):
            return None
        return {"t": stamps, **dict(zip(("wx", "wy", "wz", "ax", "ay", "az"), values.T, strict=True))}

    def _table(self, kind: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        samples = sorted(self._samples[kind].items())
        return seconds([stamp for stamp, _ in samples]), np.array([row for _, row in samples])
