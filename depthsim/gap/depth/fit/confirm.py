"""Causes of a whole model that are confirmed: each closes something, and acts where the others leave a gap."""

from collections.abc import Sequence

import numpy as np

from depthsim.gap.depth.fit.enough import is_alike
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.shapley import credit
from depthsim.gap.selection import Refuse
from depthsim.sensor.effect import effect_class


def confirmed(search: Search, refuse: Refuse, model: Model, *, first: bool = False) -> Model:
    """The causes that close something, and act where the gap lies that the others leave. refuse: hears of the rest.

    first: whether to stop at the first that does not, so that another cause can be looked for in its place before the
    others are asked, which what is its own may hide.
    """
    refined = False
    while model.parts:
        shares = credit(search.validator, search.base, model)
        reasons = [search.disagreement(model, k, alone=True) for k in range(len(model.parts))]
        if any(reasons) and not refined:  # a fit that has not converged may be all that is wrong
            model, refined = search.refined(model), True
            continue
        wrong = [k for k, why in enumerate(reasons) if why is not None]
        least = int(np.argmin(shares))
        better: Model | None = None
        faint = len(shares) > 1 and shares[least] < search.config.significance.faint * search.floor
        if faint and not search.makes_doubling(model, least):
            worst, why = least, "closes next to nothing beside the others"
        elif wrong:
            worst, better = _replaced(search, model, sorted(wrong, key=lambda k: shares[k]))
            why = str(reasons[worst])
        else:
            break
        search.say(f"{model.parts[worst].effect} is no cause: it {why}")
        refuse(model.parts[worst].effect, shares[worst] / search.whole, why)
        if better is not None:
            model = better
            continue
        model = model.less(worst)
        model = search.fit(model, 3) if model.parts else model
        if first and not faint and model.parts:
            break
    return model


def _replaced(search: Search, model: Model, wrong: Sequence[int]) -> tuple[int, Model | None]:
    """Which of the causes that are wrong goes, and the model with another in its place, if there is one.

    The first of them, unless one is geometry and another takes its place: what such a one leaves, as there is no other
    formula of it, may be all that is wrong with the others.
    """
    exact = (k for k in wrong if k != wrong[0] and effect_class(model.parts[k].effect).exact)
    for number in (*exact, wrong[0]):
        if (better := _in_its_place(search, model, number)) is not None:
            return number, better
    return wrong[0], None


def _in_its_place(search: Search, model: Model, worst: int) -> Model | None:
    """The model with an effect in the place of one that does not act where the gap lies; None where none is better.

    It is known by the axis on which what the others leave of that kind of gap changes most, or acts everywhere and does
    as well with fewer parameters.
    """
    less, part = model.less(worst), model.parts[worst]
    refused, margin = effect_class(part.effect), search.config.select.tied * search.whole
    best, found = search.validated(model).gap, None
    named, limit = [cause.effect for cause in less.parts], search.config.select
    for candidate in search.known_here(less, refused.kinds[0]) if less.parts else ():
        if candidate.effect == refused.id:
            continue
        if (begun := search.begin_near(less, candidate, model)) is None:
            continue
        trial = search.validated(search.fit(begun, 4, search.config.fit.behind * model.loss, elsewhere=True))
        plainer = found is None and len(candidate.free) < len(part.free)
        near = trial.gap < best + (margin if plainer else 0)
        if near and is_alike(candidate.effect, named):  # two shapes along one axis are one cause, by another formula
            near = search.validated(search.fit(less, 3)).gap - trial.gap >= limit.alike * search.whole
        if near and search.disagreement(trial.model, len(less.parts), alone=True) is None:
            best, found = trial.gap, trial.model
    if found is not None:
        search.say(f"{found.parts[-1].effect} in place of {refused.id}")
    return found
