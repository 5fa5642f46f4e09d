"""Two causes, of which each hides the other, so that neither closes anything alone."""

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from depthsim.gap.depth.fit import neighbours
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.chain import Chain
from depthsim.gap.depth.fit.changes import first_axes
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.traits import is_filter
from depthsim.sensor.effect import Effect, effect_class


def cancelling(search: Search, chain: Chain, alone: Trial | None) -> Trial | None:
    """Two causes that are known by the range or the time alone, and cancel where most is seen, so that neither closes
    much; beside others that make no biases, where none of what else may be added is supported.

    Such as an offset of the disparities beside a scale, which a calibration at one range leaves, or a scale that drifts
    beside one that is wrong from the beginning, as of a camera that was calibrated warm. None where ``alone`` does
    nearly as well, or as well if it acts along none of the axes on which the gap lies first, or where the two leave
    some of how biases change along their axes: they come near to any law, such as one with a knee.
    """
    so_far = chain.model or Model((), np.empty(0))
    if any("bias" in effect.kinds for effect in so_far.effects):  # two more come near to what their formulas leave
        return None
    limit, whole = search.config.select, chain.score.above if so_far.parts else search.whole
    least, first = limit.first * whole, first_axes(search.validator, so_far.build(search.base))
    if alone is not None:
        along = {name for _, names in first for name in names}
        acts = along & set(effect_class(alone.newest.effect).axes)
        least = chain.gap - alone.gap + (limit.near if acts else limit.tied) * whole
    if least >= whole:
        return None
    drifts = any(kind == "bias" and "time" in names for kind, names in first)
    known_by = {"range", "time"} if drifts else {"range"}

    def may_cancel(effect: type[Effect]) -> bool:
        return effect.kinds == ("bias",) and "range" in effect.axes and known_by.issuperset(effect.axes)

    biases = _first_of_each(search, chain, may_cancel)
    for pair in combinations(biases, 2):
        begun = so_far.plus(search.begin(pair[0], so_far.build(search.base)))
        both = search.validated(search.fit(begun.plus(search.begin(pair[1], begun.build(search.base))), 4))
        axes = {effect.axes[0] for effect in both.model.effects[-2:]}
        left = max(search.left_of_biases(both.model, axis) for axis in axes)
        if chain.gap - both.gap < least or left > search.config.agreement.near_floor:
            continue
        count = len(both.model.parts)
        if not any(search.disagreement(both.model, k, alone=True) for k in (count - 2, count - 1)):
            return both
    return None


def beneath_a_filter(search: Search, chain: Chain) -> Trial | None:
    """A noise and a filter that takes as much of it away as the recording has more, here or there, on top of the causes
    so far.

    Alone the noise is too much where the filter's picture is quiet, and the filter too quiet where noise is added. That
    neighbours go together speaks for a filter where there is none of a bias, which makes them go together, too.
    """
    so_far = chain.model or Model((), np.empty(0))
    before = so_far.build(search.base)
    if any(kind == "bias" for kind, _ in first_axes(search.validator, before)):
        return None

    def may_filter(effect: type[Effect]) -> bool:
        known = effect.axes[0] if is_filter(effect.id) else ""
        more = neighbours.lacking(search.validator, known, before) if known in neighbours.HISTOGRAMS else 0.0
        return more > search.config.agreement.brought_together

    filters = _first_of_each(search, chain, may_filter)
    noises = _first_of_each(search, chain, lambda effect: effect.kinds == ("spread",))
    pairs = [(one, noise) for one in filters for noise in noises]
    if not pairs:
        return None
    one, noise = _nearest(search, so_far, pairs).parts[-2:]
    forms = [(one, other) for other in search.bank if other.effect == noise.effect and not other.in_place]
    both = search.validated(search.fit(_nearest(search, so_far, forms), 4))
    closes = chain.gap - both.gap >= search.config.select.first * chain.score.above
    count = len(both.model.parts)
    if not closes or any(search.disagreement(both.model, k, alone=True) for k in (count - 2, count - 1)):
        return None
    return both


def _nearest(search: Search, so_far: Model, pairs: Sequence[tuple[Candidate, Candidate]]) -> Model:
    """The pair of a filter and a noise that comes nearest to the recording, on a few frames."""
    number = len(so_far.parts)
    with_filter = ((so_far.plus(Model((one,), one.encode(one.starts[0]))), noise) for one, noise in pairs)
    begun = [search.begin_together(model, number, noise) for model, noise in with_filter]
    return min((search.fit_roughly(model, 2) for model in begun), key=lambda model: model.loss)


def _first_of_each(search: Search, chain: Chain, wanted: Callable[[type[Effect]], bool]) -> list[Candidate]:
    found: dict[str, Candidate] = {}
    for candidate in search.bank:
        is_open = not (candidate.in_place or candidate.effect in chain.named or chain.is_out(candidate.effect))
        if is_open and wanted(effect_class(candidate.effect)):
            found.setdefault(candidate.effect, candidate)
    return list(found.values())
