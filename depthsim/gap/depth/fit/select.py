"""Which effects explain the gap: one, then more, each validated on frames that it was not fitted on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.candidates import Candidate
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Say, Search, Trial
from depthsim.gap.depth.fit.shapley import credit
from depthsim.gap.depth.fit.ties import Ties, compare_rivals
from depthsim.gap.depth.fit.validate import Validator


@dataclass(frozen=True)
class Selection:
    """The causes. shares: what each takes off the gap on the frames held out [bits per pixel]; ties: the equals of
    each cause.

    looked_at: the leaders of each step, for the report.
    """

    model: Model
    shares: tuple[float, ...]
    ties: Ties
    looked_at: tuple[tuple[Trial, ...], ...]


@dataclass(frozen=True)
class _Chain:
    """Causes found one after the other. looked, before: the leaders of each step, and the gap before it."""

    model: Model | None
    gap: float
    looked: list[tuple[Trial, ...]]
    before: list[float]


def select(
    evidence: Evidence, validator: Validator, bank: Sequence[Candidate], before: float, floor: float, say: Say
) -> Selection:
    """One cause after the other, as long as the frames held out support it.

    bank: what may be wrong; before, floor: the gap of the simulator as it is, and its least.
    """
    search = Search(evidence, validator, bank, before, floor, say)
    chain = _grow(search, _Chain(None, before, [], []))
    if chain.model is not None and (plain := _plain_rival(search, chain)) is not None:
        say(f"beginning again with {plain.newest.effect}")
        leaders = (plain, *(c for c in chain.looked[0] if c is not plain))
        other = _grow(search, _Chain(plain.model, plain.gap, [leaders], [before]))
        chain = other if other.gap < chain.gap - search.config.select.tied * search.whole else chain
    if chain.model is None:
        return Selection(Model((), np.empty(0)), (), {}, tuple(chain.looked))
    model, ties = compare_rivals(search, chain.model, chain.gap, chain.looked, chain.before)
    shares = credit(validator, search.base, model)
    while len(shares) > 1 and min(shares) < search.config.select.least * search.whole:
        least = int(np.argmin(shares))
        say(f"{model.parts[least].effect} closes next to nothing")
        ties.pop(model.parts[least].effect, None)
        model = search.fit(model.less(least), 3)
        shares = credit(validator, search.base, model)
    say("refining the parameters")
    model = search.refined(model)
    return Selection(model, credit(validator, search.base, model), ties, tuple(chain.looked))


def _grow(search: Search, chain: _Chain) -> _Chain:
    """The chain with every further cause that is supported."""
    model, gap, looked, before = chain.model, chain.gap, list(chain.looked), list(chain.before)
    limit = search.config.select
    while (model is None or len(model.parts) < limit.most_causes) and search.left(gap) > limit.done:
        leaders = search.step(model, looked[-1] if looked else ())
        looked.append(tuple(leaders))
        before.append(gap)
        if not leaders or not _supported(search, gap, leaders, first=model is None):
            break
        model, gap = leaders[0].model, leaders[0].gap
        if len(model.parts) > 1:
            model, gap = _prune(search, model, gap)
    return _Chain(model, gap, looked, before)


def _plain_rival(search: Search, chain: _Chain) -> Trial | None:
    """What to begin with instead, where the first cause is flexible and all the same leaves something.

    Light from a side brings noise and holes: by itself it closes more than either of the two causes that brought
    the one and the other, and leaves too little of each for them to be found on top of it.
    """
    first, limit = chain.looked[0][0], search.config.select
    if not search.is_flexible(first.newest) or search.left(chain.gap) <= limit.done:
        return None
    enough = search.before - limit.plain * (search.before - first.gap)
    return next((c for c in chain.looked[0] if not search.is_flexible(c.newest) and c.gap <= enough), None)


def _supported(search: Search, before: float, leaders: Sequence[Trial], first: bool) -> bool:
    """Whether what the first of ``leaders`` closes is enough to name it."""
    whole, limit = search.whole, search.config.select
    best = leaders[0]
    share = (before - best.gap) / whole
    others = [c for c in leaders if c.newest.effect != best.newest.effect]
    if first:
        most = max((before - c.gap for c in others), default=0.0)
        apart = share >= limit.first_apart and before - best.gap >= limit.first_apart_times * most
        return share >= limit.first or apart
    if share >= limit.further or (share >= limit.least and share >= limit.further_of_left * search.left(before)):
        return True
    return share >= limit.further_apart and all(_stays(search, before, best, other) for other in others)


def _stays(search: Search, before: float, best: Trial, other: Trial) -> bool:
    """Whether ``best`` closes its part of the gap also where ``other`` has closed its own."""
    gained, limit = before - best.gap, search.config.select
    if before - other.gap < limit.rival * gained:
        return True
    newest = Model((other.newest,), other.model.split(other.model.x)[-1])
    both = search.validated(best.model.plus(newest)).gap
    return other.gap - both >= limit.stays * gained


def _prune(search: Search, model: Model, gap: float) -> tuple[Model, float]:
    """Without the causes that later ones have made needless."""
    for number in range(len(model.parts) - 2, -1, -1):
        without = search.fit(model.less(number), 3)
        left = search.validated(without).gap
        if left - gap < search.config.select.least * search.whole:
            search.say(f"{model.parts[number].effect} is no longer needed")
            model, gap = without, left
    return model, gap
