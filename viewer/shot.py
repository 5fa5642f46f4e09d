"""One frame as the viewer sees it, and the few figures that are told of it."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.units import SATURATED


@dataclass(frozen=True, eq=False)
class Shot:
    """One frame.

    pose: (4, 4) camera to world. depth_raw: (height, width) uint16 depth as stored; 0 is a hole, 65535 too far.
    clean: (height, width) float32 depth without the sensor [m], 0 where nothing is; None where it is not known.
    tag: (height, width) uint8 indices of material tags, 255 for none; None where they are not known.
    instance: (height, width) uint16 numbers of objects, 0 for none; None where they are not known.
    """

    camera: Camera
    pose: NDArray[np.float64]
    depth_raw: NDArray[np.uint16]
    clean: NDArray[np.float32] | None = None
    tag: NDArray[np.uint8] | None = None
    instance: NDArray[np.uint16] | None = None

    def without(self, hidden: frozenset[int]) -> "Shot":
        """The same without what is seen of the objects of these numbers."""
        if not hidden or self.instance is None or self.instance.shape != self.depth_raw.shape:
            return self
        gone = np.isin(self.instance, list(hidden))
        clean = None if self.clean is None else np.where(gone, np.float32(0), self.clean)
        return replace(self, depth_raw=np.where(gone, np.uint16(0), self.depth_raw), clean=clean)

    @cached_property
    def figures(self) -> "Figures":
        """What is told of the frame."""
        returned = (self.depth_raw > 0) & (self.depth_raw < SATURATED)
        if self.clean is None:
            return Figures(float(1 - returned.mean()), None, None)
        there = self.clean > 0
        both = returned & there
        rows = slice(None, None, 1 if both.size < 100_000 else 3)  # every third row tells as much
        known = both[rows]
        error = self.depth_raw[rows][known] * np.float32(self.camera.depth_scale) - self.clean[rows][known]
        holes = 1 - int(np.count_nonzero(both)) / max(int(np.count_nonzero(there)), 1)
        if not error.size:
            return Figures(holes, None, None)
        places = [int(share * error.size) for share in (0.1587, 0.5, 0.8413)]
        low, middle, high = (float(value) for value in np.partition(error, places)[places])
        return Figures(holes, (high - low) / 2, middle)


@dataclass(frozen=True)
class Figures:
    """holes: share of the pixels with a surface that are holes; of all pixels where surfaces are not known.

    spread: of measured less true depth [m], half the width of its middle 68.3 %: the standard deviation of a normal
    error, unmoved by the few that are far off. bias: its median [m].
    """

    holes: float
    spread: float | None
    bias: float | None

    def __str__(self) -> str:
        parts = [f"{self.holes:.1%} holes"]
        if self.spread is not None and self.bias is not None:
            parts += [f"noise {1000 * self.spread:.1f} mm (1σ)", f"bias {1000 * self.bias:+.1f} mm"]
        return " · ".join(parts)
