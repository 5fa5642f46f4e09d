"""Which effects explain the gap: one, then more, each validated on frames that it was not fitted on.

A further cause is looked for as long as what is left would be a gap if it were alone. An effect becomes a cause if it
closes enough of that, and acts where it lies.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from depthsim.gap.config import DepthSelect
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.candidates import Candidate
from depthsim.gap.depth.fit.changes import first_axes
from depthsim.gap.depth.fit.in_one import in_one
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.rules import INDEPENDENT
from depthsim.gap.depth.fit.search import Say, Search, Trial
from depthsim.gap.depth.fit.shapley import credit
from depthsim.gap.depth.fit.ties import Ties, compare_rivals, instead, surely_worse
from depthsim.gap.depth.fit.validate import Score, Validator
from depthsim.gap.diagnosis import Nearest
from depthsim.gap.selection import Refused, closes_enough
from depthsim.sensor.effect import effect_class
from depthsim.sensor.parameter import learned_of


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
    effect, what it closed and why it is none; asked: how often it was refused; dropped: effects that were causes until
    all of them were there; trusted: those that were taken for the moment.

    ties: the equals of each cause; gap, score: with all of them, on the frames held out. config: of the selection.
    """

    config: DepthSelect
    score: Score
    gap: float
    model: Model | None = None
    looked: list[tuple[Trial, ...]] = field(default_factory=list)
    before: list[float] = field(default_factory=list)
    refused: Refused = field(default_factory=Refused)
    asked: Counter[str] = field(default_factory=Counter)
    dropped: set[str] = field(default_factory=set)
    trusted: list[str] = field(default_factory=list)
    ties: Ties = field(default_factory=dict)

    def refuse(self, effect: str, closed: float, why: str) -> None:
        """Keep why an effect is no cause."""
        self.asked[effect] += 1
        self.refused.refuse(effect, closed, why)

    def is_out(self, effect: str) -> bool:
        """Whether an effect was asked often enough: beside other causes, too, it does not act where the gap lies."""
        return effect in self.dropped or self.asked[effect] >= self.config.asked

    @property
    def named(self) -> tuple[str, ...]:
        """The causes."""
        return tuple(part.effect for part in self.model.parts) if self.model else ()

    @property
    def nearest(self) -> tuple[Nearest, ...]:
        """The effects that come nearest of those that are no causes."""
        return self.refused.nearest(self.named, self.config)


def select(evidence: Evidence, validator: Validator, bank: Sequence[Candidate], say: Say) -> Selection:
    """One cause after the other, as long as the frames of ``validator`` support it. bank: what may be wrong.

    What closes most by itself may be near to two causes together. So where something is left, the next of the
    effects that came first is put in its place, and causes are looked for once more.
    """
    score = validator.score(evidence.base)
    search = Search(evidence, validator, bank, evidence.base, say)
    chain = _chain(search, score, _Chain(search.config.select, score, search.before))
    for other in _other_beginnings(search, chain):
        chain = _better(search, chain, _chain(search, score, other))
    if chain.model is None:
        return Selection(Model((), np.empty(0)), {}, chain.nearest, tuple(chain.looked))
    chain.model = in_one(search, chain.model, chain.gap)
    say("refining the parameters")
    model = search.refined(chain.model)
    ties = {cause: equals for cause, equals in chain.ties.items() if cause in chain.named}
    return Selection(model, ties, chain.nearest, tuple(chain.looked))


