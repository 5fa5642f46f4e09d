"""How the errors of single pixels are distributed, and how those of neighbours go together, as numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.frames import inner_rows
from depthsim.gap.report.drawing import Array, Drawn

Floats = NDArray[np.float32]
Frames = Callable[[int], list[NDArray[np.uint16]]]
_LAGS = 12
_CLIP = 5.0
NEAR, FAR = np.linspace(-5, 5, 81), np.linspace(-40, 40, 81)
"""Edges of the histograms of the core and of the tails [spreads of the simulator]."""
_BLOCKS = 4
"""How many blocks of frames are looked at, which is plenty for a picture."""


@dataclass(frozen=True)
class Sample:
    """The errors of one sensor in some frames. error: (frames, rows, width) in spreads of the simulator, NaN where
    there is no measurement or the scene may not be trusted. holes: share of the pixels that should have a depth.
    """

    name: str
    colour: str
    error: Floats
    block: NDArray[np.int64]
    holes: float


def sample(evidence: Evidence, name: str, colour: str, blocks: Sequence[int], frames: Frames) -> Sample:
    """The errors of the pictures that ``frames`` gives of each block."""
    selected = list(blocks)[:: max(1, -(-len(blocks) // _BLOCKS))]
    errors, numbers, holes, wanted = [], [], 0, 0
    for block in selected:
        for index, units in zip(evidence.blocks[block], frames(block), strict=True):
            frame = evidence.frames[int(index)]
            clean = frame.geometry.depth
            asked = clean > 0
            mask = evidence.trusted(int(index))
            if mask is not None:
                asked &= mask
            asked &= inner_rows(frame.camera)[:, None]  # pixels beside a cut are no neighbours
            valid = asked & (units > 0) & (units < 65535)
            depth = units * np.float32(evidence.camera.depth_scale)
            error = (depth - clean) * frame.per_spread.reshape(clean.shape)
            errors.append(np.where(valid, error, np.nan).astype(np.float32))
            numbers.append(block)
            wanted += int(asked.sum())
            holes += int((asked & ~valid).sum())
    return Sample(name, colour, np.stack(errors), np.array(numbers), holes / max(wanted, 1))


class ErrorShares(Drawn):
    """The density of one sensor's errors, (80,) between NEAR and between FAR. holes: share of the pixels."""

    name: str
    colour: str
    holes: float
    near: Array
    far: Array


class Correlations(Drawn):
    """The correlation of one sensor's errors some pixels apart along rows and columns, and some frames apart."""

    name: str
    colour: str
    rows: Array
    columns: Array
    frames: Array


def error_shares(one: Sample) -> ErrorShares:
    """How the errors of one sensor are distributed."""
    values = one.error[np.isfinite(one.error)]
    near, far = (np.histogram(values, edges)[0] / max(values.size, 1) / np.diff(edges) for edges in (NEAR, FAR))
    return ErrorShares(name=one.name, colour=one.colour, holes=one.holes, near=near, far=far)


def correlations(one: Sample) -> Correlations:
    """How the errors of one sensor go together."""
    rows, columns, frames = _correlations(one)
    return Correlations(name=one.name, colour=one.colour, rows=rows, columns=columns, frames=frames)


def _frames_apart(one: Sample) -> int:
    return int(min(np.bincount(one.block).max() - 1, 4))


def _correlations(one: Sample) -> tuple[Floats, Floats, Floats]:
    e = np.clip(one.error, -_CLIP, _CLIP)
    rows = [1.0] + [_correlation(e[:, :, k:], e[:, :, :-k]) for k in range(1, min(_LAGS, e.shape[2] - 1) + 1)]
    columns = [1.0] + [_correlation(e[:, k:], e[:, :-k]) for k in range(1, min(_LAGS, e.shape[1] - 1) + 1)]
    times = [1.0]
    for k in range(1, _frames_apart(one) + 1):
        same = one.block[k:] == one.block[:-k]
        times.append(_correlation(e[k:][same], e[:-k][same]))
    return tuple(np.array(values, np.float32) for values in (rows, columns, times))  # type: ignore[return-value]


def _correlation(a: Floats, b: Floats) -> float:
    both = np.isfinite(a) & np.isfinite(b)
    x, y = a[both].astype(np.float64), b[both].astype(np.float64)
    if x.size < 2 or x.std() == 0 or y.std() == 0:
        return float("nan")
    return float(np.mean((x - x.mean()) * (y - y.mean())) / (x.std() * y.std()))
