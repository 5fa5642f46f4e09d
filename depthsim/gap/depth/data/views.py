"""The views of a run: along which axes, cut into which cells, what is counted there."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.depth.data.counting import NO_CELL
from depthsim.gap.depth.data.covariates import EDGE_CODES, Covariates
from depthsim.gap.depth.data.histograms import (
    ACROSS,
    BEFORE,
    BINS,
    ERROR,
    FAR_LEFT,
    FAR_UP,
    LEFT,
    PHASE,
    STEPS,
    UP,
)  # fmt: skip
from depthsim.scene import NO_TAG

_REGIONS = 64
_TIMES = 6
Cells = Callable[["Cuts", Covariates, int], NDArray[np.integer]]


@dataclass(frozen=True)
class View:
    """One way to look: ``axis`` as in diagnosis.json, ``kind`` what is counted, ``size`` how many cells there are.

    cells gives a cell for every pixel of a frame; -1 is none. single: whether the cells lie along one axis alone.
    """

    axis: str
    kind: int
    size: int
    cells: Cells
    single: bool = True
    unit: str = ""


@dataclass
class Cuts:
    """Where each axis is cut, from the frames at hand, so that every cell has pixels.

    Built by :meth:`of`. spread: the simulator's own spread of the error by tag and range, see :meth:`per_spread`.
    """

    camera: Camera
    tags: tuple[str, ...]
    range: NDArray[np.float32]
    range6: NDArray[np.float32]
    range12: NDArray[np.float32]
    height: NDArray[np.float32]
    flow: NDArray[np.float32]
    times: NDArray[np.float64]
    region_of_face: NDArray[np.int16]
    stamps: NDArray[np.float64]
    shown_tags: NDArray[np.int16]
    spread: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))
    spread_cuts: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))

    def per_spread(self, depth: NDArray[np.float32], tag: NDArray[np.uint8]) -> NDArray[np.float32]:
        """1 over the simulator's spread of the depth [1/m] at each pixel; 0 where nothing was hit."""
        where = np.searchsorted(self.spread_cuts, depth)
        return np.where(depth > 0, 1 / self.spread[np.minimum(tag, len(self.spread) - 1), where], 0).astype(np.float32)


def _cut(values: NDArray[np.floating], edges: NDArray[np.floating]) -> NDArray[np.int16]:
    return np.searchsorted(edges, values).astype(np.int16)


def _hit(c: Covariates, cell: NDArray[np.integer]) -> NDArray[np.integer]:
    return np.where(c.depth > 0, cell, -1)


def _columns(c: Covariates) -> NDArray[np.integer]:
    return np.broadcast_to(np.arange(c.depth.shape[1]), c.depth.shape)


def _rows(c: Covariates) -> NDArray[np.integer]:
    return np.broadcast_to(np.arange(c.depth.shape[0])[:, None], c.depth.shape)


