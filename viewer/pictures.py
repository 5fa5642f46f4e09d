"""The picture beside the 3D view: one frame, or two next to each other, no larger than a panel shows."""

import numpy as np
from numpy.typing import NDArray

from depthsim.units import SATURATED
from viewer import colours
from viewer.paint import Colouring, Painted
from viewer.shot import Shot

_WIDEST = 640
"""[px] A frame that is wider is shown by every second pixel, or fewer; a mean would hide single holes."""
_GAP = 6


def frame_picture(shot: Shot, painted: Painted, how: Colouring, widest: int = _WIDEST) -> NDArray[np.uint8]:
    """(rows, columns, 3) RGB of a frame; dark where nothing returned."""
    step = max(1, -(-shot.depth_raw.shape[1] // widest))
    units, index = shot.depth_raw[::step, ::step], painted.index[::step, ::step]
    returned = None if how == "validity" else (units > 0) & (units < SATURATED)
    larger = widest // (2 * index.shape[1])  # a tiny frame is shown by squares
    picture = Painted(index, painted.palette).picture(returned)
    return picture.repeat(larger, axis=0).repeat(larger, axis=1) if larger > 1 else picture


def share_picture(share: NDArray[np.float32], shape: tuple[int, int], widest: int = 320) -> NDArray[np.uint8]:
    """The image plane by each cell's share of the gap. shape: (height, width) of the camera."""
    height, width = shape
    columns = min(width, widest)
    rows = max(1, round(height * columns / width))
    v, u = np.arange(rows) * share.shape[0] // rows, np.arange(columns) * share.shape[1] // columns
    most = float(share.max())
    place = np.clip(share / most if most > 0 else share, 0, 1)[v[:, None], u]
    return colours.SHARE[(255 * place).astype(np.uint8)]


def side_by_side(pictures: list[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Pictures from left to right, each as high as the highest."""
    if len(pictures) == 1:
        return pictures[0]
    rows = max(picture.shape[0] for picture in pictures)
    parts: list[NDArray[np.uint8]] = []
    for picture in pictures:
        if parts:
            parts.append(np.zeros((rows, _GAP, 3), np.uint8))
        parts.append(np.pad(picture, ((0, rows - picture.shape[0]), (0, 0), (0, 0))))
    return np.concatenate(parts, axis=1)
