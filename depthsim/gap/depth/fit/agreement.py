"""Whether an effect acts where the gap lies: what it leaves along the axis on which the gap changes most.

An effect that only comes near closes much of a gap, as most of a gap is the same everywhere. What it cannot do is make
the errors change along the axis along which the recording's do, where that is no axis of its own. So the gap is taken
apart into bias, spread and holes, and for each of these that the effect changes, the axis is looked for along which the
gap changes most. An effect by another formula than the recording's leaves a part of that; one that acts elsewhere
leaves nearly all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import jensenshannon

from depthsim.gap.depth.data import histograms
from depthsim.gap.depth.data.divergence import Counted
from depthsim.gap.depth.data.evidence import Counts
from depthsim.gap.depth.fit.validate import Validator
from depthsim.gap.depth.where.differences import moments
from depthsim.gap.depth.where.localize import PAIRS, axis_cost, beyond_each
from depthsim.sensor.effect import Effect
from depthsim.sensor.parameter import learned_of

Floats = NDArray[np.float64]
Effects = Sequence[Effect]
KINDS = ("bias", "spread", "missing", "all")
ALL = 3
_BITS = 2 * np.log(2)
"""Squared differences of the roots of shares, where they are small, for a bit of divergence."""
_WORDS = {"bias": "biases", "spread": "spreads", "missing": "holes", "all": "errors"}


@dataclass(frozen=True)
class Changes:
    """How two sensors differ, kind by kind [bits per pixel], over chance.

    mean: (4, axes) in the mean over an axis' pixels; varies: (4, axes) in what changes from cell to cell; of bias, of
    spread, of holes, and of the whole distribution. Zero for axes that count no errors. chance: (4, axes) the same as
    varies of two runs of one sensor. pairs: (axes,) how neighbours and successive frames differ, zero for the others;
    together: the same beyond what each error alone has.
    """

    mean: Floats
    varies: Floats
    chance: Floats
    pairs: Floats
    together: float

    @property
    def whole(self) -> Floats:
        """(4,) all of it, by the axis that shows most."""
        return np.asarray(np.maximum(self.mean + self.varies, 0).max(axis=1))


def against(validator: Validator, effects: Effects) -> Changes:
    """How the recording differs from a sensor with ``effects``."""
    return _changes(validator, validator.real, _runs(validator, effects))


def done_by(validator: Validator, before: Effects, after: Effects) -> Changes:
    """What is changed from one sensor to another."""
    return _changes(validator, _runs(validator, after)[0], _runs(validator, before))


def leaves_biases(before: tuple[Validator, Effects], after: tuple[Validator, Effects]) -> bool:
    """Whether most of how biases change is left, along the axis on which they change most.

    before, after: sensors, each with the frames that it is compared with.
    """
    gap, left = (validator.once(against, effects) for validator, effects in (before, after))
    limit = before[0].evidence.config.agreement
    bias = KINDS.index("bias")
    sure, worth = _worth(before[0], gap, bias)
    first = int(np.argmax(worth))
    most = limit.left_by_flexible * limit.left_along  # six numbers a frame come near to much
    return bool(sure[first] and left.varies[bias, first] > most * gap.varies[bias, first])


def first_axes(validator: Validator, effects: Effects) -> list[tuple[str, set[str]]]:
    """Kinds of which there is much of the gap, and the names of the axis along which each changes most."""
    gap, limit = validator.once(against, effects), validator.evidence.config.agreement
    found = []
    for k, kind in enumerate(KINDS[:ALL]):
        sure, worth = _worth(validator, gap, k)
        first = int(np.argmax(worth))
        if sure[first] and gap.whole[k] >= limit.acts * gap.whole[ALL]:
            found.append((kind, set(validator.evidence.axes[first].name.split(" x "))))
    return found


def makes_steps(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether ``effect`` makes steps: disparities of ``after`` lie on the recording's, those of ``before`` do not.

    What loses the far pixels, of which alone steps are seen, makes none.
    """
    if validator.evidence.cuts.own_steps is None or effect.axes[:1] != ("disparity_phase",):
        return False
    gap, left = validator.once(_steps, before), validator.once(_steps, after)
    axis = int(np.argmax(gap))
    limit = validator.evidence.config.agreement
    return bool(gap[axis] > limit.steps and left[axis] < limit.left_along * gap[axis])


