"""Rows that are exposed one after another."""

from typing import ClassVar

from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.view import View


class RollingShutter(Effect):
    """Row v of H is taken at stamp + readout · ((v + 1/2) / H - 1/2): the stamp is that of the middle row."""

    id: ClassVar[str] = "rolling_shutter"
    stage: ClassVar[Stage] = Stage.POSE
    rank: ClassVar[int] = 1
    source: ClassVar[str] = (
        "Intel white paper 'High-speed capture mode of Intel RealSense Depth Camera D435': the D415 has rolling "
        "shutters, the D435 global ones"
    )
    axes = ("motion", "image_row", "time", "edge_distance")
    kinds = ("bias", "spread", "tail")
    recording = "fast turns, which bend straight edges between the first row and the last"

    readout: float = parameter(
        0.011,
        low=0,
        high=0.1,
        unit="s",
        neutral=0,
        about="time from the first row to the last",
        source="assumed: all rows within a frame at 90 Hz, the highest rate at 848x480",
        starts=(0.004, 0.03),
    )

    def bend(self, view: View) -> None:
        """Give every row the pose of its own time."""
        height = view.camera.whole.height
        view.rows = view.stamp + self.readout * ((view.camera.rows + 0.5) / height - 0.5)
        view.pose = view.motion.at(view.rows)
