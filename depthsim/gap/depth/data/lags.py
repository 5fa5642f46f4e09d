"""How far off the pixel and the frame are that an error is compared with: as a rule, or where the recording shows it.

What smooths makes an error go together with the next ones most, and less with those farther off. An echo on a read-out
line, or two buffers that take turns, make it go together with one some way off and with none between, and who looks at
neighbours alone sees nothing.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.config import DepthData
from depthsim.gap.depth.data.locked import Signs, together

_PIXELS, _FRAMES = 16, 4
"""How far off is looked at most."""
_SOME = 8
"""Frames that are looked at."""


class Lags(NamedTuple):
    """How far off the second error of a pair is: to the left, above [px], and how many frames before."""

    left: int = 5
    up: int = 4
    frames: int = 1

    @property
    def remark(self) -> str:
        """What a reader must know of lags that are not the usual ones; empty for those."""
        words = zip(self, Lags(), ("columns to the left", "rows above", "frames before"), strict=True)
        farther = [f"{own} {what}" for own, usual, what in words if own != usual]
        return f"errors go together with those {' and '.join(farther)}, and less with nearer ones" if farther else ""


def find_lags(signs: Mapping[int, Signs], are_whole: bool, limit: DepthData) -> Lags:
    """Where signs of errors go together more than at the usual lags and with the next ones; else the usual lags.

    signs: of the errors of each frame (rows, width), 0 where there is none. are_whole: whether the rows are all there;
    then those above are looked at, and the frames before.
    """
    usual, every = Lags(), [*signs]
    some = [signs[index] for index in every[:: max(1, len(every) // _SOME)]]
    left = _farther([_agree([(s[:, k:], s[:, :-k]) for s in some]) for k in range(1, _PIXELS + 1)], usual.left, limit)
    if not are_whole:
        return usual._replace(left=left)
    up = _farther([_agree([(s[k:], s[:-k]) for s in some]) for k in range(1, _PIXELS + 1)], usual.up, limit)
    last = [index for index in every if all(index - k in signs for k in range(1, _FRAMES + 1))]
    last = last[:: max(1, len(last) // _SOME)]
    over_time = [_agree([(signs[i], signs[i - k]) for i in last]) for k in range(1, _FRAMES + 1)]
    return Lags(left, up, _farther(over_time, usual.frames, limit))


def pair_frames(count: int, lag: int) -> list[NDArray[np.int64]]:
    """Frames in pairs that are so many apart; those that are left at the end are alone."""
    firsts = [begin + k for begin in range(0, count - 2 * lag + 1, 2 * lag) for k in range(lag)]
    return [
        *(np.array([first, first + lag]) for first in firsts),
        *(np.array([k]) for k in range(2 * len(firsts), count)),
    ]


def _agree(pairs: Sequence[tuple[Signs, Signs]]) -> float:
    """How signs go together, on average over pairs of pictures; see :func:`together`."""
    return float(np.mean([together(*pair)[0] for pair in pairs] or [0.0]))


def _farther(agreement: Sequence[float], usual: int, limit: DepthData) -> int:
    """agreement: at lags of 1, 2, and so on."""
    sizes = np.abs(agreement)
    most, near = int(np.argmax(sizes)), max(sizes[0], sizes[usual - 1])
    # Of waves, too, errors a whole one apart go together most, and the next ones nearly as much.
    return most + 1 if sizes[most] > max(2 * near, near + limit.farther_together) else usual
