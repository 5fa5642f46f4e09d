"""The nearest and the farthest depth that a camera gives."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_ZERO = np.float32(0)


@kernel
def _keep_between(start, stop, least, most, depth):
    z = depth[start:stop]
    for i in range(z.size):
        z[i] = z[i] if (z[i] >= least) & (z[i] <= most) else _ZERO


def _softness() -> float:
    """How gradual a limit is."""
    softness: float = parameter(
        0.0,
        low=0,
        high=2,
        unit="m",
        about="scale of a logistic limit, drawn for each pixel; 0: a sharp one",
        source="none: the data sheet has a sharp one",
    )
    return softness


def _limit(frame: Frame, name: str, depth: float, softness: float) -> NDArray[np.float32] | np.float32:
    """The limit [m]: one for all, or drawn for each pixel."""
    if softness == 0:
        return np.float32(depth)
    u = frame.draws(name).uniform(frame.depth.shape)
    return np.asarray(depth + softness * np.log(u / (1 - u)), np.float32)


class MinRange(Effect):
    """No depth nearer than ``depth``: the search ends at a widest disparity D, so f·b / D is the least depth."""

    id: ClassVar[str] = "min_range"
    stage: ClassVar[Stage] = Stage.MISSING
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "RealSense D400 series datasheet, document 337029, table Minimum-Z Depth"

    depth: float = parameter(
        0.195, low=0, high=5, unit="m", neutral=0, about="least depth", source="the datasheet's D435 at 848x480"
    )
    softness: float = _softness()

    def apply(self, frame: Frame) -> None:
        """Set what was measured nearer to 0."""
        limit, depth = _limit(frame, self.id, self.depth, self.softness), frame.depth
        if np.ndim(limit):
            depth[depth < limit] = 0
        else:
            frame.run(_keep_between, limit, np.float32(np.inf), depth.reshape(-1))


class MaxRange(Effect):
    """No depth farther than ``depth``."""

    id: ClassVar[str] = "max_range"
    stage: ClassVar[Stage] = Stage.MISSING
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "product brief of the D400 series: maximum range approximately 10 m"

    depth: float = parameter(
        10.0, low=0.1, high=1000, unit="m", neutral=1000, about="greatest depth", source="that product brief"
    )
    softness: float = _softness()

    def apply(self, frame: Frame) -> None:
        """Set what was measured farther to 0."""
        limit, depth = _limit(frame, self.id, self.depth, self.softness), frame.depth
        if np.ndim(limit):
            depth[depth > limit] = 0
        else:
            frame.run(_keep_between, _ZERO, limit, depth.reshape(-1))
