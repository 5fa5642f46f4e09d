"""How two sensors differ, kind by kind: in bias, spread, holes and tails, along every axis, free of chance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import jensenshannon

from depthsim.gap.depth.data import histograms
from depthsim.gap.depth.data.divergence import Counted
from depthsim.gap.depth.data.evidence import Counts
from depthsim.gap.depth.fit.neighbours import counted
from depthsim.gap.depth.fit.validate import Validator
from depthsim.gap.depth.where.differences import holes_together, moments, tails, together_more
from depthsim.gap.depth.where.localize import PAIRS, axis_cost, over_pixels
from depthsim.sensor.effect import Effect

Floats = NDArray[np.float64]
Effects = Sequence[Effect]
KINDS = ("bias", "spread", "missing", "tail", "all")
ALL = 4
GROWING = ("range", "incidence")
"""The axes along which holes begin somewhere."""
ENOUGH = 30
"""Pixels of a cell, with fewer of which nothing is said of it."""
_BITS = 2 * np.log(2)
"""Squared differences of the roots of shares, where they are small, for a bit of divergence."""
_MOST = 3.0
"""Times the divergence of two errors: the logarithms of their spreads say more only of normal errors of which one is
fifteen times the other."""


@dataclass(frozen=True)
class Changes:
    """How two sensors differ, kind by kind [bits per pixel], over chance.

    mean: (5, axes) in the mean over an axis' pixels; varies: (5, axes) in what changes from cell to cell; of each of
    KINDS, the last being the whole distribution. Zero for axes that count no errors. chance: (5, axes) the same as
    varies of two runs of one sensor. pairs: (axes,) how neighbours and successive frames differ, zero for the others;
    together: the same beyond what each error alone has, where the first go together more; lost_together: how much more
    holes go together.
    """

    mean: Floats
    varies: Floats
    chance: Floats
    pairs: Floats
    together: float
    lost_together: float

    @property
    def whole(self) -> Floats:
        """(5,) all of it, by the axis that shows most."""
        return np.asarray(np.maximum(self.mean + self.varies, 0).max(axis=1))


def against(validator: Validator, effects: Effects) -> Changes:
    """How the recording differs from a sensor with ``effects``."""
    return _changes(validator, validator.real, _runs(validator, effects))


def done_by(validator: Validator, before: Effects, after: Effects) -> Changes:
    """What is changed from one sensor to another."""
    return _changes(validator, _runs(validator, after)[0], _runs(validator, before))


def holes_of(validator: Validator, effects: Effects) -> float:
    """The share of pixels without depth that a sensor has."""
    errors = counted(validator, _runs(validator, effects)[0].sum(axis=0), histograms.ERROR)
    return float(moments(errors[None]).holes[0])


def holes_along(validator: Validator, axis: int, counts: Counts) -> Floats:
    """(cells,) the share of holes along an axis. counts: (blocks, size)."""
    return moments(validator.evidence.cells(axis, counts.sum(axis=0)).astype(float)).holes


def pixels_along(validator: Validator, axis: int, counts: Counts) -> Floats:
    """(cells,) how many pixels lie in the cells of an axis. counts: (blocks, size)."""
    return validator.evidence.cells(axis, counts.sum(axis=0)).sum(axis=1).astype(float)


def holes_made(validator: Validator, axis: int, before: Effects, after: Effects) -> Floats:
    """(cells,) the share of holes along an axis that ``after`` has more than ``before``."""
    without, with_it = (holes_along(validator, axis, _runs(validator, one)[0]) for one in (before, after))
    return with_it - without


def more_holes(validator: Validator, axis: int, effects: Effects) -> Floats:
    """(cells,) the share of holes along an axis that the recording has more than a sensor."""
    return holes_along(validator, axis, validator.real) - holes_along(validator, axis, _runs(validator, effects)[0])


def where_they_begin(made: Floats, pixels: Floats, share: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The cells of ``share`` of the pixels with the fewest of the holes that are made, and those that come next, of one
    and a half times as many."""
    seen = np.flatnonzero(pixels >= ENOUGH)
    order = seen[np.argsort(made[seen], kind="stable")]
    up_to = np.cumsum(pixels[order]) / pixels.sum()
    first = max(int(np.searchsorted(up_to, share)), 1)
    return order[:first], order[first : max(int(np.searchsorted(up_to, 2.5 * share)), first + 1)]


