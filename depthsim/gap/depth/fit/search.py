"""The bank of effects tried on top of the causes found so far: all in a first look, the leaders in full."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from depthsim.gap.depth.fit.agreement import (
    disagreement,
    goes_together,
    is_its_own,
    is_theirs,
    left_along,
    left_in_all,
    left_of_change,
)
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.changes import first_axes, has_effect, holes_lie_apart, plain_axes
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.itself import is_idle, shows_itself
from depthsim.gap.depth.fit.marks import (
    breaks_at_seams,
    brings_together,
    comes_in_waves,
    makes_doubling,
    makes_steps,
    stays_at_pixels,
)
from depthsim.gap.depth.fit.optimize import Model, refine, starts
from depthsim.gap.depth.fit.screening import Screening
from depthsim.gap.depth.fit.traits import acts_along, has_more_pixels, is_filling, is_filter, is_known_by
from depthsim.gap.selection import not_outdone, plainest
from depthsim.sensor.effect import Effect, effect_class

GONE = 11.5
"""A hundredth of what it was, as fits vary logarithms."""


class Search(Screening):
    """Fits what leads, and asks it where it acts."""

    def disagreement(self, model: Model, number: int, *, alone: bool = False) -> str | None:
        """Why one part of a model does not act where the gap lies that the others leave; None if it does.

        alone: whether the model is whole, see :func:`agreement.disagreement`.
        """
        flexible = self.is_flexible(model.parts[number])
        return disagreement(self.validator, *self._part(model, number), alone=alone, flexible=flexible)

    def acts(self, model: Model) -> bool:
        """Whether the newest part of a model acts where the gap lies that the others leave."""
        return self.disagreement(model, len(model.parts) - 1) is None

    def is_known(self, model: Model) -> bool:
        """Whether the newest part of a model is known by the axis along which its kind of what others leave changes
        first, however little there is of it."""
        effect, before, _ = self._newest(model)
        return is_known_by(effect.id, first_axes(self.validator, before, however_little=True))

    def goes_together(self, model: Model) -> bool:
        """Whether errors that the newest part of a model makes one by one go together in the recording."""
        return goes_together(self.validator, *self._newest(model))

    def is_theirs(self, model: Model) -> bool:
        """Whether the newest part of a model is for what another cause's formula leaves, see
        :func:`agreement.is_theirs`."""
        return is_theirs(self.validator, *self._newest(model))

    def is_its_own(self, model: Model) -> bool:
        """Whether the newest part of a model is for no other cause's formula, see :func:`agreement.is_its_own`."""
        return is_its_own(self.validator, *self._newest(model))

    def left_along(self, model: Model) -> float | None:
        """What the newest part of a model leaves, see :func:`agreement.left_along`."""
        return left_along(self.validator, *self._newest(model))

    def left_in_all(self, model: Model) -> float:
        """What the newest part of a model leaves of its kind of errors, see :func:`agreement.left_in_all`."""
        return left_in_all(self.validator, *self._newest(model))

    def lies_apart(self, model: Model) -> bool:
        """Whether the newest part of a model makes holes along the axis that it is known by, and where none of the
        others do that are known by it, too."""
        effect, before, after = self._newest(model)
        less = model.less(len(model.parts) - 1)
        alike = [
            k for k, one in enumerate(less.effects) if one.kinds[0] == "missing" and one.axes[:1] == effect.axes[:1]
        ]
        return effect.kinds[0] == "missing" and all(
            holes_lie_apart(self.validator, effect.axes[0], less.less(k).build(self.base), before, after) for k in alike
        )

    def left_of_biases(self, model: Model, axis: str) -> float:
        """Share that a model leaves of how biases change along an axis."""
        return left_of_change(self.validator, axis, "bias", self.base, model.build(self.base))

    def makes_steps(self, model: Model) -> bool:
        """Whether the newest part of a model puts the disparities on the recording's steps."""
        return makes_steps(self.validator, *self._newest(model))

    def stands_for_another(self, model: Model) -> bool:
        """Whether the newest part of a model, as it is fitted, is not itself, or makes neighbours go together that do
        not in the recording: its place is another one's, and no cause beside it makes it right."""
        newest = (self.validator, *self._newest(model))
        return (is_idle(*newest) or brings_together(*newest)) is not None

    def is_early(self, model: Model, beside: Model | None = None) -> bool:
        """Whether the newest part of a model makes errors go together, where the recording's come in waves or in blocks
        or stay at their pixels and those of the model, or of the one ``beside`` it, do not yet: what makes them so is
        looked for before it."""
        effect, _, after = self._newest(model)
        if beside is not None:
            after = beside.build(self.base)
        if effect.kinds[0] != "correlation":
            return False
        return any(
            mark(self.validator, effect, after) is not None
            for mark in (comes_in_waves, breaks_at_seams, stays_at_pixels)
        )

    def shows_itself(self, model: Model, number: int) -> bool:
        """Whether one part of a model, as it is fitted, makes what it is known by."""
        return shows_itself(self.validator, *self._part(model, number))

    def makes_doubling(self, model: Model, number: int) -> bool:
        """Whether one part of a model makes the recording's doubled rows, which the others do not."""
        return makes_doubling(self.validator, *self._part(model, number))

    def _newest(self, model: Model) -> tuple[type[Effect], Sequence[Effect], Sequence[Effect]]:
        return self._part(model, len(model.parts) - 1)

    def _part(self, model: Model, number: int) -> tuple[type[Effect], Sequence[Effect], Sequence[Effect]]:
        """An effect of a model, and the sensor without it and with it.

        Without a noise there is as much of a law that is only supposed as at first: next to nothing is a noise seen.
        """
        effect, less = effect_class(model.parts[number].effect), model.less(number)
        named = [part.effect for part in less.parts]
        if effect.kinds[0] == "spread" and self.evidence.supposed in named:
            less = less.less(named.index(self.evidence.supposed))
        return effect, less.build(self.base), model.build(self.base)

    def step(
        self,
        so_far: Model | None,
        earlier: Sequence[Trial] = (),
        is_out: Callable[[str], bool] = lambda _: False,
        trusted: Sequence[str] = (),
    ) -> list[Trial]:
        """The leaders of the bank on top of ``so_far``, fitted in full, best first by the frames held out.

        earlier: the leaders of the step before, of which the first has become part of ``so_far``. is_out: whether an
        effect is not to be looked at. trusted: effects of ``so_far`` that leave too much where they act, and may stand
        for two.
        """
        before = so_far.build(self.base) if so_far else self.base
        screened = self._leading(self.screen(so_far, is_out), before)
        leaders = [*screened, *self._passed_over(screened, so_far, earlier, trusted)]
        without = self.loss_on_few(before)
        most = without - min((model.loss for model in screened), default=without)

        def whole_of(model: Model) -> Model:
            if not (self._is_worth_it(model, without, most) or self._is_taken_up(so_far, model)):
                return replace(so_far.plus(model), loss=model.loss) if so_far else model
            model = self._from_elsewhere(model, before)
            whole = self.fit_roughly(so_far.plus(model) if so_far else model, 2)
            for begun in self._otherwise(so_far, model, earlier, trusted) if so_far else ():
                whole = self._best_begun(whole, begun)
            return whole

        begun = list(self.told(whole_of, leaders, [f"fitting {model.parts[-1].effect}" for model in leaders]))
        gap = self.validated(so_far).gap if so_far else self.before
        found = self._in_best_forms(so_far, gap, self._fitted_further(begun, without))
        found.sort(key=lambda trial: trial.gap)
        # Of those that do equally well one that is known by where the gap changes first comes first, and then the
        # plainest: holes everywhere before holes on every material, and what there is otherwise before what is new.
        margin, limit = self.config.select.tied * self.whole, self.config.select
        if so_far and found:
            much = limit.taken_up * (gap - found[0].gap)
            # Behind a large cause the whole gap is no measure, but chance is. What has many parameters takes up some
            # of what is still to be found, too.
            least = self.config.significance.faint * self.floor
            margin = max(much if self.is_flexible(found[0].newest) else min(margin, much), least)
        mainly, also = (first_axes(self.validator, before, however_little=little) for little in (False, True))

        free = partial(self.parameters_of, others=found)

        def plain(trial: Trial) -> tuple[bool, bool, int, bool]:
            effect = trial.newest.effect
            known, known_too = is_known_by(effect, mainly), is_known_by(effect, also)
            return not known, not known_too, free(trial), not has_effect(self.base, effect)

        def alike(trial: Trial) -> str:
            return effect_class(trial.newest.effect).kinds[0]

        # However it is known, one with more parameters than another of its kind that closes as much is not first.
        rest = not_outdone(found, lambda trial: trial.gap, free, alike)
        first = plainest(rest, lambda trial: trial.gap, plain, margin)
        return sorted(found, key=lambda trial: trial is not first)

    def _best_begun(self, best: Model, begun: Iterable[Model]) -> Model:
        """A model that is fitted on a few frames, or the same from where else it may begin, if that comes nearer.

        No other is tried after one that leads to what is known already.
        """
        for begin in begun:
            other = self.fit_roughly(begin, 3)
            if abs(other.loss - best.loss) < self.config.fit.same_minimum * best.loss:
                break
            best = min(best, other, key=lambda model: model.loss)
        return best

    def _is_worth_it(self, model: Model, without: float, most: float) -> bool:
        """Whether a model is to be fitted in full whose newest part takes long: it takes off the loss, on a few frames,
        some of what the best one does (``most``), or it is not known."""
        taken = without - model.loss
        takes_long = self.takes_long(model.parts[-1].effect)
        return not takes_long or not np.isfinite(taken) or taken >= self.config.fit.promising * most

    def _is_taken_up(self, so_far: Model | None, model: Model) -> bool:
        """Whether what many parameters have taken up may be the newest part's of a model, as it is of its kind."""
        kind = effect_class(model.parts[-1].effect).kinds[0]
        parts = so_far.parts if so_far else ()
        return any(self.is_flexible(part) and effect_class(part.effect).kinds[0] == kind for part in parts)

    def _fitted_further(self, begun: Sequence[Model], without: float) -> list[Trial]:
        """Leaders that are fitted on a few frames, fitted in full if they may win; what the others close is reported as
        it is.

        without: the loss of what is there already.
        """
        config, least = self.config.fit, min((model.loss for model in begun), default=np.inf)
        enough = min(without, config.far_behind * least)

        def in_full(model: Model) -> Model | None:
            if model.loss > enough or not self._is_worth_it(model, without, without - least):
                return None
            known = self.fitted(model)
            is_elsewhere = known is not None and self.loss_on_few(known.build(self.base)) > model.loss
            return self.fit(model, 4, polished_below=0, elsewhere=is_elsewhere)

        fitted = list(self.evidence.side_by_side(in_full, begun))
        least = min((model.loss for model in fitted if model), default=np.inf)

        def validated(number: int) -> Trial:
            model = fitted[number]
            return self.validated(self.fit(model, 4, config.behind * least) if model else begun[number])

        return list(self.evidence.side_by_side(validated, range(len(begun))))

    def parameters_of(self, trial: Trial, others: Iterable[Trial]) -> int:
        """How many parameters the newest part of a trial has, and with holes that are all gone one more than what fills
        them has, where that is among the others: hardly a sensor loses nothing."""
        fills = [len(other.newest.free) + 1 for other in others if is_filling(other.newest.effect)]
        return max([len(trial.newest.free), *(fills if self.is_less(trial, GONE) else ())])

    def is_less(self, trial: Trial, by: float = 0.0) -> bool:
        """Whether an effect that the simulator has is fitted to be less, by more than so many changes that matter."""
        newest, x = trial.newest, trial.model.newest.x
        return (
            has_effect(self.base, newest.effect)
            and len(x) == 1
            and newest.free[0].log
            and newest.encode(newest.starts[0])[0] - x[0] > by
        )

    def closes_by_one_material(self, trial: Trial, before: float) -> bool:
        """Whether the newest part of a trial closes nearly as much if it is for one material alone.

        before: the gap without it.
        """
        *others, newest = trial.model.parts
        *xs, own = trial.model.split(trial.model.x)
        enough = before - self.config.select.of_one * (before - trial.gap)
        for k, free in enumerate(newest.free):
            if free.by_material:
                kept = [n for n, one in enumerate(newest.free) if n == k or not one.by_material]
                model = Model((*others, newest.only(kept)), np.concatenate([*xs, own[kept]]))
                if self.validated(model).gap <= enough:
                    return True
        return False

    def in_other_form(self, so_far: Model | None, trial: Trial) -> Trial | None:
        """An effect in the form that closes more than that of ``trial``, if one does; None for one with few parameters
        that is not known by an axis along which the gap changes first.

        The first look at the bank is on few frames, and takes one form only.
        """
        newest, base = trial.newest, so_far.build(self.base) if so_far else self.base
        first = {name for _, along in first_axes(self.validator, base) for name in along}
        if not self.is_flexible(newest) and not first & set(effect_class(newest.effect).axes[:1]):
            return None
        return self._best_other_form(so_far, trial)

    def _in_best_forms(self, so_far: Model | None, gap: float, found: Sequence[Trial]) -> list[Trial]:
        """What is found, each filter that comes near the best in the form that closes most: each form has minima of its
        own, and by a few frames another came first. gap: of ``so_far``."""
        best = min((trial.gap for trial in found), default=np.inf)
        near = best + self.config.select.near_of_cause * (gap - best)

        def in_best(trial: Trial) -> Trial:
            is_asked = is_filter(trial.newest.effect) and trial.gap < near
            return (self._best_other_form(so_far, trial, nearer=True) if is_asked else None) or trial

        return list(map(in_best, found))

    def _best_other_form(self, so_far: Model | None, trial: Trial, *, nearer: bool = False) -> Trial | None:
        """See :meth:`in_other_form`. nearer: whether to fit in full only what is nearer on a few frames already."""
        base = so_far.build(self.base) if so_far else self.base
        forms = self.other_forms(trial.newest, in_place=True)
        begun = (self.begin(candidate, base, roughly=True) for candidate in forms)
        tried = (self.fit_roughly(so_far.plus(one) if so_far else one, 2) for one in begun)
        best = min(tried, key=lambda model: model.loss, default=None)
        if nearer and best and best.loss >= self.loss_on_few(trial.model.build(self.base)):
            return None
        other = self.validated(self.fit(best, 4)) if best else trial
        return other if other.gap < trial.gap else None

    def other_forms(self, of: Candidate, *, in_place: bool = False) -> list[Candidate]:
        """The other forms of an effect. in_place: also those that are tried only in place of another form."""
        alike = [one for one in self.bank if (one.effect, one.replaces) == (of.effect, of.replaces) and one != of]
        return [one for one in alike if in_place or not one.in_place]

    def _leading(self, screened: Sequence[Model], base: Sequence[Effect]) -> list[Model]:
        """The leaders, of which not all make one kind of error, and whatever may make the recording's steps. Two forms
        of one effect are one leader.

        And of each kind of the gap the first that acts along the axis on which that changes most, and the first that is
        known by that axis; by each of two that are crossed. And of what is known along nearly that axis, see
        :func:`changes.plain_axes`, the first where none leads.
        """
        found: list[Model] = []
        steps = self.evidence.cuts.own_steps is not None
        for model in screened:
            kind = effect_class(model.parts[-1].effect)
            others = {m.parts[-1].effect for m in found} - {kind.id}
            alike = [name for name in others if effect_class(name).kinds[0] == kind.kinds[0]]
            leads = len(others) < self.config.fit.leaders and len(alike) < self.config.fit.leaders_of_kind
            if leads or (steps and kind.axes[:1] == ("disparity_phase",)):
                found.append(model)
        for kind_of_gap, along in first_axes(self.validator, base):
            acting = [m for m in screened if acts_along(m.parts[-1].effect, kind_of_gap, along)]
            for name in (None, *sorted(along)):
                first = next((m for m in acting if name in (None, effect_class(m.parts[-1].effect).axes[0])), None)
                if first is not None and all(first is not model for model in found):
                    found.append(first)
        for one in plain_axes(self.validator, base):
            known = [model for model in screened if is_known_by(model.parts[-1].effect, [one])]
            there = {model.parts[-1].effect for model in found}
            if known and not there & {model.parts[-1].effect for model in known}:
                found.append(known[0])
        return found

    def _passed_over(
        self, screened: Sequence[Model], so_far: Model | None, earlier: Sequence[Trial], trusted: Sequence[str]
    ) -> list[Model]:
        """Effects that came close in the step before, and now do not, where the first can stand for much."""
        if so_far is None or not (trusted or any(map(self.is_flexible, so_far.parts))):
            return []
        there = {model.parts[-1].effect for model in screened} | {part.effect for part in so_far.parts}
        close = [c for c in earlier[:4] if c.newest.effect not in there]
        close = [c for c in close if not c.newest.replaces or (trusted and c.newest.replaces == {c.newest.effect})]
        # Beside what takes many times the pixels the whole bank does, for what did not come near again.
        close = [c for c in close if not has_more_pixels(c.newest.effect, self.evidence.camera)]
        return [c.model.newest for c in close]

    def _otherwise(
        self, so_far: Model, model: Model, earlier: Sequence[Trial], trusted: Sequence[str]
    ) -> Iterator[Iterable[Model]]:
        """Where else to begin with ``model`` on top of ``so_far``; of those that go together the others are not tried
        where one comes to what is known already."""
        yield self._afresh(so_far, model, earlier, trusted)
        newest = model.parts[-1]
        for number, part in enumerate(so_far.parts):
            # What the errors of a pattern or of steps hide of the noise, a correlation of it cannot be fitted to.
            if part.effect in effect_class(newest.effect).seen_on and part.free[0].log:
                xs = so_far.split(so_far.x)
                xs[number] = xs[number] + self.config.fit.louder * np.eye(1, len(part.free))[0]
                louder = Model(so_far.parts, np.concatenate(xs))
                yield (louder.plus(self.begin(newest, louder.build(self.base))),)
            # How far holes are filled is seen where there are large ones, and these may be another cause's.
            if is_filling(part.effect) and effect_class(newest.effect).kinds[0] == "missing":
                yield (self.begin_together(so_far, number, newest),)

    def begin_together(self, so_far: Model, number: int, newest: Candidate) -> Model:
        """``newest`` on top of ``so_far``, of which a part begins where both together are nearest to the recording."""
        _, target, roots = self._on(self._few)
        begun: list[Model] = []
        for values in so_far.parts[number].starts:
            xs = so_far.split(so_far.x)
            xs[number] = so_far.parts[number].encode(values)
            part = Model(so_far.parts, np.concatenate(xs))
            before = part.build(self.base)
            begun.append(part.plus(starts(newest, before, roots(before), target, roots)[0][0]))
        return min(begun, key=lambda model: self.loss_on_few(model.build(self.base)))

    def _afresh(self, so_far: Model, model: Model, earlier: Sequence[Trial], trusted: Sequence[str]) -> Iterator[Model]:
        """``model`` on top of ``so_far``, begun where that has not yet taken up what is its own.

        An m for each of ten materials comes near to what many another effect does, and holes from 0 m on to holes
        anywhere beside holes far away. With those fitted, the true cause has little left to close, and the fit does not
        find the way back.
        """
        kind = effect_class(model.parts[-1].effect).kinds[0]
        stands_for_two = [p.effect in trusted and effect_class(p.effect).kinds[0] == kind for p in so_far.parts]
        if not (any(stands_for_two) or any(map(self.is_flexible, so_far.parts))):
            return
        was = next((c for c in earlier if c.newest == model.parts[-1]), None)
        begin = was.model.newest if was else model
        for number in range(
            max(len(p.starts) if two else 1 for p, two in zip(so_far.parts, stands_for_two, strict=True))
        ):
            xs = [
                part.encode(part.starts[number % len(part.starts)]) if two or self.is_flexible(part) else x
                for part, x, two in zip(so_far.parts, so_far.split(so_far.x), stands_for_two, strict=True)
            ]
            yield Model(so_far.parts, np.concatenate(xs)).plus(begin)

    def known_here(self, model: Model, kind: str) -> Iterator[Candidate]:
        """What may be added to a model and makes one kind of error everywhere, or is known by the axis along which that
        kind of what is left changes most.

        Not what takes many times the pixels: it takes long, and has been looked at beside the others.
        """
        taken = {name for part in model.parts for name in (part.effect, *part.replaces)}
        first = [(one, along) for one, along in first_axes(self.validator, model.build(self.base)) if one == kind]
        for candidate in self.replacing:
            effect, has_more = effect_class(candidate.effect), has_more_pixels(candidate.effect, self.evidence.camera)
            is_open = not (candidate.in_place or candidate.effect in taken or candidate.replaces & taken or has_more)
            everywhere = not effect.axes and effect.kinds[0] == kind
            if is_open and (everywhere or is_known_by(candidate.effect, first)):
                yield candidate

    def _from_elsewhere(self, model: Model, base: Sequence[Effect]) -> Model:
        """An effect of many parameters on top of ``base``, from the best of some places after rounds on a few frames.

        Light from one side is not on the way to light from another.
        """
        candidate, config = model.parts[-1], self.config.fit
        if not self.is_flexible(candidate) or candidate.of_materials:
            return model
        _, target, roots = self._on(self._few)
        places = starts(candidate, base, roots(tuple(base)), target, roots)[0][: config.places]
        begun = (refine(place, base, target, roots, config, config.rounds_elsewhere) for place in places)
        return min((model, *begun), key=lambda one: one.loss)
