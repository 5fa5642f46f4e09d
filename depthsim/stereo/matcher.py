"""The matcher: a rectified pair of images in, disparity out, in the steps that the D4 chip takes.

OpenCV's StereoSGBM would be the library for this. It compares grey values: ``benchmarks/stereo_matching.py`` finds that
it has 80 % of the pixels within 0.5 px at night with dots and 69 % by day, this census 94 and 80 %, and more so where
the two images are not equally bright; and its steps are 1/16 px, the chip's 1/32.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.parallel import core_count, split
from depthsim.stereo import choose, cost, neighbours, paths, refine
from depthsim.stereo.settings import MatcherSettings
from depthsim.stereo.speckles import drop_speckles


class Matcher:
    """Finds the disparity of rectified pairs; the volumes of costs are kept from pair to pair, one set an object.

    The result does not depend on the number of threads. An object must not be used by two threads at the same time.
    """

    def __init__(self, settings: MatcherSettings | None = None) -> None:
        self.settings = settings or MatcherSettings()
        self._cost = self._vertical = np.empty((0, 0, 0), np.uint8)

    def match(
        self, left: NDArray[np.integer], right: NDArray[np.integer], threads: int | None = None
    ) -> NDArray[np.float32]:
        """(height, width) float32 disparity of the left image [px], in steps of 1/32; -1 where there is none.

        left, right: (height, width) uint8 or uint16, rectified: a point lies in the same row of both, and in the right
        image at x - disparity. Their brightness need not agree.
        """
        if left.shape != right.shape or left.ndim != 2:
            raise ValueError(f"the images are {left.shape} and {right.shape}, not two of one size")
        threads, settings = threads or core_count(), self.settings
        height, width = left.shape
        disparities = min(settings.disparities, width)
        padded = (disparities // cost.LANES + 1) * cost.LANES
        if self._cost.shape != (height, width, padded):
            self._cost = np.empty((height, width, padded), np.uint8)
            self._vertical = np.empty_like(self._cost)
        pair = [np.ascontiguousarray(image, np.float32) for image in (left, right)]
        codes = np.empty((2, height, width), np.uint64)
        noise = max(cost.noise_level(image[::2]) for image in pair)
        tolerance = np.float32(max(settings.tolerance * noise, settings.least_tolerance))
        for image, code in zip(pair, codes, strict=True):
            border = np.pad(image, ((cost.DOWN,) * 2, (cost.ACROSS,) * 2), mode="edge")
            split(cost.census, height, threads, border, tolerance, code)
        across, down = settings.window[0] // 2, settings.window[1] // 2
        pixels, shift = settings.window[0] * settings.window[1], cost.shift_of(settings.window)
        split(cost.cost_rows, height, threads, codes[0], codes[1], disparities, across, down, shift, self._cost)
        small, large = ((step * pixels) >> shift for step in (settings.small_step, settings.large_step))
        blocks = -(-width // paths.BLOCK)
        split(paths.vertical, blocks, threads, self._cost, min(small, 255), min(large, 255), self._vertical)
        whole, firm = np.empty((height, width), np.int16), np.empty((height, width), np.uint8)
        worst = int(settings.worst_score * cost.BITS * pixels) >> shift
        split(
            choose.choose_rows, height, threads, self._cost, self._vertical, disparities,
            (min(small, 255), min(large, 255)), settings.margin, worst, settings.left_right,
            (int(settings.median * cost.BITS * pixels) >> shift, int(settings.quantile * disparities)),
            settings.second_peak, whole, firm,
        )  # fmt: skip
        across, down = settings.neighbourhood[0] // 2, settings.neighbourhood[1] // 2
        split(neighbours.drop_lonely_rows, height, threads, firm, across, down, settings.neighbours, whole)
        if settings.torn_reach:
            seen = whole.copy()
            split(
                choose.drop_torn_rows, height, threads, self._cost, seen, settings.torn_reach,
                float(settings.torn_share), whole,
            )  # fmt: skip
        smooth = np.empty((2, height, width), np.float32)
        for image, part in zip(pair, smooth, strict=True):
            split(refine.normalise_rows, height, threads, image, 10, 8, np.float32(settings.floor), part)
        across, down = settings.support[0] // 2, settings.support[1] // 2
        arms = _roomy(np.int16, 4, height, width)
        sums, (start, before, out) = (_roomy(np.float32, count, height, width) for count in (2, 3))
        split(refine.arms_of_rows, height, threads, whole, across, down, arms)
        start[:] = out[:] = whole
        for _ in range(settings.steps):
            before, out = out, before
            split(refine.shift_rows, height, threads, smooth[0], smooth[1], arms[:2], before, sums)
            split(
                refine.solve_rows, height, threads, start, arms[2:], down, sums, np.float32(settings.texture), before,
                out,
            )  # fmt: skip
        out[out < settings.least_disparity] = -1
        if settings.speckle_size > 1:
            drop_speckles(out, settings.speckle_size, float(settings.speckle_step))
        return out


def _roomy(kind: type[np.generic], *shape: int) -> NDArray[Any]:
    """An array with room behind it for vectors that hang over its end."""
    size = math.prod(shape)
    room = np.zeros(size + refine.LANES, kind)
    return room[:size].reshape(shape)


def to_depth(disparity: NDArray[np.float32], focal_baseline: float) -> NDArray[np.float32]:
    """Depth [m] of a disparity [px]; 0 where there is none, or where it is 0."""
    out = np.zeros_like(disparity)
    return np.divide(np.float32(focal_baseline), disparity, out=out, where=disparity > 0)
