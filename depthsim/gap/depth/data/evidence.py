"""What a recording shows along every axis, and what a simulated sensor shows there."""

import threading
from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Seed
from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data import counting, histograms
from depthsim.gap.depth.data.axes import make_axes
from depthsim.gap.depth.data.axis import frame_cells, layout
from depthsim.gap.depth.data.covariates import Covariates, covariates
from depthsim.gap.depth.data.cuts import Cuts, make_cuts
from depthsim.gap.depth.data.frames import CleanFrame
from depthsim.gap.depth.data.histograms import BINS, ERROR
from depthsim.gap.depth.data.noise_scale import Nearby, nearby, spread_of
from depthsim.gap.depth.data.quantization import find_steps
from depthsim.gap.depth.data.recording import Recording
from depthsim.gap.depth.data.regions import region_name, split_scene
from depthsim.gap.depth.data.simulate import FITTING, SPREAD, Replay
from depthsim.materials import Materials
from depthsim.raycast import Caster, Geometry
from depthsim.runs import Run
from depthsim.scene import Scene
from depthsim.sensor.effect import Effect
from depthsim.sensor.effects.pose_noise import PoseNoise
from depthsim.sensor.pipeline import acting
from depthsim.units import SATURATED

Counts = NDArray[np.uint32]
_REMEMBERED = 1000
"""Sensors whose counts over some blocks are kept."""


def biases_of(effects: Sequence[Effect]) -> list[Effect]:
    """The effects that make biases, but errors of the poses, in the order in which they act."""
    return acting([one for one in effects if one.kinds[0] == "bias" and not isinstance(one, PoseNoise)])


