"""Whether an effect acts where the gap lies: what it leaves along the axis on which the gap changes most.

An effect that only comes near closes much of a gap, as most of a gap is the same everywhere. What it cannot do is make
the errors change along the axis along which the recording's do, where that is no axis of its own. So the gap is taken
apart into bias, spread, holes and tails, and for each of these that the effect changes, the axis is looked for along
which the gap changes most. An effect by another formula than the recording's leaves a part of that; one that acts
elsewhere leaves nearly all.
"""

from dataclasses import replace

import numpy as np

from depthsim.gap.depth.fit import itself, marks, pairs, rules
from depthsim.gap.depth.fit.along import leaves
from depthsim.gap.depth.fit.asked import Asked
from depthsim.gap.depth.fit.changes import (
    ALL,
    KINDS,
    Effects,
    against,
    done_by,
    first_axis,
    holes_of,
    less_others,
    too_many_left,
    worth_of,
)
from depthsim.gap.depth.fit.traits import is_known_by
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import Effect

_ALONE = (
    rules.leaves_geometry, rules.leaves_crossed, rules.brings, rules.leaves_own, rules.is_for_another_axis,
    rules.is_by_height, rules.leaves_beside_pattern,
)  # fmt: skip
"""Rules for the kind of errors that an effect mainly makes, once all other causes are there."""


def leaves_biases(before: tuple[Validator, Effects], after: tuple[Validator, Effects]) -> bool:
    """Whether most of how biases change is left, along the axis on which they change most, where there is much of them.

    before, after: sensors, each with the frames that it is compared with.
    """
    gap, left = (validator.once(against, effects) for validator, effects in (before, after))
    limit = before[0].evidence.config.agreement
    bias = KINDS.index("bias")
    first = first_axis(before[0], gap, bias)
    if first is None or gap.whole[bias] < limit.acts * gap.whole[:ALL].max():
        return False
    most = limit.left_by_flexible * limit.left_along  # six numbers a frame come near to much
    return bool(left.varies[bias, first] > most * gap.varies[bias, first])


def left_of_change(validator: Validator, axis: str, what: str, before: Effects, after: Effects) -> float:
    """Share that ``after`` leaves of how a kind of gap of ``before`` changes along an axis; 0 where that is chance."""
    gap, left = (validator.once(against, effects) for effects in (before, after))
    k = KINDS.index(what) if what in KINDS else ALL
    sure, worth = worth_of(validator, gap, k)
    first = int(np.argmax(np.where([one.name == axis for one in validator.evidence.axes], worth, -np.inf)))
    still = left.varies[k, first] > validator.evidence.config.agreement.sure * left.chance[k, first]
    known = sure[first] and still and validator.evidence.axes[first].name == axis
    return float(left.varies[k, first] / gap.varies[k, first]) if known else 0.0


def is_uniform(validator: Validator, axis: str, what: str, before: Effects) -> bool:
    """Whether a kind of gap of ``before`` is much the same all along an axis."""
    gap, k = validator.once(against, before), KINDS.index(what) if what in KINDS else ALL
    own = [one.name == axis for one in validator.evidence.axes]
    return float(gap.varies[k, own].max(initial=0.0)) <= validator.evidence.config.agreement.uniform * gap.whole[k]


