"""What a diagnosis looks at of a recording, and what is known of it before any sensor has looked.

The work is bounded by a budget of pixels. Frames are in blocks over the whole time. Of large frames it is a band of
rows in full width: what goes on beside an edge or between neighbours needs pixels that hang together, and the whole
baseline. Other rows have their turn in every block, so that each part of the blocks (see :class:`Evidence`) sees all
of the picture.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import gcd

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.config import DepthData
from depthsim.raycast import Geometry

MARGIN = 16
"""[px] Rows at a cut that are simulated and not counted, as effects act on them from beyond the cut."""


@dataclass
class CleanFrame:
    """One frame without a sensor.

    camera: that of the rows that are looked at, of which those in ``counted`` are counted. across: (pixels,) the clean
    depth beyond an edge [m], 0 where there is none. per_spread: (pixels,) 1 over the simulator's own spread of the
    depth [1/m]. places: (axes, pixels that are counted), see :func:`counting.places`.
    """

    index: int
    stamp: float
    pose: NDArray[np.float64]
    camera: Camera
    counted: slice
    geometry: Geometry
    across: NDArray[np.float32]
    per_spread: NDArray[np.float32]
    places: NDArray[np.unsignedinteger]


def select_frames(count: int, width: int, limit: DepthData) -> list[NDArray[np.int64]]:
    """Blocks of frames in a row, spread over the run; a short run is taken whole. width: of a frame [px].

    Neighbours in time are alike, and a block is never parted between fitting and validating.
    """
    wanted = int(np.clip(limit.pixels // (width * limit.least_rows), limit.least_frames, limit.most_frames))
    length = int(np.clip(min(count, wanted) // 10, 1 if count < 8 else 2, limit.block))
    number = max(min(count, wanted) // length, 1)
    if count <= wanted + length:
        return [block for block in np.array_split(np.arange(count), number) if len(block)]
    starts = np.linspace(0, count - length, number).round().astype(np.int64)
    return [np.arange(start, start + length) for start in np.unique(starts)]


def select_rows(blocks: Sequence[NDArray[np.int64]], camera: Camera, parts: int, limit: DepthData) -> list[Camera]:
    """The camera that each block is looked at with: the whole one, or a band of its rows, all of one height.

    parts: every ``parts``-th block is in one part. Its bands are spread evenly from the first row to the last, in an
    order that has little to do with time.
    """
    rows = limit.pixels // (sum(map(len, blocks)) * camera.width)
    rows = max(rows, limit.least_rows)
    if rows >= camera.height:
        return [camera] * len(blocks)
    found = []
    for number in range(len(blocks)):
        part, place = number % parts, number // parts
        count = len(range(part, len(blocks), parts))
        turn = next(k for k in range(round(0.62 * count) or 1, count + 2) if gcd(k, count) == 1)
        share = (place * turn + part * count // parts) % count / max(count - 1, 1)
        found.append(camera.window(round(share * (camera.height - rows)), rows))
    return found


def counted_rows(window: Camera, first: int, stride: int) -> slice:
    """Every ``stride``-th row of a window, but for those at its cuts. first: of these, which is the first."""
    below = window.whole.height - window.first_row - window.height
    begin, end = MARGIN if window.first_row else 0, window.height - (MARGIN if below else 0)
    return slice(begin + first, end, stride)