def has_effect(effects: Effects, name: str) -> bool:
    """Whether an effect is among those of a sensor."""
    return any(name == one.id for one in effects)


def mean_over(cells: NDArray[np.intp], pixels: Floats, values: Floats) -> float:
    """The mean over some cells, by their pixels; 0 over none."""
    return float(pixels[cells] @ values[cells] / max(pixels[cells].sum(), 1))


def cuts_along(validator: Validator, axis: str) -> list[int]:
    """The cuts of errors along an axis."""
    return [n for n, one in enumerate(validator.evidence.axes) if (one.name, one.kind) == (axis, histograms.ERROR)]


def holes_lie_apart(validator: Validator, axis: str, before: Effects, between: Effects, after: Effects) -> bool:
    """Whether hardly any of the holes that ``after`` has more than ``between`` lie along an axis where ``between`` has
    more than ``before``: the nearest and the farthest, beside each other, are no two shapes of one."""
    number = cuts_along(validator, axis)[0]
    pixels = pixels_along(validator, number, validator.real)
    first = np.maximum(holes_made(validator, number, before, between), 0) * pixels
    more = np.maximum(holes_made(validator, number, between, after), 0) * pixels
    limit = validator.evidence.config.agreement.near_floor
    there = first > limit * first.max(initial=0.0)
    return bool(more[there].sum() <= limit * more.sum())


def too_many_left(validator: Validator, before: Effects, after: Effects) -> float | None:
    """Where ``before`` has more holes than the recording, how far ``after`` is from it as a share of that, squared.

    Along the axis on which the holes change most; None where there are no more than by chance.
    """
    axis = first_axis(validator, validator.once(against, before), KINDS.index("missing"))
    if axis is None:
        return None

    runs = [holes_along(validator, axis, run) for run in _runs(validator, before)[:2]]
    weight = validator.evidence.cells(axis, validator.real.sum(axis=0)).sum(axis=1).astype(float)
    real = holes_along(validator, axis, validator.real)
    more = runs[0] - real
    weight *= more > 0
    chance = weight @ np.square(runs[0] - runs[1])
    if weight @ np.square(more) <= validator.evidence.config.agreement.sure * chance:
        return None
    still = holes_along(validator, axis, _runs(validator, after)[0]) - real
    return float(weight @ np.square(still) / (weight @ np.square(more)))


def first_axes(validator: Validator, effects: Effects, *, however_little: bool = False) -> list[tuple[str, set[str]]]:
    """Kinds of which there is much of the gap, or some, and the names of the axis along which each changes most."""
    gap = validator.once(against, effects)
    least = 0.0 if however_little else validator.evidence.config.agreement.acts * gap.whole[ALL]
    found = []
    for k, kind in enumerate(KINDS[:ALL]):
        first = first_axis(validator, gap, k)
        if first is not None and gap.whole[k] >= least:
            found.append((kind, validator.evidence.axes[first].names))
    return found


def plain_axes(validator: Validator, effects: Effects) -> list[tuple[str, set[str]]]:
    """The same for every axis that is not crossed with another one, along which a kind changes nearly as much as along
    its first: of two biases both may change first along the range of a material, and neither is known by that."""
    gap, axes = validator.once(against, effects), validator.evidence.axes
    limit, found = validator.evidence.config.agreement, []
    for k, kind in enumerate(KINDS[:ALL]):
        if gap.whole[k] < limit.acts * gap.whole[ALL]:
            continue
        sure, worth = worth_of(validator, gap, k)
        near = sure & (worth >= limit.strong * max(float(worth.max()), 0.0))
        found += [(kind, axes[n].names) for n in map(int, np.flatnonzero(near)) if len(axes[n].names) == 1]
    return found