def _range(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return np.where(c.depth > 0, _cut(c.depth, k.range), len(k.range) + 1)


def _tag(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return k.shown_tags[c.tag]


def _range_tag(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _hit(c, k.shown_tags[c.tag] * (len(k.range12) + 1) + _cut(c.depth, k.range12))


ANGLES = np.cos(np.radians([15, 25, 35, 45, 52, 58, 64, 69, 74, 79, 84]))[::-1].astype(np.float32)
_FEW_ANGLES = np.cos(np.radians([8, 16, 25, 38, 50, 60, 70, 78]))[::-1].astype(np.float32)


def _incidence(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _hit(c, len(ANGLES) - _cut(c.cosine, ANGLES))


def _incidence_tag(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _hit(c, k.shown_tags[c.tag] * (len(_FEW_ANGLES) + 1) + len(_FEW_ANGLES) - _cut(c.cosine, _FEW_ANGLES))


def _row(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _rows(c) * 16 // k.camera.height


def _column(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _columns(c) * 32 // k.camera.width


def radius(camera: Camera) -> NDArray[np.float32]:
    """(height, width): distance from the principal point, 1 at the farthest corner."""
    r = np.hypot(*camera.rays)
    return (r / r.max()).astype(np.float32)


def _radius(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return np.minimum((radius(k.camera) * 10).astype(np.int16), 9)


def _position(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return (_rows(c) * 12 // k.camera.height) * 16 + _columns(c) * 16 // k.camera.width


def _edge(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    near = (c.edge > 0) | c.hidden
    return np.where(near, c.edge.astype(np.int16) + EDGE_CODES * c.hidden, -1)


def _phase(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    disparity = k.camera.focal_baseline / np.maximum(c.depth, 1e-3)
    return _hit(c, np.minimum(((disparity - np.floor(disparity)) * 16).astype(np.int16), 15))


def _time(k: Cuts, c: Covariates, frame: int) -> NDArray[np.integer]:
    return np.full(c.depth.shape, np.searchsorted(k.times, k.stamps[frame]))


def _time_range(k: Cuts, c: Covariates, frame: int) -> NDArray[np.integer]:
    return _hit(c, _time(k, c, frame) * (len(k.range6) + 1) + _cut(c.depth, k.range6))


def _height(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _hit(c, _cut(c.height, k.height))


def _region(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _hit(c, k.region_of_face[np.maximum(c.face, 0)])


def _normal(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    facing = c.normal * np.where(c.toward, 1, -1)
    x, y, z = (np.searchsorted([-0.38, 0.38], axis) for axis in facing)
    return _hit(c, x * 9 + y * 3 + z)


def _flow(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _hit(c, _cut(c.flow, k.flow))


_SIGNED = np.array([-4, -1.5, -0.5, -0.12, 0.12, 0.5, 1.5, 4], np.float32)
_SLOPES = np.array([-2, -0.6, -0.15, 0.15, 0.6, 2], np.float32)


def _drift(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    """Where the depth would go in 10 ms, in spreads, and the third of the picture."""
    moves = c.drift * np.float32(0.01) * k.per_spread(c.depth, c.tag)
    return _hit(c, (_rows(c) * 3 // k.camera.height) * 9 + _cut(moves, _SIGNED))


def _slope(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    """Where the depth would go for half a pixel in x and in y, in spreads."""
    per = k.per_spread(c.depth, c.tag) * np.float32(0.5)
    x, y = (_cut(s * per / np.float32(f), _SLOPES) for s, f in ((c.slope_x, k.camera.fx), (c.slope_y, k.camera.fy)))
    return _hit(c, x * 7 + y)


def _radial(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    """Where the depth would go if the ray went outwards, by the third of the image radius."""
    x, y = k.camera.rays
    r = np.maximum(np.hypot(x, y), 1e-6)
    out = (x * c.slope_x + y * c.slope_y) / r * k.per_spread(c.depth, c.tag) / np.float32(2 * k.camera.fx)
    return _hit(c, np.minimum((radius(k.camera) * 3).astype(np.int16), 2) * 9 + _cut(out, _SIGNED))


def _roll(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    """Where the depth would go if the picture turned by half a degree."""
    x, y = k.camera.rays
    turned = (x * c.slope_y - y * c.slope_x) * np.float32(np.radians(0.5)) * k.per_spread(c.depth, c.tag)
    return _hit(c, _cut(turned, _SIGNED))


def _band(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    """Columns from the left border, less the disparity."""
    beyond = _columns(c) - k.camera.focal_baseline / np.maximum(c.depth, 1e-3)
    return np.where((beyond < 40) & (c.depth > 0), np.clip(beyond / 2 + 4, 0, 23).astype(np.int16), -1)


def _few(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _hit(c, _cut(c.depth, k.range6) * 2 + (c.edge > 0))


def _few_ranges(k: Cuts, c: Covariates, _: int) -> NDArray[np.integer]:
    return _hit(c, _cut(c.depth, k.range6))


def _step_cells(step: float) -> Cells:
    def cells(k: Cuts, c: Covariates, frame: int) -> NDArray[np.integer]:
        """Only where the step is wider than the unit of the depth, which would hide it."""
        seen = c.depth * c.depth * np.float32(step / k.camera.focal_baseline) > 2.5 * k.camera.depth_scale
        return np.where(seen & (c.depth > 0), 0, -1)

    return cells


def make_views(cuts: Cuts) -> list[View]:
    """All views of a run."""
    tags = int(cuts.shown_tags.max()) + 1
    ranges = len(cuts.range) + 2
    few = len(cuts.range6) + 1
    return [
        View("range", ERROR, ranges, _range, unit="m"),
        View("material", ERROR, tags, _tag),
        View("range x material", ERROR, tags * (len(cuts.range12) + 1), _range_tag, single=False),
        View("incidence", ERROR, len(ANGLES) + 1, _incidence, unit="deg"),
        View("incidence x material", ERROR, tags * (len(_FEW_ANGLES) + 1), _incidence_tag, single=False),
        View("image_row", ERROR, 16, _row, unit="px"),
        View("image_column", ERROR, 32, _column, unit="px"),
        View("image_radius", ERROR, 10, _radius, unit="1"),
        View("image_position", ERROR, 192, _position),
        View("edge_distance", ERROR, 2 * EDGE_CODES, _edge, unit="px"),
        View("edge_distance", ACROSS, 2 * EDGE_CODES, _edge, single=False, unit="px"),
        View("disparity_phase", ERROR, 16, _phase, unit="px"),
        View("time", ERROR, len(cuts.times) + 1, _time, unit="s"),
        View("time x range", ERROR, (len(cuts.times) + 1) * few, _time_range, single=False),
        View("height", ERROR, len(cuts.height) + 1, _height, unit="m"),
        View("surface", ERROR, int(cuts.region_of_face.max()) + 1, _region),
        View("surface", ERROR, 27, _normal, single=False),
        View("motion", ERROR, len(cuts.flow) + 1, _flow, unit="rad/s"),
        View("motion", ERROR, 27, _drift, single=False),
        View("incidence x image_position", ERROR, 49, _slope, single=False),
        View("image_radius", ERROR, 27, _radial, single=False),
        View("image_position", ERROR, 9, _roll, single=False),
        View("image_column", ERROR, 24, _band, single=False),
        View("pixel_neighbours", LEFT, 2 * few, _few),
        View("pixel_neighbours", UP, 2 * few, _few),
        View("pixel_neighbours", FAR_LEFT, few, _few_ranges),
        View("pixel_neighbours", FAR_UP, few, _few_ranges),
        View("frame_neighbours", BEFORE, few, _few_ranges),
        *(View("disparity_phase", PHASE + k, 1, _step_cells(step), single=False) for k, step in enumerate(STEPS)),
    ]


def frame_cells(
    views: list[View], cuts: Cuts, c: Covariates, frame: int, mask: NDArray[np.bool_] | None, rows: slice
) -> NDArray[np.uint16]:
    """(views, pixels of ``rows``): the cell of each pixel in each view; NO_CELL where it is not counted."""
    out = np.empty((len(views), c.depth[rows].size), np.uint16)
    for w, view in enumerate(views):
        cell = np.asarray(view.cells(cuts, c, frame))
        cell = np.where((cell >= 0) & (cell < view.size), cell, NO_CELL)
        out[w] = (cell if mask is None else np.where(mask, cell, NO_CELL))[rows].reshape(-1)
    return out


def layout(views: list[View]) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """The kind of each view, where its counts begin, and how many counts there are in all."""
    kinds = np.array([view.kind for view in views], np.int64)
    sizes = np.array([view.size for view in views], np.int64) * BINS[kinds]
    return kinds, np.concatenate([[0], np.cumsum(sizes)[:-1]]), int(sizes.sum())


def make_cuts(
    camera: Camera,
    tags: tuple[str, ...],
    sample: list[Covariates],
    stamps: NDArray[np.float64],
    used: NDArray[np.integer],
    region_of_face: NDArray[np.int16],
) -> Cuts:
    """Cut the axes by what the frames ``sample`` show. stamps: of all frames; used: the frames that are looked at."""
    step = max(1, sum(c.depth.size for c in sample) // 200_000)
    hit = [c.depth > 0 for c in sample]

    def gather(name: str) -> NDArray[np.float32]:
        return np.concatenate([getattr(c, name)[h] for c, h in zip(sample, hit, strict=True)])[::step]

    depth, tag = gather("depth"), gather("tag")
    if not depth.size:
        depth, tag = np.array([1.0], np.float32), np.array([NO_TAG], np.uint8)

    def quantiles(values: NDArray[np.float32], count: int) -> NDArray[np.float32]:
        return np.unique(np.quantile(values, np.arange(1, count) / count).astype(np.float32))

    share = np.bincount(tag, minlength=NO_TAG + 1) / len(tag)
    shown = np.full(NO_TAG + 1, -1, np.int16)
    common = [t for t in np.argsort(-share[:NO_TAG]) if share[t] > 0.002][:10]
    shown[np.array(common, int)] = np.arange(len(common))
    first, last = float(stamps[used].min()), float(stamps[used].max())
    height = gather("height") if any(h.any() for h in hit) else np.zeros(1, np.float32)
    flow = gather("flow") if any(h.any() for h in hit) else np.zeros(1, np.float32)
    # The ends of the range matter most to limits of range: a quarter of the cuts lie in the outer tenths.
    shares = np.concatenate([[0.005, 0.01, 0.02, 0.035, 0.06], np.arange(1, 16) / 16, [0.965, 0.98, 0.99, 0.995]])
    return Cuts(
        camera=camera,
        tags=tags,
        range=np.unique(np.quantile(depth, np.sort(shares)).astype(np.float32)),
        range6=quantiles(depth, 6),
        range12=quantiles(depth, 12),
        height=quantiles(height, 12),
        flow=quantiles(flow, 8),
        times=np.linspace(first, last, _TIMES + 1)[1:-1] if last > first else np.empty(0),
        region_of_face=region_of_face,
        stamps=stamps,
        shown_tags=shown,
    )
