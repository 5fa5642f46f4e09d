"""Models at their best parameters on the frames for fitting, and their gaps on the frames held out."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.evidence import Counts, Evidence
from depthsim.gap.depth.data.simulate import LOCATING
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.optimize import Floats, Model, Roots, best_neighbour, loss, polish, refine, starts
from depthsim.gap.depth.fit.validate import Score, Validator
from depthsim.sensor.effect import Effect

Say = Callable[[str], None]
T = TypeVar("T")


@dataclass(frozen=True)
class Trial:
    """A model and its gap on the frames held out."""

    model: Model
    gap: float

    @property
    def newest(self) -> Candidate:
        """What was added last."""
        return self.model.parts[-1]


class Fitting:
    """Fits models. bank: what may be wrong; before: the simulator that causes are added to, with what is known.

    replacing: what may take the place of a cause that is refused, the bank unless it is given; config: the evidence's,
    unless it is.
    """

    def __init__(
        self,
        evidence: Evidence,
        validator: Validator,
        bank: Sequence[Candidate],
        before: Sequence[Effect],
        say: Say,
        *,
        replacing: Sequence[Candidate] | None = None,
        config: DepthConfig | None = None,
    ) -> None:
        self.evidence, self.validator, self.bank, self.say = evidence, validator, list(bank), say
        self.replacing, self.config = self.bank if replacing is None else list(replacing), config or evidence.config
        score = validator.score(before)
        self.before, self.floor, self.base = score.gap, score.floor, evidence.base
        # A few runs are above or below the mean of all by chance, with common random numbers alike whatever the cause.
        self._chance = validator.quick(before, self.config.fit.runs) - self.before
        self._fitted_on = Validator(evidence, evidence.train)
        self._few = first_look(evidence, validator.ruler, before)
        self._fitted: dict[frozenset[str], tuple[Model, int, bool]] = {}
        self._known: dict[tuple[object, ...], Any] = {}
        self._targets = {len(b): self._sum(evidence.real_counts(b)) for b in (self._few[:1], self._few, evidence.train)}

    @property
    def whole(self) -> float:
        """What a model that explains everything takes off the gap."""
        return self.before - self.floor

    def validated(self, model: Model) -> Trial:
        """The model with its gap on the frames held out."""
        return Trial(model, self.validator.quick(model.build(self.base), self.config.fit.runs) - self._chance)

    def leaves(self, model: Model | None, held_out: Score) -> bool:
        """Whether there is something left to be fitted. held_out: the score of ``model`` there, or of nothing.

        It stands out on the frames held out, and by part of the limits on those that ``model`` was fitted on, too. What
        does not is how far its parameters are off: as much as those frames are unlike these by chance.
        """
        limit = self.config.significance
        if model is None or not held_out.stands_out(limit):
            return held_out.stands_out(limit)
        return self._fitted_on.score(model.build(self.base)).stands_out(limit, limit.where_fitted)

    @property
    def is_spent(self) -> bool:
        """Whether so much was simulated that no further cause is looked for."""
        return self.evidence.work > self.config.fit.most_work

    def is_flexible(self, candidate: Candidate) -> bool:
        """Whether it has so many parameters that it can stand for other effects."""
        return len(candidate.free) >= self.config.select.flexible

    def fit(self, model: Model, rounds: int, polished_below: float = np.inf, elsewhere: bool = False) -> Model:
        """The model at its best parameters, on the frames for fitting; what was fitted before is not fitted again.

        polished_below: a loss, above which no other minima are looked for. elsewhere: whether ``model`` begins at
        another place than before, where another minimum may be.
        """
        known, done, polished = self._fitted.get(_key(model), (model, 0, False))
        if elsewhere and done:
            other, was_polished = self._fit(model, rounds, polished_below)
            if other.loss < known.loss:
                self._fitted[_key(model)] = other, rounds, was_polished
                return other
        if done >= rounds and (polished or known.loss >= polished_below):
            return known.in_order_of(model)
        fitted, polished = self._fit(model, rounds, polished_below)
        self._fitted[_key(model)] = fitted, rounds, polished
        return fitted

    def fitted(self, model: Model) -> Model | None:
        """A model of the same parts that was fitted before."""
        known = self._fitted.get(_key(model))
        return known[0] if known else None

    def fit_roughly(self, model: Model, rounds: int) -> Model:
        """The model after some rounds on a few of the frames for fitting; its loss is of those."""

        def fit() -> Model:
            return replace(refine(model, *self._on(self._few), self.config.fit, rounds), jacobian=None)

        return self.once((rounds, *map(repr, model.parts), model.x.tobytes()), fit)

    def once(self, key: tuple[object, ...], work: Callable[[], T]) -> T:
        """What ``work`` finds, found once: the bank is tried again on top of what was dropped in between."""
        if key not in self._known:
            self._known[key] = work()
        known: T = self._known[key]
        return known

    def begin_near(self, less: Model, candidate: Candidate, model: Model) -> Model | None:
        """A candidate on top of ``less``, fitted on a few frames; None if that is far behind ``model`` there.

        Then no fit on all of them makes it an equal.
        """
        begun = self.fit_roughly(less.plus(self.begin(candidate, less.build(self.base), roughly=True)), 3)
        return begun if begun.loss < self.config.fit.behind * self.loss_on_few(model.build(self.base)) else None

    def begin_on_few(self, candidate: Candidate, beside: Model | None = None) -> tuple[Model, float]:
        """A candidate after some rounds on a few of the frames for fitting, and the share of the loss beyond chance
        that it takes off there. beside: what is there already; it is fitted, too."""
        begun = self.begin(candidate, self.base, roughly=True)
        model = self.fit_roughly(begun if beside is None else begun.plus(beside), 3)
        _, target, roots = self._on(self._few)
        here, again = roots(tuple(self.base)), self.evidence.total(self.base, self._few, LOCATING[0])
        without, chance = loss(target, here), loss(here, self.validator.ruler.roots(again))
        return model, (without - model.loss) / max(without - chance, 1e-12)

    def loss_on_few(self, effects: Sequence[Effect]) -> float:
        """The loss of a sensor on a few of the frames for fitting."""
        _, target, roots = self._on(self._few)
        return loss(target, roots(tuple(effects)))

    def _fit(self, model: Model, rounds: int, polished_below: float) -> tuple[Model, bool]:
        arguments = self._on(self.evidence.train)
        model = refine(model, *arguments, self.config.fit, rounds)
        polished = model.loss < polished_below
        if polished and len(model.x) <= 6:
            model = refine(polish(model, *arguments, self.config.fit, (1.0, 0.4)), *arguments, self.config.fit, 2)
        return model, polished

    def refined(self, model: Model) -> Model:
        """The model with parameters as fine as the frames for fitting determine them."""
        arguments = self._on(self.evidence.train)
        fit = self.config.fit
        fine = fit.model_copy(update={"least_gain": fit.refined_gain})
        return refine(best_neighbour(model, *arguments), *arguments, fine, fit.refined_rounds, both_sides=True)

    def begin(self, candidate: Candidate, base: Sequence[Effect], *, roughly: bool = False) -> Model:
        """The best of the places where a candidate begins, on the frames for fitting. roughly: on a few of them."""
        _, target, roots = self._on(self._few if roughly else self.evidence.train)
        return starts(candidate, base, roots(tuple(base)), target, roots)[0][0]

    def _on(self, blocks: Sequence[int]) -> tuple[Sequence[Effect], Floats, Roots]:
        """What fits are given: the simulator, and what the recording and any sensor show on some blocks."""
        return self.base, self._targets[len(blocks)], self._roots(blocks)

    def _sum(self, counts: Counts) -> Floats:
        return self.validator.ruler.roots(counts.sum(axis=0))

    def _roots(self, blocks: Sequence[int]) -> Roots:
        def roots(effects: tuple[Effect, ...]) -> Floats:
            return self.validator.ruler.roots(self.evidence.total(effects, blocks))

        return roots


def _key(model: Model) -> frozenset[str]:
    return frozenset(map(repr, model.parts))


def first_look(evidence: Evidence, ruler: Ruler, before: Sequence[Effect]) -> list[int]:
    """The blocks that the whole bank is tried on: two fifths of those for fitting, fewer where frames are large.

    Spread over the time, but for one: that in which the gap of ``before`` is largest, as what is nearer than depth
    begins may be in few of them.
    """
    train = evidence.train
    usual = len(train[:: max(1, round(len(train) / 2.5))])
    frames = max(len(evidence.blocks[b]) for b in train)
    enough = -(-evidence.config.fit.first_look_pixels // (frames * evidence.counted_of_frame))
    count = min(usual, max(enough, 2))
    pairs = zip(evidence.real_counts(train), evidence.simulate(before, train), strict=True)
    largest = int(np.argmax([ruler.gap(real, simulated) for real, simulated in pairs]))
    others = [k for k in range(len(train)) if k != largest]
    spread = np.linspace(0, max(len(others) - 1, 0), min(count - 1, len(others))).round().astype(int)
    return [train[k] for k in sorted({largest, *(others[n] for n in spread)})]
