"""Along which axis an effect is asked what it leaves of a kind of gap, and whether that is too much there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.fit.asked import WORDS, Asked
from depthsim.gap.depth.fit.changes import ALL, KINDS, worth_of
from depthsim.gap.depth.fit.traits import bends_rays


def leaves(asked: Asked, k: int) -> str | None:
    """Whether too much is left along the axis on which a kind of gap changes most, or of what is the same all over."""
    limit, gap, asks = asked.limit, asked.gap, _axis_asked(asked, k)
    first, whole = asks.first, max(float(gap.whole[k]), 1e-12)
    if _is_for_others(asked, k, asks):
        return None
    uniform = whole * (limit.uniform_tails if KINDS[k] == "tail" else limit.uniform)
    if asked.closes_well and asked.named and not asked.alone:  # the change may be for a cause still to be found
        uniform = whole * limit.mostly
    gives_way = asks.is_second and asked.closes_well
    if not asks.sure[first] or (gap.varies[k, first] <= uniform and not gives_way):
        return _leaves_all_over(asked, k)
    most, is_first = _may_leave(asked, k), np.arange(len(asks.worth)) == first
    if asks.is_second:
        most[first] = limit.left_along
    strong = asks.worth >= limit.strong * asks.worth[first] if asked.alone else is_first
    for axis in map(int, np.flatnonzero(strong & asks.sure & ((gap.varies[k] > uniform) | is_first))):
        if axis != first and asked.others(axis):
            continue
        share = asked.surely_left(k, axis)
        if share > (most[axis] if axis == first else limit.untouched):
            return f"leaves {share:.0%} of how {asked.change_along(k, axis)}"
    return None


@dataclass(frozen=True)
class _AxisAsked:
    """The axis along which an effect is asked (``first``), and how surely and by how much a kind of gap changes along
    each. is_second: another cause's comes before it, so that what is closed along its own speaks for the effect."""

    first: int
    sure: NDArray[np.bool_]
    worth: NDArray[np.float64]
    is_second: bool


def _axis_asked(asked: Asked, k: int) -> _AxisAsked:
    sure, worth = worth_of(asked.validator, asked.gap, k)
    first = first_asked(asked, k)
    own = np.where(asked.own, worth, -np.inf)
    if KINDS[k] not in (asked.effect.kinds[0], "all") and sure[int(np.argmax(own))]:
        worth, first = own, int(np.argmax(own))  # what it makes besides may be the smaller part: asked where it acts
    is_second = first != int(np.argmax(worth))
    return _AxisAsked(first if is_second else _in_scene(asked, worth, first), sure, worth, is_second)


def _may_leave(asked: Asked, k: int) -> NDArray[np.float64]:
    """(axes,) The share of how a kind of gap changes along an axis that an effect may leave, if it is asked there."""
    limit, effect, axes = asked.limit, asked.effect, asked.validator.evidence.axes
    share = limit.left_by_flexible if asked.learned or asked.flexible else 1.0
    along = np.full(len(axes), share * limit.left_along)
    # The axis that it is known by is the right one, if the shape along it is not; of holes the more, as by two shapes
    # both may lie where there were none.
    well = np.inf if KINDS[k] == "missing" else limit.left_along if asked.flexible else limit.untouched
    errors_by = next((name for name in effect.axes if not name.endswith("_neighbours")), None)
    known_by = [axis.name == errors_by for axis in axes]
    along[known_by] = well if asked.closes_well else limit.left_along
    if effect.axes == ("range",) and KINDS[k] == "missing":  # four are, which their shapes tell apart
        along[known_by] = limit.shape
    if asked.closes_well and bends_rays(effect.id):  # whatever the formula, rays that are bent see past edges
        at_edges = ["edge_distance" in axis.names for axis in axes]
        along[at_edges] = np.maximum(along[at_edges], limit.left_along)
    if asked.learned:  # along its own axes as much is removed as other frames say for sure is there
        along[[axis.name in effect.axes for axis in axes]] = limit.untouched
    return along