def less_others(changes: Changes, others: Sequence[int]) -> Changes:
    """The same, where what all errors change by is without some kinds: one effect may make the biases, and another the
    holes."""
    rows = [x.copy() for x in (changes.mean, changes.varies)]
    for row in rows:
        row[ALL] -= _BITS * np.maximum(row[list(others)], 0).sum(axis=0)
    return replace(changes, mean=rows[0], varies=rows[1])


def worth_of(validator: Validator, gap: Changes, k: int) -> tuple[NDArray[np.bool_], Floats]:
    """(axes,) where one kind surely changes, and how much of it each axis explains, over what its cells cost."""
    sure = gap.varies[k] > validator.evidence.config.agreement.sure * gap.chance[k]
    whole = max(float(gap.whole[k]), 1e-12)
    return sure, np.where(sure, gap.varies[k], 0) / whole - cost(validator)


def first_axis(validator: Validator, gap: Changes, k: int) -> int | None:
    """The axis along which one kind changes most; None where it surely changes along none."""
    sure, worth = worth_of(validator, gap, k)
    first = int(np.argmax(worth))
    return first if sure[first] else None


def cost(validator: Validator) -> Floats:
    """(axes,) what each axis must explain more, see :func:`axis_cost`; infinite where no errors are counted."""
    axes, limit = validator.evidence.axes, validator.evidence.config.where
    return np.array([axis_cost(axis, limit) if axis.kind == histograms.ERROR else np.inf for axis in axes])


def phases_apart(validator: Validator, effects: Effects) -> Floats:
    """(axes,) how the phases of the disparities differ from the recording's [bits], where there is depth."""
    evidence, run = validator.evidence, _runs(validator, effects)[0].sum(axis=0)
    real, bits = validator.real.sum(axis=0), np.zeros(len(evidence.axes))
    for number, axis in enumerate(evidence.axes):
        if axis.kind >= histograms.PHASE:
            begin = int(evidence.offsets[number])
            phases = slice(begin, begin + int(histograms.BINS[axis.kind]) - 1)
            if min(real[phases].sum(), run[phases].sum()) > 0:
                bits[number] = jensenshannon(real[phases], run[phases], base=2) ** 2
    return bits


def _runs(validator: Validator, effects: Effects) -> list[Counts]:
    return validator.runs(effects, validator.evidence.config.fit.runs)


def _changes(validator: Validator, one: Counts, others: Sequence[Counts]) -> Changes:
    """How ``one`` (blocks, size) differs from ``others``, each (blocks, size)."""
    evidence = validator.evidence
    usual = np.asarray(np.sum(others[1:], axis=0, dtype=np.float64))
    fewer = np.asarray(np.sum(others[2:], axis=0, dtype=np.float64))
    mean, varies, chance = np.zeros((3, len(KINDS), len(evidence.axes)))
    for number, axis in enumerate(evidence.axes):
        if axis.kind == histograms.ERROR:
            mean[:, number], varies[:, number] = _along(validator, number, one, others[0], usual)
            chance[:, number] = np.abs(_along(validator, number, others[0], others[1], fewer)[1])
    kinds = np.array([axis.kind for axis in evidence.axes])
    # One draw of chance says little of one axis: it is no less than it usually is.
    chance = np.maximum(chance, np.median(chance[:, kinds == histograms.ERROR], axis=1, keepdims=True))
    real, null, runs = (np.asarray(x.sum(axis=0)) for x in (one, others[0], usual))
    pairs = [n for n, axis in enumerate(evidence.axes) if axis.kind in PAIRS]

    def more(how: Callable[[Any, Any], Floats], number: int, counts: Counted) -> float:
        return over_pixels(validator.ruler, number, counts, how(*(evidence.cells(number, x) for x in (counts, runs))))

    together, lost = (
        max([0.0, *(more(how, n, real) - more(how, n, null) for n in pairs)])
        for how in (together_more, lambda a, b: holes_together(a) - holes_together(b))
    )
    counted = (kinds > histograms.ERROR) & (kinds < histograms.PHASE)
    apart = validator.ruler.by_axis(real, runs) - validator.ruler.by_axis(null, runs)
    return Changes(mean, varies, chance, np.where(counted, np.maximum(apart, 0), 0), together, lost)


