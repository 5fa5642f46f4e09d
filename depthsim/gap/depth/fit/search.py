"""The bank of effects tried on top of the causes found so far: all in a first look, the leaders in full."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.evidence import Counts, Evidence
from depthsim.gap.depth.fit.agreement import disagreement
from depthsim.gap.depth.fit.candidates import Candidate
from depthsim.gap.depth.fit.optimize import Floats, Model, Roots, polish, refine, start
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import Effect, effect_class

Say = Callable[[str], None]


@dataclass(frozen=True)
class Trial:
    """A model and its gap on the frames held out."""

    model: Model
    gap: float

    @property
    def newest(self) -> Candidate:
        """What was added last."""
        return self.model.parts[-1]


class Search:
    """Fits models. bank: what may be wrong; before, floor: the gap of the simulator as it is, and its least."""

    def __init__(
        self, evidence: Evidence, validator: Validator, bank: Sequence[Candidate], before: float, floor: float, say: Say
    ) -> None:
        self.evidence, self.validator, self.bank, self.say = evidence, validator, list(bank), say
        self.before, self.floor, self.base, self.config = before, floor, evidence.base, evidence.config
        # A few runs are above or below the mean of all by chance, with common random numbers alike whatever the cause.
        self._chance = validator.quick(evidence.base, self.config.fit.runs) - before
        self._few = first_look(evidence)
        self._responses: dict[int, NDArray[np.float32]] = {}
        self._targets = {len(b): self._sum(evidence.real_counts(b)) for b in (self._few, evidence.train)}

    @property
    def whole(self) -> float:
        """What a model that explains everything takes off the gap."""
        return self.before - self.floor

    def validated(self, model: Model) -> Trial:
        """The model with its gap on the frames held out."""
        return Trial(model, self.validator.quick(model.build(self.base), self.config.fit.runs) - self._chance)

    def disagreement(self, model: Model, number: int, *, alone: bool = False) -> str | None:
        """Why one part of a model does not act where the gap lies that the others leave; None if it does.

        alone: whether the model is whole, see :func:`agreement.disagreement`.
        """
        part, before, after = model.parts[number], model.less(number).build(self.base), model.build(self.base)
        kind, flexible = effect_class(part.effect), self.is_flexible(part)
        return disagreement(self.validator, kind, before, after, alone=alone, flexible=flexible)

    def step(self, so_far: Model | None, earlier: Sequence[Trial] = ()) -> list[Trial]:
        """The leaders of the bank on top of ``so_far``, fitted in full, best first by the frames held out.

        earlier: the leaders of the step before, of which the first has become part of ``so_far``.
        """
        found: list[Trial] = []
        least = np.inf
        screened = self._screen(so_far)[: self.config.fit.leaders]
        for model in [*screened, *self._passed_over(screened, so_far, earlier)]:
            self.say(f"fitting {model.parts[-1].effect}")
            whole = self.fit(so_far.plus(model) if so_far else model, 2, polished=False)
            if so_far and (afresh := self._afresh(so_far, model, earlier)) is not None:
                whole = min(whole, afresh, key=lambda fitted: fitted.loss)
            # One that is far behind after two rounds will not win; what it closes is reported as it is.
            if whole.loss < self.config.fit.far_behind * least:
                whole = self.fit(whole, 4)
            least = min(least, whole.loss)
            found.append(self.validated(whole))
        found.sort(key=lambda trial: trial.gap)
        # Of those that do equally well the plainest comes first: holes everywhere before holes on every material.
        margin = self.config.select.tied * self.whole
        if so_far and found and self.is_flexible(found[0].newest):  # it takes up some of what is still to be found, too
            margin = max(margin, self.config.select.taken_up * (self.validated(so_far).gap - found[0].gap))
        close = [c for c in found if c.gap - found[0].gap < margin]
        plainest = min(close, key=lambda trial: len(trial.newest.free), default=None)
        return sorted(found, key=lambda trial: trial is not plainest)

    def _passed_over(self, screened: Sequence[Model], so_far: Model | None, earlier: Sequence[Trial]) -> list[Model]:
        """Effects that came close in the step before, and now do not, where the first can stand for much."""
        if so_far is None or not any(map(self.is_flexible, so_far.parts)):
            return []
        there = {model.parts[-1].effect for model in screened} | {part.effect for part in so_far.parts}
        close = [c for c in earlier[:4] if c.newest.effect not in there and not c.newest.replaces]
        return [Model((c.newest,), c.model.split(c.model.x)[-1]) for c in close]

    def _afresh(self, so_far: Model, model: Model, earlier: Sequence[Trial]) -> Model | None:
        """``model`` on top of ``so_far``, fitted from where the flexible causes have not yet taken up what is its own.

        An m for each of ten materials comes near to what many another effect does. With those fitted, the true cause
        has little left to close, and the fit does not find the way back.
        """
        if not any(map(self.is_flexible, so_far.parts)):
            return None
        was = next((c for c in earlier if c.newest == model.parts[-1]), None)
        begin = Model(model.parts, was.model.split(was.model.x)[-1]) if was else model
        xs = [
            part.encode(part.starts[0]) if self.is_flexible(part) else x
            for part, x in zip(so_far.parts, so_far.split(so_far.x), strict=True)
        ]
        return self.fit(Model(so_far.parts, np.concatenate(xs)).plus(begin), 3, polished=False)

    def is_flexible(self, candidate: Candidate) -> bool:
        """Whether it has so many parameters that it can stand for other effects."""
        return len(candidate.free) >= self.config.select.flexible

    def fit(self, model: Model, rounds: int, polished: bool = True) -> Model:
        """The model at its best parameters, on the frames for fitting."""
        arguments = self.base, self._targets[len(self.evidence.train)], self._roots(self.evidence.train)
        model = refine(model, *arguments, self.config.fit, rounds)
        if polished and len(model.x) <= 6:
            model = refine(polish(model, *arguments, (1.0, 0.4)), *arguments, self.config.fit, 2)
        return model

    def refined(self, model: Model) -> Model:
        """The model with parameters as fine as the frames for fitting determine them."""
        arguments = self.base, self._targets[len(self.evidence.train)], self._roots(self.evidence.train)
        fit = self.config.fit
        fine = fit.model_copy(update={"least_gain": fit.refined_gain})
        return refine(model, *arguments, fine, fit.refined_rounds, both_sides=True)

    def _screen(self, so_far: Model | None) -> list[Model]:
        """The bank on top of ``so_far``, best first, after a first look; of each effect its best form."""
        taken = {part.effect for part in so_far.parts} if so_far else set()
        taken |= {name for part in so_far.parts for name in part.replaces} if so_far else set()
        base = so_far.build(self.base) if so_far else self.base
        target, roots = self._targets[len(self._few)], self._roots(self._few)
        open_to = [k for k, c in enumerate(self.bank) if c.effect not in taken and not (c.replaces & taken)]
        here = roots(base)
        if self._responses:
            open_to = self._likely(open_to, target - here)
        best: dict[tuple[str, bool], Model] = {}
        for number in open_to:
            candidate = self.bank[number]
            self.say(f"looking at {candidate.effect}, {number + 1} of {len(self.bank)}")
            model = refine(start(candidate, base, target, roots), base, target, roots, self.config.fit, 1)
            if so_far is None:
                self._responses[number] = (roots(model.build(base)) - here).astype(np.float32)
            key = candidate.effect, bool(candidate.replaces)
            if key not in best or model.loss < best[key].loss:
                best[key] = model
        return sorted(best.values(), key=lambda model: model.loss)

    def _likely(self, numbers: Sequence[int], left: Floats) -> list[int]:
        """Of the bank by number, what may close most of what is ``left`` of the fingerprint, by what it did at first.

        What did nothing at first, as correlation where there is no noise, may do something now.
        """
        sizes = {k: float(np.square(self._responses[k]).sum()) for k in numbers}
        least = 1e-3 * max(sizes.values(), default=0.0)
        gains = {k: float(self._responses[k] @ left) ** 2 / sizes[k] for k in numbers if sizes[k] > least}
        likely = sorted(gains, key=lambda k: -gains[k])[: self.config.fit.looked_at_again]
        return sorted({*likely, *(k for k in numbers if sizes[k] <= least)})

    def _sum(self, counts: Counts) -> Floats:
        return self.validator.ruler.roots(counts.sum(axis=0))

    def _roots(self, blocks: Sequence[int]) -> Roots:
        def roots(effects: tuple[Effect, ...]) -> Floats:
            return self.validator.ruler.roots(self.evidence.total(effects, blocks))

        return roots


def first_look(evidence: Evidence) -> list[int]:
    """The blocks that the whole bank is tried on: two fifths of those for fitting, fewer where frames are large."""
    train = evidence.train
    usual = len(train[:: max(1, round(len(train) / 2.5))])
    frames = max(len(evidence.blocks[b]) for b in train)
    enough = -(-evidence.config.fit.first_look_pixels // (frames * evidence.counted_of_frame))
    selected = np.linspace(0, len(train) - 1, min(usual, max(enough, 2))).round().astype(int)
    return [train[k] for k in np.unique(selected)]
