"""The steps of a recording's disparities, seen in the spectrum of their histogram.

A fit that follows slopes does not find them: a step that is wrong by one part in a hundred is out of tune with the
right one after fifty steps.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.config import DepthData
from depthsim.runs import Run

_CELL, _SPAN = 1 / 1024, 256.0
"""Width of the histogram's cells, and of the whole [px]."""
_LEAST_PIXELS = 2000


def find_steps(
    run: Run, frames: Iterable[tuple[int, NDArray[np.float32]]], limit: DepthData
) -> tuple[float, float] | None:
    """The step [px], and where the steps begin, in steps from -0.5 to 0.5; None where none are seen.

    frames: the number of each, and the depth of the scene there [m].
    """
    seen, there = [], []
    for index, depth in frames:
        seen.append(_disparities(run.camera, run.depth_raw(index).reshape(-1)[::3]))
        there.append(_disparities(run.camera, np.round(depth.reshape(-1)[::3] / run.camera.depth_scale)))
    if min(sum(map(len, seen)), sum(map(len, there))) <= _LEAST_PIXELS:
        return None
    return _steps_of(np.concatenate(seen), np.concatenate(there), limit)


def _disparities(camera: Camera, units: NDArray[np.integer] | NDArray[np.floating]) -> NDArray[np.float64]:
    known = units[(units > 0) & (units < 65535)].astype(np.float64)
    disparity = camera.focal_baseline / (known * camera.depth_scale)
    # Where the unit of the depth is wide, it hides steps, or shows its own.
    return disparity[(disparity < _SPAN) & (disparity / known < 0.1)]


def _steps_of(seen: NDArray[np.float64], there: NDArray[np.float64], limit: DepthData) -> tuple[float, float] | None:
    real, scene = (_spectrum(disparity) for disparity in (seen, there))
    frequencies = np.arange(len(real)) / _SPAN
    allowed = (frequencies >= 1 / limit.coarsest_step) & (frequencies <= 0.1 / _CELL)
    # The scene has a shape, and its own spectrum with it: an edge, a wall at one distance.
    line = np.where(allowed & (real > limit.step_over_scene * scene), real, 0)
    if line.max() < limit.step_seen:
        return None
    lowest = int(np.flatnonzero(line > limit.overtone * line.max())[0])
    near = slice(lowest, lowest + int(0.3 * _SPAN))
    at = frequencies[lowest + int(np.argmax(line[near]))]
    fine = at + np.linspace(-1, 1, 81) / _SPAN
    some = seen[:: max(1, len(seen) // 20_000)]
    waves = np.exp(-2j * np.pi * fine[:, None] * some).mean(axis=1)
    best = int(np.argmax(np.abs(waves)))
    return float(1 / fine[best]), float(-np.angle(waves[best]) / (2 * np.pi))


def _spectrum(disparity: NDArray[np.float64]) -> NDArray[np.float64]:
    counts = np.bincount((disparity / _CELL).astype(np.int64), minlength=int(_SPAN / _CELL))
    return np.asarray(np.abs(np.fft.rfft(counts)) / len(disparity))
