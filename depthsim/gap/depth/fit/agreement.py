"""Whether an effect acts where the gap lies: what it leaves along the axis on which the gap changes most.

An effect that only comes near closes much of a gap, as most of a gap is the same everywhere. What it cannot do is make
the errors change along the axis along which the recording's do, where that is no axis of its own. So the gap is taken
apart into bias, spread and holes, and for each of these that the effect changes, the axis is looked for along which the
gap changes most. An effect by another formula than the recording's leaves a part of that; one that acts elsewhere
leaves nearly all.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data import histograms
from depthsim.gap.depth.data.divergence import Counted
from depthsim.gap.depth.data.evidence import Counts
from depthsim.gap.depth.fit.validate import Validator
from depthsim.gap.depth.where.differences import moments
from depthsim.gap.depth.where.localize import beyond_each
from depthsim.sensor.effect import Effect

Floats = NDArray[np.float64]
Effects = Sequence[Effect]
KINDS = ("bias", "spread", "missing", "all")
ALL = 3
_WORDS = {"bias": "biases", "spread": "spreads", "missing": "holes", "all": "errors"}


@dataclass(frozen=True)
class Changes:
    """How two recordings differ, kind by kind [bits per pixel], over chance.

    mean: (4, axes) in the mean over an axis' pixels; varies: (4, axes) in what changes from cell to cell; of bias, of
    spread, of holes, and of the whole distribution. Zero for axes that count no errors. together: how neighbours and
    successive frames go together, beyond each error alone.
    """

    mean: Floats
    varies: Floats
    together: float

    @property
    def whole(self) -> Floats:
        """(4,) all of it, by the axis that shows most."""
        return np.asarray(np.maximum(self.mean + self.varies, 0).max(axis=1))


def changes(validator: Validator, one: Counts, others: Sequence[Counts], chance: Counts) -> Changes:
    """How ``one`` recording differs from ``others``, beyond what ``chance``, another run like those, does."""
    evidence = validator.evidence
    usual = np.asarray(np.sum(others, axis=0, dtype=np.float64))
    seen, null = (_by_axis(validator, x.astype(np.float64), usual) for x in (one, chance))
    pairs = [
        n
        for n, axis in enumerate(evidence.axes)
        if axis.kind in (histograms.FAR_LEFT, histograms.FAR_UP, histograms.BEFORE)
    ]
    together = max(
        (_together(validator, n, one, usual) - _together(validator, n, chance, usual) for n in pairs), default=0.0
    )
    return Changes(seen[0] - null[0], seen[1] - null[1], max(together, 0.0))


def against(validator: Validator, effects: Effects) -> Changes:
    """How the recording differs from a sensor with ``effects``."""
    runs = [run.sum(axis=0) for run in validator.runs(effects, validator.evidence.config.fit.runs)]
    return changes(validator, validator.real.sum(axis=0), runs[1:], runs[0])


def done_by(validator: Validator, before: Effects, after: Effects) -> Changes:
    """What is changed from one sensor to another."""
    count = validator.evidence.config.fit.runs
    first, then = ([run.sum(axis=0) for run in validator.runs(effects, count)] for effects in (before, after))
    return changes(validator, then[0], first[1:], first[0])


def disagreement(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Why ``effect``, which ``after`` has and ``before`` has not, does not act where the gap of ``before`` lies.

    None if it does.
    """
    limit = validator.evidence.config.agreement
    gap, left, does = against(validator, before), against(validator, after), done_by(validator, before, after)
    acts = does.whole
    for k, kind in enumerate(KINDS):
        answers = k == ALL or (kind in effect.kinds and acts[k] >= limit.acts * acts[:ALL].sum())
        whole = max(float(gap.whole[k]), 1e-12)
        axis = int(np.argmin(_cost(validator) - gap.varies[k] / whole))
        varies, name = float(gap.varies[k, axis]), validator.evidence.axes[axis].name.replace("_", " ")
        if not answers or (k == ALL and varies < limit.all_along * whole):
            continue
        if varies > limit.uniform * whole:
            share = max(float(left.varies[k, axis]), 0.0) / varies
            if share > limit.left_along:
                return f"leaves {share:.0%} of how {_WORDS[kind]} change along {name}"
        elif (share := float(left.whole[k]) / whole) > limit.left_of_uniform:
            return f"leaves {share:.0%} of the {_WORDS[kind]}"
    if effect.kinds[0] == "correlation" and left.together > limit.left_along * gap.together:
        return f"leaves {left.together / gap.together:.0%} of how errors go together"
    return None


def _cost(validator: Validator) -> Floats:
    """(axes,) what an axis must explain more for having many cells or being a pair; infinite where none is counted."""
    limit, costs = validator.evidence.config.where, []
    for axis in validator.evidence.axes:
        own = limit.per_doubling * max(np.log2(axis.size / 8), 0.0) + (0.0 if axis.single else limit.pair)
        costs.append(own if axis.kind == histograms.ERROR else np.inf)
    return np.array(costs)


def _by_axis(validator: Validator, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """(4, axes) the mean difference of each kind, and what changes from cell to cell, both squared [bits]."""
    evidence = validator.evidence
    mean, varies = np.zeros((2, len(KINDS), len(evidence.axes)))
    bins = int(histograms.BINS[histograms.ERROR])
    for number, axis in enumerate(evidence.axes):
        if axis.kind != histograms.ERROR:
            continue
        begin = int(evidence.offsets[number])
        a, b = (counts[begin : begin + axis.size * bins].reshape(axis.size, bins) for counts in (x, y))
        enough = (a.sum(axis=1) >= 30) & (b.sum(axis=1) >= 30)
        if not enough.any():
            continue
        a, b = a[enough], b[enough]
        weight = a.sum(axis=1) / a.sum()
        values = _scaled(a, b)
        middle = values @ weight
        mean[:ALL, number] = middle**2
        varies[:ALL, number] = ((values - middle[:, None]) ** 2) @ weight
        apart = np.sqrt(a / a.sum(axis=1, keepdims=True)) - np.sqrt(b / b.sum(axis=1, keepdims=True))
        usual = weight @ apart
        mean[ALL, number] = (usual**2).sum()
        varies[ALL, number] = weight @ ((apart - usual) ** 2).sum(axis=1)
    return mean, varies


def _scaled(a: Floats, b: Floats) -> Floats:
    """(3, cells) how two sets of histograms differ, such that the square is the divergence in bits of a small one."""
    one, other = moments(a), moments(b)
    bias = (one.middle - other.middle) / np.sqrt(one.spread**2 + other.spread**2)
    spread = np.log(one.spread / other.spread)
    holes = 2 * (np.arcsin(np.sqrt(one.holes)) - np.arcsin(np.sqrt(other.holes)))
    return np.stack([bias, spread, holes / np.sqrt(2)]) / np.sqrt(4 * np.log(2))


def _together(validator: Validator, axis: int, x: Counted, y: Counted) -> float:
    """How pairs of errors differ beyond each error alone [bits per pixel]."""
    totals = validator.ruler.totals(x)[validator.ruler.axis_of_cell == axis]
    return float((beyond_each(validator.evidence, axis, x, y) * totals).sum() / max(totals.sum(), 1))