def disagreement(
    validator: Validator,
    effect: type[Effect],
    before: Effects,
    after: Effects,
    *,
    alone: bool = False,
    flexible: bool = False,
) -> str | None:
    """Why ``effect``, which ``after`` has and ``before`` has not, does not act where the gap of ``before`` lies.

    None if it does. alone: whether all other causes are in ``before``, so that what is there is for ``effect`` alone to
    explain, along every axis on which it stands out, and not along the first one only. flexible: whether it has so many
    parameters that it comes near to much.
    """
    if makes_steps(validator, effect, before, after):  # which nothing else does
        return None
    if _is_idle(validator, effect, before, after):
        return f"changes nothing along {effect.axes[0].replace('_', ' ')} as it is fitted, by which it is known"
    is_first = tuple(before) == validator.evidence.base
    if is_first and not validator.score(after).stands_out(validator.config):  # nothing is left that could disagree
        return None
    gap, left = validator.once(against, before), validator.once(against, after)
    does = validator.once(done_by, before, after)
    if effect.kinds[0] == "correlation":
        return _of_pairs(validator, effect, gap, left)
    limit, acts, learned = validator.evidence.config.agreement, does.whole, bool(learned_of(effect))
    was, least = validator.quick(before), validator.score(before).floor
    closes_well = was - validator.quick(after) >= limit.well * (was - least)
    for k, kind in enumerate(KINDS):
        if k == ALL and learned:  # as much as other frames say for sure is there, and no more
            continue
        answers = acts[k] >= limit.acts * acts[ALL] or (learned and kind == effect.kinds[0])
        if k != ALL and not (kind in effect.kinds and answers):
            continue
        seen = gap, left
        if k == ALL:
            seen = less_others(gap, effect), less_others(left, effect)
        if why := _leaves(validator, effect, *seen, k, alone, flexible, closes_well):
            return why
        if kind == effect.kinds[0] and (why := _is_of(validator, effect, before, gap, k)):
            return why
        if alone and k != ALL and (why := _leaves_elsewhere(validator, effect, gap, left, k)):
            return why
    if why := _not_itself(validator, effect, gap, left, does):
        return why
    if alone and left.together > limit.together * acts[ALL]:
        return "adds errors that are independent, where those of the recording go together"
    return None


def _leaves(
    validator: Validator,
    effect: type[Effect],
    gap: Changes,
    left: Changes,
    k: int,
    alone: bool,
    flexible: bool,
    closes_well: bool,
) -> str | None:
    """Whether too much is left along the axis on which a kind of gap changes most, or of what is the same all over."""
    limit, whole = validator.evidence.config.agreement, max(float(gap.whole[k]), 1e-12)
    most = limit.left_by_flexible if flexible else 1.0
    learned = bool(learned_of(effect))
    along = np.full(len(gap.varies[k]), (limit.left_by_flexible if learned else most) * limit.left_along)
    if closes_well and not flexible:  # the axis is the right one, if the shape along it is not
        along[[effect.axes[:1] == (axis.name,) for axis in validator.evidence.axes]] = limit.untouched
    if learned:  # along its own axes as much is removed as other frames say for sure is there
        along[[axis.name in effect.axes for axis in validator.evidence.axes]] = limit.untouched
    sure, worth = _worth(validator, gap, k)
    first = int(np.argmax(worth))
    if k == ALL and not (sure[first] and gap.varies[k, first] >= limit.all_along * whole):
        return None
    if not sure[first] or gap.varies[k, first] <= limit.uniform * whole:
        share = float(left.whole[k]) / whole
        return f"leaves {share:.0%} of the {_WORDS[KINDS[k]]}" if share > most * limit.left_of_uniform else None
    strong = worth >= limit.strong * worth[first] if alone else np.arange(len(worth)) == first
    for axis in np.flatnonzero(strong & sure & (gap.varies[k] > limit.uniform * whole)):
        share = max(float(left.varies[k, axis]), 0.0) / float(gap.varies[k, axis])
        if share > (along[axis] if axis == first else limit.untouched):
            return f"leaves {share:.0%} of how {_WORDS[KINDS[k]]} change along {_name(validator, int(axis))}"
    return None


def _is_of(validator: Validator, effect: type[Effect], before: Effects, gap: Changes, k: int) -> str | None:
    """Whether a kind of gap changes first along an axis of another cause of that kind, and none of the effect's.

    Then it is what that cause's own formula leaves, which many another effect takes up. A learned pattern has none.
    """
    sure, worth = _worth(validator, gap, k)
    first = int(np.argmax(worth))
    if not sure[first] or gap.varies[k, first] <= validator.evidence.config.agreement.uniform * gap.whole[k]:
        return None
    along = set(validator.evidence.axes[first].name.split(" x "))
    for cause in before:
        named = cause not in validator.evidence.base and not learned_of(type(cause))
        if named and KINDS[k] in cause.kinds and along & set(cause.axes) and not along & set(effect.axes):
            return f"is for what {cause.id} leaves along {_name(validator, first)}"
    return None