class Evidence(Recording):
    """A recording cut into axes, with its counts along them and those of any simulated sensor on the same frames.

    like: the evidence of another run in the same scene, whose cuts and spread are taken, so that the counts of the two
    can be compared. supposed: the law of the noise that the simulator has only so that causes can be looked for.
    """

    supposed: str | None = None

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
        caster = like.caster if like is not None and like.scene is scene else Caster(scene)
        super().__init__(run, scene, caster, base, threads, config, None if like is None else like.lags)
        self.materials = materials
        if like is not None:
            self.supposed = like.supposed
        self._replay = Replay(self.caster, materials, self.motion)
        self.cuts, self.depths = self._cuts(like)
        self.axes = make_axes(self.cuts, self.lags)
        self.kinds, self.offsets, self.size = layout(self.axes)
        if like is None:
            self.cuts.spread_cuts, self.cuts.spread = self._own_spread()
        self._place()
        self.real: dict[int, Counts] = {}
        self._totals: dict[str, bytes] = {}
        self._lock = threading.Lock()
        self._work = [0]  # one for all that are made of this one
        self._count_real()

    @property
    def work(self) -> int:
        """What was simulated so far, or asked for again [pixels]; see :meth:`Replay.work`."""
        return self._work[0]

    def _add_work(self, ordered: Sequence[Effect], blocks: Sequence[int], runs: int = 1) -> None:
        frames = [int(i) for b in blocks for i in self.blocks[b]]
        work = runs * len(frames) * self._replay.work(ordered, self.windows[frames[0]])
        with self._lock:
            self._work[0] += work

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

        if not however_small:
            off = [off for _, off in self.each(moved, self._some_frames(8))]
            if np.mean(off) < self.config.data.hidden:
                return None
        frames = [*self.frames]
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

    def beside(self, law: Effect) -> "Evidence":
        """The same frames, compared with a simulator that has a law of the noise, too, by whose spread errors are
        measured."""
        other = copy(self)
        other.base, other.supposed, other.cuts = (*self.base, law), law.id, copy(self.cuts)
        other.cuts.spread_cuts, other.cuts.spread = other._own_spread()

        def measured(frame: CleanFrame) -> CleanFrame:
            per_spread = other.cuts.per_spread(frame.geometry.depth, frame.geometry.tag).reshape(-1)
            return replace(frame, per_spread=per_spread)

        return other._from({index: measured(frame) for index, frame in self.frames.items()})

    def as_of_simulator(self, base: Sequence[Effect]) -> "Evidence":
        """The same, with errors measured as they are, said to be compared with another simulator."""
        other = copy(self)
        other.base, other.supposed = tuple(base), None
        return other

    def nearby(self) -> tuple[Nearby, Nearby]:
        """How errors of a few frames differ nearby: the recording's, and the simulator's; see :func:`nearby`."""
        some, unit = self._some_frames(8), self.camera.depth_scale
        recorded = ((self._trusted_units(i), self.frames[i].geometry) for i in some)
        return nearby(recorded, unit), nearby(self._simulated(some), unit)

    def real_counts(self, blocks: Sequence[int]) -> Counts:
        """(blocks, size): what the recording shows."""
        return np.stack([self.real[b] for b in blocks])

    def simulate(self, effects: Sequence[Effect], blocks: Sequence[int], seed: Seed = FITTING) -> Counts:
        """(blocks, size): what a sensor with ``effects`` shows on those blocks."""
        return self.simulate_runs(effects, blocks, (seed,))[0]

    def simulate_runs(self, effects: Sequence[Effect], blocks: Sequence[int], seeds: Sequence[Seed]) -> list[Counts]:
        """What :meth:`simulate` finds by each of some seeds, all side by side."""
        ordered = acting(effects)
        self._add_work(ordered, blocks, len(seeds))

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
        self._add_work(ordered, blocks)
        key = repr(([(e.id, e) for e in ordered], list(blocks), seed))
        with self._lock:
            packed = self._totals.pop(key, None)
        if packed is not None:
            total = counting.unpack(packed)
        else:
            total = self._total(ordered, blocks, seed)
            packed = counting.pack(total)
        with self._lock:
            self._totals[key] = packed
            if len(self._totals) > _REMEMBERED:
                del self._totals[next(iter(self._totals))]
        return total

    def forget_totals(self) -> None:
        """Let go of the counts that are kept for fits to come."""
        with self._lock:
            self._totals.clear()

    def _total(self, ordered: Sequence[Effect], blocks: Sequence[int], seed: Seed) -> Counts:
        frames = [int(i) for b in blocks for i in self.blocks[b]]
        first = {int(self.blocks[b][0]) for b in blocks}
        threads = self._workers.free

        def one(part: int) -> Counts:
            begin, end = (k * len(frames) // threads for k in (part, part + 1))
            own = frames[begin:end]
            before = [frames[begin - 1]] if own and own[0] not in first else []
            return self._count_frames(own, (self._measure(ordered, i, seed) for i in (*before, *own)), before)

        return np.asarray(np.sum(self.each(one, range(threads)), axis=0, dtype=np.uint32))

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
        return self._count_frames([int(i) for i in self.blocks[block]], pictures, (), correction)

    def _count_frames(
        self,
        frames: Sequence[int],
        pictures: Iterable[NDArray[np.uint16]],
        ahead: Sequence[int],
        correction: tuple[Any, ...] | None = None,
    ) -> NDArray[Any]:
        """(size,) counts of some frames in a row. ahead: the frame before them, if its picture comes first."""
        counts = np.zeros(self.size + counting.SPARE, np.uint32 if correction is None else np.float64)
        pixels = self.camera.width * self.rows
        unit, focal_baseline = np.float32(self.camera.depth_scale), np.float32(self.camera.focal_baseline)
        error, bins = np.empty(pixels, np.float32), np.empty((int(self.kinds.max()) + 1, 0), np.uint8)
        before, steps = np.empty(0, np.uint8), np.array(self.cuts.steps, np.float32)
        shared = np.empty(0, np.uint32)
        for number, (index, units) in enumerate(zip((*ahead, *frames), pictures, strict=True)):
            frame, coarse = self.frames[index], np.empty(pixels, np.uint8)
            raw, clean = units.reshape(-1), frame.geometry.depth.reshape(-1)
            if bins.shape[1] != frame.places.shape[1]:
                bins = np.zeros((len(bins), frame.places.shape[1]), np.uint8)
            expected = clean if frame.expected is None else frame.expected
            histograms.errors(raw, unit, expected, frame.per_spread, error, coarse)
            if number < len(ahead):
                before = coarse
                continue
            histograms.codes(
                raw, unit, clean, frame.across, focal_baseline, self.camera.width, error, coarse, before,
                self.lags.left, self.lags.up, steps, frame.counted, bins,
            )  # fmt: skip
            if correction is None:
                counting.count(bins, self.kinds, frame.places, self._alone, counts)
                counting.count_whole(bins, self.kinds, frame.places, self.offsets, self._whole, counts)
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

    def _covariates(self, index: int) -> Covariates:
        pose, stamp = self.run.poses[index], float(self.run.stamps[index])
        geometry = self.frames[index].geometry
        found = covariates(geometry, pose, self.windows[index], self.scene, self.motion, stamp)
        if self._shows_objects and (shown := self.run.instance(index)) is not None:
            found.instance = self._cut(shown, self.windows[index])
        return found

    @property
    def _shows_objects(self) -> bool:
        """Whether the recording says which object each pixel shows."""
        return self.run.has("instance") and bool(self.run.instances)

    def _some_frames(self, about: int) -> list[int]:
        frames = [*self.frames]
        return frames[:: max(1, len(frames) // about)]

    def _cuts(self, like: "Evidence | None") -> tuple[Cuts, NDArray[np.float32]]:
        """Where the axes are cut, as those of ``like`` if that is given, and some of the depths that are seen [m]."""
        sample = self.each(self._covariates, self._some_frames(10))
        depths = np.concatenate([c.depth[c.depth > 0][::53] for c in sample])
        depths = depths if len(depths) else np.ones(1, np.float32)
        region_of_face = split_scene(self.scene)
        cuts = make_cuts(
            self.camera, self.scene.tags, sample, self.run.stamps, np.array([*self.frames]), region_of_face,
            partial(region_name, self.scene, region_of_face), self.config.data,
        )  # fmt: skip
        if like is not None:
            return replace(like.cuts, camera=self.camera, stamps=self.run.stamps, times=cuts.times), depths
        cuts.instances = {number: one.name for number, one in enumerate(self.scene.objects, start=1)}
        if self._shows_objects:
            cuts.instances = {number: one.name for number, one in self.run.instances.items()}
        some = [int(block[0]) for block in self.blocks[:: max(1, len(self.blocks) // 8)]]
        seen = ((self.recorded(i), self.frames[i].geometry.depth) for i in some)
        cuts.own_steps = find_steps(self.camera, seen, self.config.data)
        return cuts, depths

    def _simulated(self, frames: Iterable[int]) -> Iterator[tuple[NDArray[np.uint16], Geometry]]:
        # An error of the pose moves the whole frame.
        ordered = acting([effect for effect in self.base if not isinstance(effect, PoseNoise)])
        return ((self._measure(ordered, i, SPREAD), self.frames[i].geometry) for i in frames)

    def _own_spread(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The simulator's own spread of a pixel, by tag and range; see :func:`spread_of`."""
        some, unit, tags = self._some_frames(8), self.camera.depth_scale, len(self.scene.tags)
        cuts, spread = spread_of(self._simulated(some), unit, tags)
        # In a far larger unit all that the recording does would lie within the first bins.
        recorded = [(self._trusted_units(i), self.frames[i].geometry) for i in some]
        _, own = spread_of(recorded, unit, tags, cuts)
        times, limit = np.median(own / spread), self.config.data
        if times < limit.far_less_noise:
            return cuts, np.minimum(spread, own)
        if times <= limit.far_more_noise:  # without their biases errors are no larger
            return cuts, spread
        # In a far smaller one, as that of a simulator without noise, all of it would lie in the last.
        _, noise = spread_of(recorded, unit, tags, cuts, without_bias=True)
        shown = np.isfinite(noise)
        times = float(np.median((noise / spread)[shown])) if shown.any() else 1.0
        if times > limit.far_more_noise:
            spread = np.where(shown, np.maximum(spread, noise), times * spread).astype(np.float32)
        return cuts, spread

    def _place(self) -> None:
        """Find the cells of every pixel that is counted, and which axes are counted together."""
        first_of_block = {int(block[0]) for block in self.blocks}

        def cut(index: int) -> None:
            # The covariates again: those of all frames at once would take more memory than all else.
            frame, found = self.frames[index], self._covariates(index)
            frame.across = found.across.reshape(-1)
            frame.per_spread = self.cuts.per_spread(found.depth, found.tag).reshape(-1)
            trusted = self.trusted(index)
            trusted = None if trusted is None else trusted[frame.counted]
            cells = frame_cells(self.axes, found.of_rows(frame.counted), index, trusted)
            frame.places = counting.places(
                cells, self.kinds, self.offsets, self.size, rows=frame.counted,
                across=found.across[frame.counted].reshape(-1), follows=index not in first_of_block,
                left=self.lags.left, up=self.lags.up,
            )  # fmt: skip

        frames = [*self.frames]
        self.each(cut, frames)
        bundles = counting.bundles(self.frames[frames[len(frames) // 2]].places, self.kinds)
        alone = np.setdiff1d(np.arange(len(self.axes)), [axis for axes in bundles for axis in axes])
        has_one = np.array([self.axes[axis].size == 1 for axis in alone], bool)
        self._alone, self._whole = alone[~has_one], alone[has_one]

        def bundle(index: int) -> None:
            frame = self.frames[index]
            frame.together = [counting.together(frame.places, axes) for axes in bundles]

        self.each(bundle, frames)
