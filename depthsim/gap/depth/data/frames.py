"""Which frames of a recording a diagnosis looks at, and what is known of them before any sensor has looked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.config import DepthData
from depthsim.raycast import Geometry


@dataclass
class CleanFrame:
    """One frame without a sensor.

    across: (pixels,) the clean depth beyond an edge [m], 0 where there is none. per_spread: (pixels,) 1 over the
    simulator's own spread of the depth [1/m]. places: (axes, pixels that are counted), see :func:`counting.places`.
    """

    index: int
    stamp: float
    pose: NDArray[np.float64]
    geometry: Geometry
    across: NDArray[np.float32]
    per_spread: NDArray[np.float32]
    places: NDArray[np.unsignedinteger]


def select_frames(count: int, pixels: int, limit: DepthData) -> list[NDArray[np.int64]]:
    """Blocks of frames in a row, spread over the run; a short run is taken whole.

    Neighbours in time are alike, and a block is never parted between fitting and validating.
    """
    wanted = int(np.clip(limit.pixels // max(pixels, 1), limit.least_frames, limit.most_frames))
    length = int(np.clip(min(count, wanted) // 10, 1 if count < 8 else 2, limit.block))
    number = max(min(count, wanted) // length, 1)
    if count <= wanted + length:
        return [block for block in np.array_split(np.arange(count), number) if len(block)]
    starts = np.linspace(0, count - length, number).round().astype(np.int64)
    return [np.arange(start, start + length) for start in np.unique(starts)]
