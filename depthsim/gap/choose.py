"""Which effects explain the gap: one, then more, each judged on frames that it was not fitted on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations
from math import factorial

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.evidence import Counts, Evidence
from depthsim.gap.fit import Floats, Model, Roots, polish, refine, start
from depthsim.gap.hypotheses import Hypothesis
from depthsim.gap.judge import Judge, jackknife
from depthsim.sensor.effect import Effect

_LEADERS = 6
"""How many of the bank are fitted in full after a first look at all."""
_MOST = 6
"""How many causes are told at most."""
_FAR_BEHIND = 2.0
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
_TIED, _NEAR, _ALIKE = 0.01, 0.15, 0.3
"""Effects whose closed fractions differ by less than the first are not told apart, however sure the difference; by more
than the second, or by a larger part than the third of what the better one closes, they are no rivals."""
_SETTLING, _SETTLED = 6, 1e-4
"""How many rounds the chosen causes are fitted once more, and what a round must gain for another."""
_PLIANT = 4
"""With so many parameters an effect can take up much of what is another's."""
_PLAIN = 0.5
"""What part of what a pliant first cause closes a plain one must close to be begun with instead."""
_TAKEN_UP = 0.1
"""By what part of what it closes a pliant further cause may be ahead of a plain one without being preferred."""
_LOOKED_AT = 400_000
"""As many pixels are enough for a first look."""
Say = Callable[[str], None]


@dataclass(frozen=True)
class Candidate:
    """A model and its gap on the frames held out."""

    model: Model
    gap: float

    @property
    def newest(self) -> Hypothesis:
        """What was added last."""
        return self.model.parts[-1]


@dataclass(frozen=True)
class Choice:
    """The causes. shares: what each takes off the gap on the frames held out; ties: the equals of each cause.

    looked_at: the leaders of each step, for the report.
    """

    model: Model
    shares: tuple[float, ...]
    ties: dict[str, tuple[str, ...]]
    looked_at: tuple[tuple[Candidate, ...], ...]


@dataclass(frozen=True)
class _Chain:
    """Causes found one after the other. looked, before: the leaders of each step, and the gap before it."""

    model: Model | None
    gap: float
    looked: list[tuple[Candidate, ...]]
    before: list[float]


