"""Rows that were doubled when pictures were resampled, seen in the spectrum of where a pixel equals the one above.

Depth that was resampled into a finer picture, as by an alignment to colour, has rows twice, and which they are repeats
itself: once in 1 / (1 - 1 / zoom) rows, in lines that are slanted where the one camera is turned against the other. No
fit that follows slopes finds a zoom: a few pixels on, other rows are doubled.

The steps of a depth without noise repeat themselves on a tilted plane in the same way. So what is found is evidence of
a resampling only where a simulator without one does not show the same lines, see :func:`line_of`.
"""

from collections.abc import Iterable
from itertools import product

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.config import DepthData

_WINDOW, _PADDED = 96, 512
"""[px] Parts of the picture, of which none has another zoom than the next by much; their transforms' size."""
SMALLEST = _WINDOW
"""[px] Pictures must be larger than that to show doubled rows."""
_SLOWEST, _SLANT = 0.05, 0.25
"""[cycles/px] What repeats itself more slowly is the scene's; and how much along rows of what is down columns."""
_OVERTONE = 0.4
"""Of the strongest line: a slower one of which it is a multiple, with so much, is the lines' own."""
_NEAR = 4
"""Of the transform's frequencies: how far a line reaches."""


def find_doubling(pictures: Iterable[NDArray[np.uint16]], limit: DepthData) -> tuple[float, float] | None:
    """The zoom, and the roll [deg] rightwards of what was resampled; None where no rows are doubled.

    pictures: (height, width) as they are stored, each as a whole.
    """
    same = _equal(pictures)
    if same is None:
        return None
    power, least = _spectrum(same)
    down, across = np.fft.fftfreq(_PADDED)[:, None], np.fft.rfftfreq(_PADDED)[None]
    power = np.where((np.abs(down) > _SLOWEST) & (across < _SLANT * np.abs(down)), power, np.nan)
    if not np.nanmax(power, initial=0) > limit.doubling_seen * np.nanmedian(power):
        return None
    row = _lowest(np.nanmax(power, axis=1, initial=0))
    at = row, int(np.nanargmax(power[row]))
    slow, along = float(down[at[0], 0] + _beyond(power[:, at[1]], at[0])), float(_beyond(power[at[0]], at[1]))
    along += float(across[0, at[1]])
    # What is sampled once a row looks the same at a frequency and at 1 less it; of doubled rows fewer are equal.
    if least < 0.9 * (1 - abs(slow)):
        slow -= np.sign(slow)
    if np.nanmean(same) < limit.doubled_equal * (1 - abs(slow)):
        return None
    return 1 / abs(slow), float(np.degrees(np.arctan2(along * np.sign(slow), abs(slow))))


def line_of(pictures: Iterable[NDArray[np.uint16]], doubled: tuple[float, float]) -> float:
    """How strong the lines of a zoom and a roll [deg] are: the amplitude of the share of equal pixels, 0 without any.

    pictures: as for :func:`find_doubling`.
    """
    same = _equal(pictures)
    if same is None:
        return 0.0
    zoom, turned = doubled[0], np.tan(np.radians(doubled[1]))
    power, windows = _spectrum(same)[0], np.hanning(_WINDOW).sum() ** 2
    at = round(np.copysign(1 / zoom, turned) * _PADDED), round(abs(turned) / zoom * _PADDED)
    near = np.arange(-_NEAR, _NEAR + 1)
    return float(2 * np.sqrt(power[np.ix_((at[0] + near) % _PADDED, np.maximum(at[1] + near, 0))].max()) / windows)


def _equal(pictures: Iterable[NDArray[np.uint16]]) -> NDArray[np.float64] | None:
    """(height - 1, width) the share of the pictures in which a pixel equals the one above, NaN where none has both."""
    both, equal = [], []
    for units in pictures:
        both.append((units[1:] > 0) & (units[:-1] > 0))
        equal.append(both[-1] & (units[1:] == units[:-1]))
    if not both or min(both[0].shape) < _WINDOW:
        return None
    known, same = np.sum(both, axis=0), np.sum(equal, axis=0)
    return np.where(known > 0, same / np.maximum(known, 1), np.nan)


def _lowest(most: NDArray[np.float64]) -> int:
    """The strongest frequency, or that of which it is the second or third multiple, if there is much there."""
    strongest = int(np.argmax(most))
    for number in (3, 2):
        for turn in range(number):
            place = round((strongest + turn * _PADDED) / number) % _PADDED
            near = (place + np.arange(-_NEAR, _NEAR + 1)) % _PADDED
            if strongest not in near and most[near].max() > _OVERTONE * most[strongest]:
                return int(near[np.argmax(most[near])])
    return strongest


def _beyond(line: NDArray[np.float64], at: int | np.intp) -> float:
    """How far beyond the largest value of a line its top is [cycles/px], by the parabola through the logarithms."""
    if not 0 < at < len(line) - 1 or not np.isfinite(line[at - 1 : at + 2]).all():
        return 0.0
    before, here, after = np.log(line[at - 1 : at + 2])
    return float(0.5 * (before - after) / (before - 2 * here + after)) / _PADDED


def _spectrum(same: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """The mean power of the windows, and the share of equal pixels in the window that has fewest."""
    hann = np.outer(np.hanning(_WINDOW), np.hanning(_WINDOW))
    total, shares = np.zeros((_PADDED, _PADDED // 2 + 1)), []
    for v, u in product(*(range(0, n - _WINDOW + 1, _WINDOW) for n in same.shape)):
        part = same[v : v + _WINDOW, u : u + _WINDOW]
        some = np.isfinite(part)
        if some.mean() > 0.9:
            share = float(part[some].mean())
            total += np.abs(np.fft.rfft2(np.where(some, part - share, 0) * hann, (_PADDED, _PADDED))) ** 2
            shares.append(share)
    return total / max(len(shares), 1), min(shares, default=1.0)
