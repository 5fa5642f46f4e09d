"""Where the axes of a run are cut, so that every cell has pixels."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.config import DepthData
from depthsim.gap.depth.data.covariates import Covariates
from depthsim.gap.depth.data.histograms import STEPS
from depthsim.scene import NO_TAG

_TIMES = 6
_ALIKE = 0.003
"""Steps that differ by less are the same: over 30 of them they come apart by a tenth of one."""


@dataclass
class Cuts:
    """Where each axis is cut, by the frames at hand; see :func:`make_cuts`.

    depths, heights, flows, times_seen: first and last of each in the frames [m, m, rad/s, s]. spread: the simulator's
    own spread of the error by tag and range, see :meth:`per_spread`. region_name: a region of the scene in words.
    own_steps: of the recording's disparities, see :func:`~depthsim.gap.depth.data.quantization.find_steps`. instances:
    names of the objects by their numbers.
    """

    camera: Camera
    tags: tuple[str, ...]
    range: NDArray[np.float32]
    range6: NDArray[np.float32]
    range12: NDArray[np.float32]
    height: NDArray[np.float32]
    flow: NDArray[np.float32]
    times: NDArray[np.float64]
    depths: tuple[float, float]
    heights: tuple[float, float]
    fastest: float
    times_seen: tuple[float, float]
    region_of_face: NDArray[np.int16]
    region_name: Callable[[int], str]
    stamps: NDArray[np.float64]
    shown_tags: NDArray[np.int16]
    own_steps: tuple[float, float] | None = None
    instances: dict[int, str] = field(default_factory=dict)
    spread: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))
    spread_cuts: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))

    def per_spread(self, depth: NDArray[np.float32], tag: NDArray[np.uint8]) -> NDArray[np.float32]:
        """1 over the simulator's spread of the depth [1/m] at each pixel; 0 where nothing was hit."""
        where = np.searchsorted(self.spread_cuts, depth)
        return np.where(depth > 0, 1 / self.spread[np.minimum(tag, len(self.spread) - 1), where], 0).astype(np.float32)

    @property
    def steps(self) -> tuple[float, ...]:
        """[px] The usual steps of a disparity, and the recording's own, if it has others."""
        if self.own_steps is None or any(abs(self.own_steps[0] / step - 1) < _ALIKE for step in STEPS):
            return STEPS
        return (*STEPS, self.own_steps[0])

    @property
    def tag_cells(self) -> int:
        """How many materials have cells of their own."""
        return int(self.shown_tags.max()) + 1

    def tag_name(self, cell: int) -> str:
        """The material of a cell."""
        return next((name for t, name in enumerate(self.tags) if self.shown_tags[t] == cell), "other")


def make_cuts(
    camera: Camera,
    tags: tuple[str, ...],
    sample: list[Covariates],
    stamps: NDArray[np.float64],
    used: NDArray[np.integer],
    region_of_face: NDArray[np.int16],
    region_name: Callable[[int], str],
    limit: DepthData,
) -> Cuts:
    """Cut the axes by what the frames ``sample`` show. stamps: of all frames; used: the frames that are looked at."""
    step = max(1, sum(c.depth.size for c in sample) // 200_000)
    hit = [c.depth > 0 for c in sample]

    def gather(name: str, every: int = step) -> NDArray[np.float32]:
        return np.concatenate([getattr(c, name)[h] for c, h in zip(sample, hit, strict=True)])[::every]

    depth, tag = gather("depth"), gather("tag")
    if not depth.size:
        depth, tag = np.array([1.0], np.float32), np.array([NO_TAG], np.uint8)

    def quantiles(values: NDArray[np.float32], count: int) -> NDArray[np.float32]:
        return np.unique(np.quantile(values, np.arange(1, count) / count).astype(np.float32))

    share = np.bincount(tag, minlength=NO_TAG + 1) / len(tag)
    shown = np.full(NO_TAG + 1, -1, np.int16)
    common = [t for t in np.argsort(-share[:NO_TAG]) if share[t] > limit.material_share][: limit.most_materials]
    shown[np.array(common, int)] = np.arange(len(common))
    first, last = float(stamps[used].min()), float(stamps[used].max())
    anything = any(h.any() for h in hit)
    height = gather("height") if anything else np.zeros(1, np.float32)
    flow = gather("flow") if anything else np.zeros(1, np.float32)
    # The ends of the range matter most to limits of range: a quarter of the cuts lie in the outer tenths.
    shares = np.concatenate([[0.005, 0.01, 0.02, 0.035, 0.06], np.arange(1, 16) / 16, [0.965, 0.98, 0.99, 0.995]])
    depths, heights = (_thinned(sample, name) for name in ("depth", "height"))
    return Cuts(
        camera=camera,
        tags=tags,
        range=np.unique(np.quantile(depth, np.sort(shares)).astype(np.float32)),
        range6=quantiles(depth, 6),
        range12=quantiles(depth, 12),
        height=quantiles(height, 12),
        flow=quantiles(flow, 8),
        times=np.linspace(first, last, _TIMES + 1)[1:-1] if last > first else np.empty(0),
        depths=_span(depths, (1.0, 1.0)),
        heights=_span(heights, (0.0, 1.0)),
        fastest=max((float(np.quantile(c.flow, 0.999)) for c in sample), default=0.0),
        times_seen=(first, last),
        region_of_face=region_of_face,
        region_name=region_name,
        stamps=stamps,
        shown_tags=shown,
    )


def _thinned(sample: list[Covariates], name: str) -> NDArray[np.float32]:
    return np.concatenate([getattr(c, name)[c.depth > 0][::53] for c in sample])


def _span(values: NDArray[np.float32], otherwise: tuple[float, float]) -> tuple[float, float]:
    return (float(values.min()), float(values.max())) if len(values) else otherwise
