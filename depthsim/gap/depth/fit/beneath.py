"""Holes anywhere beneath holes that grow along an axis: those that there are where these have not yet begun.

By another formula that begins earlier, an effect whose holes grow comes so near to both that nothing is left to be
looked for. But what it then makes there grows, and what the recording has is the same all over.
"""

import numpy as np

from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.changes import (
    ENOUGH,
    GROWING,
    Effects,
    cuts_along,
    has_effect,
    holes_along,
    holes_made,
    mean_over,
    pixels_along,
    where_they_begin,
)
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.traits import is_anywhere
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import effect_class


def beneath(search: Search, found: Trial) -> Trial:
    """What is found, or with a cause of holes anywhere beside one whose holes grow."""
    model = found.model
    others = anywhere(search, model)
    for number, part in enumerate(model.parts):
        effect, less = effect_class(part.effect), model.less(number)
        is_new = not has_effect(search.base, part.effect)
        if not (others and is_new and effect.kinds[0] == "missing" and effect.axes[:1] and effect.axes[0] in GROWING):
            continue
        before = less.build(search.base)
        if not lies_beneath(search.validator, effect.axes[0], before, model.build(search.base)):
            continue
        under = search.begin(others[0], before)
        begun = less.plus(under) if less.parts else under
        begun = begun.plus(search.begin(part, begun.build(search.base)))
        both = search.validated(search.fit(begun, 4, elsewhere=True))
        under_alone = both.model.less(len(both.model.parts) - 1).build(search.base)
        still = lies_beneath(search.validator, effect.axes[0], under_alone, both.model.build(search.base))
        if both.gap < found.gap and not still:
            search.say(f"{others[0].effect} beneath {part.effect}")
            return both
    return found


def anywhere(search: Search, model: Model) -> list[Candidate]:
    """What of the bank loses pixels anywhere, and is not in the model yet."""
    there = {part.effect for part in model.parts}
    return [one for one in search.bank if is_anywhere(one.effect) and one.effect not in there and not one.in_place]


def lies_beneath(validator: Validator, axis: str, before: Effects, after: Effects) -> bool:
    """Whether the recording has holes where those that ``after`` makes over ``before`` begin, which do not grow there
    as those do, in two halves of the frames."""
    number = cuts_along(validator, axis)[0]
    real, without = validator.real, validator.runs(before, validator.evidence.config.fit.runs)[0]
    made = holes_made(validator, number, before, after)
    pixels = pixels_along(validator, number, real)
    limit = validator.evidence.config.agreement
    begins, goes_on = where_they_begin(made, pixels, limit.begins)
    seen = np.flatnonzero(pixels >= ENOUGH)
    if not len(goes_on):
        return False

    def flat(half: slice) -> bool:
        more = holes_along(validator, number, real[half]) - holes_along(validator, number, without[half])
        weight = pixels_along(validator, number, real[half])

        level, fitted = mean_over(begins, weight, more), mean_over(begins, weight, made)
        grows = mean_over(goes_on, weight, more) - level
        much = level > limit.beneath * mean_over(seen, weight, more) > 0
        return bool(much and grows < limit.flat * level and fitted < (1 - limit.flat) * level)

    return flat(slice(0, None, 2)) and flat(slice(1, None, 2))
