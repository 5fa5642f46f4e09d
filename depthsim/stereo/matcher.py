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
from depthsim.stereo import choose, cost, neighbours, paths, refine, smoothing
from depthsim.stereo.settings import MatcherSettings
from depthsim.stereo.speckles import drop_speckles


class Matcher:
    """Finds the disparity of rectified pairs; what it works in is kept from pair to pair, one set an object.

    The result does not depend on the number of threads. An object must not be used by two threads at the same time.
    """

    def __init__(self, settings: MatcherSettings | None = None) -> None:
        self.settings = settings or MatcherSettings()
        self._kept: dict[str, NDArray[Any]] = {}

    def _room(self, name: str, kind: type[np.generic], *shape: int) -> NDArray[Any]:
        """The array of that name, as it was left: memory that the system has to hand out anew takes a tenth of a match.

        It begins where a vector of 64 bytes does, and behind it there is room for vectors that hang over its end.
        """
        size = math.prod(shape)
        if name not in self._kept or self._kept[name].size != size + refine.LANES:
            raw = np.zeros((size + refine.LANES) * np.dtype(kind).itemsize + 64, np.uint8)
            first = -raw.ctypes.data % 64
            self._kept[name] = raw[first : first + raw.size - 64].view(kind)
        return self._kept[name][:size].reshape(shape)

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
        costs, vertical = (self._room(name, np.uint8, height, width, padded) for name in ("cost", "vertical"))
        pair = [np.ascontiguousarray(image, np.float32) for image in (left, right)]
        codes = self._room("codes", np.uint64, 2, height, width)
        noise = max(cost.noise_level(image[::2]) for image in pair)
        tolerance = np.float32(max(settings.tolerance * noise, settings.least_tolerance))
        border = self._room("border", np.float32, height + 2 * cost.DOWN, width + 2 * cost.ACROSS)
        for image, code in zip(pair, codes, strict=True):
            cost.put_in_border(image, border)
            split(cost.census, height, threads, border, tolerance, code)
        across, down = settings.window[0] // 2, settings.window[1] // 2
        pixels, shift = settings.window[0] * settings.window[1], cost.shift_of(settings.window)
        split(cost.cost_rows, height, threads, codes[0], codes[1], disparities, across, down, shift, costs)
        small, large = ((step * pixels) >> shift for step in (settings.small_step, settings.large_step))
        blocks = -(-width // paths.BLOCK)
        split(paths.vertical, blocks, threads, costs, min(small, 255), min(large, 255), vertical)
        whole, seen = self._room("whole", np.int16, 2, height, width)
        firm, fine = self._room("firm", np.uint8, height, width), self._room("fine", np.float32, height, width)
        worst = int(settings.worst_score * cost.BITS * pixels) >> shift
        split(
            choose.choose_rows, height, threads, costs, vertical, disparities,
            (min(small, 255), min(large, 255)), settings.margin, worst, settings.left_right,
            (int(settings.median * cost.BITS * pixels) >> shift, int(settings.quantile * disparities)),
            settings.second_peak, whole, fine, firm,
        )  # fmt: skip
        across, down = settings.neighbourhood[0] // 2, settings.neighbourhood[1] // 2
        split(neighbours.drop_lonely_rows, height, threads, firm, across, down, settings.neighbours, whole)
        if settings.torn_reach:
            seen[:] = whole
            split(
                choose.drop_torn_rows, height, threads, costs, seen, settings.torn_reach,
                float(settings.torn_share), whole,
            )  # fmt: skip
        smooth = self._room("smooth", np.float32, 2, height, width)
        for image, part in zip(pair, smooth, strict=True):
            split(refine.normalise_rows, height, threads, image, 10, 8, np.float32(settings.floor), part)
        across, down = settings.support[0] // 2, settings.support[1] // 2
        arms = self._room("arms", np.int16, 4, height, width)
        sums, (start, before, out) = (
            self._room(name, np.float32, count, height, width) for name, count in (("sums", 2), ("steps", 3))
        )
        split(refine.arms_of_rows, height, threads, whole, across, down, arms)
        start[:] = whole
        out[:] = fine
        np.copyto(out, -1, where=whole < 0)
        for _ in range(settings.steps):
            before, out = out, before
            split(refine.shift_rows, height, threads, smooth[0], smooth[1], arms[:2], before, sums)
            split(
                refine.solve_rows, height, threads, start, arms[2:], down, sums, np.float32(settings.texture), before,
                out,
            )  # fmt: skip
        if settings.speckle_size > 1:
            drop_speckles(out, settings.speckle_size, float(settings.speckle_step))
        found, (across, down) = np.empty_like(out), settings.smoothing
        split(
            smoothing.smooth_rows, height, threads, out, across // 2, down // 2, np.float32(settings.smoothing_step),
            refine.STEPS, found,
        )  # fmt: skip
        found[found < settings.least_disparity] = -1
        return found


def to_depth(disparity: NDArray[np.float32], focal_baseline: float) -> NDArray[np.float32]:
    """Depth [m] of a disparity [px]; 0 where there is none, or where it is 0."""
    out = np.zeros_like(disparity)
    return np.divide(np.float32(focal_baseline), disparity, out=out, where=disparity > 0)
