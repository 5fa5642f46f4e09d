"""The nearest and the farthest depth that a camera gives."""

from typing import ClassVar

import numpy as np

from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_ZERO = np.float32(0)


@kernel
def _keep_between(start, stop, least, most, depth):
    z = depth[start:stop]
    for i in range(z.size):
        z[i] = z[i] if (z[i] >= least) & (z[i] <= most) else _ZERO


class MinRange(Effect):
    """No depth nearer than ``depth``: the search ends at a widest disparity D, so f·b / D is the least depth."""

    id: ClassVar[str] = "min_range"
    stage: ClassVar[Stage] = Stage.MISSING
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "RealSense D400 series datasheet, document 337029, table Minimum-Z Depth"

    depth: float = parameter(
        0.195, low=0, high=5, unit="m", neutral=0, about="least depth", source="the datasheet's D435 at 848x480"
    )

    def apply(self, frame: Frame) -> None:
        """Set what was measured nearer to 0."""
        frame.run(_keep_between, np.float32(self.depth), np.float32(np.inf), frame.depth.reshape(-1))


class MaxRange(Effect):
    """No depth farther than ``depth``."""

    id: ClassVar[str] = "max_range"
    stage: ClassVar[Stage] = Stage.MISSING
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "product brief of the D400 series: maximum range approximately 10 m"

    depth: float = parameter(
        10.0, low=0.1, high=1000, unit="m", neutral=1000, about="greatest depth", source="that product brief"
    )

    def apply(self, frame: Frame) -> None:
        """Set what was measured farther to 0."""
        frame.run(_keep_between, _ZERO, np.float32(self.depth), frame.depth.reshape(-1))
