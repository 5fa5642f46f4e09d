"""What an effect must not do to be the cause of a gap: each rule gives the reason in words, or None."""

import numpy as np

from depthsim.gap.depth.fit.along import first_asked, is_crossed, is_more, is_theirs, lies_by_its_axis
from depthsim.gap.depth.fit.asked import WORDS, Asked
from depthsim.gap.depth.fit.changes import ALL, KINDS, cost, worth_of
from depthsim.gap.depth.fit.itself import known_by
from depthsim.sensor.parameter import learned_of


def is_little(asked: Asked, k: int) -> bool:
    """Whether a kind of errors is next to nothing beside what an effect does, without and with it, and it closes most
    of the gap where it is known by.

    Such as biases of weakly fattened edges: medians move where more than half of what is near one is foreground.
    """
    there = max(float(asked.gap.whole[k]), float(asked.left.whole[k]))
    return there <= asked.limit.known_by * float(asked.does.whole[:ALL].max()) and lies_by_its_axis(asked)


def is_untouched(asked: Asked, k: int) -> bool:
    """Whether an effect hardly changes a kind of errors along the axis on which that kind of gap changes most.

    That is for a cause that is still to be found.
    """
    first = first_asked(asked, k)
    return float(asked.does.varies[k, first]) < asked.limit.acts * float(asked.gap.varies[k, first])


def is_beside_others(asked: Asked, k: int) -> bool:
    """Whether an effect makes holes anywhere, and those of the gap change along an axis of another cause of holes."""
    return KINDS[k] == "missing" and not asked.effect.axes and is_theirs(asked, k, first_asked(asked, k))


def leaves_level(asked: Asked, k: int) -> str | None:
    """Whether too much is left of what a kind of gap has in the mean, however it changes."""
    axis = int(np.argmax(asked.gap.mean[k]))
    share = float(asked.left.mean[k, axis] / max(asked.gap.mean[k, axis], 1e-12))
    return f"leaves {share:.0%} of the {WORDS[KINDS[k]]}" if share > asked.limit.left_of_uniform else None


def leaves_unfilled(asked: Asked) -> str | None:
    """Whether an effect that fills holes leaves too many of those that the recording has not. Of those that it has more
    of, another cause that is still to be found may be."""
    if asked.filled is None or asked.filled <= asked.limit.left_along:
        return None
    return f"leaves {asked.filled:.0%} of the holes that the recording has not"


def is_of(asked: Asked, k: int) -> str | None:
    """Whether a kind of gap changes first along an axis of another cause of that kind, and none of the effect's.

    Then it is what that cause's own formula leaves, which many another effect takes up, as far as it can: next to
    nothing is left by what acted before the cause, such as an offset before steps.
    """
    first, gap = first_asked(asked, k), asked.gap
    if is_more(asked, k) or asked.surely_left(k, first) <= asked.limit.left_by_exact:
        return None
    sure, _ = worth_of(asked.validator, gap, k)
    if not sure[first] or asked.own[first] or gap.varies[k, first] <= asked.limit.uniform * gap.whole[k]:
        return None
    if _lie_anywhere(asked, k, first):
        return None
    cause = next(iter(asked.others(first, k)), None)
    if cause is None:
        return None
    return f"is for what {cause.id} leaves along {asked.validator.evidence.axes[first].name.replace('_', ' ')}"


def _lie_anywhere(asked: Asked, k: int, axis: int) -> bool:
    """Whether outliers that an effect makes wherever pixels are lie all along an axis, too, and it closes these.

    What is left by the formula of what makes them in some places is little in the mean over all.
    """
    if KINDS[k] != "tail" or asked.effect.axes != ("residual_tail",):
        return False
    whole, left = float(asked.gap.mean[k, axis]), float(asked.left.mean[k, axis])
    return whole >= asked.limit.beside * asked.gap.varies[k, axis] and left <= asked.limit.near_floor * whole


