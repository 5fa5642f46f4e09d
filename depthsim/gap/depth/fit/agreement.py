"""Whether an effect acts where the gap lies: what it leaves along the axis on which the gap changes most.

An effect that only comes near closes much of a gap, as most of a gap is the same everywhere. What it cannot do is make
the errors change along the axis along which the recording's do, where that is no axis of its own. So the gap is taken
apart into bias, spread, holes and tails, and for each of these that the effect changes, the axis is looked for along
which the gap changes most. An effect by another formula than the recording's leaves a part of that; one that acts
elsewhere leaves nearly all.
"""

import numpy as np

from depthsim.draws import Seed
from depthsim.gap.depth.data import histograms
from depthsim.gap.depth.data.quantization import find_steps
from depthsim.gap.depth.fit.changes import (
    ALL,
    KINDS,
    Changes,
    Effects,
    against,
    cost,
    done_by,
    first_axis,
    less_others,
    phases_apart,
    worth_of,
)
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import Effect
from depthsim.sensor.parameter import learned_of

_WORDS = {"bias": "biases", "spread": "spreads", "missing": "holes", "tail": "tails", "all": "errors"}


def leaves_biases(before: tuple[Validator, Effects], after: tuple[Validator, Effects]) -> bool:
    """Whether most of how biases change is left, along the axis on which they change most.

    before, after: sensors, each with the frames that it is compared with.
    """
    gap, left = (validator.once(against, effects) for validator, effects in (before, after))
    limit = before[0].evidence.config.agreement
    bias = KINDS.index("bias")
    first = first_axis(before[0], gap, bias)
    most = limit.left_by_flexible * limit.left_along  # six numbers a frame come near to much
    return bool(first is not None and left.varies[bias, first] > most * gap.varies[bias, first])


