"""What a diagnosis looks at: some frames of a recording, what the scene is there, and what a simulator makes of it."""

import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import replace
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from depthsim.draws import Seed
from depthsim.errors import InputError
from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data import counting, histograms
from depthsim.gap.depth.data.axes import make_axes
from depthsim.gap.depth.data.axis import Axis, frame_cells, layout
from depthsim.gap.depth.data.border import Border, find_border
from depthsim.gap.depth.data.covariates import Covariates, covariates
from depthsim.gap.depth.data.cuts import Cuts, make_cuts
from depthsim.gap.depth.data.doubling import SMALLEST, find_doubling
from depthsim.gap.depth.data.frames import (
    CleanFrame,
    cast_clean,
    counted_rows,
    deal_blocks,
    select_frames,
    select_rows,
)
from depthsim.gap.depth.data.histograms import BINS, ERROR
from depthsim.gap.depth.data.noise_scale import spread_of
from depthsim.gap.depth.data.quantization import find_steps
from depthsim.gap.depth.data.ray_length import are_ray_lengths
from depthsim.gap.depth.data.regions import region_name, split_scene
from depthsim.gap.depth.data.simulate import FITTING, SPREAD, Replay
from depthsim.gap.depth.data.tiles import find_tiles
from depthsim.materials import Materials
from depthsim.parallel import core_count
from depthsim.raycast import Caster, Geometry
from depthsim.runs import Run
from depthsim.scene import Scene
from depthsim.sensor.effect import Effect
from depthsim.sensor.effects.pose_noise import PoseNoise
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import acting
from depthsim.units import SATURATED

Counts = NDArray[np.uint32]
S = TypeVar("S")
T = TypeVar("T")
_REMEMBERED = 1000
"""Sensors whose counts over some blocks are kept."""


def biases_of(effects: Sequence[Effect]) -> list[Effect]:
    """The effects that make biases, but errors of the poses, in the order in which they act."""
    return acting([one for one in effects if one.kinds[0] == "bias" and not isinstance(one, PoseNoise)])


