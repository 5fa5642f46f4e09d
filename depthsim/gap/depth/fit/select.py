"""Which effects explain the gap: one, then more, each validated on frames that it was not fitted on.

A further cause is looked for as long as what is left would be a gap if it were alone. An effect becomes a cause if it
closes enough of that, and acts where it lies.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.beneath import beneath
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.chain import Chain
from depthsim.gap.depth.fit.changes import first_axes
from depthsim.gap.depth.fit.confirm import confirmed
from depthsim.gap.depth.fit.finer import with_pattern_beside_biases
from depthsim.gap.depth.fit.fitting import Fitting, Say, Trial
from depthsim.gap.depth.fit.grow import grow
from depthsim.gap.depth.fit.in_one import (
    bias_in_other_form,
    biases_in_one,
    holes_anywhere,
    noises_in_one,
    smoothed_in_one,
)
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.pairs import INDEPENDENT
from depthsim.gap.depth.fit.search import GONE, Search
from depthsim.gap.depth.fit.ties import Ties, compare_rivals, instead, surely_worse
from depthsim.gap.depth.fit.traits import is_filling
from depthsim.gap.depth.fit.validate import Score, Validator
from depthsim.gap.diagnosis import Nearest
from depthsim.gap.selection import Refused
from depthsim.sensor.effect import effect_class


@dataclass(frozen=True)
class Selection:
    """The causes, and the equals of each. nearest: effects that come near, but are no causes.

    looked_at: the leaders of each step, for the report. is_unfinished: whether something is left, and no further cause
    was looked for, as it would have taken too long.
    """

    model: Model
    ties: Ties
    nearest: tuple[Nearest, ...]
    looked_at: tuple[tuple[Trial, ...], ...]
    is_unfinished: bool = False


def select(evidence: Evidence, validator: Validator, bank: Sequence[Candidate], say: Say) -> Selection:
    """One cause after the other, as long as the frames of ``validator`` support it. bank: what may be wrong.

    What closes most by itself may be near to two causes together. So where something is left, the next of the
    effects that came first is put in its place, and causes are looked for once more.
    """
    score = validator.score(evidence.base)
    search = Search(evidence, validator, bank, evidence.base, say)
    chain = _chain(search, score, Chain(search.config.select, score, search.before))
    for other in _other_beginnings(search, chain):
        chain = _better(search, chain, _chain(search, score, other, chain.named))
    if chain.model is None:
        return Selection(Model((), np.empty(0)), {}, chain.nearest, tuple(chain.looked), chain.is_unfinished)
    found = noises_in_one(search, Trial(chain.model, chain.gap), chain.refuse)
    found = smoothed_in_one(search, found)
    found = biases_in_one(search, bias_in_other_form(search, found))
    chain.model = beneath(search, holes_anywhere(search, found)).model
    say("refining the parameters")
    model = search.refined(chain.model) if chain.model.parts else chain.model
    ties = {cause: equals for cause, equals in chain.ties.items() if cause in chain.named}
    return Selection(model, ties, chain.nearest, tuple(chain.looked), chain.is_unfinished)


def select_more(validator: Validator, bank: Sequence[Candidate], found: Selection, say: Say) -> Selection | None:
    """Causes besides those of a selection from elsewhere, less noise and filters that do not show; None where nothing
    is left, or its biases bring no pixel nearer or are no causes there, so that nothing is seen behind them.

    validator: see :meth:`Evidence.centred`. Further biases are none, nor noise beside a noise or where a bias is left,
    nor holes beside holes: so near to a large one, they are what its formula leaves.
    """
    evidence, model = validator.evidence, found.model
    before = model.build(evidence.base)
    left = validator.score(before)
    if not left.stands_out(evidence.config.significance) or left.gap >= validator.quick(evidence.base):
        return None
    if left.floor <= evidence.config.significance.least:  # no noise: what is left is how depths are rounded
        return found
    fitting = Fitting(evidence, validator, (), before, say)
    again = fitting.validated(fitting.fit(model, 4))  # what its parameters are off by there is for no other cause
    if again.gap < left.gap:
        model = fitting.refined(again.model)
        before = model.build(evidence.base)
        found, left = replace(found, model=model), validator.score(before)
        if not left.stands_out(evidence.config.significance):
            return found
    theirs = {"bias"} | ({one.kinds[0] for one in model.effects} & {"spread", "missing"})
    if any(kind == "bias" for kind, _ in first_axes(validator, before)):
        theirs.add("spread")
    hidden = [candidate for candidate in bank if effect_class(candidate.effect).kinds[0] not in theirs]
    noises = [candidate for candidate in bank if effect_class(candidate.effect).kinds[0] != "bias"]
    strict = evidence.config.select.model_copy(update={"further": evidence.config.select.further_of_left})
    config = evidence.config.model_copy(update={"select": strict})
    search = Search(evidence, validator, hidden, before, say, replacing=noises, config=config)
    chain = _chain(search, left, Chain(strict, left, left.gap, model))
    # Noise and how it goes together are seen better here than beside the biases, whatever was named for them there.
    refused = chain.dropped | set(chain.refused)
    dropped = {name for name in refused if effect_class(name).kinds[0] in ("correlation", "spread")}
    already = {part.effect for part in model.parts}
    if chain.model is None:  # what formulas leave is too much there to say anything of any cause
        return None
    if not set(chain.named) >= already - dropped or set(chain.named) == already:
        return found
    nearest = tuple(near for near in found.nearest if near.effect not in chain.named)
    ties = {cause: equals for cause, equals in {**found.ties, **chain.ties}.items() if cause in chain.named}
    looked_at, unfinished = (*found.looked_at, *map(tuple, chain.looked)), found.is_unfinished or chain.is_unfinished
    return Selection(search.refined(chain.model), ties, nearest, looked_at, unfinished)


def confirm(search: Search, selection: Selection) -> Selection:
    """The causes of a selection that was made elsewhere, as far as they are supported here."""
    refused = Refused({near.effect: near for near in selection.nearest})
    model = confirmed(search, refused.refuse, selection.model)
    nearest = refused.nearest([part.effect for part in model.parts], search.config.select)
    return replace(selection, model=model, nearest=nearest)


def _chain(search: Search, score: Score, chain: Chain, known: Collection[str] = ()) -> Chain:
    """Every cause that is supported. score: of the sensor as it is. known: causes that another chain has found; one
    that comes back to some of these alone finds no others, and has no model.

    Only what is confirmed is compared with its rivals: most of those of a cause that is dropped would be, too, and the
    others come first when causes are looked for again.
    """
    rounds = search.config.select.rounds
    for number in range(1, rounds + 1):
        grow(search, chain)
        if chain.model is None:
            break
        beside = with_pattern_beside_biases(search, chain.model)
        dropped = _confirm(search, score, chain, beside, first=number < rounds)
        if chain.model is None or (dropped and number < rounds):
            continue
        looked = [[trial for trial in step if not chain.is_out(trial.newest.effect)] for step in chain.looked]
        whole, chain.ties = compare_rivals(search, chain.model, chain.gap, looked, chain.before)
        causes = {part.effect for part in whole.parts}
        if causes <= set(chain.named):
            break
        if causes <= set(known):
            chain.model = None
            break
        _confirm(search, score, chain, whole)  # a cause in place of another one may leave other things
    return chain


def _confirm(search: Search, score: Score, chain: Chain, model: Model, *, first: bool = False) -> bool:
    """Make of ``model`` what is confirmed of it the chain's own; whether anything was dropped. first: see
    :func:`confirm.confirmed`.

    Where errors go together which a cause makes one by one, other first causes that do so are no better.
    """
    whys: dict[str, str] = {}

    def refuse(effect: str, closed: float, why: str) -> None:
        whys[effect] = why
        chain.refuse(effect, closed, why)

    kept = confirmed(search, refuse, model, first=first)
    if kept is chain.model:
        return False
    if {part.effect for part in kept.parts} <= {part.effect for part in model.parts}:
        chain.dropped |= set(whys)  # or it is asked once more, beside what came in its place
    chain.model = kept if kept.parts else None
    chain.score = search.validator.score(kept.build(search.base)) if kept.parts else score
    chain.gap = search.validated(kept).gap if kept.parts else search.before
    if INDEPENDENT in whys.values():
        chain.looked[0] = tuple(trial for trial in chain.looked[0] if not search.goes_together(trial.model))
    return bool(whys)


def _other_beginnings(search: Search, chain: Chain) -> Iterator[Chain]:
    """Where something is left: the same causes with another one in the place of the first, if that comes near.

    Not no holes at all in the place of what fills them, which does nearly as well: hardly a sensor loses nothing.
    """
    limit = search.config.select
    first = next((trial for step in chain.looked[:1] for trial in step if trial.newest.effect in chain.named), None)
    if chain.model is None or first is None or not search.leaves(chain.model, chain.score):
        return
    reach = min(limit.near * search.whole, limit.near_of_cause * (search.before - first.gap))
    others = [
        trial
        for trial in chain.looked[0]
        if trial.newest.effect not in chain.named
        and not chain.is_out(trial.newest.effect)
        and trial.gap - first.gap < reach
        and not (is_filling(first.newest.effect) and search.is_less(trial, GONE))
    ]
    for other in others[: limit.beginnings - 1]:
        if search.is_spent:
            chain.is_unfinished = True
            return
        trial = instead(search, chain.model, first.newest.effect, other)
        alone = len(chain.named) == 1  # then it has been compared with the first, and not with what that stood for
        if alone or trial.gap - chain.gap < limit.near_of_cause * (chain.gap - search.floor):
            score = search.validator.score(trial.model.build(search.base))
            begun = Chain(search.config.select, score, trial.gap, trial.model, [*chain.looked], [*chain.before])
            yield replace(begun, refused=Refused(chain.refused), asked=chain.asked.copy())


def _better(search: Search, one: Chain, other: Chain) -> Chain:
    """The chain that leaves surely less, and the first where neither does; what the other refused is kept."""
    one.is_unfinished = other.is_unfinished = one.is_unfinished or other.is_unfinished
    limit, left = search.config.select, max(one.gap - search.floor, 0.0)
    if (
        other.model is None
        or one.gap - other.gap < limit.better * left
        or not surely_worse(search.validator, *(c.model.build(search.base) for c in (one, other) if c.model))
    ):
        return one
    search.say(f"{' and '.join(other.named)} in place of {' and '.join(one.named)}")
    for near in one.refused.values():
        other.refuse(near.effect, near.closed_fraction, near.why_not)
    return other
