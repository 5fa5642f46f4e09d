"""What a diagnosis looks at: some frames of a recording, what the scene is there, and what a simulator makes of it."""

import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.gap import counting, fingerprint
from depthsim.gap.covariates import Covariates, covariates
from depthsim.gap.views import Cuts, View, frame_cells, layout, make_cuts, make_views
from depthsim.materials import Materials
from depthsim.parallel import core_count
from depthsim.raycast import Caster, Geometry
from depthsim.runs import Run
from depthsim.scene import Scene
from depthsim.sensor.effect import Effect, Stage, physical_order
from depthsim.sensor.frame import Frame
from depthsim.sensor.motion import Motion
from depthsim.sensor.scratch import Scratch
from depthsim.sensor.sensor import to_units
from depthsim.sensor.view import View as Rays

Counts = NDArray[np.uint32]
_FITTING = 1
"""The seed of the simulations that parameters are fitted by."""
_CASTS = 2
"""How many casts of bent rays are kept of a frame."""
T = TypeVar("T")
_BLOCK = 4
"""How many frames in a row go together at most, into fitting or into judging: neighbours in time are alike."""
_SIMULATED, _COUNTED = 6e6, 50_000
"""How many pixels are simulated in all, and about how many are counted of a frame: of a larger one, not every row."""


@dataclass
class _Still:
    """What is known of one frame before any sensor has looked at it."""

    index: int
    stamp: float
    pose: NDArray[np.float64]
    geometry: Geometry
    across: NDArray[np.float32]
    per_spread: NDArray[np.float32]
    places: NDArray[np.unsignedinteger]


