"""How far off the pixel and the frame are that an error is compared with: as a rule, or where the recording shows it.

What smooths makes an error go together with the next ones most, and less with those farther off. An echo on a read-out
line, or buffers and patterns that take turns, make it go together with one some way off and with none between, and who
looks at neighbours alone sees nothing.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from depthsim.gap.config import DepthData
from depthsim.gap.depth.data.locked import Signs, together

_PIXELS = 16
BEFORE = 4
"""How far off is looked at most, in pixels and in frames."""


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


def find_lags(in_a_row: Iterable[Sequence[Signs]], are_whole: bool, limit: DepthData) -> Lags:
    """Where signs of errors go together more than at the usual lags and with the next ones; else the usual lags.

    in_a_row: some frames, each with the :data:`BEFORE` ones before it, the last one first; or alone, where there are no
    such. Of each the signs of its errors (rows, width), 0 where there is none. are_whole: whether the rows are all
    there; then those above are looked at.
    """
    found: tuple[list[list[float]], ...] = ([], [], [])
    left, up, frames = found
    for last, *before in in_a_row:
        left.append([together(last[:, k:], last[:, :-k])[0] for k in range(1, _PIXELS + 1)])
        if are_whole:
            up.append([together(last[k:], last[:-k])[0] for k in range(1, _PIXELS + 1)])
        if before:
            frames.append([together(last, one)[0] for one in before])
    return Lags(*(_farther(one, usual, limit) for one, usual in zip(found, Lags(), strict=True)))


def _farther(agreements: Sequence[Sequence[float]], usual: int, limit: DepthData) -> int:
    """agreements: of some frames, at lags of 1, 2, and so on."""
    if not agreements:
        return usual
    sizes = np.abs(np.mean(agreements, axis=0))
    most, near = int(np.argmax(sizes)), max(sizes[0], sizes[usual - 1])
    # Of waves, too, errors a whole one apart go together most, and the next ones nearly as much.
    return most + 1 if sizes[most] > max(2 * near, near + limit.farther_together) else usual
