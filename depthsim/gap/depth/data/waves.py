"""Waves of errors, such as a second projector's stripes, or even and odd columns; they may move from frame to frame.

The spectrum of noise is flat, and falls where neighbouring pixels go together. That of waves rises at their frequency.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

_SMOOTH = np.array([0.25, 0.5, 0.25])


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