def select_more(validator: Validator, bank: Sequence[Candidate], found: Selection, say: Say) -> Selection | None:
    """Causes besides those of a selection from elsewhere; None where nothing is left for them.

    validator: see :meth:`Evidence.centred`. Further biases are none, nor noise beside a noise or where a bias is left:
    so near to a large one, they are what its formula leaves.
    """
    evidence, model = validator.evidence, found.model
    before = model.build(evidence.base)
    left = validator.score(before)
    if not left.stands_out(evidence.config.significance):
        return None
    if left.floor <= evidence.config.significance.least:  # no noise: what is left is how depths are rounded
        return found
    has_noise = any(effect_class(part.effect).kinds[0] == "spread" for part in model.parts)
    has_bias = any(kind == "bias" for kind, _ in first_axes(validator, before))
    theirs = {"bias", "spread"} if has_noise or has_bias else {"bias"}
    hidden = [candidate for candidate in bank if effect_class(candidate.effect).kinds[0] not in theirs]
    search = Search(evidence, validator, hidden, before, say)
    strict = search.config.select.model_copy(update={"further": search.config.select.further_of_left})
    search.config = search.config.model_copy(update={"select": strict})
    chain = _chain(search, left, _Chain(strict, left, left.gap, model))
    if chain.model is None or not set(chain.named) > {part.effect for part in model.parts}:
        return found
    nearest = tuple(near for near in found.nearest if near.effect not in chain.named)
    ties = {cause: equals for cause, equals in {**found.ties, **chain.ties}.items() if cause in chain.named}
    return Selection(search.refined(chain.model), ties, nearest, (*found.looked_at, *map(tuple, chain.looked)))


def confirm(search: Search, selection: Selection) -> Selection:
    """The causes of a selection that was made elsewhere, as far as they are supported here."""
    refused = Refused({near.effect: near for near in selection.nearest})
    model = _confirmed(search, refused.refuse, selection.model)
    nearest = refused.nearest([part.effect for part in model.parts], search.config.select)
    return replace(selection, model=model, nearest=nearest)


def _chain(search: Search, score: Score, chain: _Chain) -> _Chain:
    """Every cause that is supported. score: of the sensor as it is.

    Only what is confirmed is compared with its rivals: most of those of a cause that is dropped would be, too, and the
    others come first when causes are looked for again.
    """
    rounds = search.config.select.rounds
    for number in range(1, rounds + 1):
        _grow(search, chain)
        if chain.model is None:
            break
        dropped = _confirm(search, score, chain, chain.model)
        if chain.model is None or (dropped and number < rounds):
            continue
        looked = [[trial for trial in step if not chain.is_out(trial.newest.effect)] for step in chain.looked]
        whole, chain.ties = compare_rivals(search, chain.model, chain.gap, looked, chain.before)
        if {part.effect for part in whole.parts} <= set(chain.named):
            break
        _confirm(search, score, chain, whole)  # a cause in place of another one may leave other things
    return chain


def _confirm(search: Search, score: Score, chain: _Chain, model: Model) -> bool:
    """Make of ``model`` what is confirmed of it the chain's own; whether anything was dropped.

    Where errors go together which a cause makes one by one, other first causes that do so are no better.
    """
    whys: dict[str, str] = {}

    def refuse(effect: str, closed: float, why: str) -> None:
        whys[effect] = why
        chain.refuse(effect, closed, why)

    confirmed = _confirmed(search, refuse, model)
    if confirmed is chain.model:
        return False
    chain.dropped |= set(whys)
    chain.model = confirmed if confirmed.parts else None
    chain.score = search.validator.score(confirmed.build(search.base)) if confirmed.parts else score
    chain.gap = search.validated(confirmed).gap if confirmed.parts else search.before
    if INDEPENDENT in whys.values():
        chain.looked[0] = tuple(trial for trial in chain.looked[0] if not search.goes_together(trial.model))
    return bool(whys)