def less_others(changes: Changes, effect: type[Effect]) -> Changes:
    """The same, where what all errors change by is without the holes, or without all but them, if they are not the
    effect's: pixels without depth have no error, and one effect may make the errors and another the holes."""
    holes = KINDS.index("missing")
    others = [k for k in range(ALL) if k != holes] if effect.kinds == ("missing",) else [holes]
    if "missing" in effect.kinds and effect.kinds != ("missing",):
        return changes
    rows = [x.copy() for x in (changes.mean, changes.varies)]
    for row in rows:
        row[ALL] -= _BITS * np.maximum(row[others], 0).sum(axis=0)
    return replace(changes, mean=rows[0], varies=rows[1])


def _leaves_elsewhere(validator: Validator, effect: type[Effect], gap: Changes, left: Changes, k: int) -> str | None:
    """Whether what is left of a kind of gap lies along an axis that is none of the effect's, as it was."""
    limit, whole = validator.evidence.config.agreement, float(left.whole[k])
    if whole < limit.near_floor * gap.whole[k]:
        return None
    axis = int(np.argmax(left.varies[k] / max(whole, 1e-12) - _cost(validator)))
    varies = float(left.varies[k, axis])
    own = set(validator.evidence.axes[axis].name.split(" x ")) & set(effect.axes)
    sure = varies > limit.sure * left.chance[k, axis]
    if own or not sure or varies < limit.mostly * whole or varies < limit.untouched * gap.varies[k, axis]:
        return None
    return f"leaves all of how {_WORDS[KINDS[k]]} change along {_name(validator, axis)}"


def _of_pairs(validator: Validator, effect: type[Effect], gap: Changes, left: Changes) -> str | None:
    """Whether an effect that makes errors go together leaves too much of how they do."""
    axes = validator.evidence.axes
    own = [n for n, axis in enumerate(axes) if axis.name in effect.axes and axis.kind != histograms.ERROR]
    before, after = float(gap.pairs[own].sum()), float(left.pairs[own].sum())
    if after <= validator.evidence.config.agreement.left_along * before:
        return None
    return f"leaves {after / max(before, 1e-12):.0%} of how errors go together"


def _not_itself(validator: Validator, effect: type[Effect], gap: Changes, left: Changes, does: Changes) -> str | None:
    """Whether an effect, as it is fitted, brings along its first axis what the recording has not.

    Such as a drift of the scale that is fitted to a scale that is wrong all the time.
    """
    axes, limit = validator.evidence.axes, validator.evidence.config.agreement
    if not effect.axes or effect.axes[0] == "range":  # the spread, in which errors are measured, goes with the range
        return None
    own = [n for n, axis in enumerate(axes) if axis.name == effect.axes[0] and axis.kind == histograms.ERROR]
    for k, kind in enumerate(KINDS[:ALL]):
        if not own or kind not in effect.kinds or does.whole[k] < limit.acts * does.whole[ALL]:
            continue
        least = limit.idle * float(does.whole[k])
        axis = own[int(np.argmax(does.varies[k, own]))]  # of several cuts of one axis, the one that shows it best
        more = left.varies[k, axis] - gap.varies[k, axis] - limit.sure * left.chance[k, axis]
        if more > least:
            return f"makes {_WORDS[kind]} change along {effect.axes[0].replace('_', ' ')}, where the recording's do not"
    return None