def leaves_elsewhere(asked: Asked, k: int) -> str | None:
    """Whether what is left of a kind of gap lies along an axis of no cause, as it was."""
    limit, left, whole = asked.limit, asked.left, float(asked.left.whole[k])
    if whole < (limit.uniform_tails if KINDS[k] == "tail" else limit.near_floor) * asked.gap.whole[k]:
        return None
    axis = int(np.argmax(left.varies[k] / max(whole, 1e-12) - cost(asked.validator)))
    varies = float(left.varies[k, axis])
    sure = varies > limit.sure * left.chance[k, axis]
    untouched = varies >= limit.mostly * whole and varies >= limit.untouched * asked.gap.varies[k, axis]
    if asked.own[axis] or asked.others(axis) or not (sure and untouched):
        return None
    return f"leaves all of how {asked.change_along(k, axis)}"


def is_for_another_axis(asked: Asked, k: int) -> str | None:
    """Whether an effect follows a change along an axis by which it is not known, where its own change less.

    With many parameters it comes near to nearly all of that, such as light from a side for noise that grows over the
    picture, where the camera hardly turns, or light from above for noise that grows towards the floor. With few, such
    as noise of a material that lies where the picture is noisy, it leaves much. What is much the same all over is not
    for that axis, such as the noise of a simulator without any, of which frames have a few per cent more or less.
    """
    limit, gap, named_by = asked.limit, asked.gap, asked.effect.axes[:1] if asked.flexible else asked.effect.axes
    sure, worth = worth_of(asked.validator, gap, k)
    first = int(np.argmax(worth))
    own = np.array([bool(axis.names & set(named_by)) for axis in asked.validator.evidence.axes]) & asked.own
    if own[first] or not own.any() or asked.others(first, k) or not sure[first]:
        return None
    if gap.varies[k, first] <= limit.uniform * gap.whole[k] or asked.is_seen_past_edges(first):
        return None
    share = asked.surely_left(k, first)
    enough, most = (limit.as_much, limit.near_floor) if asked.flexible else (limit.beside, limit.left_of_noise)
    if float(worth[own].max(initial=0.0)) >= enough * worth[first] or share <= most:
        return None
    return f"leaves {share:.0%} of how {asked.change_along(k, first)}, by which it is not known"


def is_by_height(asked: Asked, k: int) -> str | None:
    """Whether biases that a pattern is learned from change along the height nearly as much as in the picture.

    What a level camera sees at one height it sees in one row, and a pattern of the picture follows what the scene has.
    """
    if not asked.learned or KINDS[k] != "bias":
        return None
    sure, worth = worth_of(asked.validator, asked.gap, k)
    heights = [n for n, axis in enumerate(asked.validator.evidence.axes) if axis.name == "height" and sure[n]]
    most = max((float(worth[n]) for n in heights), default=0.0)
    if most < max(asked.limit.uniform, asked.limit.untouched * float(worth[asked.own].max(initial=0.0))):
        return None
    return "is not told from biases that change along height"


def leaves_beside_pattern(asked: Asked, k: int) -> str | None:
    """Whether biases that a pattern is learned from change much along an axis of no other cause, as they did before.

    What stays at its pixels changes with nothing else, and as it has no formula nothing is left by that: such as biases
    by how surfaces face, which stay where they are as long as the camera hardly turns.
    """
    if not asked.learned or KINDS[k] != "bias":
        return None
    limit, gap, left = asked.limit, asked.gap, asked.left
    much = (left.varies[k] >= limit.beside_pattern * gap.whole[k]) & (left.varies[k] > limit.sure * left.chance[k])
    for axis in map(int, np.flatnonzero(much & ~asked.own & (left.varies[k] >= limit.untouched * gap.varies[k]))):
        if not asked.others(axis):
            return f"leaves all of how {asked.change_along(k, axis)}"
    return None


