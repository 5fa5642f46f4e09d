"""Holes anywhere beneath holes that grow along an axis: those that there are where these have not yet begun.

By another formula that begins earlier, an effect whose holes grow comes so near to both that nothing is left to be
looked for. But what it then makes there grows, and what the recording has is the same all over.
"""

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.histograms import ERROR
from depthsim.gap.depth.fit.changes import GROWING, Effects, holes_along, holes_made, pixels_along, where_they_begin
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.search import Search, is_anywhere
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import effect_class


def beneath(search: Search, found: Trial) -> Trial:
    """What is found, or with a cause of holes anywhere beside one whose holes grow."""
    model = found.model
    there = {part.effect for part in model.parts}
    anywhere = [c for c in search.bank if c.effect not in there and is_anywhere(c.effect) and not c.in_place]
    for number, part in enumerate(model.parts):
        effect, less = effect_class(part.effect), model.less(number)
        is_new = all(part.effect != one.id for one in search.base)
        if not (anywhere and is_new and effect.kinds[0] == "missing" and effect.axes[:1] and effect.axes[0] in GROWING):
            continue
        before = less.build(search.base)
        if not lies_beneath(search.validator, effect.axes[0], before, model.build(search.base)):
            continue
        under = search.begin(anywhere[0], before)
        begun = less.plus(under) if less.parts else under
        begun = begun.plus(search.begin(part, begun.build(search.base)))
        both = search.validated(search.fit(begun, 4, elsewhere=True))
        under_alone = both.model.less(len(both.model.parts) - 1).build(search.base)
        still = lies_beneath(search.validator, effect.axes[0], under_alone, both.model.build(search.base))
        if both.gap < found.gap and not still:
            search.say(f"{anywhere[0].effect} beneath {part.effect}")
            return both
    return found


def lies_beneath(validator: Validator, axis: str, before: Effects, after: Effects) -> bool:
    """Whether the recording has holes where those that ``after`` makes over ``before`` begin, which do not grow there
    as those do, in two halves of the frames."""
    number = next(n for n, one in enumerate(validator.evidence.axes) if one.name == axis and one.kind == ERROR)
    real, without = validator.real, validator.runs(before, validator.evidence.config.fit.runs)[0]
    made = holes_made(validator, number, before, after)
    pixels = pixels_along(validator, number, real)
    limit = validator.evidence.config.agreement
    begins, goes_on = where_they_begin(made, pixels, limit.begins)
    if not len(goes_on):
        return False

    def flat(half: slice) -> bool:
        more = holes_along(validator, number, real[half]) - holes_along(validator, number, without[half])
        weight = pixels_along(validator, number, real[half])

        def over(some: NDArray[np.integer], of: NDArray[np.float64]) -> float:
            return float(weight[some] @ of[some] / max(weight[some].sum(), 1))

        level = over(begins, more)
        grows, fitted = over(goes_on, more) - level, over(begins, made)
        much = level > limit.beneath * over(np.flatnonzero(pixels >= 30), more) > 0
        return bool(much and grows < limit.flat * level and fitted < (1 - limit.flat) * level)

    return flat(slice(0, None, 2)) and flat(slice(1, None, 2))
