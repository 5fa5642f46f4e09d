"""The frames of a recording that a diagnosis looks at, and what their pictures show by themselves."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.border import Border, find_border
from depthsim.gap.depth.data.doubling import SMALLEST, find_doubling
from depthsim.gap.depth.data.frames import (
    CleanFrame,
    cast_clean,
    counted_rows,
    deal_blocks,
    select_frames,
    select_rows,
)
from depthsim.gap.depth.data.lags import BEFORE, Lags, find_lags
from depthsim.gap.depth.data.locked import Signs
from depthsim.gap.depth.data.ray_length import are_ray_lengths
from depthsim.gap.depth.data.tiles import find_tiles
from depthsim.gap.depth.data.workers import Workers
from depthsim.parallel import core_count
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.scene import Scene
from depthsim.sensor.effect import Effect
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import acting
from depthsim.units import SATURATED

S = TypeVar("S")
T = TypeVar("T")
_SOME, _LATE = 6, BEFORE + 1
"""Frames that are asked how far off errors go together, about; and how many are passed over, to have some before."""


class Recording:
    """Frames of one run, as many as the budget of pixels allows, with their clean geometry.

    blocks: the frames by block, each for fitting, for selecting causes, or to be reported on. windows: the rows of each
    frame that are looked at, as a camera; rows: how many; stride: one of so many is counted. base: the effects of the
    simulator as it is. lags: how far off the errors are that others are compared with, as the recording shows if not
    given. config: the thresholds of the diagnosis.
    """

    def __init__(
        self,
        run: Run,
        scene: Scene,
        caster: Caster,
        base: Sequence[Effect],
        threads: int | None,
        config: DepthConfig,
        lags: Lags | None = None,
    ) -> None:
        self.config = config
        self.run, self.scene, self.camera = run, scene, run.camera
        self.caster, self.base = caster, tuple(base)
        self.threads = threads or core_count()
        self._workers = Workers(self.threads)
        self.motion = Motion.along(run.trajectory, run.truth)
        self._look_at(1 if lags is None else lags.frames)
        self.lags = find_lags(self._in_a_row(), self._are_whole, config.data) if lags is None else lags
        if lags is None and self.lags.frames > 1:
            self._look_at(self.lags.frames)

    def _look_at(self, lag: int) -> None:
        """Take frames, those of a block so many apart, and cast them."""
        run, limit = self.run, self.config.data
        self.blocks = select_frames(len(run), run.camera.width, limit, lag)
        if len(self.blocks) < 2:
            raise InputError(run.path, "", f"has {len(run)} frame, too few to fit and to validate", "give 2 or more")
        self._dealt = deal_blocks(len(self.blocks), 3 if self.in_three else 2)
        windows = [run.camera] * len(self.blocks)
        if not self._resizes:
            windows = select_rows(self.blocks, run.camera, self._dealt, limit)
        shown = ((int(i), window) for window, block in zip(windows, self.blocks, strict=True) for i in block)
        self.windows = dict(sorted(shown, key=lambda one: one[0]))
        self.rows = windows[0].height
        self.stride = max(1, round(self.rows * run.camera.width / limit.pixels_of_frame))
        self.frames: dict[int, CleanFrame] = dict(zip(self.windows, self.each(self._cast, self.windows), strict=True))

    def _cast(self, index: int) -> CleanFrame:
        camera, pose, stamp = self.windows[index], self.run.poses[index], float(self.run.stamps[index])
        geometry, none = cast_clean(self.caster, camera, pose, stamp), np.empty(0, np.float32)
        counted = counted_rows(camera, index, self.stride)
        return CleanFrame(index, stamp, pose, camera, counted, geometry, none, none, np.empty((0, 0), np.uint16))

    def _in_a_row(self) -> list[list[Signs]]:
        """As :func:`find_lags` has it; the frames before are cast where they are not looked at."""
        every = [*self.windows]
        some = every[_LATE :: max(1, len(every) // _SOME)] if len(every) > _LATE else every

        def of(index: int) -> list[Signs]:
            before = range(index, index - BEFORE - 1, -1) if index >= BEFORE else (index,)
            return [self._signs(k, self.windows[index]) for k in before]

        return self.each(of, some)

    def _signs(self, index: int, window: Camera) -> Signs:
        """(rows, width) of the errors in some rows of a frame; 0 where there is none."""
        known = self.frames.get(index)
        if known is not None and known.camera is window:
            clean = known.geometry.depth
        else:
            pose, stamp = self.run.poses[index], float(self.run.stamps[index])
            clean = self.caster.cast(window, pose, stamps=stamp, threads=1).depth
        units, mask = self._cut(self.run.depth_raw(index), window), self.run.mask(index)
        ok = (units > 0) & (units < SATURATED) & (clean > 0)
        ok = ok if mask is None else ok & self._cut(mask, window)
        return np.where(ok, np.sign(units * np.float32(self.camera.depth_scale) - clean), 0).astype(np.int8)

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
    def _resizes(self) -> bool:
        """Whether the simulator as it is resamples its pictures."""
        return any(effect.resizes() for effect in acting(self.base))

    @property
    def _are_whole(self) -> bool:
        return self.rows == self.camera.height

    @cached_property
    def tiled(self) -> int | None:
        """The side [px] of tiles that have one value each, if the pictures have them and the sensor makes none."""
        if not self._are_whole or self._resizes:
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
        if self.camera.aligned or self._resizes:
            return None
        some = [self.frames[int(i)] for b in self.train for i in self.blocks[b][:1] if int(i) in self.frames]
        looked = ((frame.camera.rows, self.recorded(frame.index), frame.geometry.depth) for frame in some)
        return find_border(looked, self.camera.height)

    def recorded(self, index: int) -> NDArray[np.uint16]:
        """(rows, width) the rows of a frame that are looked at, as the recording has them."""
        return self._cut(self.run.depth_raw(index), self.windows[index])

    def _trusted_units(self, index: int) -> NDArray[np.uint16]:
        """What is recorded where the scene may be trusted, and 0 elsewhere."""
        mask = self.trusted(index)
        return self.recorded(index) if mask is None else np.where(mask, self.recorded(index), 0).astype(np.uint16)

    def trusted(self, index: int) -> NDArray[np.bool_] | None:
        """(rows, width) where the scene may be trusted in these rows; None for a run without masks."""
        mask = self.run.mask(index)
        return None if mask is None else self._cut(mask, self.windows[index])

    def _cut(self, picture: NDArray[Any], window: Camera) -> NDArray[Any]:
        return picture if window is self.camera else picture[window.rows]

    def each(self, work: Callable[[S], T], items: Iterable[S]) -> list[T]:
        """See :meth:`Workers.each`."""
        return self._workers.each(work, items)

    def side_by_side(self, work: Callable[[S], T], items: Iterable[S]) -> Iterator[T]:
        """See :meth:`Workers.side_by_side`."""
        return self._workers.side_by_side(work, items)
