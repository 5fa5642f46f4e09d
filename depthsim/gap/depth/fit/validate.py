"""Validating on frames that nothing was fitted on: how large the gap is, what is closed, and how sure that is."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Seed
from depthsim.gap.config import DepthSignificance
from depthsim.gap.depth.data.counting import pack, unpack
from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.evidence import Counts, Evidence
from depthsim.gap.depth.data.simulate import judging
from depthsim.gap.resampling import jackknife
from depthsim.sensor.effect import Effect

Floats = NDArray[np.float64]
T = TypeVar("T")
Numbers = NDArray[np.int64]

_KEPT = 1 << 26
"""Bytes of simulated recordings that are kept, of the sensors that were last asked for; and of those before, packed."""


@dataclass(frozen=True)
class Score:
    """A sensor against the recording.

    gap: bits per pixel; floor: that of two runs of this sensor. by_axis, floor_by_axis: the same by axis.
    excess: how far the gap is above its floor, as the logarithm of their ratio over the spread of that logarithm from
    run to run; excess_by_axis: the same by axis, 0 where the axis has no pixels. How large they get where there is no
    gap is counted by benchmarks/nulls.py.
    """

    gap: float
    floor: float
    by_axis: Floats
    floor_by_axis: Floats
    excess_by_axis: Floats
    excess: float

    @property
    def above(self) -> float:
        """The gap over its floor."""
        return self.gap - self.floor

    def stands_out(self, limit: DepthSignificance, share: float = 1.0) -> bool:
        """Whether there is more than chance between recording and simulation. share: of the limits of an excess."""
        along = bool(self.excess_by_axis.max() > share * limit.excess_along_axis)
        return self.above > limit.least and (self.excess > share * limit.excess or along)


class Validator:
    """Scores sensors on some blocks of the evidence."""

    def __init__(self, evidence: Evidence, blocks: Sequence[int]) -> None:
        self.evidence, self.blocks, self.config = evidence, list(blocks), evidence.config.significance
        self.ruler = Ruler.of(evidence.axes)
        self.real = evidence.real_counts(self.blocks)
        self._lock = threading.Lock()
        self._runs: dict[str, list[Counts]] = {}
        self._packed: dict[str, list[bytes]] = {}
        self._known: dict[tuple[Any, ...], Any] = {}

    @property
    def few(self) -> list[int]:
        """Four or a few more of the blocks, spread over all: enough for what pictures show as a whole."""
        return self.blocks[:: max(1, len(self.blocks) // 4)]

    def runs(self, effects: Sequence[Effect], count: int) -> list[Counts]:
        """``count`` simulated recordings of one sensor, each (blocks, size)."""
        key = key_of(effects)
        with self._lock:
            known, packed = self._runs.get(key, []), self._packed.get(key, [])
        shape = (len(self.blocks), self.evidence.size)
        known = known or [unpack(run).reshape(shape) for run in packed]
        seeds = [judging(run) for run in range(len(known), count)]
        # A list of its own, as another thread may be at the same sensor.
        known = [*known, *self.evidence.simulate_runs(effects, self.blocks, seeds)]
        with self._lock:
            self._runs.pop(key, None)
            self._runs[key] = known
            self._packed.pop(key, None)
            while sum(run.nbytes for runs in self._runs.values() for run in runs) > _KEPT and len(self._runs) > 1:
                oldest = next(iter(self._runs))
                self._packed[oldest] = [*map(pack, self._runs.pop(oldest))]
            while sum(len(run) for runs in self._packed.values() for run in runs) > _KEPT:
                del self._packed[next(iter(self._packed))]
        return known[:count]

    def once(self, work: Callable[..., T], *sensors: Sequence[Effect]) -> T:
        """What ``work`` finds of some sensors, found once."""
        key = work, *map(key_of, sensors)
        if key not in self._known:
            self._known[key] = work(self, *sensors)
        known: T = self._known[key]
        return known

    def simulate(self, effects: Sequence[Effect], seed: Seed) -> Counts:
        """(blocks, size): a run of the sensor with random numbers that no fit has seen."""
        return self.evidence.simulate(effects, self.blocks, seed)

    def score(self, effects: Sequence[Effect]) -> Score:
        """How far the sensor with ``effects`` is from the recording."""
        return self.once(Validator._score, effects)

    def _score(self, effects: Sequence[Effect]) -> Score:
        nulls = self.config.runs
        runs = [run.sum(axis=0) for run in self.runs(effects, nulls)]
        real = self.real.sum(axis=0)
        seen = np.array([self.ruler.by_axis(real, run) for run in runs]).mean(axis=0)
        between = np.zeros((nulls, nulls, len(seen)))
        for i in range(nulls):
            for j in range(i):
                between[i, j] = between[j, i] = self.ruler.by_axis(runs[i], runs[j])
        # A run against the others: the spread over the runs is that of the recording's own chance.
        null = between.sum(axis=1) / (nulls - 1)
        floor = null.mean(axis=0)
        gap, least = (float(self.ruler.over_axes(x, real)) for x in (seen, floor))
        in_all, by_axis = excess(self.ruler, seen, null, real, self.config)
        return Score(gap, least, seen, floor, by_axis, in_all)

    def floor(self, effects: Sequence[Effect]) -> float:
        """How far two runs of the sensor are apart, by as many as fits are validated by."""
        return self.between(effects, self.evidence.config.fit.runs)

    def quick(self, effects: Sequence[Effect], runs: int = 1, blocks: Numbers | slice = slice(None)) -> float:
        """The gap by one simulated run, or the mean of several. blocks: those that are looked at, by number."""
        real = self.real[blocks].sum(axis=0)
        return float(np.mean([self.ruler.gap(real, run[blocks].sum(axis=0)) for run in self.runs(effects, runs)]))

    def between(self, effects: Sequence[Effect], runs: int, blocks: Numbers | slice = slice(None)) -> float:
        """How far two runs of the sensor are apart, the mean over all pairs of several. blocks: as of :meth:`quick`."""
        summed = [run[blocks].sum(axis=0) for run in self.runs(effects, runs)]
        return float(np.mean([self.ruler.gap(a, b) for a, b in combinations(summed, 2)]))


def key_of(effects: Sequence[Effect]) -> str:
    """What a sensor is kept by."""
    return repr([(e.id, e) for e in effects])


def excess(ruler: Ruler, seen: Floats, null: Floats, counts: Counts, config: DepthSignificance) -> tuple[float, Floats]:
    """:class:`Score`'s excess and excess_by_axis.

    seen: (axes,) divergence of the recording from simulated runs; null: (runs, axes) that of each of the runs from
    the others; counts: (size,) what was counted, which says how many pixels each axis has.

    By logarithms, as a divergence that is due to chance is skewed: it is a sum of squares, of few that count where
    pixels or frames go together. One pixel at odds makes half a bit; so much is added, so that what has no chance in
    it has a logarithm, too.
    """
    pixels = np.bincount(ruler.axis_of_cell, ruler.totals(counts), ruler.axes)
    counted, runs = pixels > 0, len(null)
    if not counted.any():
        return 0.0, np.zeros(ruler.axes)
    one = 0.5 / np.maximum(pixels, 1)
    chance = np.log(null + one)
    variance = chance.var(axis=0, ddof=1)
    usual = np.median(variance[counted])
    prior = config.spread_prior
    spread = np.sqrt((prior * usual + (runs - 1) * variance) / (prior + runs - 1))
    by_axis = (np.log(seen + one) - chance.mean(axis=0)) / np.maximum(spread, config.least_spread_along_axis)
    total, totals = (np.log(ruler.over_axes(x + one, counts)) for x in (seen, null))
    in_all = (total - totals.mean()) / max(float(totals.std(ddof=1)), config.least_spread)
    return float(in_all), np.where(counted, by_axis, 0)


Compared = tuple[Validator, Sequence[Effect]]
"""A sensor, and the frames that it is compared with: as they were recorded, or registered."""


def closed_error(start: Compared, before: Compared, after: Compared) -> float:
    """Half of the 95 % interval of the share of the gap that is closed from ``before`` to ``after``.

    By the jackknife over blocks of frames, as frames that follow each other are alike. The gap is that of ``start``,
    the simulator and the frames as they are, over the floor of ``after``.
    """

    runs = start[0].config.runs_resampled

    def gap(compared: Compared, blocks: Numbers) -> float:
        validator, effects = compared
        return validator.quick(effects, runs, blocks)

    def fraction(blocks: Numbers) -> float:
        whole = gap(start, blocks) - after[0].between(after[1], runs, blocks)
        return (gap(before, blocks) - gap(after, blocks)) / whole if whole > 0 else 0.0

    _, (low, high) = jackknife(fraction, len(start[0].blocks))
    return float(np.hypot((high - low) / 2, start[0].config.least_error))
