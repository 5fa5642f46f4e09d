"""The driver's limits of range."""

from typing import ClassVar

import numpy as np

from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.effects.limits import keep_between
from depthsim.sensor.frame import Frame


class ThresholdFilter(Effect):
    """No depth nearer than ``nearest`` or farther than ``farthest``, by a choice that is made in the driver.

    As a cause it is ``min_range`` or ``max_range``, which do the same within the camera: it is no candidate itself.
    """

    id: ClassVar[str] = "threshold_filter"
    stage: ClassVar[Stage] = Stage.PROCESSING
    rank: ClassVar[int] = -1
    source: ClassVar[str] = "librealsense, src/proc/threshold.cpp"
    axes = ("range",)
    kinds = ("missing",)
    recording = "one material in to and out to ranges where holes begin"
    forms = ()
    shown: ClassVar = {"farthest": 3.0}

    nearest: float = parameter(
        0.1, low=0, high=16, unit="m", neutral=0, about="least depth", source="librealsense's default"
    )
    farthest: float = parameter(
        4.0, low=0, high=100, unit="m", neutral=100, about="greatest depth", source="librealsense's default"
    )

    @property
    def is_neutral(self) -> bool:
        """Whether neither limit is set."""
        return self.nearest == 0 and self.farthest == 100

    def apply(self, frame: Frame) -> None:
        """Set what is beyond to 0."""
        frame.run(keep_between, np.float32(self.nearest), np.float32(self.farthest), frame.depth.reshape(-1))