def leaves_crossed(asked: Asked, k: int) -> str | None:
    """Whether much bias is left along an axis of the effect's crossed with another one, beyond what is along its own.

    What has the effect's axis and another shape, such as an offset of the disparities for a scale, comes near along
    that axis alone: other parameters make up for it. They cannot at every range on every material. Crossed with an axis
    of another cause of bias, such as the time beside a drift, what is left is by that one's formula.
    """
    if KINDS[k] != "bias":  # another formula of noise or holes leaves as much
        return None
    gap, limit = asked.gap, asked.limit
    axes = asked.validator.evidence.axes
    crossed = np.array([len(axis.names) > 1 for axis in axes])
    seen = (gap.varies[k] >= limit.crossed * gap.whole[k]) & (gap.varies[k] >= limit.sure * gap.chance[k])
    for axis in map(int, np.flatnonzero(asked.own & crossed & seen)):
        if is_crossed(asked, k, axis):
            continue
        parts = [n for n in np.flatnonzero(asked.own & ~crossed) if axes[n].names < axes[axis].names]
        alone = max([0.0, *asked.left.varies[k, parts]])
        share = float((asked.left.varies[k, axis] - alone) / max(gap.varies[k, axis], 1e-12))
        if share > limit.left_along:
            return f"leaves {share:.0%} of how {asked.change_along(k, axis)}"
    return None


def leaves_geometry(asked: Asked, k: int) -> str | None:
    """Whether an effect that has no other formula leaves some of how biases change along an axis of no other cause.

    Such as a turned mount for a principal point that is off; or along the range, if that is its only axis: an offset of
    the disparities for a scale that is wrong. A pattern that is learned beside it leaves some along any axis.
    """
    if not asked.effect.exact or KINDS[k] != "bias":
        return None
    sure, worth = worth_of(asked.validator, asked.gap, k)
    first, limit = int(np.argmax(worth)), asked.limit
    most = limit.left_of_own if any(learned_of(type(cause)) for cause in asked.named) else limit.left_by_exact
    much = sure & (asked.gap.varies[k] >= limit.known_by * asked.gap.whole[k])
    asks = {first: most} if much[first] and not asked.others(first, k) else {}
    if asked.effect.axes == ("range",):
        much &= asked.own
        theirs = {name for one in asked.named if KINDS[k] in one.kinds for name in one.axes[:1]}
        much &= [not axis.names & theirs for axis in asked.validator.evidence.axes]
        asks |= {int(n): max(most, limit.near_floor) for n in np.flatnonzero(much) if n not in asks}
    for axis, most in asks.items():
        share = asked.surely_left(k, axis)
        if share > most:
            return f"leaves {share:.0%} of how {asked.change_along(k, axis)}"
    return None


def brings(asked: Asked, k: int) -> str | None:
    """Whether an effect makes biases or spreads change along an axis of its own, where the recording's do not.

    Such as an offset of the disparities for a scale that is wrong, which has another shape along the range, or noise by
    motion for more noise all the time. But at edges, where what moves pixels by another formula has other medians, if
    it is not known by them.
    """
    gap, left, limit = asked.gap, asked.left, asked.limit
    most = {"bias": limit.brought, "spread": limit.idle}.get(KINDS[k])
    if most is None or asked.learned:
        return None
    own = asked.own
    if asked.effect.axes[:1] != ("edge_distance",):
        own = own & ["edge_distance" not in axis.names for axis in asked.validator.evidence.axes]
    more = np.where(own, left.varies[k] - np.maximum(gap.varies[k], 0) - limit.sure * left.chance[k], 0)
    axis = int(np.argmax(more))
    if more[axis] <= most * asked.does.whole[k]:
        return None
    return _makes(asked, k, axis)


