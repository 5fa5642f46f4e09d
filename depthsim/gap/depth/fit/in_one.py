"""A pattern and the biases beside it as one, where the pattern with all that they explain does as well alone.

Such as an offset of the disparities for a pattern whose mean is not 0, or a turned mount for one that is a ramp.
"""

from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.ties import surely_worse


def in_one(search: Search, model: Model, gap: float) -> Model:
    """``model``, or with fewer causes that do as well on the frames held out. gap: what it leaves there."""
    biases = [k for k, one in enumerate(model.effects) if one.kinds[0] == "bias"]
    named = {model.parts[k].effect for k in biases}
    wholes = (one for one in search.bank if one.in_place and one.effect in named and one not in model.parts)
    whole = next(wholes, None)
    if whole is None or len(biases) == 1:
        return model
    others = model
    for number in reversed(biases):
        others = others.less(number)
    begun = search.begin(whole, others.build(search.base))
    trial = search.validated(search.fit(others.plus(begun) if others.parts else begun, 3))
    fewer, more = (one.build(search.base) for one in (trial.model, model))
    as_well = trial.gap - gap < search.config.select.tied * search.whole
    if not as_well or surely_worse(search.validator, fewer, more):
        return model
    search.say(f"{whole.effect} alone does as well")
    return trial.model
