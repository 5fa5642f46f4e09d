"""Judging on frames that nothing was fitted on: how large the gap is, what is closed, and how sure that is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.evidence import Counts, Evidence
from depthsim.sensor.effect import Effect

Floats = NDArray[np.float64]
_NULLS = 8
"""Simulated recordings that tell how far apart two runs of one sensor are."""
_SEED = 1000
_LEAST_SURE = 0.01
"""Half of the narrowest interval of a closed fraction: other frames of one way differ by as much, however many blocks
agree."""
_REMEMBERED = 24
"""Sensors whose simulated recordings are kept."""


@dataclass(frozen=True)
class Score:
    """A sensor against the recording.

    gap: bits per pixel; floor: that of two runs of this sensor. by_view, floor_by_view: the same by view; excess: how
    many standard deviations of the floor each view is above it.
    """

    gap: float
    floor: float
    by_view: Floats
    floor_by_view: Floats
    excess: Floats
    total_excess: float

    @property
    def above(self) -> float:
        """The gap over its floor."""
        return self.gap - self.floor


class Judge:
    """Scores sensors on some blocks of the evidence."""

    def __init__(self, evidence: Evidence, blocks: Sequence[int]) -> None:
        self.evidence, self.blocks = evidence, list(blocks)
        self.ruler = Ruler.of(evidence.axes)
        self.real = evidence.real_counts(self.blocks)
        self._runs: dict[str, list[Counts]] = {}

    def runs(self, effects: Sequence[Effect], count: int = _NULLS) -> list[Counts]:
        """``count`` simulated recordings of one sensor, each (blocks, size)."""
        key = repr([(e.id, e) for e in effects])
        if key not in self._runs and len(self._runs) >= _REMEMBERED:
            del self._runs[next(iter(self._runs))]
        known = self._runs.setdefault(key, [])
        while len(known) < count:
            known.append(self.simulate(effects, len(known)))
        return known[:count]

    def simulate(self, effects: Sequence[Effect], seed: int) -> Counts:
        """(blocks, size): a run of the sensor with random numbers that no fit has seen."""
        return self.evidence.simulate(effects, self.blocks, _SEED + seed)

    def score(self, effects: Sequence[Effect], nulls: int = _NULLS) -> Score:
        """How far the sensor with ``effects`` is from the recording."""
        runs = [run.sum(axis=0) for run in self.runs(effects, nulls)]
        real = self.real.sum(axis=0)
        seen = np.array([self.ruler.by_view(real, run) for run in runs]).mean(axis=0)
        between = np.zeros((nulls, nulls, len(seen)))
        for i in range(nulls):
            for j in range(i):
                between[i, j] = between[j, i] = self.ruler.by_view(runs[i], runs[j])
        null = between.sum(axis=1) / (nulls - 1)
        floor = null.mean(axis=0)
        # A run against the others: the spread over the runs is that of the recording's own chance.
        spread = np.maximum(null.std(axis=0, ddof=1), 0.03 * floor + 1e-9)
        used = floor > 0
        total = null[:, used].mean(axis=1)
        total_spread = max(float(total.std(ddof=1)), 0.01 * float(total.mean()), 1e-9)
        gap = float(seen[used].mean()) if used.any() else 0.0
        least = float(floor[used].mean()) if used.any() else 0.0
        return Score(gap, least, seen, floor, (seen - floor) / spread, (gap - least) / total_spread)

    def quick(self, effects: Sequence[Effect], runs: int = 1) -> float:
        """The gap by one simulated run, or the mean of several."""
        real = self.real.sum(axis=0)
        return float(np.mean([self.ruler.gap(real, run.sum(axis=0)) for run in self.runs(effects, runs)]))


def closed_interval(
    judge: Judge, before: Sequence[Effect], after: Sequence[Effect], initial: Sequence[Effect], floor: Sequence[Effect]
) -> tuple[float, tuple[float, float]]:
    """What of the gap of ``initial`` over the floor of ``floor`` is closed from ``before`` to ``after``.

    With its 95 % interval by the jackknife over blocks of frames, as frames that follow each other are alike.
    """

    def gap(effects: Sequence[Effect], blocks: NDArray[np.int64]) -> float:
        real = judge.real[blocks].sum(axis=0)
        return float(np.mean([judge.ruler.gap(real, run[blocks].sum(axis=0)) for run in judge.runs(effects)]))

    def between(effects: Sequence[Effect], blocks: NDArray[np.int64]) -> float:
        runs = [run[blocks].sum(axis=0) for run in judge.runs(effects)]
        return float(np.mean([judge.ruler.gap(a, b) for a, b in combinations(runs, 2)]))

    def fraction(blocks: NDArray[np.int64]) -> float:
        whole = gap(initial, blocks) - between(floor, blocks)
        return (gap(before, blocks) - gap(after, blocks)) / whole if whole > 0 else 0.0

    value, (low, high) = jackknife(fraction, np.arange(len(judge.blocks)))
    half = float(np.hypot((high - low) / 2, _LEAST_SURE))
    return value, (value - half, value + half)


def jackknife(
    statistic: Callable[[NDArray[np.int64]], float], every: NDArray[np.int64]
) -> tuple[float, tuple[float, float]]:
    """The statistic of all blocks, and its 95 % interval by leaving out one at a time."""
    value = float(statistic(every))
    if len(every) < 3:
        return value, (value - 0.5, value + 0.5)
    left_out = np.array([statistic(np.delete(every, k)) for k in range(len(every))])
    count = len(every)
    error = float(np.sqrt((count - 1) / count * ((left_out - left_out.mean()) ** 2).sum()))
    half = error * float(stats.t.ppf(0.975, count - 1))
    return value, (value - half, value + half)
