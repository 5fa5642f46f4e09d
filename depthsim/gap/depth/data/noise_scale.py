"""The spread of a simulator's own error: the unit in which errors are measured; and how errors differ nearby."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthsim.raycast import Geometry

_APART = 4
"""[px] Between errors of one row that are compared: biases hardly change over as much, and most noise is another."""
ENOUGH = 200
"""Pixels, with fewer of which nothing is said of a material."""
ROUNDED = 0.3
"""Of a unit of depth: as much spread is in depths that are rounded to it."""


class Nearby(NamedTuple):
    """Errors of pairs of pixels of one row and one material, some pixels apart.

    depth: [m] of one of them, float32; tag: what both show; differ: [m] float32 their difference over the root of two,
    which spreads as the errors do.
    """

    depth: NDArray[np.float32]
    tag: NDArray[np.uint8]
    differ: NDArray[np.float32]


def nearby(frames: Iterable[tuple[NDArray[np.uint16], Geometry]], unit: float) -> Nearby:
    """How errors differ from such a few pixels away, free of what changes slowly in a picture. frames, unit: as of
    :func:`spread_of`."""
    found = []
    for units, met in frames:
        ok = (units > 0) & (units < 65535) & (met.depth > 0)
        error = units * np.float32(unit) - met.depth
        one, other = (slice(None), slice(_APART, None)), (slice(None), slice(-_APART))
        both = ok[one] & ok[other] & (met.tag[one] == met.tag[other])
        differ = (error[one] - error[other]) / np.float32(np.sqrt(2))
        found.append((met.depth[one][both], met.tag[one][both], differ[both]))
    return Nearby(*map(np.concatenate, zip(*found, strict=True)))


def spread_of(
    frames: Iterable[tuple[NDArray[np.uint16], Geometry]],
    unit: float,
    tags: int,
    cuts: NDArray[np.float32] | None = None,
    *,
    without_bias: bool = False,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Cuts of the range [m], and the spread of the depth [m] by tag and range between them: (tags + 1, cuts + 1).

    frames: what is stored, in units of ``unit`` metres, and what is there. cuts: to be taken, by the frames if not
    given; of what no pixel shows the spread is then infinite. without_bias: about the median error between them.
    """
    parts = []
    for units, met in frames:
        ok = (units > 0) & (units < 65535) & (met.depth > 0)
        error = units[ok] * np.float32(unit) - met.depth[ok]
        parts.append(np.stack([met.depth[ok], met.tag[ok].astype(np.float32), error]))
    depth, tag, error = np.concatenate(parts, axis=1)
    least = np.float32(ROUNDED * unit)
    nothing = least if cuts is None else np.float32(np.inf)
    if not depth.size:
        cuts = np.empty(0, np.float32) if cuts is None else cuts
        return cuts, np.full((tags + 1, len(cuts) + 1), max(nothing, 1e-3), np.float32)
    if cuts is None:
        cuts = np.unique(np.quantile(depth, np.arange(1, 20) / 20).astype(np.float32))
    cell = np.searchsorted(cuts, depth)
    found = np.empty((tags + 1, len(cuts) + 1), np.float32)
    for k in range(len(cuts) + 1):
        here = cell == k
        common = spread(error[here], without_bias=without_bias) if here.any() else nothing
        for t in range(tags + 1):
            own = error[here & (tag == t)]
            found[t, k] = max(spread(own, without_bias=without_bias) if own.size >= ENOUGH else common, least)
    return cuts, found


def spread(errors: NDArray[np.float32], *, without_bias: bool = False) -> float:
    """The standard deviation of a normal distribution whose absolute values have this median."""
    return float(np.median(np.abs(errors - np.median(errors) if without_bias else errors)) * 1.4826)