def _other_beginnings(search: Search, chain: _Chain) -> Iterator[_Chain]:
    """Where something is left: the same causes with another one in the place of the first, if that comes near."""
    limit = search.config.select
    first = next((trial for step in chain.looked[:1] for trial in step if trial.newest.effect in chain.named), None)
    if chain.model is None or first is None or not chain.score.stands_out(search.config.significance):
        return
    reach = min(limit.near * search.whole, limit.near_of_cause * (search.before - first.gap))
    others = [
        trial
        for trial in chain.looked[0]
        if trial.newest.effect not in chain.named
        and not chain.is_out(trial.newest.effect)
        and trial.gap - first.gap < reach
    ]
    for other in others[: limit.beginnings - 1]:
        trial = instead(search, chain.model, first.newest.effect, other)
        alone = len(chain.named) == 1  # then it has been compared with the first, and not with what that stood for
        if alone or trial.gap - chain.gap < limit.near_of_cause * (chain.gap - search.floor):
            score = search.validator.score(trial.model.build(search.base))
            begun = _Chain(search.config.select, score, trial.gap, trial.model, [*chain.looked], [*chain.before])
            yield replace(begun, refused=Refused(chain.refused), asked=chain.asked.copy())


def _better(search: Search, one: _Chain, other: _Chain) -> _Chain:
    """The chain that leaves surely less, and the first where neither does; what the other refused is kept."""
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


def _grow(search: Search, chain: _Chain) -> None:
    """Every cause that is supported, into the chain.

    Two causes may each leave what is the other's. So where none of the leaders acts where the gap lies, the one that
    closes most is taken all the same, a few times, and asked again when the others are there.
    """
    while chain.model is None or len(chain.model.parts) < search.config.select.most_causes:
        if not chain.score.stands_out(search.config.significance):
            break
        leaders = _leaders(search, chain)
        selected = _first_supported(search, chain, leaders)
        if selected is None and len(chain.trusted) < search.config.select.trusted:
            itself = next((trial for trial in leaders if not search.stands_for_another(trial.model)), None)
            if itself and _closes_enough(search, chain, itself, leaders):
                selected = itself
                chain.trusted.append(itself.newest.effect)
        if chain.model is None:
            selected = _cancelling(search, chain, selected) or selected
        if selected is None:
            break
        polished = search.validated(search.fit(selected.model, 4))  # other minima are looked for near the best only
        selected = min(selected, polished, key=lambda trial: trial.gap)
        chain.model, chain.gap = selected.model, selected.gap
        if len(chain.model.parts) > 1:
            _prune(search, chain)
        chain.score = search.validator.score(chain.model.build(search.base))


def _cancelling(search: Search, chain: _Chain, alone: Trial | None) -> Trial | None:
    """Two first causes that are known by the range alone, and cancel where most is seen, so that neither closes much.

    Such as an offset of the disparities beside a scale, which a calibration at one range leaves. None where ``alone``
    does nearly as well, or as well if it acts along none of the axes on which the gap lies first.
    """
    limit, whole = search.config.select, search.whole
    least = limit.first * whole
    if alone is not None:
        along = {name for _, names in first_axes(search.validator, search.base) for name in names}
        acts = along & set(effect_class(alone.newest.effect).axes)
        least = chain.gap - alone.gap + (limit.near if acts else limit.tied) * whole
    biases = {}
    for candidate in search.bank if least < whole else ():
        effect = effect_class(candidate.effect)
        if effect.kinds == ("bias",) and effect.axes == ("range",) and not chain.is_out(effect.id):
            biases[effect.id] = candidate
    for first, second in combinations(biases.values(), 2):
        begun = search.begin(first, search.base)
        both = search.validated(search.fit(begun.plus(search.begin(second, begun.build(search.base))), 4))
        if chain.gap - both.gap >= least and not any(search.disagreement(both.model, k, alone=True) for k in (0, 1)):
            return both
    return None


def _leaders(search: Search, chain: _Chain) -> list[Trial]:
    """The leaders of the bank on top of the causes so far, but for what was dropped."""
    if chain.model is None and chain.looked:  # they were fitted at the beginning
        leaders = chain.looked[0]
    else:
        leaders = tuple(search.step(chain.model, chain.looked[-1] if chain.looked else (), chain.is_out, chain.trusted))
        chain.looked.append(leaders)
        chain.before.append(chain.gap)
    return [trial for trial in leaders if not chain.is_out(trial.newest.effect)]


