"""Waves of errors, such as a second projector's stripes, or even and odd columns; they may move from frame to frame.

The spectrum of noise is flat, and falls where neighbouring pixels go together. That of waves rises at their frequency.
And the seams between blocks of pixels, such as those of a lossy codec, across which neighbours do not go together.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

_SMOOTH = np.array([0.25, 0.5, 0.25])
_SIDES = range(4, 17)
"""[px] Of blocks; a codec's are 4, 8 or 16 wide."""


def strongest_wave(signs: Iterable[NDArray[np.int8]]) -> tuple[float, float]:
    """How far the spectrum of errors rises above the least of lower frequencies, and the length of that wave [px].

    signs: (rows, columns) of frames, -1 or 1 by the side to which a pixel is off, so that large errors count no more
    than others, and 0 where nothing is known. 1 where it never rises. Along rows or down columns, whichever rises more.
    """
    frames = list(signs)
    return max((_along_rows(frames), _along_rows([frame.T for frame in frames])), key=lambda wave: wave[0])


def _along_rows(frames: list[NDArray[np.int8]]) -> tuple[float, float]:
    width = frames[0].shape[1]
    power = np.sum([(np.abs(np.fft.rfft(frame, axis=1)) ** 2).sum(axis=0) for frame in frames], axis=0)
    smooth = np.convolve(np.pad(power, 1, "edge"), _SMOOTH, "valid")[1:]  # without the mean, which is a bias
    if len(smooth) == 0 or smooth.min() <= 0:
        return 1.0, np.inf
    rises = smooth / np.minimum.accumulate(smooth)
    at = int(np.argmax(rises))
    return float(rises[at]), width / (at + 1)


def strongest_seam(signs: Iterable[NDArray[np.int8]]) -> tuple[float, int]:
    """How much less errors agree across seams between blocks of columns than elsewhere, and how wide these are [px].

    signs: as of :func:`strongest_wave`. They agree by the mean product of neighbours in a row. 0 where nothing differs.
    """
    products = [frame[:, 1:] * frame[:, :-1] for frame in signs]
    agree = sum((one.sum(axis=0) for one in products), np.zeros(1))
    known = sum((np.abs(one).sum(axis=0) for one in products), np.zeros(1))
    best = 0.0, _SIDES[0]
    for side in _SIDES:
        whole = len(agree) // side * side
        if whole < 2 * side:
            continue
        seams, pixels = (one[:whole].reshape(-1, side).sum(axis=0) for one in (agree, known))
        across = seams / np.maximum(pixels, 1)
        inside = (seams.sum() - seams) / np.maximum(pixels.sum() - pixels, 1)
        best = max(best, (float((inside - across).max()), side), key=lambda seam: seam[0])
    return best
