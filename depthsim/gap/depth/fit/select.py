"""Which effects explain the gap: one, then more, each judged on frames that it was not fitted on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.candidates import Hypothesis
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import TIED, Candidate, Say, Search, is_pliant
from depthsim.gap.depth.fit.shapley import credit
from depthsim.gap.depth.fit.ties import Ties, compare_rivals
from depthsim.gap.depth.fit.validate import Judge

_MOST = 6
"""How many causes are told at most."""
_DONE = 0.015
"""With no more than this part of the gap left, no further cause is looked for."""
_FIRST = 0.3
"""What the first cause must close at least: less is a name that happens to be near, not an explanation."""
_OF_REST, _OF_ALL, _LARGE = 0.5, 0.01, 0.1
"""What a further cause must close at least: of what was left and of the whole gap, or of the whole gap alone. The rest
of a cause that follows another formula than the bank's is spread over many effects that close a little each."""
_FIRST_APART = 0.05, 3.0
"""What is enough for the first cause, too: so much of the gap, and so many times what the next effect would close."""
_APART, _STAYS = 0.02, 0.7
"""What is enough for a further cause, too: so much of the gap, of which so much stays when a rival is there before
it. A true cause closes its own part of the gap; the rest of a misfit is one for all that could take it up."""
_PLAIN = 0.5
"""What part of what a pliant first cause closes a plain one must close to be begun with instead."""


@dataclass(frozen=True)
class Choice:
    """The causes. shares: what each takes off the gap on the frames held out [bits per pixel]; ties: the equals of
    each cause.

    looked_at: the leaders of each step, for the report.
    """

    model: Model
    shares: tuple[float, ...]
    ties: Ties
    looked_at: tuple[tuple[Candidate, ...], ...]


@dataclass(frozen=True)
class _Chain:
    """Causes found one after the other. looked, before: the leaders of each step, and the gap before it."""

    model: Model | None
    gap: float
    looked: list[tuple[Candidate, ...]]
    before: list[float]


def choose(
    evidence: Evidence, judge: Judge, bank: Sequence[Hypothesis], before: float, floor: float, say: Say
) -> Choice:
    """One cause after the other, as long as the frames held out support it.

    bank: what may be wrong; before, floor: the gap of the simulator as it is, and its least.
    """
    search = Search(evidence, judge, bank, before, floor, say)
    chain = _grow(search, _Chain(None, before, [], []))
    if chain.model is not None and (plain := _plain_rival(search, chain)) is not None:
        say(f"beginning again with {plain.newest.effect}")
        leaders = (plain, *(c for c in chain.looked[0] if c is not plain))
        other = _grow(search, _Chain(plain.model, plain.gap, [leaders], [before]))
        chain = other if other.gap < chain.gap - TIED * search.whole else chain
    if chain.model is None:
        return Choice(Model((), np.empty(0)), (), {}, tuple(chain.looked))
    model, ties = compare_rivals(search, chain.model, chain.gap, chain.looked, chain.before)
    shares = credit(judge, search.base, model)
    while len(shares) > 1 and min(shares) < _OF_ALL * search.whole:
        least = int(np.argmin(shares))
        say(f"{model.parts[least].effect} closes next to nothing")
        ties.pop(model.parts[least].effect, None)
        model = search.fit(model.less(least), 3)
        shares = credit(judge, search.base, model)
    say("settling the parameters")
    model = search.settled(model)
    return Choice(model, credit(judge, search.base, model), ties, tuple(chain.looked))


def _grow(search: Search, chain: _Chain) -> _Chain:
    """The chain with every further cause that is supported."""
    model, gap, looked, before = chain.model, chain.gap, list(chain.looked), list(chain.before)
    while (model is None or len(model.parts) < _MOST) and search.left(gap) > _DONE:
        leaders = search.step(model, looked[-1] if looked else ())
        looked.append(tuple(leaders))
        before.append(gap)
        if not leaders or not _supported(search, gap, leaders, first=model is None):
            break
        model, gap = leaders[0].model, leaders[0].gap
        if len(model.parts) > 1:
            model, gap = _prune(search, model, gap)
    return _Chain(model, gap, looked, before)


def _plain_rival(search: Search, chain: _Chain) -> Candidate | None:
    """What to begin with instead, where the first cause bends to everything and all the same leaves something.

    Light from a side brings noise and holes: by itself it closes more than either of the two causes that brought
    the one and the other, and leaves too little of each for them to be found on top of it.
    """
    first = chain.looked[0][0]
    if not is_pliant(first.newest) or search.left(chain.gap) <= _DONE:
        return None
    enough = search.before - _PLAIN * (search.before - first.gap)
    return next((c for c in chain.looked[0] if not is_pliant(c.newest) and c.gap <= enough), None)


def _supported(search: Search, before: float, leaders: Sequence[Candidate], first: bool) -> bool:
    """Whether what the first of ``leaders`` closes is enough to name it."""
    whole = search.whole
    best = leaders[0]
    share = (before - best.gap) / whole
    others = [c for c in leaders if c.newest.effect != best.newest.effect]
    if first:
        most = max((before - c.gap for c in others), default=0.0)
        return share >= _FIRST or (share >= _FIRST_APART[0] and before - best.gap >= _FIRST_APART[1] * most)
    if share >= _LARGE or (share >= _OF_ALL and share >= _OF_REST * search.left(before)):
        return True
    return share >= _APART and all(_stays(search, before, best, other) for other in others)


def _stays(search: Search, before: float, best: Candidate, other: Candidate) -> bool:
    """Whether ``best`` closes its part of the gap also where ``other`` has closed its own."""
    gained = before - best.gap
    if before - other.gap < 0.25 * gained:
        return True
    newest = Model((other.newest,), other.model.split(other.model.x)[-1])
    both = search.judged(best.model.plus(newest)).gap
    return other.gap - both >= _STAYS * gained


def _prune(search: Search, model: Model, gap: float) -> tuple[Model, float]:
    """Without the causes that later ones have made needless."""
    for number in range(len(model.parts) - 2, -1, -1):
        without = search.fit(model.less(number), 3)
        rest = search.judged(without).gap
        if rest - gap < _OF_ALL * search.whole:
            search.say(f"{model.parts[number].effect} is no longer needed")
            model, gap = without, rest
    return model, gap