def _is_for_others(asked: Asked, k: int, asks: _AxisAsked) -> bool:
    """Whether what changes along the axis that is asked is for other causes, or for none, to answer for."""
    first = asks.first
    if is_more(asked, k) and is_theirs(asked, k, first):
        return True
    if k != ALL:
        return False
    most = asked.limit.all_along * max(float(asked.gap.whole[k]), 1e-12)
    if not (asks.sure[first] and asked.gap.varies[k, first] >= most):
        return True
    return not asked.own[first] and bool(asked.others(first))  # it is what they leave


def _leaves_all_over(asked: Asked, k: int) -> str | None:
    """Whether too much is left of what is much the same along all axes."""
    limit, share = asked.limit, float(asked.left.whole[k]) / max(float(asked.gap.whole[k]), 1e-12)
    tails_alone = KINDS[k] == "tail" and not lies_by_its_axis(asked)
    most = limit.left_of_tails if tails_alone else limit.left_of_uniform
    most *= limit.left_by_flexible if asked.flexible else 1.0
    return f"leaves {share:.0%} of the {WORDS[KINDS[k]]}" if share > most else None


def first_asked(asked: Asked, k: int) -> int:
    """The axis along which a kind of gap changes most. One of another cause, whose formula may leave that, gives way to
    one of the effect's own, if much changes along it or the effect closes most of all that is left, and one of its own
    that is crossed with that to its own alone."""
    varies, first = asked.gap.varies[k], int(np.argmax(worth_of(asked.validator, asked.gap, k)[1]))
    if k == ALL or not asked.others(first):
        return first
    own = asked.beside(k)
    if asked.own[first]:
        return own if own is not None and is_crossed(asked, k, first) else first
    if own is None and asked.closes_well:
        return asked.along_own(k, first)
    return first if own is None or varies[own] < asked.limit.beside * varies[first] else own


def _in_scene(asked: Asked, worth: NDArray[np.float64], first: int) -> int:
    """The axis of the scene in place of one of the picture that explains as much: a camera that hardly turns sees the
    same surfaces at the same places, and what acts on surfaces is known by these."""
    own = int(np.argmax(np.where(asked.own, worth, -np.inf)))
    names = asked.validator.evidence.axes[own].names
    in_picture = asked.validator.evidence.axes[first].names == {"image_position"}
    alike = in_picture and asked.flexible and "surface" in names and worth[own] >= asked.limit.same * worth[first]
    return own if alike else first


def is_theirs(asked: Asked, k: int, axis: int) -> bool:
    """Whether an axis is one of another cause of that kind, and none of the effect's."""
    return not asked.own[axis] and bool(asked.others(axis, k))


def is_more(asked: Asked, k: int) -> bool:
    """Whether so much is closed of what others leave that it is not for their formulas alone. Two biases come near to a
    third, such as an offset and a distortion of the lens to a scale that is wrong."""
    return asked.closes_well and KINDS[k] != "bias"


def is_crossed(asked: Asked, k: int, axis: int) -> bool:
    """Whether an axis is one of the effect's own crossed with one of another cause of that kind, which it has not."""
    theirs = asked.validator.evidence.axes[axis].names - set(asked.effect.axes)
    return any(theirs & set(cause.axes) for cause in asked.others(axis, k))


def lies_by_its_axis(asked: Asked) -> bool:
    """Whether most of the gap, all kinds together, lies along the axis that an effect is known by, and it closes that.

    Where most pixels near an edge are off, their tails are seen as spread there: how many are left or brought is for
    the formula.
    """
    along = worth_of(asked.validator, asked.gap, ALL)[1]
    first, limit = int(np.argmax(along)), asked.limit
    if asked.validator.evidence.axes[first].names != set(asked.effect.axes[:1]):
        return False
    most = asked.gap.varies[ALL, first] >= limit.all_along * asked.gap.whole[ALL]
    return bool(most and asked.surely_left(ALL, first) <= limit.left_along)