def _first_supported(search: Search, chain: _Chain, leaders: Sequence[Trial]) -> Trial | None:
    """The leader that closes most of those that close enough and act where the gap lies."""
    left = sorted(leaders, key=lambda trial: (trial is not leaders[0], trial.gap))
    asked = left[:]
    while asked:
        best = asked.pop(0)
        if not _closes_enough(search, chain, best, left):
            continue
        why = search.disagreement(best.model, len(best.model.parts) - 1)
        if why is not None and best is leaders[0]:  # a fit that has not converged may be all that is wrong
            finer = search.validated(search.refined(best.model))
            if best.gap - finer.gap > search.config.select.tied * search.whole:
                left[left.index(best)] = best = finer
                why = search.disagreement(best.model, len(best.model.parts) - 1)
        if why is None:
            return best
        left.remove(best)
        if (other := search.in_other_form(chain.model, best)) is not None:
            left, asked = [other, *left], [other, *asked]
            continue
        chain.refuse(best.newest.effect, (chain.gap - best.gap) / search.whole, why)
        search.say(f"{best.newest.effect} is no cause: it {why}")
    return None


def _closes_enough(search: Search, chain: _Chain, trial: Trial, leaders: Sequence[Trial]) -> bool:
    """Whether what one of ``leaders`` closes is enough to name it."""
    limit, gap = search.config.select, chain.gap
    gained, left = gap - trial.gap, max(chain.score.above, 1e-12)
    others = [c for c in leaders if c.newest.effect != trial.newest.effect]
    if search.makes_steps(trial.model):  # which nothing else does, however little it closes
        return True
    if chain.model is None:
        most = max((gap - c.gap for c in others), default=0.0)
        share = gained / _closable(search, trial)
        return share >= limit.first or (share >= limit.first_apart and gained >= limit.first_apart_times * most)
    if _is_alike(trial.newest.effect, chain.named) and gained < limit.alike * search.whole:
        return False
    biases = [effect_class(name).kinds[0] == "bias" for name in (trial.newest.effect, *chain.named)]
    if biases[0] and any(biases[1:]) and gained < limit.least * search.whole:
        return False
    by_material = any(isinstance(free.key, tuple) for free in trial.newest.free)
    # With so many parameters it takes up what the formulas of others leave.
    if (by_material or search.is_flexible(trial.newest)) and gained < limit.further * search.whole:
        return False
    faint = search.config.significance.faint * chain.score.floor
    if closes_enough(gained, left, search.whole, faint, limit):
        return True
    if gained < max(faint, limit.further_apart * left):
        return False
    if not search.is_flexible(trial.newest):  # with many parameters as much is closed of anything
        others = [other for other in others if other.gap < trial.gap or not search.is_flexible(other.newest)]
    if search.acts(trial.model):  # two that act where errors of different kinds lie are no rivals
        others = [other for other in others if not (_is_other_kind(trial, other) and search.acts(other.model))]
    along = search.left_along(trial.model)
    learned = learned_of(effect_class(trial.newest.effect))  # as much as other frames say for sure is there
    acts = along is not None and (bool(learned) or along <= limit.left_alone)
    return all(_stays(search, gap, trial, other) or (acts and not search.acts(other.model)) for other in others)


def _is_other_kind(one: Trial, other: Trial) -> bool:
    return effect_class(one.newest.effect).kinds[0] != effect_class(other.newest.effect).kinds[0]


def _is_alike(effect: str, named: Sequence[str]) -> bool:
    """Whether a cause makes the same kind of error along the same axis first: an effect may be for what it leaves."""
    kinds = [(one.kinds[0], one.axes[:1]) for one in map(effect_class, (effect, *named))]
    return bool(kinds[0][1]) and kinds[0] in kinds[1:]