def _is_idle(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether an effect that the sensor has not, as it is fitted, changes nothing along the axis it is known by.

    Such as a drift over time that has come to its end with the first frame: any bias along range does as well.
    """
    if not effect.axes or effect.axes[0] == "range" or effect.kinds[0] not in ("bias", "missing"):
        return False  # noise is much the same all over where a camera moves evenly, or sees what is alike
    if any(effect.id == there.id for there in validator.evidence.base):
        return False
    does = validator.once(done_by, before, after)
    own = [n for n, axis in enumerate(validator.evidence.axes) if axis.name == effect.axes[0]]
    least = validator.evidence.config.agreement.known_by * float(does.whole[ALL])
    return bool(own) and float(does.varies[ALL, own].max()) < least


def _name(validator: Validator, axis: int) -> str:
    return validator.evidence.axes[axis].name.replace("_", " ")


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
    own = (_together(validator, n, real, runs) - _together(validator, n, null, runs) for n in pairs)
    counted = (kinds > histograms.ERROR) & (kinds < histograms.PHASE)
    apart = validator.ruler.by_axis(real, runs) - validator.ruler.by_axis(null, runs)
    return Changes(mean, varies, chance, np.where(counted, np.maximum(apart, 0), 0), max(0.0, *own) if pairs else 0.0)


def _along(validator: Validator, number: int, one: Counts, null: Counts, usual: Counted) -> tuple[Floats, Floats]:
    """(4,) squared mean difference of each kind, and what changes from cell to cell, along one axis.

    Two halves of the frames have the same true difference and chances of their own, so the product of the two has no
    part of chance in it, however errors of a frame go together. Axes whose cells the halves do not share, such as time,
    have the chance of a simulated run taken off instead.
    """
    evidence = validator.evidence
    axis, begin = evidence.axes[number], int(evidence.offsets[number])
    bins = int(histograms.BINS[histograms.ERROR])

    def cells(counts: Counted) -> Floats:
        return counts[..., begin : begin + axis.size * bins].reshape(len(counts), axis.size, bins).astype(np.float64)

    a, b = cells(one), cells(usual)
    halves = [(x[::2].sum(axis=0), x[1::2].sum(axis=0)) for x in (a, b)]
    pixels = a.sum(axis=(0, 2))
    shared = np.all([half.sum(axis=1) >= 30 for pair in halves for half in pair], axis=0)
    if pixels[shared].sum() > 0.8 * pixels.sum() > 0:
        (one_a, two_a), (one_b, two_b) = halves
        weight = pixels[shared] / pixels[shared].sum()
        return _squares(_scaled(one_a[shared], one_b[shared]), _scaled(two_a[shared], two_b[shared]), weight)
    whole_a, whole_b, whole_null = (x.sum(axis=0) for x in (a, b, cells(null)))
    enough = np.all([x.sum(axis=1) >= 30 for x in (whole_a, whole_b, whole_null)], axis=0)
    if not enough.any():
        return np.zeros(len(KINDS)), np.zeros(len(KINDS))
    weight = pixels[enough] / pixels[enough].sum()
    seen, chance = (_scaled(x[enough], whole_b[enough]) for x in (whole_a, whole_null))
    (mean, varies), (mean_null, varies_null) = _squares(seen, seen, weight), _squares(chance, chance, weight)
    return mean - mean_null, varies - varies_null


def _squares(x: Floats, y: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """(4,) the product of the means of two (3 + bins, cells), and the mean product of what is beside them."""
    mean_x, mean_y = x @ weight, y @ weight
    means = mean_x * mean_y
    varies = ((x - mean_x[:, None]) * (y - mean_y[:, None])) @ weight
    return np.append(means[:ALL], means[ALL:].sum()), np.append(varies[:ALL], varies[ALL:].sum())


def _scaled(a: Floats, b: Floats) -> Floats:
    """(3 + bins, cells) how histograms (cells, bins) differ: in bias, spread and holes, such that the square is the
    divergence in bits where it is small, and in the roots of all shares."""
    one, other = moments(a), moments(b)
    bias = (one.middle - other.middle) / np.sqrt(one.spread**2 + other.spread**2)
    spread = np.log(one.spread / other.spread)
    holes = 2 * (np.arcsin(np.sqrt(one.holes)) - np.arcsin(np.sqrt(other.holes)))
    kinds = np.stack([bias, spread, holes / np.sqrt(2)]) / np.sqrt(4 * np.log(2))
    roots = [np.sqrt(x / x.sum(axis=1, keepdims=True)) for x in (a, b)]
    return np.concatenate([kinds, (roots[0] - roots[1]).T])


def _worth(validator: Validator, gap: Changes, k: int) -> tuple[NDArray[np.bool_], Floats]:
    """(axes,) where one kind surely changes, and how much of it each axis explains, over what its cells cost."""
    sure = gap.varies[k] > validator.evidence.config.agreement.sure * gap.chance[k]
    whole = max(float(gap.whole[k]), 1e-12)
    return sure, np.where(sure, gap.varies[k], 0) / whole - _cost(validator)


def _cost(validator: Validator) -> Floats:
    """(axes,) what each axis must explain more, see :func:`axis_cost`; infinite where no errors are counted."""
    axes, limit = validator.evidence.axes, validator.evidence.config.where
    return np.array([axis_cost(axis, limit) if axis.kind == histograms.ERROR else np.inf for axis in axes])


def _steps(validator: Validator, effects: Effects) -> Floats:
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


def _together(validator: Validator, axis: int, x: Counted, y: Counted) -> float:
    """How pairs of errors differ beyond each error alone [bits per pixel]."""
    totals = validator.ruler.totals(x)[validator.ruler.axis_of_cell == axis]
    return float((beyond_each(validator.evidence, axis, x, y) * totals).sum() / max(totals.sum(), 1))