def choose_frames(count: int, pixels: int) -> list[NDArray[np.int64]]:
    """Blocks of frames in a row, spread over the run; a short run is taken whole."""
    wanted = int(np.clip(_SIMULATED // max(pixels, 1), 20, 40))
    length = int(np.clip(min(count, wanted) // 10, 1 if count < 8 else 2, _BLOCK))
    number = max(min(count, wanted) // length, 1)
    if count <= wanted + length:
        return [block for block in np.array_split(np.arange(count), number) if len(block)]
    starts = np.linspace(0, count - length, number).round().astype(np.int64)
    return [np.arange(start, start + length) for start in np.unique(starts)]


class Evidence:
    """Frames of one run with their clean geometry, cut into views, and the counts of any simulated sensor on them.

    blocks: the frames by block; even blocks are for fitting, odd ones for judging.
    base: the effects of the simulator as it is. like: the evidence of another run in the same scene, whose cuts and
    spread are taken, so that the counts of the two can be compared.
    """

    def __init__(
        self,
        run: Run,
        scene: Scene,
        materials: Materials,
        base: Sequence[Effect],
        threads: int | None = None,
        like: "Evidence | None" = None,
    ) -> None:
        self.run, self.scene, self.materials, self.camera = run, scene, materials, run.camera
        self.threads = threads or core_count()
        self.caster = Caster(scene)
        self._own = threading.local()
        self._pool = ThreadPoolExecutor(self.threads, thread_name_prefix="evidence")
        self._casts: dict[int, list[tuple[list[Effect], bool, Geometry]]] = {}
        self.motion = Motion.along(run.trajectory)
        self.base = tuple(base)
        self.stride = max(1, round(run.camera.width * run.camera.height / _COUNTED))
        self.blocks = choose_frames(len(run), run.camera.width * run.camera.height)
        if len(self.blocks) < 2:
            raise InputError(run.path, "", f"has {len(run)} frame, too few to fit and to judge", "give 2 or more")
        self.stills: dict[int, _Still] = {}
        self._look(like)
        self.real: dict[int, Counts] = {}
        self._count_real()

    def _first_row(self, index: int) -> int:
        """Where the rows that are counted begin: another one for every frame, so that all rows have their turn."""
        return index % self.stride

    @property
    def counted_of_frame(self) -> int:
        """About how many pixels of a frame are counted."""
        return self.camera.width * self.camera.height // self.stride

    @property
    def train(self) -> list[int]:
        """The blocks that parameters are fitted on."""
        return list(range(0, len(self.blocks), 2))

    @property
    def test(self) -> list[int]:
        """The blocks that are judged on."""
        return list(range(1, len(self.blocks), 2))

    def real_counts(self, blocks: Sequence[int]) -> Counts:
        """(blocks, size): what the recording shows."""
        return np.stack([self.real[b] for b in blocks])

    def simulate(self, effects: Sequence[Effect], blocks: Sequence[int], seed: int = _FITTING) -> Counts:
        """(blocks, size): what a sensor with ``effects`` shows on those blocks."""
        ordered = _acting(effects)

        def one(block: int) -> Counts:
            return self._count(block, (self._measure(ordered, int(i), seed) for i in self.blocks[block]))

        return np.stack(self.each(one, blocks))

    def total(self, effects: Sequence[Effect], blocks: Sequence[int], seed: int = _FITTING) -> Counts:
        """(size,): what :meth:`simulate` finds, summed over the blocks; the frames are shared out evenly."""
        ordered = _acting(effects)
        frames = [int(i) for b in blocks for i in self.blocks[b]]
        first = {int(self.blocks[b][0]) for b in blocks}

        def one(part: int) -> Counts:
            begin, end = (k * len(frames) // self.threads for k in (part, part + 1))
            own = frames[begin:end]
            before = [frames[begin - 1]] if own and own[0] not in first else []
            return self._count_frames(own, (self._measure(ordered, i, seed) for i in (*before, *own)), len(before))

        return np.asarray(np.sum(self.each(one, range(self.threads)), axis=0, dtype=np.uint32))

    def pictures(self, effects: Sequence[Effect], block: int, seed: int = 1) -> list[NDArray[np.uint16]]:
        """The frames of a block as a sensor with ``effects`` stores them."""
        ordered = _acting(effects)
        return [self._measure(ordered, int(i), seed) for i in self.blocks[block]]

    def recount(
        self, block: int, pictures: Iterable[NDArray[np.uint16]], correction: tuple[Any, ...]
    ) -> NDArray[np.float64]:
        """(size,) counts of pictures, corrected along one view; see :func:`counting.count_corrected`."""
        return self._count(block, pictures, correction)

    def _measure(self, effects: Sequence[Effect], index: int, seed: int) -> NDArray[np.uint16]:
        """One frame as the sensor with ``effects``, in physical order, stores it: Sensor.measure on known geometry."""
        still, camera = self.stills[index], self.camera
        bending = [effect for effect in effects if effect.stage <= Stage.OPTICS]
        met, scratch = still.geometry, self._scratch()
        if bending:
            met = self._bent(bending, still, seed, any(effect.needs_right for effect in effects))
        depth = scratch.empty(met.depth.shape)
        depth[:] = met.depth
        frame = Frame(depth, met, camera, self.scene, self.materials, self.motion, seed, index, still.stamp, 1, scratch)
        for effect in effects[len(bending) :]:
            effect.apply(frame)
        return to_units(frame.depth, camera)

    def _bent(self, bending: list[Effect], still: _Still, seed: int, right: bool) -> Geometry:
        """What bent rays meet. The last few casts for fitting are kept: the bank is tried on top of one bent sensor."""
        kept = self._casts.get(still.index, []) if seed == _FITTING else []
        for effects, with_right, known in kept:
            if effects == bending and (with_right or not right):
                return known
        view = Rays(
            still.pose, self.camera.rays, self.camera, self.motion, seed, still.index, still.stamp, 1, self._own.scratch
        )
        for effect in bending:
            effect.bend(view)
        poses = view.pose if view.pose.ndim == 2 else view.pose[None]
        met = self.caster.cast(self.camera, poses, right=right, rays=view.rays, threads=1)
        met = met if view.pose.ndim == 2 else met[0]
        if seed == _FITTING:
            self._casts[still.index] = [(bending, right, met), *kept][:_CASTS]
        return met

    def _scratch(self) -> Scratch:
        """This thread's memory for a frame."""
        if not hasattr(self._own, "scratch"):
            self._own.scratch = Scratch()
        scratch: Scratch = self._own.scratch
        scratch.begin()
        return scratch

    def _count(
        self,
        block: int,
        pictures: Iterable[NDArray[np.uint16]],
        correction: tuple[Any, ...] | None = None,
    ) -> NDArray[Any]:
        return self._count_frames([int(i) for i in self.blocks[block]], pictures, 0, correction)

    def _count_frames(
        self,
        frames: Sequence[int],
        pictures: Iterable[NDArray[np.uint16]],
        ahead: int,
        correction: tuple[Any, ...] | None = None,
    ) -> NDArray[Any]:
        """(size,) counts of some frames in a row. ahead: whether the picture of the frame before them comes first."""
        counts = np.zeros(self.size + counting.SPARE, np.uint32 if correction is None else np.float64)
        pixels = self.camera.width * self.camera.height
        unit, focal_baseline = np.float32(self.camera.depth_scale), np.float32(self.camera.focal_baseline)
        error, bins = np.empty(pixels, np.float32), np.empty((int(self.kinds.max()) + 1, 0), np.uint8)
        before = np.empty(0, np.uint8)
        every = [frames[0] - 1, *frames] if ahead else frames
        for number, (index, units) in enumerate(zip(every, pictures, strict=True)):
            still, coarse = self.stills[index], np.empty(pixels, np.uint8)
            raw, clean = units.reshape(-1), still.geometry.depth.reshape(-1)
            if bins.shape[1] != still.places.shape[1]:
                bins = np.zeros((len(bins), still.places.shape[1]), np.uint8)
            fingerprint.errors(raw, unit, clean, still.per_spread, error, coarse)
            if number < ahead:
                before = coarse
                continue
            fingerprint.codes(
                raw, unit, clean, still.across, focal_baseline, self.camera.width, error, coarse, before,
                self._first_row(index), self.stride, bins,
            )  # fmt: skip
            if correction is None:
                counting.count(bins, self.kinds, still.places, counts)
            else:
                counting.count_corrected(bins, self.kinds, still.places, counts, *correction)
            before = coarse
        return counts[: self.size]

    def _count_real(self) -> None:
        def one(block: int) -> Counts:
            return self._count(block, (self.run.depth_raw(int(i)) for i in self.blocks[block]))

        numbers = range(len(self.blocks))
        self.real = dict(zip(numbers, self.each(one, numbers), strict=True))

    def each(self, work: Callable[[int], T], blocks: Iterable[int]) -> list[T]:
        """The results of ``work`` on each block, side by side."""
        if self.threads == 1:
            return [work(block) for block in blocks]
        return list(self._pool.map(work, blocks))

    cuts: Cuts
    views: list[View]

    def _look(self, like: "Evidence | None") -> None:
        """Cast every frame, and cut the axes."""
        frames = [int(i) for block in self.blocks for i in block]

        def cast(index: int) -> tuple[Geometry, Covariates]:
            pose, stamp = self.run.poses[index], float(self.run.stamps[index])
            met = self.caster.cast(self.camera, pose, right=True, threads=1)
            return met, covariates(met, pose, self.camera, self.scene, self.motion, stamp)

        looked = dict(zip(frames, self.each(cast, frames), strict=True))
        sample = [looked[i][1] for i in frames[:: max(1, len(frames) // 10)]]
        regions = _regions(self.scene)
        self._region_of_face = regions
        self.depths = np.concatenate([c.depth[c.depth > 0][::53] for c in sample] or [np.zeros(1, np.float32)])
        self.depths = self.depths if len(self.depths) else np.ones(1, np.float32)
        heights = np.concatenate([c.height[c.depth > 0][::53] for c in sample])
        self.heights = (float(heights.min()), float(heights.max())) if len(heights) else (0.0, 1.0)
        self.fastest = max((float(np.quantile(c.flow, 0.999)) for c in sample), default=0.0)
        cuts = make_cuts(self.camera, self.scene.tags, sample, self.run.stamps, np.array(frames), regions)
        if like is not None:
            cuts = replace(like.cuts, camera=self.camera, stamps=self.run.stamps, times=cuts.times)
        self.cuts, self.views = cuts, make_views(cuts)
        self.kinds, self.offsets, self.size = layout(self.views)
        first_of_block = {int(block[0]) for block in self.blocks}
        for index in frames:
            met, found = looked[index]
            self.stills[index] = _Still(
                index, float(self.run.stamps[index]), self.run.poses[index], met, found.across.reshape(-1),
                np.empty(0, np.float32), np.empty((0, 0), np.uint16),
            )  # fmt: skip
        if like is None:
            cuts.spread_cuts, cuts.spread = self._spread(frames[:: max(1, len(frames) // 8)])

        def cut(index: int) -> None:
            still, found = self.stills[index], looked.pop(index)[1]
            still.per_spread = cuts.per_spread(found.depth, found.tag).reshape(-1)
            rows = slice(self._first_row(index), None, self.stride)
            cells = frame_cells(self.views, cuts, found, index, self.run.mask(index), rows)
            still.places = counting.places(
                cells, self.kinds, self.offsets, self.size, rows=np.arange(self.camera.height)[rows],
                across=found.across[rows].reshape(-1), follows=index not in first_of_block,
            )  # fmt: skip

        self.each(cut, frames)

    def region_name(self, region: int) -> str:
        """A region of the scene in words: what it is made of and where it lies."""
        faces = np.flatnonzero(self._region_of_face == region)
        corners = self.scene.vertices[self.scene.faces[faces]].reshape(-1, 3)
        if not len(faces):
            return "nothing"
        tags = np.bincount(self.scene.face_tags[faces], self.scene.areas[faces], len(self.scene.tags))
        low, high = corners.min(axis=0), corners.max(axis=0)
        spans = ", ".join(f"{axis} {a:.1f} to {b:.1f}" for axis, a, b in zip("xyz", low, high, strict=True))
        return f"{self.scene.tags[int(tags.argmax())]} at {spans} m"

    def _spread(self, frames: Sequence[int]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The spread of the simulator's own error by tag and range [m]: the measure in which errors are told."""
        effects = _acting(self.base)
        parts = []
        for index in frames:
            units = self._measure(effects, index, 0)
            met = self.stills[index].geometry
            ok = (units > 0) & (units < 65535) & (met.depth > 0)
            error = np.abs(units[ok] * np.float32(self.camera.depth_scale) - met.depth[ok])
            parts.append(np.stack([met.depth[ok], met.tag[ok].astype(np.float32), error]))
        depth, tag, error = np.concatenate(parts, axis=1)
        least = np.float32(0.3 * self.camera.depth_scale)
        if not depth.size:
            return np.empty(0, np.float32), np.full((2, 1), max(least, 1e-3), np.float32)
        cuts = np.unique(np.quantile(depth, np.arange(1, 20) / 20).astype(np.float32))
        cell = np.searchsorted(cuts, depth)
        spread = np.empty((len(self.scene.tags) + 1, len(cuts) + 1), np.float32)
        for k in range(len(cuts) + 1):
            here = cell == k
            common = np.median(error[here]) * 1.4826 if here.any() else least
            for t in range(len(self.scene.tags) + 1):
                own = error[here & (tag == t)]
                spread[t, k] = max(np.median(own) * 1.4826 if own.size >= 200 else common, least)
        return cuts, spread


def _acting(effects: Sequence[Effect]) -> list[Effect]:
    """Those that change anything, in the order in which they act."""
    return sorted((e for e in effects if not e.is_neutral), key=physical_order)


def _regions(scene: Scene, levels: int = 6) -> NDArray[np.int16]:
    """A region of each face: the scene split at the middle of its widest side, ``levels`` times over, by area."""
    middles = scene.vertices[scene.faces].mean(axis=1)
    region = np.zeros(len(scene.faces), np.int16)
    parts = [np.arange(len(scene.faces))]
    for _ in range(levels):
        halves = []
        for part in parts:
            if len(part) < 2:
                halves.append(part)
                continue
            side = int(np.argmax(np.ptp(middles[part], axis=0)))
            order = part[np.argsort(middles[part, side], kind="stable")]
            area = np.cumsum(scene.areas[order])
            at = int(np.clip(np.searchsorted(area, area[-1] / 2), 1, len(order) - 1))
            halves += [order[:at], order[at:]]
        parts = halves
    for number, part in enumerate(parts):
        region[part] = number
    return region


def open_run(run: Path | Run) -> Run:
    """A run, from its folder where it is not open yet."""
    return run if isinstance(run, Run) else Run.open(Path(run))
