"""Which effects explain the gap: one, then more, each validated on frames that it was not fitted on.

A further cause is looked for as long as what is left would be a gap if it were alone. An effect becomes a cause if it
closes enough of that, and acts where it lies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.candidates import Candidate
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Say, Search, Trial
from depthsim.gap.depth.fit.shapley import credit
from depthsim.gap.depth.fit.ties import Ties, compare_rivals
from depthsim.gap.depth.fit.validate import Score, Validator
from depthsim.gap.diagnosis import Nearest
from depthsim.sensor.effect import effect_class


@dataclass(frozen=True)
class Selection:
    """The causes, and the equals of each. nearest: effects that come near, but are no causes.

    looked_at: the leaders of each step, for the report.
    """

    model: Model
    ties: Ties
    nearest: tuple[Nearest, ...]
    looked_at: tuple[tuple[Trial, ...], ...]


@dataclass
class _Chain:
    """Causes found one after the other. looked, before: the leaders of each step, and the gap before it; refused: by
    effect, what it closed and why it is none; dropped: effects that were causes until all of them were there."""

    model: Model | None = None
    looked: list[tuple[Trial, ...]] = field(default_factory=list)
    before: list[float] = field(default_factory=list)
    refused: dict[str, Nearest] = field(default_factory=dict)
    dropped: set[str] = field(default_factory=set)

    def refuse(self, effect: str, closed: float, why: str) -> None:
        """Keep why an effect is no cause, by where it closed most."""
        if effect not in self.refused or self.refused[effect].closed_fraction < closed:
            self.refused[effect] = Nearest(effect=effect, closed_fraction=closed, why_not=why)


def select(evidence: Evidence, validator: Validator, bank: Sequence[Candidate], say: Say) -> Selection:
    """One cause after the other, as long as the frames of ``validator`` support it. bank: what may be wrong."""
    score = validator.score(evidence.base)
    search = Search(evidence, validator, bank, score.gap, score.floor, say)
    chain, ties = _Chain(), dict[str, tuple[str, ...]]()
    for _ in range(search.config.select.rounds):
        gap = _grow(search, chain, score)
        if chain.model is None:
            break
        looked = [[trial for trial in step if trial.newest.effect not in chain.dropped] for step in chain.looked]
        whole, ties = compare_rivals(search, chain.model, gap, looked, chain.before)
        confirmed = _confirmed(search, chain, whole)
        chain.model = confirmed if confirmed.parts else None
        dropped = {part.effect for part in whole.parts} - {part.effect for part in confirmed.parts}
        chain.dropped |= dropped
        score = validator.score(confirmed.build(evidence.base))
        if not dropped:
            break
    model = chain.model
    if model is None:
        return Selection(Model((), np.empty(0)), {}, _nearest(search, chain, ()), tuple(chain.looked))
    say("refining the parameters")
    model = search.refined(model)
    named = tuple(part.effect for part in model.parts)
    ties = {cause: equals for cause, equals in ties.items() if cause in named}
    return Selection(model, ties, _nearest(search, chain, named), tuple(chain.looked))


def _grow(search: Search, chain: _Chain, score: Score) -> float:
    """Every cause that is supported, into the chain; the gap with all of them. score: of the sensor as it is.

    Two causes may each leave what is the other's. So where none of the leaders acts where the gap lies, the one that
    closes most is taken all the same, a few times, and asked again when the others are there.
    """
    gap, trusted = search.validated(chain.model).gap if chain.model else search.before, search.config.select.trusted
    while chain.model is None or len(chain.model.parts) < search.config.select.most_causes:
        if not score.stands_out(search.config.significance):
            break
        leaders = _leaders(search, chain, gap)
        selected = _first_supported(search, chain, leaders, gap, score)
        if (
            selected is None
            and trusted > 0
            and leaders
            and _closes_enough(search, gap, leaders, score, first=chain.model is None)
        ):
            selected, trusted = leaders[0], trusted - 1
        if selected is None:
            break
        chain.model, gap = selected.model, selected.gap
        if len(chain.model.parts) > 1:
            chain.model, gap = _prune(search, chain.model, gap)
        score = search.validator.score(chain.model.build(search.base))
    return gap


def _leaders(search: Search, chain: _Chain, gap: float) -> list[Trial]:
    """The leaders of the bank on top of the causes so far, but for what was dropped."""
    if chain.model is None and chain.looked:  # they were fitted at the beginning
        leaders = chain.looked[0]
    else:
        leaders = tuple(search.step(chain.model, chain.looked[-1] if chain.looked else ()))
        chain.looked.append(leaders)
        chain.before.append(gap)
    return [trial for trial in leaders if trial.newest.effect not in chain.dropped]


def _first_supported(search: Search, chain: _Chain, leaders: Sequence[Trial], gap: float, score: Score) -> Trial | None:
    """The leader that closes most of those that close enough and act where the gap lies."""
    left = list(leaders)
    while left and _closes_enough(search, gap, left, score, first=chain.model is None):
        best = left.pop(0)
        why = search.disagreement(best.model, len(best.model.parts) - 1)
        if why is None:
            return best
        chain.refuse(best.newest.effect, (gap - best.gap) / search.whole, why)
        search.say(f"{best.newest.effect} is no cause: it {why}")
        left.sort(key=lambda trial: trial.gap)
    return None


def _closes_enough(search: Search, gap: float, leaders: Sequence[Trial], score: Score, first: bool) -> bool:
    """Whether what the first of ``leaders`` closes is enough to name it. gap, score: before it."""
    limit, best = search.config.select, leaders[0]
    gained, left = gap - best.gap, max(score.above, 1e-12)
    others = [c for c in leaders if c.newest.effect != best.newest.effect]
    if first:
        most = max((gap - c.gap for c in others), default=0.0)
        share = gained / _closable(search, best)
        return share >= limit.first or (share >= limit.first_apart and gained >= limit.first_apart_times * most)
    if gained < search.config.significance.faint * score.floor:
        return False
    if gained >= limit.further * search.whole or gained >= limit.further_of_left * left:
        return True
    return gained >= limit.further_apart * left and all(_stays(search, gap, best, other) for other in others)


def _closable(search: Search, trial: Trial) -> float:
    """What a first cause could take off the gap: errors that go together have a higher floor."""
    if effect_class(trial.newest.effect).kinds[0] != "correlation":
        return search.whole
    floor = search.validator.score(trial.model.build(search.base)).floor
    return max(search.before - floor, 1e-12)


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


def _confirmed(search: Search, chain: _Chain, model: Model) -> Model:
    """The causes that close something, and act where the gap lies that the others leave."""
    refined = False
    while model.parts:
        shares = credit(search.validator, search.base, model)
        reasons = [search.disagreement(model, k, alone=True) for k in range(len(model.parts))]
        if any(reasons) and not refined:  # a fit that has not converged may be all that is wrong
            model, refined = search.refined(model), True
            continue
        wrong = [k for k, why in enumerate(reasons) if why is not None]
        least = int(np.argmin(shares))
        if len(shares) > 1 and shares[least] < search.config.significance.faint * search.floor:
            worst, why = least, "closes next to nothing beside the others"
        elif wrong:
            worst = min(wrong, key=lambda k: shares[k])
            why = str(reasons[worst])
        else:
            break
        search.say(f"{model.parts[worst].effect} is no cause: it {why}")
        chain.refuse(model.parts[worst].effect, shares[worst] / search.whole, why)
        model = model.less(worst)
        model = search.fit(model, 3) if model.parts else model
    return model


def _nearest(search: Search, chain: _Chain, named: Sequence[str]) -> tuple[Nearest, ...]:
    """The effects that come nearest of those that are no causes, best first."""
    limit = search.config.select
    some = [n for n in chain.refused.values() if n.effect not in named and n.closed_fraction >= limit.nearest]
    return tuple(sorted(some, key=lambda n: -n.closed_fraction)[: limit.most_nearest])