class Evidence:
    """Frames of one run with their clean geometry, cut into axes, and the counts of any simulated sensor on them.

    blocks: the frames by block, each for fitting, for selecting causes, or to be reported on.
    base: the effects of the simulator as it is. like: the evidence of another run in the same scene, whose cuts and
    spread are taken, so that the counts of the two can be compared. config: the thresholds of the diagnosis.
    """

    def __init__(
        self,
        run: Run,
        scene: Scene,
        materials: Materials,
        base: Sequence[Effect],
        threads: int | None = None,
        like: "Evidence | None" = None,
        config: DepthConfig = DepthConfig(),  # noqa: B008 - frozen
    ) -> None:
        self.config = config
        self.run, self.scene, self.materials, self.camera = run, scene, materials, run.camera
        self.threads = threads or core_count()
        self.caster: Caster = like.caster if like is not None and like.scene is scene else Caster(scene)
        self.motion = Motion.along(run.trajectory, run.truth)
        self._replay = Replay(self.caster, materials, self.motion)
        self._pool = ThreadPoolExecutor(self.threads, thread_name_prefix="evidence")
        self._of_thread, self._lock = threading.local(), threading.Lock()
        self.base = tuple(base)
        self.blocks = select_frames(len(run), run.camera.width, config.data)
        if len(self.blocks) < 2:
            raise InputError(run.path, "", f"has {len(run)} frame, too few to fit and to validate", "give 2 or more")
        self._dealt = deal_blocks(len(self.blocks), 3 if self.in_three else 2)
        resized = any(effect.resizes() for effect in acting(base))
        windows = [run.camera] * len(self.blocks)
        if not resized:
            windows = select_rows(self.blocks, run.camera, self._dealt, config.data)
        self.windows = {int(i): window for window, block in zip(windows, self.blocks, strict=True) for i in block}
        self.rows = windows[0].height
        self.stride = max(1, round(self.rows * run.camera.width / config.data.pixels_of_frame))
        self.frames: dict[int, CleanFrame] = {}
        self._look(like)
        self.real: dict[int, Counts] = {}
        self._totals: dict[str, bytes] = {}
        self._count_real()

    @property
    def counted_of_frame(self) -> int:
        """About how many pixels of a frame are counted."""
        return self.camera.width * self.rows // self.stride

    @property
    def train(self) -> list[int]:
        """The blocks that parameters are fitted on."""
        return self._dealt[0]

    @property
    def held_out(self) -> list[int]:
        """The blocks that causes are selected on."""
        return self._dealt[1]

    @property
    def test(self) -> list[int]:
        """The blocks that are reported on. Of a short recording they are those that causes are selected on."""
        return self._dealt[-1]

    @property
    def in_three(self) -> bool:
        """Whether there are enough blocks for three parts."""
        return len(self.blocks) >= self.config.data.least_blocks

    def forget(self, kept: Sequence[int]) -> None:
        """Let go of the geometry of all blocks but those, which is most of what is kept in memory."""
        frames = {int(i) for b in kept for i in self.blocks[b]}
        self.frames = {index: frame for index, frame in self.frames.items() if index in frames}

    def centred(self, effects: Sequence[Effect], *, however_small: bool = False) -> "Evidence | None":
        """The same frames, with errors measured from the depth that the biases of ``effects`` make; None where these
        are small, but ``however_small``.

        Beyond a bias of some times the spread nobody sees whether noise is stronger, or goes together.
        """
        if not (biases := biases_of(effects)):
            return None
        unit = np.float32(self.camera.depth_scale)

        def moved(index: int) -> tuple[NDArray[np.float32], float]:
            frame = self.frames[index]
            clean, units = frame.geometry.depth.reshape(-1), self._measure(biases, index, SPREAD).reshape(-1)
            expected = np.where((units > 0) & (units < SATURATED) & (clean > 0), units * unit, clean)
            off = np.abs(expected - clean) * frame.per_spread > 1
            return expected, float(off.sum() / max((clean > 0).sum(), 1))

        frames = [*self.frames]
        some = frames[:: max(1, len(frames) // 8)]
        if not however_small and np.mean([off for _, off in self.each(moved, some)]) < self.config.data.hidden:
            return None
        expected = (depth for depth, _ in self.each(moved, frames))
        return self._from({i: replace(self.frames[i], expected=one) for i, one in zip(frames, expected, strict=True)})

    def displaced(self) -> "Evidence":
        """The same frames, with the surfaces at the depth that errors are measured from, for effects to act on there.

        So is noise whose law is of the depth that is measured, and not of the one that is there.
        """

        def moved(frame: CleanFrame) -> CleanFrame:
            there, clean = frame.expected, frame.geometry
            depth = clean.depth if there is None else there.reshape(clean.depth.shape)
            return replace(frame, geometry=replace(clean, depth=depth), expected=None)

        return self._from({index: moved(frame) for index, frame in self.frames.items()})

    def _from(self, frames: dict[int, CleanFrame]) -> "Evidence":
        """The same recording, whose errors are measured by other frames."""
        other = copy(self)
        other.frames, other._totals = frames, {}
        other._count_real()
        return other

    def real_counts(self, blocks: Sequence[int]) -> Counts:
        """(blocks, size): what the recording shows."""
        return np.stack([self.real[b] for b in blocks])

    def simulate(self, effects: Sequence[Effect], blocks: Sequence[int], seed: Seed = FITTING) -> Counts:
        """(blocks, size): what a sensor with ``effects`` shows on those blocks."""
        return self.simulate_runs(effects, blocks, (seed,))[0]

    def simulate_runs(self, effects: Sequence[Effect], blocks: Sequence[int], seeds: Sequence[Seed]) -> list[Counts]:
        """What :meth:`simulate` finds by each of some seeds, all side by side."""
        ordered = acting(effects)

        def one(number: int) -> Counts:
            seed, block = seeds[number // len(blocks)], blocks[number % len(blocks)]
            return self._count(block, (self._measure(ordered, int(i), seed) for i in self.blocks[block]))

        counts = self.each(one, range(len(seeds) * len(blocks)))
        return [np.stack(counts[k : k + len(blocks)]) for k in range(0, len(counts), len(blocks))]

    def cells(self, number: int, counts: NDArray[Any]) -> NDArray[Any]:
        """(..., cells, bins) the histograms of one axis. counts: (..., size)."""
        axis, begin = self.axes[number], int(self.offsets[number])
        bins = int(BINS[axis.kind])
        return counts[..., begin : begin + axis.size * bins].reshape(*counts.shape[:-1], axis.size, bins)

    def total(self, effects: Sequence[Effect], blocks: Sequence[int], seed: Seed = FITTING) -> Counts:
        """(size,): what :meth:`simulate` finds, summed over the blocks; the frames are shared out evenly.

        The last ones are remembered, as one fit begins where another ended, and a bank is looked at again on top of
        what was looked at before; packed, as most counts are small.
        """
        ordered = acting(effects)
        key = repr(([(e.id, e) for e in ordered], list(blocks), seed))
        with self._lock:
            packed = self._totals.pop(key, None)
        if packed is not None:
            total = np.frombuffer(isal_zlib.decompress(packed), np.uint32)
        else:
            total = self._total(ordered, blocks, seed)
            packed = isal_zlib.compress(total, 0)
        with self._lock:
            self._totals[key] = packed
            if len(self._totals) > _REMEMBERED:
                del self._totals[next(iter(self._totals))]
        return total

    def _total(self, ordered: Sequence[Effect], blocks: Sequence[int], seed: Seed) -> Counts:
        frames = [int(i) for b in blocks for i in self.blocks[b]]
        first = {int(self.blocks[b][0]) for b in blocks}
        threads = 1 if self._is_alone else self.threads

        def one(part: int) -> Counts:
            begin, end = (k * len(frames) // threads for k in (part, part + 1))
            own = frames[begin:end]
            before = [frames[begin - 1]] if own and own[0] not in first else []
            return self._count_frames(own, (self._measure(ordered, i, seed) for i in (*before, *own)), len(before))

        return np.asarray(np.sum(self.each(one, range(threads)), axis=0, dtype=np.uint32))

    @property
    def stands_still(self) -> bool:
        """Whether the camera does, so that what is anywhere in the scene is always at one place of the picture."""
        poses = self.run.poses
        return len(poses) > 1 and bool(np.abs(poses - poses[0]).max() < 1e-6)

    @property
    def shows_doubling(self) -> bool:
        """Whether doubled rows would be seen: the pictures are whole, and do not say that they are resampled."""
        return not self.camera.aligned and self._are_whole and min(self.camera.shape) > SMALLEST and self.tiled is None

    @property
    def _are_whole(self) -> bool:
        return self.rows == self.camera.height

    @cached_property
    def tiled(self) -> int | None:
        """The side [px] of tiles that have one value each, if the pictures have them and the sensor makes none."""
        if not self._are_whole or any(effect.resizes() for effect in acting(self.base)):
            return None
        return find_tiles(self.recorded(int(self.blocks[b][0])) for b in self.train[:: max(1, len(self.train) // 4)])

    @cached_property
    def has_ray_lengths(self) -> bool:
        """Whether the recording has the lengths of rays where depth should be."""
        some = [int(i) for b in self.train[:: max(1, len(self.train) // 4)] for i in self.blocks[b][:1]]
        unit = np.float32(self.camera.depth_scale)
        frames = (self.frames[i] for i in some)
        return are_ray_lengths(
            (self._trusted_units(frame.index) * unit, frame.geometry.depth, frame.camera.rays) for frame in frames
        )

    @cached_property
    def doubled(self) -> tuple[float, float] | None:
        """Zoom and roll [deg] of the resampling that doubled rows of the pictures, if they do not say so themselves."""
        if not self.shows_doubling:
            return None
        some = self.train[:: max(1, len(self.train) // 8)]
        return find_doubling((self.recorded(int(i)) for b in some for i in self.blocks[b]), self.config.data)

    @cached_property
    def border(self) -> Border | None:
        """What is empty at the border of every frame, though things as far away are seen elsewhere; None where the
        sensor resamples its pictures, which leaves a border that is its own.
        """
        if self.camera.aligned or any(effect.resizes() for effect in acting(self.base)):
            return None
        some = [self.frames[int(i)] for b in self.train for i in self.blocks[b][:1] if int(i) in self.frames]
        looked = ((frame.camera.rows, self.recorded(frame.index), frame.geometry.depth) for frame in some)
        return find_border(looked, self.camera.height)

    def recorded(self, index: int) -> NDArray[np.uint16]:
        """(rows, width) the rows of a frame that are looked at, as the recording has them."""
        return self._cut(self.run.depth_raw(index), index)

    def _trusted_units(self, index: int) -> NDArray[np.uint16]:
        """What is recorded where the scene may be trusted, and 0 elsewhere."""
        mask = self.trusted(index)
        return self.recorded(index) if mask is None else np.where(mask, self.recorded(index), 0).astype(np.uint16)

    def trusted(self, index: int) -> NDArray[np.bool_] | None:
        """(rows, width) where the scene may be trusted in these rows; None for a run without masks."""
        mask = self.run.mask(index)
        return None if mask is None else self._cut(mask, index)

    def _cut(self, picture: NDArray[Any], index: int) -> NDArray[Any]:
        window = self.windows[index]
        return picture if window is self.camera else picture[window.rows]

    def pictures(self, effects: Sequence[Effect], block: int, seed: Seed) -> list[NDArray[np.uint16]]:
        """What is looked at of the frames of a block, each (rows, width), as a sensor with ``effects`` stores it."""
        ordered = acting(effects)
        return [self._measure(ordered, int(i), seed) for i in self.blocks[block]]

    def recount(
        self, block: int, pictures: Iterable[NDArray[np.uint16]], correction: tuple[Any, ...]
    ) -> NDArray[np.float64]:
        """(size,) counts of pictures, corrected along one axis; see :func:`counting.count_corrected`."""
        return self._count(block, pictures, correction)

    def _measure(self, ordered: Sequence[Effect], index: int, seed: Seed) -> NDArray[np.uint16]:
        return self._replay.measure(ordered, self.frames[index], seed)

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
        pixels = self.camera.width * self.rows
        unit, focal_baseline = np.float32(self.camera.depth_scale), np.float32(self.camera.focal_baseline)
        error, bins = np.empty(pixels, np.float32), np.empty((int(self.kinds.max()) + 1, 0), np.uint8)
        before, steps = np.empty(0, np.uint8), np.array(self.cuts.steps, np.float32)
        shared = np.empty(0, np.uint32)
        every = [frames[0] - 1, *frames] if ahead else frames
        for number, (index, units) in enumerate(zip(every, pictures, strict=True)):
            frame, coarse = self.frames[index], np.empty(pixels, np.uint8)
            raw, clean = units.reshape(-1), frame.geometry.depth.reshape(-1)
            if bins.shape[1] != frame.places.shape[1]:
                bins = np.zeros((len(bins), frame.places.shape[1]), np.uint8)
            expected = clean if frame.expected is None else frame.expected
            histograms.errors(raw, unit, expected, frame.per_spread, error, coarse)
            if number < ahead:
                before = coarse
                continue
            histograms.codes(
                raw, unit, clean, frame.across, focal_baseline, self.camera.width, error, coarse, before,
                steps, frame.counted, bins,
            )  # fmt: skip
            if correction is None:
                counting.count(bins, self.kinds, frame.places, self._alone, counts)
                for some in frame.together:
                    needed = len(some.begins) * counting.ROOM
                    shared = shared if len(shared) >= needed else np.zeros(needed, np.uint32)
                    counting.count_together(bins[ERROR], some.places, some.begins, shared, counts)
            else:
                counting.count_corrected(bins, self.kinds, frame.places, counts, *correction)
            before = coarse
        return counts[: self.size]

    def _count_real(self) -> None:
        def one(block: int) -> Counts:
            return self._count(block, (self.recorded(int(i)) for i in self.blocks[block]))

        numbers = [b for b, block in enumerate(self.blocks) if {*map(int, block)} <= self.frames.keys()]
        self.real = dict(zip(numbers, self.each(one, numbers), strict=True))

    def each(self, work: Callable[[int], T], blocks: Iterable[int]) -> list[T]:
        """The results of ``work`` on each block, side by side."""
        if self.threads == 1 or self._is_alone:
            return [work(block) for block in blocks]
        return list(self._pool.map(work, blocks))

    def side_by_side(self, work: Callable[[S], T], items: Iterable[S]) -> Iterator[T]:
        """The results of ``work`` on each item, as they come, in order: whole sensors, each looked at on one thread.

        There is less to wait for than where two threads share the frames of each.
        """

        def alone(item: S) -> T:
            self._of_thread.is_alone = True
            try:
                return work(item)
            finally:
                self._of_thread.is_alone = False

        return map(work, items) if self.threads == 1 or self._is_alone else self._pool.map(alone, items)

    @property
    def _is_alone(self) -> bool:
        """Whether the other threads have work of their own."""
        return getattr(self._of_thread, "is_alone", False)

    cuts: Cuts
    axes: list[Axis]

    def _look(self, like: "Evidence | None") -> None:
        """Cast every frame, and cut the axes."""
        frames = [int(i) for block in self.blocks for i in block]

        def cast(index: int) -> Geometry:
            return cast_clean(self.caster, self.windows[index], self.run.poses[index], float(self.run.stamps[index]))

        looked = dict(zip(frames, self.each(cast, frames), strict=True))

        by_recording = self.run.has("instance") and bool(self.run.instances)

        def known(index: int) -> Covariates:
            pose, stamp = self.run.poses[index], float(self.run.stamps[index])
            found = covariates(looked[index], pose, self.windows[index], self.scene, self.motion, stamp)
            if by_recording and (shown := self.run.instance(index)) is not None:
                found.instance = self._cut(shown, index)
            return found

        sample = self.each(known, frames[:: max(1, len(frames) // 10)])
        region_of_face = split_scene(self.scene)
        self.depths = np.concatenate([c.depth[c.depth > 0][::53] for c in sample] or [np.zeros(1, np.float32)])
        self.depths = self.depths if len(self.depths) else np.ones(1, np.float32)
        cuts = make_cuts(
            self.camera, self.scene.tags, sample, self.run.stamps, np.array(frames), region_of_face,
            partial(region_name, self.scene, region_of_face), self.config.data,
        )  # fmt: skip
        some = [int(block[0]) for block in self.blocks[:: max(1, len(self.blocks) // 8)]]
        cuts.instances = {number: one.name for number, one in enumerate(self.scene.objects, start=1)}
        if by_recording:
            cuts.instances = {number: one.name for number, one in self.run.instances.items()}
        cuts.own_steps = find_steps(self.camera, ((self.recorded(i), looked[i].depth) for i in some), self.config.data)
        if like is not None:
            cuts = replace(like.cuts, camera=self.camera, stamps=self.run.stamps, times=cuts.times)
        self.cuts, self.axes = cuts, make_axes(cuts)
        self.kinds, self.offsets, self.size = layout(self.axes)
        first_of_block = {int(block[0]) for block in self.blocks}
        for index in frames:
            counted = counted_rows(self.windows[index], index, self.stride)
            none = np.empty(0, np.float32)
            self.frames[index] = CleanFrame(
                index, float(self.run.stamps[index]), self.run.poses[index], self.windows[index], counted,
                looked[index], none, none, np.empty((0, 0), np.uint16),
            )  # fmt: skip
        if like is None:
            # A pixel's own spread: an error of the pose moves the whole frame.
            ordered = acting([effect for effect in self.base if not isinstance(effect, PoseNoise)])
            some = frames[:: max(1, len(frames) // 8)]
            simulated = ((self._measure(ordered, i, SPREAD), self.frames[i].geometry) for i in some)
            unit, tags = self.camera.depth_scale, len(self.scene.tags)
            cuts.spread_cuts, cuts.spread = spread_of(simulated, unit, tags)
            # In a far larger unit all that the recording does would lie within the first bins.
            recorded = ((self._trusted_units(i), self.frames[i].geometry) for i in some)
            _, own = spread_of(recorded, unit, tags, cuts.spread_cuts)
            if np.median(own / cuts.spread) < self.config.data.far_less_noise:
                cuts.spread = np.minimum(cuts.spread, own)

        def cut(index: int) -> None:
            # The covariates again: those of all frames at once would take more memory than all else.
            frame, found = self.frames[index], known(index)
            frame.across = found.across.reshape(-1)
            frame.per_spread = cuts.per_spread(found.depth, found.tag).reshape(-1)
            cells = frame_cells(self.axes, found, index, self.trusted(index), frame.counted)
            frame.places = counting.places(
                cells, self.kinds, self.offsets, self.size, rows=frame.counted,
                across=found.across[frame.counted].reshape(-1), follows=index not in first_of_block,
            )  # fmt: skip

        self.each(cut, frames)
        bundles = counting.bundles(self.frames[frames[len(frames) // 2]].places, self.kinds)
        self._alone = np.setdiff1d(np.arange(len(self.axes)), [axis for axes in bundles for axis in axes])

        def bundle(index: int) -> None:
            frame = self.frames[index]
            frame.together = [counting.together(frame.places, axes) for axes in bundles]

        self.each(bundle, frames)