def left_along(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> float | None:
    """Share that ``effect`` leaves of how errors of the kind that it makes change along their first axis.

    But for the axes of causes of that kind that are in ``before``, along which their formulas may leave some. None
    where that axis is none of the effect's.
    """
    asked = _asked(validator, effect, before, after)
    gap, left = asked.gap, asked.left
    if effect.kinds[0] == "correlation":
        return pairs.left_of_pairs(asked)
    k = max((k for k in range(ALL) if KINDS[k] in effect.kinds), key=lambda k: float(asked.does.whole[k]))
    first = asked.beside(k)
    if first is None or gap.varies[k, first] <= asked.limit.uniform * gap.whole[k]:
        return None
    return max(float(left.varies[k, first]), 0.0) / float(gap.varies[k, first])


def left_in_all(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> float:
    """Share that ``effect`` leaves of all errors of the kind that it mainly makes, wherever they lie."""
    gap, left = (validator.once(against, effects) for effects in (before, after))
    k = KINDS.index(effect.kinds[0]) if effect.kinds[0] in KINDS else ALL
    return max(float(left.whole[k]), 0.0) / max(float(gap.whole[k]), 1e-12)


def is_theirs(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether errors of the kind that ``effect`` makes change more along an axis of another cause of that kind than
    along the one that it is known by: then they are what that one's formula leaves."""
    asked, k = _asked(validator, effect, before, after), KINDS.index(effect.kinds[0])
    worth = worth_of(validator, asked.gap, k)[1]
    own = np.array([bool(axis.names & set(effect.axes[:1])) for axis in validator.evidence.axes])
    theirs = np.array([bool(asked.others(number, k)) for number in range(len(own))]) & ~own
    return float(worth[theirs].max(initial=-np.inf)) > float(worth[own].max(initial=-np.inf))


def is_its_own(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether errors of the kind that ``effect`` makes change first along the axis that it is known by, along which no
    other cause acts, and next to nothing of that is left: no formula of another one leaves such."""
    asked, k = _asked(validator, effect, before, after), KINDS.index(effect.kinds[0])
    first = first_axis(validator, asked.gap, k)
    if first is None or asked.others(first):
        return False
    is_known = is_known_by(effect.id, [(KINDS[k], validator.evidence.axes[first].names)])
    return is_known and asked.surely_left(k, first) <= asked.limit.near_floor


def goes_together(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether errors that ``effect`` makes one by one go together in the recording, see :func:`pairs.goes_together`."""
    return pairs.goes_together(replace(_asked(validator, effect, before, after), alone=True)) is not None


def _asked(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> Asked:
    gap, left = validator.once(against, before), validator.once(against, after)
    asked = Asked(validator, effect, before, gap, left, validator.once(done_by, before, after), False, False, False)
    if effect.kinds[0] != "missing" or validator.once(holes_of, after) >= validator.once(holes_of, before):
        return asked
    if effect.axes:
        is_new = not itself.is_simulated(validator, effect)
        return replace(asked, filled=validator.once(too_many_left, before, after) if is_new else None)
    return replace(asked, takes_away=not any("missing" in cause.kinds for cause in asked.named))


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

    A law of the noise that is only supposed may be more or less wherever it is: that is no cause yet.
    """
    if effect.id == validator.evidence.supposed:
        return None
    if marks.only_its_own(validator, effect, before, after):
        return None
    if why := (
        itself.is_idle(validator, effect, before, after)
        or itself.is_outgrown(validator, effect, after)
        or itself.is_alike_for_all(validator, effect, before, after)
        or itself.lacks_a_kind(validator, effect, before, after)
        or itself.is_mostly_besides(validator, effect, before, after)
        or itself.takes_all(validator, effect, before, after)
        or itself.lies_elsewhere(validator, effect, before, after)
        or itself.is_of_its_materials(validator, effect, before, after)
        or marks.unseen_step(validator, effect, before, after)
        or marks.come_in_lines(validator, effect, after)
        or marks.brings_together(validator, effect, before, after)
        or (marks.acts_on_another(validator, effect, before, after) if alone else None)
    ):
        return why
    was, least = validator.quick(before), validator.floor(before)
    limit, closed = validator.evidence.config.agreement, was - validator.quick(after)
    well, all_of_it = (closed >= share * (was - least) for share in (limit.well, limit.nearly_all))
    asked = replace(_asked(validator, effect, before, after), alone=alone, flexible=flexible)
    why = _of_gap(replace(asked, closes_well=well, nearly_all=all_of_it))
    if why is None and alone and asked.makes_first:
        kept = (
            marks.comes_in_waves, marks.breaks_at_seams, marks.shifts_by_frame, marks.stays_at_pixels,
            marks.stays_in_scene,
        )  # fmt: skip
        why = next(filter(None, (mark(validator, effect, after) for mark in kept)), None)
    is_first = tuple(before) == validator.evidence.base
    if why and is_first and not validator.score(after).stands_out(validator.config):  # nothing is left to disagree on
        return None
    return why


def _of_gap(asked: Asked) -> str | None:
    """Why the effect is none for what the others leave."""
    if asked.effect.kinds[0] == "correlation":
        return pairs.of_pairs(asked) or (pairs.smooths_elsewhere(asked) if asked.alone else None)
    for k in range(ALL):
        if _answers(asked, k) and (why := _of_kind(asked, k)):
            return why
    return _of_all(asked) or rules.not_itself(asked) or rules.makes_besides(asked) or pairs.goes_together(asked)


def _answers(asked: Asked, k: int) -> bool:
    """Whether a kind of gap is one that the effect makes, and makes much of."""
    kind, effect, least = KINDS[k], asked.effect, asked.limit.acts
    primary = kind == effect.kinds[0]
    if rules.is_little(asked, k):
        return False
    by_another = any(cause.kinds[0] == kind for cause in asked.named)  # what is left is by the formula of that one
    if asked.learned and not primary and (by_another or rules.is_untouched(asked, k)):
        return False
    if kind == "tail":  # edges that lie elsewhere make tails, too
        return primary
    if effect.kinds[0] == "tail":  # it has some spread; what is left of another cause's is by the formula of that one
        theirs = any(kind in cause.kinds for cause in asked.named)
        if theirs or asked.gap.whole[k] < least * asked.gap.whole[ALL]:
            return False
    much = bool(asked.does.whole[k] >= least * asked.does.whole[ALL])
    return kind in effect.kinds and (much or (primary and asked.learned))


def _of_kind(asked: Asked, k: int) -> str | None:
    """Why the effect is none for one kind of gap."""
    primary = KINDS[k] == asked.effect.kinds[0]
    if primary and (asked.takes_away or rules.is_beside_others(asked, k)):
        return rules.leaves_level(asked, k)
    if primary and asked.filled is not None:
        return rules.leaves_unfilled(asked)
    why = leaves(asked, k) or (rules.is_of(asked, k) if primary else None)
    if why is None and asked.alone and (primary or not asked.closes_well):
        why = rules.leaves_elsewhere(asked, k)
    if why is None and asked.alone and primary:
        why = next(filter(None, (rule(asked, k) for rule in _ALONE)), None)
    return why


def _of_all(asked: Asked) -> str | None:
    """Why the effect is none for the whole of the gap, but for kinds that are others' to make, or are left by theirs.

    What is learned takes off as much as other frames say for sure is there; holes and tails are counted apart.
    """
    kinds, whole, least = asked.effect.kinds, asked.gap.whole, asked.limit.acts * asked.gap.whole[ALL]
    if asked.learned or kinds[0] in ("missing", "tail"):
        return None
    theirs = {cause.kinds[0] for cause in asked.named} - {kinds[0]}
    others = [k for k in range(ALL) if (KINDS[k] not in kinds or KINDS[k] in theirs) and whole[k] >= least]
    rest = asked.of(less_others(asked.gap, others), less_others(asked.left, others))
    return leaves(rest, ALL) if rest.gap.whole[ALL] >= least else None
