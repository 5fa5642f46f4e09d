"""A first look at the whole bank of effects on top of the causes found so far, on a few frames."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np

from depthsim.gap.depth.fit.changes import first_axes, plain_axes
from depthsim.gap.depth.fit.fitting import Fitting
from depthsim.gap.depth.fit.optimize import Model, promised, refine, starts
from depthsim.gap.depth.fit.traits import bends_rays, has_more_pixels, is_known_by
from depthsim.gap.depth.fit.validate import key_of
from depthsim.sensor.effect import Effect, effect_class

S = TypeVar("S")
T = TypeVar("T")


class Screening(Fitting):
    """Looks at the bank."""

    def screen(self, so_far: Model | None, is_out: Callable[[str], bool]) -> list[Model]:
        """The bank on top of ``so_far``, best first, after a first look; of each effect its best form.

        And of a law that must be met exactly every one, as a few frames do not tell them apart. Without what is still
        far beyond the recording. is_out: whether an effect is not to be looked at.
        """
        base = so_far.build(self.base) if so_far else self.base
        begun = self._begin_all(so_far, base, is_out)
        without = self.loss_on_few(base)
        best: dict[tuple[str, bool, str], Model] = {}

        def nearer(number: int) -> Model:
            return self.once(
                ("nearer", number, key_of(base)), lambda: self._nearer(number, begun[number], base, without)
            )

        for number, model in zip(begun, self.evidence.side_by_side(nearer, begun), strict=True):
            candidate = self.bank[number]
            form = repr(candidate.fixed) if effect_class(candidate.effect).exact else ""
            key = candidate.effect, bool(candidate.replaces), form
            if key not in best or model.loss < best[key].loss:
                best[key] = model
        near = (model for model in best.values() if model.loss < self.config.fit.far_behind * without)
        return sorted(near, key=lambda model: model.loss)

    def told(self, work: Callable[[S], T], items: Sequence[S], words: Sequence[str]) -> Iterator[T]:
        """The results of ``work`` on each item, side by side; what is waited for is said."""
        results = self.evidence.side_by_side(work, items)
        for said in words:
            self.say(said)
            yield next(results)

    def _begin_all(
        self, so_far: Model | None, base: tuple[Effect, ...], is_out: Callable[[str], bool]
    ) -> dict[int, Model]:
        """Where those of the bank begin that are worth a look, by number."""
        taken = {part.effect for part in so_far.parts} if so_far else set()
        taken |= {name for part in so_far.parts for name in part.replaces} if so_far else set()
        open_to = [
            k
            for k, c in enumerate(self.bank)
            if not (c.in_place or c.effect in taken or c.replaces & taken or is_out(c.effect))
        ]

        def begin(number: int) -> _Begun:
            return self.once(("begun", number, key_of(base)), lambda: self._begun(number, base))

        words = [f"looking at {self.bank[k].effect}, {k + 1} of {len(self.bank)}" for k in open_to]
        begun = dict(zip(open_to, self.told(begin, open_to, words), strict=True))
        fit, first = self.config.fit, [*first_axes(self.validator, base), *plain_axes(self.validator, base)]
        most_gained = max((one.gain for one in begun.values() if np.isfinite(one.gain)), default=0.0)
        gains = {k: one.gain for k, one in begun.items() if one.promised >= fit.promising * most_gained}
        known = [k for k in open_to if is_known_by(self.bank[k].effect, first)]  # however far off they begin
        looked_at = worth_a_look(gains, fit.looked_at if so_far is None else fit.looked_at_again)
        return {k: begun[k].place for k in sorted({*looked_at, *known})}

    def _begun(self, number: int, base: tuple[Effect, ...]) -> "_Begun":
        """Where one of the bank begins on a few frames; what takes long is looked at on a part of those."""
        candidate = self.bank[number]
        long = self.takes_long(candidate.effect)
        blocks = self._few[:1] if long else self._few
        _, target, roots = self._on(blocks)
        here, more = roots(base), len(self._few) / len(blocks)
        places, gain = starts(candidate, base, here, target, roots)
        flat = long and np.isinf(gain)
        slopes = promised(places[0], base, here, target, roots, self.config.fit) if flat else np.inf
        return _Begun(replace(places[0], loss=more * places[0].loss), more * gain, more * slopes)

    def _nearer(self, number: int, place: Model, base: tuple[Effect, ...], without: float) -> Model:
        """One of the bank, fitted for a few rounds on a few frames, what takes long on a part of those.

        without: the loss of what is there already, on a few frames.
        """
        long = self.takes_long(self.bank[number].effect)
        _, target, roots = self._on(self._few[:1] if long else self._few)
        if not all(free.whole for free in place.free):  # which have no slopes
            rounds = 1 if place.loss <= without else self.config.fit.rounds_from_beyond
            place = replace(refine(place, base, target, roots, self.config.fit, rounds), jacobian=None)
        return replace(place, loss=self.loss_on_few(place.build(base))) if long else place

    def takes_long(self, effect: str) -> bool:
        """Whether an effect has the scene cast anew by every trial, or takes many times the pixels."""
        return bends_rays(effect) or has_more_pixels(effect, self.evidence.camera)


class _Begun(NamedTuple):
    """Where one of the bank begins, and its gain, see :func:`optimize.starts`. promised: what slopes promise where that
    is not known, of what takes long."""

    place: Model
    gain: float
    promised: float


def worth_a_look(gains: Mapping[int, float], most: int) -> list[int]:
    """Of a bank those that begin best, and all that begin with nothing, whose gain is infinite: it is not known.

    Which these are depends on the recording. They do not take the place of what is on its way.
    """
    known = sorted((number for number, gain in gains.items() if np.isfinite(gain)), key=lambda number: -gains[number])
    return [number for number, gain in gains.items() if number in known[:most] or not np.isfinite(gain)]
