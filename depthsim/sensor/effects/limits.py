"""The nearest and the farthest depth that a camera gives."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_ZERO = np.float32(0)
_SOFTEST = 0.3
"""[m] From this scale on a limit is holes that grow with the range."""


@kernel
def keep_between(start, stop, least, most, depth):  # noqa: ANN201 - numba
    """Depths that are nearer than ``least`` or farther than ``most`` become holes."""
    z = depth[start:stop]
    for i in range(z.size):
        own = z[i]
        own = own if own >= least else _ZERO  # one choice a line, see kernel
        z[i] = own if own <= most else _ZERO


def _softness(start: float) -> float:
    """How gradual a limit is."""
    softness: float = parameter(
        0.0,
        low=0,
        high=_SOFTEST,
        unit="m",
        about="scale of a logistic limit, drawn for each pixel; 0: a sharp one. What is wider is range_dropout",
        source="none: the data sheet has a sharp one",
        starts=(start,),
        scale="log",
    )
    return softness


def _error() -> float:
    """What the limit sees of a depth's error."""
    error: float = parameter(
        1.0,
        low=0,
        high=1,
        unit="share",
        about="how much of a depth's error the limit sees; 1: it cuts what is measured, 0: the true depth",
        source="the search of a matcher ends at a measured disparity",
    )
    return error


def _along_ray() -> float:
    """What a limit is one of."""
    along_ray: float = parameter(
        0.0,
        low=0,
        high=1,
        unit="share",
        about="0: the limit is one of the depth, 1: of the distance along the ray",
        source="a matcher's search ends at a depth; software that cuts clouds of points goes by their distance",
        frozen=True,
    )
    return along_ray


def _is_plain(limit: "MinRange | MaxRange") -> bool:
    """Whether it cuts the measured depth sharply."""
    return limit.softness == 0 and limit.error == 1 and limit.along_ray == 0


def _beyond(frame: Frame, limit: "MinRange | MaxRange") -> NDArray[np.float32]:
    """How far each depth lies beyond a limit [m], one limit for all or, where it is soft, drawn for each pixel."""
    depth, clean = frame.depth, frame.geometry.depth
    seen = depth if limit.error == 1 else clean + np.float32(limit.error) * (depth - clean)
    if limit.along_ray:
        x, y = frame.camera.rays
        seen = seen * (1 + np.float32(limit.along_ray) * (np.sqrt(1 + x * x + y * y) - 1))
    if limit.softness == 0:
        return np.asarray(seen - np.float32(limit.depth), np.float32)
    u = frame.draws(limit.id).uniform(depth.shape)
    return np.asarray(seen - np.float32(limit.depth) - np.float32(limit.softness) * np.log(u / (1 - u)), np.float32)


class MinRange(Effect):
    """No depth nearer than ``depth``: the search ends at a widest disparity D, so f·b / D is the least depth.

    Nor within ``reach`` rows and columns of what is nearer, where the window of a matcher lies over it.
    """

    id: ClassVar[str] = "min_range"
    stage: ClassVar[Stage] = Stage.HOLES
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "RealSense D400 series datasheet, document 337029, table Minimum-Z Depth"
    axes = ("range",)
    kinds = ("missing",)
    recording = "one material in to ranges where holes begin"
    forms = (
        {"softness": 0.0, "error": 1.0, "reach": 0},
        {"error": 1.0, "reach": 0},
        {"error": 0.0, "reach": 0},
        {"softness": 0.0, "error": 1.0},
        {"softness": 0.0, "error": 1.0, "reach": 0, "along_ray": 1.0},
    )
    shown: ClassVar = {"depth": 1.5}
    outgrown: ClassVar = {"softness": _SOFTEST}

    depth: float = parameter(
        0.195,
        low=0,
        high=5,
        unit="m",
        neutral=0,
        about="least depth",
        source="the datasheet's D435 at 848x480",
        starts=lambda seen: seen.depths(0.02, 0.06, 0.3),
        scale="range",
    )
    softness: float = _softness(0.03)
    error: float = _error()
    along_ray: float = _along_ray()
    reach: int = parameter(
        0,
        low=0,
        high=8,
        unit="px",
        about="how far around what is nearer depths are lost, too",
        source="none: a window that sees something nearer may still match what is behind",
        starts=(2,),
    )

    def apply(self, frame: Frame) -> None:
        """Set what is nearer to 0."""
        if self.reach:
            from scipy.ndimage import minimum_filter  # takes a quarter of what all effects need to load

            beyond = _beyond(frame, self)
            nearest = minimum_filter(np.where(frame.depth > 0, beyond, np.inf), 2 * self.reach + 1, mode="nearest")
            frame.depth[nearest < 0] = 0
        elif _is_plain(self):
            frame.run(keep_between, np.float32(self.depth), np.float32(np.inf), frame.depth.reshape(-1))
        else:
            frame.depth[_beyond(frame, self) < 0] = 0


class MaxRange(Effect):
    """No depth farther than ``depth``."""

    id: ClassVar[str] = "max_range"
    stage: ClassVar[Stage] = Stage.HOLES
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "product brief of the D400 series: maximum range approximately 10 m"
    axes = ("range",)
    kinds = ("missing",)
    recording = "one material out to ranges where holes begin"
    forms = (
        {"softness": 0.0, "error": 1.0},
        {"error": 1.0},
        {"error": 0.0},
        {"softness": 0.0, "error": 1.0, "along_ray": 1.0},
    )
    shown: ClassVar = {"depth": 3.5}
    outgrown: ClassVar = {"softness": _SOFTEST}

    depth: float = parameter(
        10.0,
        low=0.1,
        high=1000,
        unit="m",
        neutral=1000,
        about="greatest depth",
        source="that product brief",
        starts=lambda seen: seen.depths(0.5, 0.85, 0.95, 0.985, 0.996),
        scale="range",
    )
    softness: float = _softness(0.1)
    error: float = _error()
    along_ray: float = _along_ray()

    def apply(self, frame: Frame) -> None:
        """Set what is farther to 0."""
        if _is_plain(self):
            frame.run(keep_between, _ZERO, np.float32(self.depth), frame.depth.reshape(-1))
        else:
            frame.depth[_beyond(frame, self) > 0] = 0