def not_itself(asked: Asked) -> str | None:
    """Whether an effect, as it is fitted, brings along its first axis what the recording has not, of any kind.

    Such as a drift of the scale that is fitted to a scale that is wrong all the time. Of outliers all kinds together
    must be less there: pixels in between for noise at edges have as much of a bias that is not the recording's. A
    learned pattern that closes most is asked for biases alone: how far it is from the recording's in a cell is spread.
    """
    gap, left, does, effect, limit = asked.gap, asked.left, asked.does, asked.effect, asked.limit
    if not effect.axes or effect.axes[0] == "range":  # the spread, in which errors are measured, goes with the range
        return None
    own = known_by(asked.validator, effect)
    for k, kind in enumerate(KINDS):
        kinds = effect.kinds[:1] if asked.learned and asked.closes_well else effect.kinds
        asks = kind in kinds or (k == ALL and effect.kinds[0] == "tail")
        if not own or not asks or does.whole[k] < limit.acts * does.whole[ALL] or (k != ALL and is_little(asked, k)):
            continue
        axis = own[int(np.argmax(does.varies[k, own]))]  # of several cuts of one axis, the one that shows it best
        if k == ALL:
            share = asked.surely_left(k, axis)
            return f"leaves {share:.0%} of how {asked.change_along(k, axis)}" if share > limit.untouched else None
        if kind == "tail" and lies_by_its_axis(asked):
            continue
        more = left.varies[k, axis] - gap.varies[k, axis] - limit.sure * left.chance[k, axis]
        if more > limit.idle * float(does.whole[k]):
            return _makes(asked, k, axis)
    return None


def makes_besides(asked: Asked) -> str | None:
    """Whether a noise makes outliers or holes along the axis that it is known by, where the recording has none of them.

    However few they are: noise of where a pixel looks has outliers at edges, whatever its formula, and noise that grows
    on a slant by another cause's has not.
    """
    gap, left, does, limit = asked.gap, asked.left, asked.does, asked.limit
    if not asked.alone or asked.effect.kinds[0] != "spread":
        return None
    for k in [KINDS.index(kind) for kind in ("tail", "missing") if kind in asked.effect.kinds]:
        for axis in known_by(asked.validator, asked.effect):
            made = float(does.varies[k, axis])
            is_sure = made > limit.sure * max(does.chance[k, axis], left.chance[k, axis])
            has_none = gap.varies[k, axis] <= limit.near_floor * made
            if is_sure and has_none and left.varies[k, axis] >= limit.mostly * made:
                return _makes(asked, k, axis)
    return None


def leaves_own(asked: Asked, k: int) -> str | None:
    """Whether a noise, or an effect with many parameters, leaves much along the axis that it is known by.

    Whatever its formula, it follows what changes there. What changes along another axis it follows as well, at the cost
    of its own: light from above for noise that grows with the height; or, where much of it changes, noise everywhere
    for that of a few far things. But for holes, which by two shapes may both lie where there were none; and what
    closes nearly all may leave more.
    """
    limit, gap, does = asked.limit, asked.gap, asked.does
    asks = KINDS[k] == "spread" or (asked.flexible and KINDS[k] != "missing")
    if not asks or gap.whole[k] < limit.acts * gap.whole[ALL]:
        return None
    own = known_by(asked.validator, asked.effect)
    if not own:
        return None
    axis = own[int(np.argmax(does.varies[k, own]))]  # of several cuts of one axis, the one that shows it best
    much, most = (limit.uniform, limit.left_of_own) if asked.flexible else (limit.all_along, limit.left_of_noise)
    if gap.varies[k, axis] <= max(much * gap.whole[k], limit.sure * gap.chance[k, axis]):
        return None
    share, most = asked.surely_left(k, axis), limit.left_along if asked.nearly_all else most
    return f"leaves {share:.0%} of how {asked.change_along(k, axis)}" if share > most else None


def _makes(asked: Asked, k: int, axis: int) -> str:
    return f"makes {asked.change_along(k, axis)}, where the recording's do not"
