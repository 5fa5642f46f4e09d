"""Each cause against the effects that came close to it: better ones take its place, equal ones are ties."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.fit.agreement import left_of_change
from depthsim.gap.depth.fit.changes import plain_axes
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.validate import Validator
from depthsim.gap.resampling import jackknife
from depthsim.gap.selection import is_tie
from depthsim.sensor.effect import Effect, effect_class

Ties = dict[str, tuple[str, ...]]


def compare_rivals(
    search: Search, model: Model, gap: float, looked: Sequence[Sequence[Trial]], before: Sequence[float]
) -> tuple[Model, Ties]:
    """The model with the best of each cause's rivals, and the equals of each cause.

    What makes nothing of what it is known by, such as noise by motion that is the same all the time, takes no place.
    What has few parameters takes that of what has many, such as holes anywhere that of light, if it leaves next to
    nothing more; what has fewer, such as holes anywhere that of holes by the range, if it leaves no more; what has as
    few, if it acts where something is left, see :func:`_acts_where_left`; and so do two with few, see :func:`_as_two`.
    An equal leaves hardly more than a cause does, or not surely, and at most twice as much, if that would be a gap if
    it were alone.

    looked, before: the leaders of each step, and the gap before it.
    """
    ties: Ties = {}
    limit = search.config.select
    for named in [part.effect for part in model.parts]:
        cause = named
        step, mine, closed = _found_as(cause, looked, before)
        reach = min(limit.near * search.whole, limit.near_of_cause * closed)
        taken = {part.effect for part in model.parts}
        equals: list[str] = []
        for rival in step:
            name = rival.newest.effect
            if mine is None or name in taken or name in equals or rival.gap - mine.gap > reach:
                continue
            if not set(effect_class(name).kinds) & set(effect_class(cause).kinds):
                continue
            other = instead(search, model, cause, rival)
            surely = partial(surely_worse, search.validator, *(m.build(search.base) for m in (other.model, model)))
            more, hardly = other.gap - gap, _hardly_more(search, gap)
            if not is_tie(more, min(limit.tied * search.whole, hardly), np.inf, surely):
                continue
            if more > hardly and search.leaves(other.model, search.validator.score(other.model.build(search.base))):
                continue
            if search.disagreement(other.model, _number(other.model, name)) is not None:
                continue
            itself = search.shows_itself(other.model, _number(other.model, name))
            part = model.parts[_number(model, cause)]
            plain = search.is_flexible(part) and not search.is_flexible(rival.newest)
            as_well = plain and more <= search.config.significance.faint * search.floor
            theirs, own = (search.parameters_of(one, step) for one in (rival, mine))
            fewer = theirs < own and more <= 0
            if itself and (
                as_well
                or fewer
                or other.gap < gap - limit.tied * search.whole
                or (theirs <= own and _acts_where_left(search, model, other.model, name))
            ):
                search.say(f"{name} in place of {cause}")
                model, gap, equals = other.model, other.gap, []
                cause = name
            else:
                equals.append(name)
        if equals:
            ties[cause] = tuple(equals)
        if (two := _as_two(search, model, gap, cause, step)) is not None:
            model, gap = two.model, two.gap
            ties.pop(cause, None)
    return model, ties


def _as_two(search: Search, model: Model, gap: float, cause: str, step: Sequence[Trial]) -> Trial | None:
    """Two effects with few parameters in the place of one that makes both their kinds of errors with many, such as more
    noise and holes anywhere for light; None where they leave more, or do not both act.

    step: the leaders among which the cause was found, whose first of each kind is tried.
    """
    number = _number(model, cause)
    one, taken = effect_class(cause), {part.effect for part in model.parts}
    if not (one.inseparable and search.is_flexible(model.parts[number])):
        return None
    open_to = (trial for trial in step if not {trial.newest.effect, *trial.newest.replaces} & taken)
    plain = [trial for trial in open_to if not search.is_flexible(trial.newest)]
    firsts = ((trial for trial in plain if effect_class(trial.newest.effect).kinds[0] == kind) for kind in one.kinds)
    two = [trial for first in firsts if (trial := next(first, None)) is not None]
    if len(two) < len(one.kinds):
        return None
    search.say(f"trying {' and '.join(trial.newest.effect for trial in two)} in place of {cause}")
    whole = model.less(number)
    for trial in two:
        whole = whole.plus(trial.model.newest)
    found = search.validated(search.fit(whole, 4))
    newest = range(len(found.model.parts) - len(two), len(found.model.parts))
    if found.gap > gap or any(search.disagreement(found.model, k, alone=True) for k in newest):
        return None
    return found


def _acts_where_left(search: Search, model: Model, other: Model, effect: str) -> bool:
    """Whether what ``model`` leaves changes most along the axis by which an effect of ``other`` is known, and that
    leaves less there: one is then for both, by its own formula, where the other has a second one yet to be found."""
    before, after = model.build(search.base), other.build(search.base)
    axis, kind = effect_class(effect).axes[:1], effect_class(effect).kinds[0]
    is_left = any(one == kind and along == {*axis} for one, along in plain_axes(search.validator, before))
    return is_left and left_of_change(search.validator, axis[0], kind, before, after) < 1


def _hardly_more(search: Search, gap: float) -> float:
    """As much as a model that leaves ``gap`` leaves over the floor, and what is next to nothing beside that."""
    return max(gap - search.floor, 0.0) + search.config.significance.faint * search.floor


def _found_as(
    cause: str, looked: Sequence[Sequence[Trial]], before: Sequence[float]
) -> tuple[Sequence[Trial], Trial | None, float]:
    """The last step in which a cause was among the leaders, what it was there, and what it closed.

    That is the one that it was named in: before a large cause is there, another may close much in its place.
    """
    for step, gap in zip(reversed(looked), reversed(before), strict=True):
        mine = next((trial for trial in step if trial.newest.effect == cause), None)
        if mine is not None:
            return step, mine, gap - mine.gap
    return (), None, np.inf


def _number(model: Model, effect: str) -> int:
    return [part.effect for part in model.parts].index(effect)


def instead(search: Search, model: Model, cause: str, rival: Trial) -> Trial:
    """``model`` with ``rival`` in the place of ``cause``."""
    if len(model.parts) == 1:
        return rival
    number = [part.effect for part in model.parts].index(cause)
    newest = rival.model.newest
    search.say(f"trying {rival.newest.effect} in place of {cause}")
    near = search.config.fit.behind * model.loss
    return search.validated(search.fit(newest.plus(model.less(number)), 3, near))


def surely_worse(validator: Validator, other: tuple[Effect, ...], selected: tuple[Effect, ...]) -> bool:
    """Whether the frames held out agree that ``other`` leaves more of the gap than ``selected``."""
    theirs, mine = (validator.runs(effects, 1)[0] for effects in (other, selected))

    def difference(blocks: NDArray[np.int64]) -> float:
        a, b, c = (x[blocks].sum(axis=0) for x in (validator.real, theirs, mine))
        return validator.ruler.gap(a, b) - validator.ruler.gap(a, c)

    return jackknife(difference, len(validator.real))[1][0] > 0
