"""One frame as the figures look at it: the clean depth, and the pixels that count. All sensors have the same view."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.frames import inner_rows

Floats = NDArray[np.float32]
Shares = dict[str, tuple[float, float]]
"""Sum and weight of each figure: the figure of some frames is the sum of the sums over that of the weights."""

_SATURATED = 65535


@dataclass(frozen=True)
class View:
    """A frame without a sensor.

    clean: (rows, width) z-depth [m], 0 where there is nothing; across: the same beyond the nearest depth edge, 0 where
    none is near. asked: (rows, width) the pixels that count: they see the scene, it may be trusted there, and no cut
    between bands of rows is near.
    """

    index: int
    camera: Camera
    clean: Floats
    across: Floats
    asked: NDArray[np.bool_]

    @classmethod
    def of(cls, evidence: Evidence, index: int) -> "View":
        """The view of one of the frames that the evidence keeps."""
        frame, trusted = evidence.frames[index], evidence.trusted(index)
        clean = frame.geometry.depth
        asked = (clean > 0) & inner_rows(frame.camera)[:, None]
        if trusted is not None:
            asked &= trusted
        return cls(index, frame.camera, clean, frame.across.reshape(clean.shape), asked)

    def depth(self, units: NDArray[np.uint16]) -> Floats:
        """(rows, width) the depth of a stored picture [m], 0 for a hole and outside of what is asked for."""
        kept = self.asked & (units < _SATURATED)
        return np.asarray(np.where(kept, units * np.float32(self.camera.depth_scale), np.float32(0)), np.float32)

    def depth_of_scene(self) -> Floats:
        """(rows, width) the clean depth of what is asked for [m], 0 elsewhere."""
        return np.asarray(np.where(self.asked, self.clean, np.float32(0)), np.float32)