class Chooser:
    """Finds the causes. bank: what may be wrong; before, floor: the gap of the simulator as it is, and its least."""

    def __init__(
        self,
        evidence: Evidence,
        judge: Judge,
        bank: Sequence[Hypothesis],
        before: float,
        floor: float,
        say: Say = lambda _: None,
    ) -> None:
        self.evidence, self.judge, self.bank, self.say = evidence, judge, list(bank), say
        self.before, self.floor, self.base = before, floor, evidence.base
        self._few = first_look(evidence)
        self._targets = {len(b): self._sum(evidence.real_counts(b)) for b in (self._few, evidence.train)}

    def run(self) -> Choice:
        """One cause after the other, as long as the frames held out support it."""
        chain = self._grow(_Chain(None, self.before, [], []))
        if chain.model is not None and (plain := self._plain_rival(chain)) is not None:
            self.say(f"beginning again with {plain.newest.effect}")
            leaders = (plain, *(c for c in chain.looked[0] if c is not plain))
            other = self._grow(_Chain(plain.model, plain.gap, [leaders], [self.before]))
            chain = other if other.gap < chain.gap - _TIED * (self.before - self.floor) else chain
        model, gap, looked, before = chain.model, chain.gap, chain.looked, chain.before
        if model is None:
            return Choice(Model((), np.empty(0)), (), {}, tuple(looked))
        model, ties = self._compare_rivals(model, gap, looked, before)
        shares = self._shares(model)
        while len(shares) > 1 and min(shares) < _OF_ALL * (self.before - self.floor):
            least = int(np.argmin(shares))
            self.say(f"{model.parts[least].effect} closes next to nothing")
            ties.pop(model.parts[least].effect, None)
            model = self.fit(model.less(least), 3)
            shares = self._shares(model)
        self.say("settling the parameters")
        return Choice(self._settled(model), shares, ties, tuple(looked))

    def _grow(self, chain: _Chain) -> _Chain:
        """The chain with every further cause that is supported."""
        model, gap, looked, before = chain.model, chain.gap, list(chain.looked), list(chain.before)
        while (model is None or len(model.parts) < _MOST) and self._left(gap) > _DONE:
            leaders = self.step(model, looked[-1] if looked else ())
            looked.append(tuple(leaders))
            before.append(gap)
            if not leaders or not self._supported(gap, leaders, first=model is None):
                break
            model, gap = leaders[0].model, leaders[0].gap
            if len(model.parts) > 1:
                model, gap = self._prune(model, gap)
        return _Chain(model, gap, looked, before)

    def _plain_rival(self, chain: _Chain) -> Candidate | None:
        """What to begin with instead, where the first cause bends to everything and all the same leaves something.

        Light from a side brings noise and holes: by itself it closes more than either of the two causes that brought
        the one and the other, and leaves too little of each for them to be found on top of it.
        """
        first = chain.looked[0][0]
        if not _is_pliant(first.newest) or self._left(chain.gap) <= _DONE:
            return None
        enough = self.before - _PLAIN * (self.before - first.gap)
        return next((c for c in chain.looked[0] if not _is_pliant(c.newest) and c.gap <= enough), None)

    def _supported(self, before: float, leaders: Sequence[Candidate], first: bool) -> bool:
        """Whether what the first of ``leaders`` closes is enough to name it."""
        whole = self.before - self.floor
        best = leaders[0]
        share = (before - best.gap) / whole
        others = [c for c in leaders if c.newest.effect != best.newest.effect]
        if first:
            most = max((before - c.gap for c in others), default=0.0)
            return share >= _FIRST or (share >= _FIRST_APART[0] and before - best.gap >= _FIRST_APART[1] * most)
        if share >= _LARGE or (share >= _OF_ALL and share >= _OF_REST * self._left(before)):
            return True
        return share >= _APART and all(self._stays(before, best, other) for other in others)

    def _stays(self, before: float, best: Candidate, other: Candidate) -> bool:
        """Whether ``best`` closes its part of the gap also where ``other`` has closed its own."""
        gained = before - best.gap
        if before - other.gap < 0.25 * gained:
            return True
        newest = Model((other.newest,), other.model.split(other.model.x)[-1])
        both = self.judge.quick(best.model.plus(newest).build(self.base))
        return other.gap - both >= _STAYS * gained

    def _shares(self, model: Model) -> tuple[float, ...]:
        """What each cause takes off the gap: the mean over all orders in which they may be added (Shapley's value)."""
        xs, count = model.split(model.x), len(model.parts)
        gaps: dict[frozenset[int], float] = {}
        for size in range(count + 1):
            for chosen in combinations(range(count), size):
                effects: tuple[Effect, ...] = self.base
                for k in chosen:
                    effects = model.parts[k].build(effects, xs[k])
                gaps[frozenset(chosen)] = self.judge.quick(effects, 2)
        taken = np.zeros(count)
        for order in permutations(range(count)):
            for place, k in enumerate(order):
                taken[k] += gaps[frozenset(order[:place])] - gaps[frozenset(order[: place + 1])]
        return tuple((taken / factorial(count)).tolist())

    def step(self, so_far: Model | None, earlier: Sequence[Candidate] = ()) -> list[Candidate]:
        """The leaders of the bank on top of ``so_far``, fitted in full, best first by the frames held out.

        earlier: the leaders of the step before, of which the first has become part of ``so_far``.
        """
        found: list[Candidate] = []
        least = np.inf
        screened = self._screen(so_far)[:_LEADERS]
        for model in [*screened, *self._passed_over(screened, so_far, earlier)]:
            self.say(f"fitting {model.parts[-1].effect}")
            whole = self.fit(so_far.plus(model) if so_far else model, 2, polished=False)
            if so_far and (afresh := self._afresh(so_far, model, earlier)) is not None:
                whole = min(whole, afresh, key=lambda fitted: fitted.loss)
            # One that is far behind after two rounds will not win; what it closes is told as it is.
            if whole.loss < _FAR_BEHIND * least:
                whole = self.fit(whole, 4)
            least = min(least, whole.loss)
            found.append(Candidate(whole, self.judge.quick(whole.build(self.base))))
        found.sort(key=lambda candidate: candidate.gap)
        # Of those that do equally well the plainest comes first: holes everywhere before holes on every material.
        margin = _TIED * (self.before - self.floor)
        if so_far and found and _is_pliant(found[0].newest):  # it takes up some of what is still to be found, too
            margin = max(margin, _TAKEN_UP * (self.judge.quick(so_far.build(self.base)) - found[0].gap))
        close = [c for c in found if c.gap - found[0].gap < margin]
        plainest = min(close, key=lambda candidate: len(candidate.newest.free), default=None)
        return sorted(found, key=lambda candidate: candidate is not plainest)

    def _passed_over(
        self, screened: Sequence[Model], so_far: Model | None, earlier: Sequence[Candidate]
    ) -> list[Model]:
        """Effects that came close in the step before, and now do not, where the first can stand for much."""
        if so_far is None or not any(map(_is_pliant, so_far.parts)):
            return []
        there = {model.parts[-1].effect for model in screened} | {part.effect for part in so_far.parts}
        close = [c for c in earlier[:4] if c.newest.effect not in there and not c.newest.replaces]
        return [Model((c.newest,), c.model.split(c.model.x)[-1]) for c in close]

    def _afresh(self, so_far: Model, model: Model, earlier: Sequence[Candidate]) -> Model | None:
        """``model`` on top of ``so_far``, fitted from where the pliant causes have not yet taken up what is its own.

        An m for each of ten materials comes near to what many another effect does. With those fitted, the true cause
        has little left to close, and the fit does not find the way back.
        """
        if not any(map(_is_pliant, so_far.parts)):
            return None
        was = next((c for c in earlier if c.newest == model.parts[-1]), None)
        begin = Model(model.parts, was.model.split(was.model.x)[-1]) if was else model
        xs = [
            part.encode(part.starts[0]) if _is_pliant(part) else x
            for part, x in zip(so_far.parts, so_far.split(so_far.x), strict=True)
        ]
        return self.fit(Model(so_far.parts, np.concatenate(xs)).plus(begin), 3, polished=False)

    def fit(self, model: Model, rounds: int, polished: bool = True) -> Model:
        """The model at its best parameters, on the frames for fitting."""
        arguments = self.base, self._targets[len(self.evidence.train)], self._roots(self.evidence.train)
        model = refine(model, *arguments, rounds)
        if polished and len(model.x) <= 6:
            model = refine(polish(model, *arguments, (1.0, 0.4)), *arguments, 2)
        return model

    def _settled(self, model: Model) -> Model:
        """The model with parameters as fine as the frames for fitting tell them."""
        arguments = self.base, self._targets[len(self.evidence.train)], self._roots(self.evidence.train)
        return refine(model, *arguments, _SETTLING, _SETTLED, both_sides=True)

    def _screen(self, so_far: Model | None) -> list[Model]:
        """The bank on top of ``so_far``, best first, after a first look at all of it; of each effect its best form."""
        taken = {part.effect for part in so_far.parts} if so_far else set()
        taken |= {name for part in so_far.parts for name in part.replaces} if so_far else set()
        base = so_far.build(self.base) if so_far else self.base
        target, roots = self._targets[len(self._few)], self._roots(self._few)
        best: dict[tuple[str, bool], Model] = {}
        for number, hypothesis in enumerate(self.bank):
            if hypothesis.effect in taken or (hypothesis.replaces & taken):
                continue
            self.say(f"looking at {hypothesis.effect}, {number + 1} of {len(self.bank)}")
            model = refine(start(hypothesis, base, target, roots), base, target, roots, 1)
            key = hypothesis.effect, bool(hypothesis.replaces)
            if key not in best or model.loss < best[key].loss:
                best[key] = model
        return sorted(best.values(), key=lambda model: model.loss)

    def _prune(self, model: Model, gap: float) -> tuple[Model, float]:
        """Without the causes that later ones have made needless."""
        for number in range(len(model.parts) - 2, -1, -1):
            without = self.fit(model.less(number), 3)
            rest = self.judge.quick(without.build(self.base))
            if rest - gap < _OF_ALL * (self.before - self.floor):
                self.say(f"{model.parts[number].effect} is no longer needed")
                model, gap = without, rest
        return model, gap

    def _compare_rivals(
        self, model: Model, gap: float, looked: Sequence[Sequence[Candidate]], before: Sequence[float]
    ) -> tuple[Model, dict[str, tuple[str, ...]]]:
        """Each cause against those that came close to it: better ones take its place, equal ones are told as ties."""
        whole = self.before - self.floor
        ties: dict[str, tuple[str, ...]] = {}
        for named in [part.effect for part in model.parts]:
            cause = named
            number = next((k for k, s in enumerate(looked) if any(c.newest.effect == cause for c in s)), None)
            step = () if number is None else looked[number]
            mine = next((c for c in step if c.newest.effect == cause), None)
            reach = _NEAR * whole
            if mine is not None and number is not None:
                reach = min(reach, _ALIKE * (before[number] - mine.gap))
            taken = {part.effect for part in model.parts}
            equals: list[str] = []
            for rival in step:
                name = rival.newest.effect
                if mine is None or name in taken or name in equals or rival.gap - mine.gap > reach:
                    continue
                other = self._instead(model, cause, rival)
                if other.gap < gap - _TIED * whole:
                    self.say(f"{name} in place of {cause}")
                    model, gap, equals = other.model, other.gap, []
                    cause = name
                elif other.gap - gap < _TIED * whole or not self._surely_worse(other, model):
                    equals.append(name)
            if equals:
                ties[cause] = tuple(equals)
        return model, ties

    def _instead(self, model: Model, cause: str, rival: Candidate) -> Candidate:
        """``model`` with ``rival`` in the place of ``cause``."""
        if len(model.parts) == 1:
            return rival
        number = [part.effect for part in model.parts].index(cause)
        newest = Model((rival.newest,), rival.model.split(rival.model.x)[-1])
        self.say(f"trying {rival.newest.effect} in place of {cause}")
        other = self.fit(newest.plus(model.less(number)), 3)
        return Candidate(other, self.judge.quick(other.build(self.base)))

    def _surely_worse(self, other: Candidate, model: Model) -> bool:
        theirs, mine = (self.judge.simulate(m.build(self.base), 0) for m in (other.model, model))
        real = self.judge.real

        def difference(blocks: NDArray[np.int64]) -> float:
            a, b, c = (x[blocks].sum(axis=0) for x in (real, theirs, mine))
            return self.judge.ruler.gap(a, b) - self.judge.ruler.gap(a, c)

        return jackknife(difference, np.arange(len(real)))[1][0] > 0

    def _left(self, gap: float) -> float:
        """The share of the gap that is left."""
        return (gap - self.floor) / (self.before - self.floor)

    def _sum(self, counts: Counts) -> Floats:
        return self.judge.ruler.roots(counts.sum(axis=0))

    def _roots(self, blocks: Sequence[int]) -> Roots:
        def roots(effects: tuple[Effect, ...]) -> Floats:
            return self.judge.ruler.roots(self.evidence.total(effects, blocks))

        return roots


def first_look(evidence: Evidence) -> list[int]:
    """The blocks that the whole bank is tried on: two fifths of those for fitting, fewer where frames are large."""
    train = evidence.train
    usual = len(train[:: max(1, round(len(train) / 2.5))])
    frames = max(len(evidence.blocks[b]) for b in train)
    enough = -(-_LOOKED_AT // (frames * evidence.counted_of_frame))
    chosen = np.linspace(0, len(train) - 1, min(usual, max(enough, 2))).round().astype(int)
    return [train[k] for k in np.unique(chosen)]


def _is_pliant(hypothesis: Hypothesis) -> bool:
    """Whether it has so many parameters that it can stand for other effects."""
    return len(hypothesis.free) >= _PLIANT
