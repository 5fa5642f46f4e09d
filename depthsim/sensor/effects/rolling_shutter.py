"""Rows that are exposed one after another."""

from typing import ClassVar

from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.view import View


class RollingShutter(Effect):
    """Row v of H is taken at stamp + readout · ((v + 1/2) / H - stamped): the stamp is that of the middle row, or of
    the first or the last one, as the driver has it. The last row comes first where readout is negative, as of a camera
    that hangs upside down.
    """

    id: ClassVar[str] = "rolling_shutter"
    stage: ClassVar[Stage] = Stage.POSE
    rank: ClassVar[int] = 1
    source: ClassVar[str] = (
        "Intel white paper 'High-speed capture mode of Intel RealSense Depth Camera D435': the D415 has rolling "
        "shutters, the D435 global ones"
    )
    axes = ("motion", "image_row", "time", "edge_distance")
    kinds = ("bias", "spread", "tail")
    forms: ClassVar = ({"stamped": 0.5}, {"stamped": 0.0}, {"stamped": 1.0})
    recording = "fast turns, which bend straight edges between the first row and the last"

    readout: float = parameter(
        0.011,
        low=-0.1,
        high=0.1,
        unit="s",
        neutral=0,
        about="time from the first row to the last; negative from the last to the first",
        source="assumed: all rows within a frame at 90 Hz, the highest rate at 848x480",
        starts=(0.004, 0.03, -0.02),
        step=0.002,
    )

    stamped: float = parameter(
        0.5,
        low=0,
        high=1,
        unit="share",
        about="the row that the stamp is of: 0 the first, 1/2 the middle one, 1 the last",
        source="assumed: a driver that does not say else gives the middle of the exposure",
        frozen=True,
    )

    def bend(self, view: View) -> None:
        """Give every row the pose of its own time."""
        height = view.camera.whole.height
        view.rows = view.stamp + self.readout * ((view.camera.rows + 0.5) / height - self.stamped)
        view.pose = view.motion.at(view.rows)
