"""The spread of depth errors, how far it can be trusted, and what is no noise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64] | NDArray[np.float32]
Groups = NDArray[np.integer]

CUT = 6.0
"""Robust deviations from the middle beyond which an error counts as an outlier; Gaussian noise has none there."""
LEAST_GROUPS = 8
"""With fewer groups their scatter says too little."""
LEAST_IN_PATCH = 10
"""A patch with fewer errors is left out: its mean would take too much of the noise away."""
TILES = 8
"""Groups of neighbouring pixels: this many a side."""
BLOCKS = 20
"""Groups of consecutive frames, at most."""


@dataclass(frozen=True)
class Spread:
    """The spread of some errors [m]; ``kept``: (n,), where they are no outliers. The rest is as in ``Point``."""

    std: float
    robust_std: float
    mean: float
    count: float
    outliers: float
    kept: NDArray[np.bool_]


def robust_deviation(errors: Floats) -> tuple[float, float]:
    """The median, and the deviation 1.4826 · MAD, which is the std of Gaussian errors."""
    middle = float(np.median(errors))
    return middle, 1.4826 * float(np.median(np.abs(errors - middle)))


def spread_of(
    errors: Floats, groupings: tuple[Groups, ...], unit: float, *, patches: Groups | None = None, fitted: int = 0
) -> Spread:
    """The spread of errors (n,) [m].

    groupings: ways to put the errors into groups that are independent of each other, (n,) whole numbers each.
    unit: the step of the depth [m]: no cut is made nearer than six of them.
    patches: (n,) which patch of the scene an error is from; the std is then that about the mean of each patch.
    fitted: parameters that were fitted to the errors before, for Bessel's correction.
    """
    patches = np.zeros(errors.size, np.int64) if patches is None else patches
    kept = np.ones(errors.size, bool)
    off: Floats = errors
    # An outlier draws the mean of its patch, so that the cut is made again about the means without it.
    for _ in range(2):
        mean, number = _means(errors, patches, kept)
        off = errors - mean[patches]
        kept = (np.abs(off) <= CUT * _scale(off, unit)) & (number >= LEAST_IN_PATCH)[patches]
        if not kept.any():
            return Spread(0.0, 0.0, 0.0, 0.0, 0.0, kept)
    mean, number = _means(errors, patches, kept)
    there = (number > 0)[patches]
    off = (errors - mean[patches])[there]
    squares, weights = (off[kept[there]]) ** 2, (1 - 1 / np.maximum(number, 1))[patches[kept]]
    std = float(np.sqrt(squares.sum() / max(weights.sum() - fitted, 1)))
    count = effective_count(squares, weights, tuple(group[kept] for group in groupings))
    bias = float(errors[kept].mean(dtype=np.float64))
    return Spread(std, robust_deviation(off)[1], bias, count, float(1 - kept[there].mean()), kept)


def _means(errors: Floats, patches: Groups, kept: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The mean of what is kept in each patch, 0 where nothing is, and how many they are."""
    most = int(patches.max()) + 1
    number = np.bincount(patches[kept], minlength=most)
    return np.bincount(patches[kept], errors[kept], minlength=most) / np.maximum(number, 1), number


def _scale(off: Floats, unit: float) -> float:
    # Coarse steps of disparity can put more than half of the errors into one level, and the MAD is then 0.
    low, high = np.percentile(off, (5, 95))
    return max(robust_deviation(off)[1], float(high - low) / 3.29, unit)


def effective_count(squares: Floats, weights: Floats, groupings: tuple[Groups, ...]) -> float:
    """How many independent Gaussian numbers have a std as exact as this one's; 0 where it is not known.

    The variance is S / N, S the sum of ``squares`` and N of ``weights`` (n,). From groups g that are independent of
    each other, its own sampling variance is G / (G - 1) · Σ (S_g - N_g·S/N)² / N² (Cochran 1977, ratio estimator).
    Noise correlated between the pixels of a group, heavy tails and noise that is uneven over the image all enlarge it.
    n Gaussian numbers have 2 S² / (N² (n - 1)), which gives n. Of several groupings the least n is taken.
    """
    total, size = squares.sum(), weights.sum()
    counts = []
    for groups in groupings:
        of_group = np.bincount(groups, weights)
        there = of_group > 0
        number = int(there.sum())
        if number < LEAST_GROUPS:
            continue
        off = np.bincount(groups, squares)[there] - of_group[there] * total / size
        relative = number / (number - 1) * (off**2).sum() / total**2 if total > 0 else np.inf
        counts.append(1 + 2 / relative if relative > 0 else size)
    return float(min([*counts, size])) if counts else 0.0


def tile_numbers(height: int, width: int) -> NDArray[np.int64]:
    """(height, width): which of TILES x TILES tiles each pixel lies in."""
    rows, columns = np.arange(height) * TILES // height, np.arange(width) * TILES // width
    return rows[:, None] * TILES + columns


def block_numbers(frames: int) -> NDArray[np.int64]:
    """(frames,): which of at most BLOCKS runs of consecutive frames each frame lies in."""
    return np.arange(frames) * min(BLOCKS, frames) // frames