def _along(validator: Validator, number: int, one: Counts, null: Counts, usual: Counted) -> tuple[Floats, Floats]:
    """(5,) squared mean difference of each kind, and what changes from cell to cell, along one axis.

    Two halves of the frames have the same true difference and chances of their own, so the product of the two has no
    part of chance in it, however errors of a frame go together. Axes whose cells the halves do not share, such as time,
    have the chance of a simulated run taken off instead.
    """
    evidence = validator.evidence
    a, b = (evidence.cells(number, counts).astype(np.float64) for counts in (one, usual))
    halves = [(x[::2].sum(axis=0), x[1::2].sum(axis=0)) for x in (a, b)]
    pixels = a.sum(axis=(0, 2))
    shared = np.all([half.sum(axis=1) >= 30 for pair in halves for half in pair], axis=0)
    if pixels[shared].sum() > 0.8 * pixels.sum() > 0:
        (one_a, two_a), (one_b, two_b) = halves
        weight = pixels[shared] / pixels[shared].sum()
        return _squares(_scaled(one_a[shared], one_b[shared]), _scaled(two_a[shared], two_b[shared]), weight)
    whole_a, whole_b, whole_null = (x.sum(axis=0) for x in (a, b, evidence.cells(number, null)))
    enough = np.all([x.sum(axis=1) >= ENOUGH for x in (whole_a, whole_b, whole_null)], axis=0)
    if not enough.any():
        return np.zeros(len(KINDS)), np.zeros(len(KINDS))
    weight = pixels[enough] / pixels[enough].sum()
    seen, chance = (_scaled(x[enough], whole_b[enough]) for x in (whole_a, whole_null))
    (mean, varies), (mean_null, varies_null) = _squares(seen, seen, weight), _squares(chance, chance, weight)
    return mean - mean_null, varies - varies_null


def _squares(x: Floats, y: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """(5,) the product of the means of two (4 + bins, cells), and the mean product of what is beside them."""
    mean_x, mean_y = x @ weight, y @ weight
    means = mean_x * mean_y
    varies = ((x - mean_x[:, None]) * (y - mean_y[:, None])) @ weight
    return np.append(means[:ALL], means[ALL:].sum()), np.append(varies[:ALL], varies[ALL:].sum())


def _scaled(a: Floats, b: Floats) -> Floats:
    """(4 + bins, cells) how histograms (cells, bins) differ: in bias, spread, holes and tails, such that the square is
    the divergence in bits where it is small, and in the roots of all shares.

    Of pixels with depth only the share that has some: the median of three in a shadow says nothing of the others. And
    spreads by no more than whole distributions: where a sixth of a cell's pixels is far off, as before edges that are
    fattened, a few more or less make its spread many times as large.
    """
    one, other = moments(a), moments(b)
    bias = (one.middle - other.middle) / np.sqrt(one.spread**2 + other.spread**2)
    spread = np.log(one.spread / other.spread)
    holes, far = (
        2 * (np.arcsin(np.sqrt(x)) - np.arcsin(np.sqrt(y))) / np.sqrt(2)
        for x, y in ((one.holes, other.holes), tails(a, b, one, other))
    )
    seen = np.sqrt(1 - np.maximum(one.holes, other.holes))
    kinds = np.stack([seen * bias, seen * spread, holes, seen * far]) / np.sqrt(4 * np.log(2))
    roots = [np.sqrt(x / x.sum(axis=1, keepdims=True)) for x in (a, b)]
    apart = roots[0] - roots[1]
    most = np.sqrt(_MOST / _BITS * np.square(apart).sum(axis=1))
    k = KINDS.index("spread")
    kinds[k] = np.clip(kinds[k], -most, most)
    return np.concatenate([kinds, apart.T])
