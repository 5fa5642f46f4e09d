"""What the camera's driver does to the finished picture."""

from typing import ClassVar

import numpy as np

from depthsim.kernels import inlined, kernel
from depthsim.parallel import split
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_f = np.float32
_ZERO = _f(0)
_LANES = 16


@inlined
def _follow(alpha, delta, above, here, before):
    """Draw the values of a line to the smoothed ones above it. before: what stood above until then; written over."""
    keep = _f(1) - alpha
    for u in range(here.size):
        d, p = here[u], before[u]
        near = (d > _ZERO) & (p > _ZERO) & (abs(d - p) < delta)
        here[u] = alpha * d + keep * above[u] if near else d
        before[u] = d


@inlined
def _there_and_back(alpha, delta, lines, pitch, first, count, before):
    """Smooth ``count`` columns from ``first`` on, down and up again. lines: flat, ``pitch`` values a line."""
    # Slices of a flat array, because the compiler does not use the vector unit where a stride is not plainly one.
    height = lines.size // pitch
    before[:] = lines[first : first + count]
    for v in range(1, height):
        at = v * pitch + first
        _follow(alpha, delta, lines[at - pitch : at - pitch + count], lines[at : at + count], before)
    before[:] = lines[(height - 1) * pitch + first : (height - 1) * pitch + first + count]
    for v in range(height - 2, -1, -1):
        at = v * pitch + first
        _follow(alpha, delta, lines[at + pitch : at + pitch + count], lines[at : at + count], before)


@kernel
def _smooth_rows(start, stop, width, alpha, delta, disparity):
    """Rows ``start`` to ``stop``, 16 at a time side by side, so that the vector unit has something to do."""
    lines, before = np.zeros(width * _LANES, np.float32), np.empty(_LANES, np.float32)
    for at in range(start, stop, _LANES):
        rows = min(_LANES, stop - at)
        for u in range(width):
            for r in range(rows):
                lines[u * _LANES + r] = disparity[(at + r) * width + u]
        _there_and_back(alpha, delta, lines, _LANES, 0, _LANES, before)
        for u in range(width):
            for r in range(rows):
                disparity[(at + r) * width + u] = lines[u * _LANES + r]


@kernel
def _smooth_columns(start, stop, width, alpha, delta, disparity):
    """Columns ``start`` to ``stop``."""
    _there_and_back(alpha, delta, disparity, width, start, stop - start, np.empty(stop - start, np.float32))


class SpatialFilter(Effect):
    """The driver's edge-preserving filter: d' = alpha·d + (1 - alpha)·d'₋₁ along rows and columns, there and back.

    d is the disparity, d'₋₁ the smoothed one of the pixel before. It is left as it is where it differs from the pixel
    before by ``delta`` or more, and next to a hole. Holes stay holes.
    """

    id: ClassVar[str] = "spatial_filter"
    stage: ClassVar[Stage] = Stage.PROCESSING
    source: ClassVar[str] = "librealsense, src/proc/spatial-filter: Gastal and Oliveira 2011, recursive"
    # Where neighbours differ by more than delta, by noise far off or by a slant, it does nothing; what it does to edges
    # is the same in every frame.
    axes = ("pixel_neighbours", "edge_distance", "range", "incidence", "frame_neighbours")
    kinds = ("correlation", "spread", "bias")
    recording = "a sharp depth edge before a far background, with the camera's filters off and on"
    forms = ({"iterations": 2}, {"iterations": 1})

    alpha: float = parameter(
        0.5,
        low=0.05,
        high=1,
        unit="1",
        neutral=1,
        about="weight of the pixel itself",
        source="librealsense's default",
        starts=(0.5, 0.85, 0.95),
    )
    delta: float = parameter(
        20 / 32, low=0, high=16, unit="px", neutral=0, about="step of the disparity that counts as an edge",
        source="librealsense's default, 20 steps of 1/32 px",
    starts=(0.2, 1.0),)  # fmt: skip
    iterations: int = parameter(
        2,
        low=0,
        high=5,
        unit="1",
        neutral=0,
        about="how often",
        source="librealsense's default",
        frozen=True,
    )

    def apply(self, frame: Frame) -> None:
        """Smooth the picture."""
        height, width = frame.camera.shape
        arguments = (width, _f(self.alpha), _f(self.delta), frame.disparity.reshape(-1))
        for _ in range(self.iterations):
            split(_smooth_rows, height, frame.threads, *arguments, multiple=_LANES)
            split(_smooth_columns, width, frame.threads, *arguments, multiple=_LANES)