def _closable(search: Search, trial: Trial) -> float:
    """What a first cause could take off the gap: errors that go together have a higher floor."""
    if effect_class(trial.newest.effect).kinds[0] != "correlation":
        return search.whole
    floor = search.validator.score(trial.model.build(search.base)).floor
    return max(search.before - floor, 1e-12)


def _stays(search: Search, before: float, best: Trial, other: Trial) -> bool:
    """Whether ``best`` closes its part of the gap also where ``other`` has closed its own.

    Either nearly all of it, as the two are apart, or so much of it that ``other`` is the one that is not needed.
    """
    gained, limit = before - best.gap, search.config.select
    theirs = before - other.gap
    if theirs < limit.rival * gained:
        return True
    newest = Model((other.newest,), other.model.split(other.model.x)[-1])
    both = search.validated(best.model.plus(newest)).gap
    apart = other.gap - both >= limit.stays * gained
    needless = best.gap - both <= (1 - limit.stays) * theirs
    return apart or (needless and other.gap - min(both, best.gap) >= (1 - limit.stays) * gained)


def _prune(search: Search, chain: _Chain) -> None:
    """Without the causes that later ones have made needless. They do not come back, or two could go round for ever."""
    model = chain.model or Model((), np.empty(0))
    for number in range(len(model.parts) - 2, -1, -1):
        if search.makes_doubling(model, number):
            continue
        effect, without = model.parts[number].effect, search.validated(search.fit(model.less(number), 3))
        if without.gap - chain.gap < search.config.select.least * search.whole:
            search.say(f"{effect} is no longer needed")
            model, chain.gap = without.model, without.gap
            chain.dropped.add(effect)
    chain.model = model


def _confirmed(search: Search, refuse: Callable[[str, float, str], None], model: Model) -> Model:
    """The causes that close something, and act where the gap lies that the others leave. refuse: hears of the rest."""
    refined = False
    while model.parts:
        shares = credit(search.validator, search.base, model)
        reasons = [search.disagreement(model, k, alone=True) for k in range(len(model.parts))]
        if any(reasons) and not refined:  # a fit that has not converged may be all that is wrong
            model, refined = search.refined(model), True
            continue
        wrong = [k for k, why in enumerate(reasons) if why is not None]
        least = int(np.argmin(shares))
        faint = len(shares) > 1 and shares[least] < search.config.significance.faint * search.floor
        if faint and not search.makes_doubling(model, least):
            worst, why = least, "closes next to nothing beside the others"
        elif wrong:
            worst = min(wrong, key=lambda k: shares[k])
            why = str(reasons[worst])
        else:
            break
        search.say(f"{model.parts[worst].effect} is no cause: it {why}")
        refuse(model.parts[worst].effect, shares[worst] / search.whole, why)
        if not faint and (better := _in_its_place(search, model, worst)):
            model = better
            continue
        model = model.less(worst)
        model = search.fit(model, 3) if model.parts else model
    return model


def _in_its_place(search: Search, model: Model, worst: int) -> Model | None:
    """The model with an effect in the place of one that does not act where the gap lies; None where none is better.

    It is known by the axis on which what the others leave of that kind of gap changes most.
    """
    less, refused = model.less(worst), effect_class(model.parts[worst].effect)
    best, found = search.validated(model).gap, None
    for candidate in search.known_here(less, refused.kinds[0]) if less.parts else ():
        if candidate.effect == refused.id:
            continue
        begun = less.plus(search.begin(candidate, less.build(search.base)))
        trial = search.validated(search.fit(begun, 4, search.config.fit.behind * model.loss))
        if trial.gap < best and search.disagreement(trial.model, len(less.parts), alone=True) is None:
            best, found = trial.gap, trial.model
    if found is not None:
        search.say(f"{found.parts[-1].effect} in place of {refused.id}")
    return found