def makes_steps(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether ``effect`` makes steps: disparities of ``after`` lie on the recording's, those of ``before`` do not.

    What loses the far pixels, of which alone steps are seen, makes none.
    """
    if validator.evidence.cuts.own_steps is None or effect.axes[:1] != ("disparity_phase",):
        return False
    gap, left = validator.once(phases_apart, before), validator.once(phases_apart, after)
    axis = int(np.argmax(gap))
    limit = validator.evidence.config.agreement
    return bool(gap[axis] > limit.steps and left[axis] < limit.left_along * gap[axis])


def _unseen_step(validator: Validator, before: Effects, after: Effects) -> float | None:
    """The step [px] of the disparities that ``after`` shows, where ``before`` and the recording show none."""
    evidence = validator.evidence
    if evidence.cuts.own_steps is not None:
        return None

    def step(effects: Effects) -> float | None:
        blocks = validator.blocks[:: max(1, len(validator.blocks) // 4)]
        pictures = ((b, evidence.pictures(effects, b, Seed("steps"))[0]) for b in blocks)
        first = ((picture, evidence.frames[int(evidence.blocks[b][0])]) for b, picture in pictures)
        shown = ((picture, frame.geometry.depth) for picture, frame in first)
        found = find_steps(evidence.camera, shown, evidence.config.data)
        return found[0] if found else None

    return step(after) if step(before) is None else None


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
    if (step := validator.once(_unseen_step, before, after)) and effect.axes[:1] == ("disparity_phase",):
        return f"makes steps of {step:.3g} px, and the recording has none"
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
        # What is learned takes off as much as other frames say for sure is there; holes and tails are counted apart.
        if k == ALL and (learned or effect.kinds[0] in ("missing", "tail")):
            continue
        primary = kind == effect.kinds[0]
        answers = acts[k] >= limit.acts * acts[ALL] or (primary and (learned or kind == "tail"))
        if k != ALL and not (kind in effect.kinds and answers and (primary or kind != "tail")):
            continue
        seen = gap, left
        if k == ALL:
            others = [
                n for n in range(ALL) if KINDS[n] not in effect.kinds and gap.whole[n] >= limit.acts * gap.whole[ALL]
            ]
            seen = less_others(gap, others), less_others(left, others)
            if seen[0].whole[ALL] < limit.acts * gap.whole[ALL]:
                continue
        if why := _leaves(validator, effect, before, *seen, k, alone, flexible, closes_well):
            return why
        if primary and (why := _is_of(validator, effect, before, gap, k)):
            return why
        if alone and k != ALL and (why := _leaves_elsewhere(validator, effect, before, gap, left, k)):
            return why
        if not (alone and primary):
            continue
        if why := _leaves_crossed(validator, effect, gap, left, k) or _brings(validator, effect, gap, left, does, k):
            return why
    if why := _not_itself(validator, effect, gap, left, does):
        return why
    if alone and left.together > limit.together * acts[ALL]:
        return "adds errors that are independent, where those of the recording go together"
    return None


def _leaves(
    validator: Validator,
    effect: type[Effect],
    before: Effects,
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
    sure, worth = worth_of(validator, gap, k)
    first = int(np.argmax(worth))
    if k == ALL and not (sure[first] and gap.varies[k, first] >= limit.all_along * whole):
        return None
    uniform = whole * (limit.uniform_tails if KINDS[k] == "tail" else limit.uniform)
    if not sure[first] or gap.varies[k, first] <= uniform:
        share = float(left.whole[k]) / whole
        return f"leaves {share:.0%} of the {_WORDS[KINDS[k]]}" if share > most * limit.left_of_uniform else None
    strong = worth >= limit.strong * worth[first] if alone else np.arange(len(worth)) == first
    for axis in np.flatnonzero(strong & sure & (gap.varies[k] > uniform)):
        if axis != first and _others_with(validator, before, validator.evidence.axes[axis].names):
            continue
        share = max(float(left.varies[k, axis]), 0.0) / float(gap.varies[k, axis])
        if share > (along[axis] if axis == first else limit.untouched):
            return f"leaves {share:.0%} of how {_WORDS[KINDS[k]]} change along {_name(validator, int(axis))}"
    return None


def _is_of(validator: Validator, effect: type[Effect], before: Effects, gap: Changes, k: int) -> str | None:
    """Whether a kind of gap changes first along an axis of another cause of that kind, and none of the effect's.

    Then it is what that cause's own formula leaves, which many another effect takes up. A learned pattern has none.
    """
    first = first_axis(validator, gap, k)
    if first is None or gap.varies[k, first] <= validator.evidence.config.agreement.uniform * gap.whole[k]:
        return None
    along = validator.evidence.axes[first].names
    for cause in _others_with(validator, before, along):
        if KINDS[k] in cause.kinds and not along & set(effect.axes):
            return f"is for what {cause.id} leaves along {_name(validator, first)}"
    return None


def _others_with(validator: Validator, before: Effects, along: set[str]) -> list[Effect]:
    """The causes named so far that act along one of some axes. What a learned pattern leaves is due to no formula."""
    named = (cause for cause in before if cause not in validator.evidence.base and not learned_of(type(cause)))
    return [cause for cause in named if along & set(cause.axes)]


def _leaves_elsewhere(
    validator: Validator, effect: type[Effect], before: Effects, gap: Changes, left: Changes, k: int
) -> str | None:
    """Whether what is left of a kind of gap lies along an axis of no cause, as it was."""
    limit, whole = validator.evidence.config.agreement, float(left.whole[k])
    near_floor = limit.uniform_tails if KINDS[k] == "tail" else limit.near_floor
    if whole < near_floor * gap.whole[k]:
        return None
    axis = int(np.argmax(left.varies[k] / max(whole, 1e-12) - cost(validator)))
    varies = float(left.varies[k, axis])
    along = validator.evidence.axes[axis].names
    own = along & set(effect.axes) or _others_with(validator, before, along)
    sure = varies > limit.sure * left.chance[k, axis]
    if own or not sure or varies < limit.mostly * whole or varies < limit.untouched * gap.varies[k, axis]:
        return None
    return f"leaves all of how {_WORDS[KINDS[k]]} change along {_name(validator, axis)}"


def _leaves_crossed(validator: Validator, effect: type[Effect], gap: Changes, left: Changes, k: int) -> str | None:
    """Whether much is left along an axis of the effect's crossed with another one.

    What has the effect's axis and another shape, such as an offset of the disparities for a scale, comes near along
    that axis alone: other parameters make up for it. They cannot at every range on every material.
    """
    limit, least = validator.evidence.config.agreement, float(gap.whole[k])
    for axis, cut in enumerate(validator.evidence.axes):
        varies = float(gap.varies[k, axis])
        crossed = len(cut.names) > 1 and bool(cut.names & set(effect.axes))
        if not crossed or varies < limit.crossed * least or varies < limit.sure * gap.chance[k, axis]:
            continue
        share = float(left.varies[k, axis]) / varies
        if share > limit.left_along:
            return f"leaves {share:.0%} of how {_WORDS[KINDS[k]]} change along {_name(validator, axis)}"
    return None


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


def _brings(
    validator: Validator, effect: type[Effect], gap: Changes, left: Changes, does: Changes, k: int
) -> str | None:
    """Whether an effect makes a kind of error change along an axis of its own, where the recording's do not.

    Such as an offset of the disparities for a scale that is wrong, which has another shape along the range.
    """
    limit = validator.evidence.config.agreement
    own = np.array([bool(axis.names & set(effect.axes)) for axis in validator.evidence.axes])
    more = np.where(own, left.varies[k] - np.maximum(gap.varies[k], 0) - limit.sure * left.chance[k], 0)
    axis = int(np.argmax(more))
    if more[axis] <= limit.brought * does.whole[k]:
        return None
    return f"makes {_WORDS[KINDS[k]]} change along {_name(validator, axis)}, where the recording's do not"


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
