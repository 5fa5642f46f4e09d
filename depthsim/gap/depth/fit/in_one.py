"""Two causes as one, where one of them does as well alone.

A pattern with all that the biases beside it explain, such as an offset of the disparities for a pattern whose mean is
not 0, or a turned mount for one that is a ramp. A noise in another form, beside which another noise was for what the
one form leaves, such as that of each material for one that grows to the corners in proportion to what is there. A bias
likewise, such as a lens that is decentred, beside which a mount that is off was for what it leaves as a centred one. Or
a law of the noise in place of the simulator's own, to which it was added before the other causes were there. A filter,
for less noise that goes together. Holes anywhere, for as many of each material.
"""

from collections.abc import Iterable, Sequence
from itertools import permutations, product

import numpy as np

from depthsim.gap.depth.fit.beneath import anywhere
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.ties import surely_worse
from depthsim.gap.depth.fit.traits import is_filter
from depthsim.gap.selection import Refuse, is_tie
from depthsim.sensor.effect import effect_class


def biases_in_one(search: Search, found: Trial) -> Trial:
    """What is found, or one pattern in place of all its biases, where that does as well on the frames held out.

    It leaves hardly more, or not surely.
    """
    model = found.model
    biases = [k for k, one in enumerate(model.effects) if one.kinds[0] == "bias"]
    named = {model.parts[k].effect for k in biases}
    wholes = (one for one in search.bank if one.in_place and one.effect in named and one not in model.parts)
    whole = next(wholes, None)
    if whole is None or len(biases) == 1:
        return found
    others = model
    for number in reversed(biases):
        others = others.less(number)
    trial = _with(search, others, whole, 3)
    more, hardly = trial.gap - found.gap, search.config.significance.faint * search.floor
    alone, several = (one.build(search.base) for one in (trial.model, model))
    tied = search.config.select.tied * search.whole
    if not is_tie(more, hardly, tied, lambda: surely_worse(search.validator, alone, several)):
        return found
    search.say(f"{whole.effect} alone does as well")
    return trial


def bias_in_other_form(search: Search, found: Trial) -> Trial:
    """What is found, or one of its biases in another form without another bias, where that leaves hardly more."""
    return _in_other_form(search, found, _other_forms(search, found.model, "bias")) or found


def law_in_place(search: Search, found: Trial) -> Trial:
    """What is found, or a law of the noise in place of the simulator's own, to which it was added, or the other way
    round, where that surely leaves less."""
    for number, part in enumerate(found.model.parts):
        less = found.model.less(number)
        for way in search.bank:
            if way.in_place or way.effect != part.effect or way.replaces == part.replaces:
                continue
            trial = _with(search, less, way, 4)
            one, other = (model.build(search.base) for model in (found.model, trial.model))
            if trial.gap < found.gap and surely_worse(search.validator, one, other):
                search.say(f"{part.effect} {'in place of' if way.replaces else 'beside'} the simulator's law")
                return trial
    return found


def noises_in_one(search: Search, found: Trial, refuse: Refuse) -> Trial:
    """What is found, or one of its noises in another form without another noise, where that leaves hardly more.

    Where that surely leaves less, and does not act where the gap lies, the two came near to what it came near to, and
    neither is a cause. refuse: hears of both, with what each closes beside the others.
    """
    trials = _other_forms(search, found.model, "spread")
    better = [trial for trial in trials if trial.gap < found.gap]
    return _in_other_form(search, found, trials) or _less_both(search, found, better, refuse)


def _other_forms(search: Search, model: Model, kind: str) -> list[Trial]:
    """The model with one of its errors of a kind in another form, without another one of that kind, in all ways."""
    alike = [number for number, one in enumerate(model.effects) if one.kinds[0] == kind]
    others = [(model.parts[k], model.less(max(k, n)).less(min(k, n))) for k, n in permutations(alike, 2)]
    tried = [(less, form) for part, less in others for form in search.other_forms(part)]
    return list(search.evidence.side_by_side(lambda one: _with(search, *one, 4), tried))


def _in_other_form(search: Search, found: Trial, trials: Sequence[Trial]) -> Trial | None:
    """The one of :func:`_other_forms` that acts and leaves least, if that is hardly more than what is found leaves."""
    best = _first_that_acts(search, trials, _enough(search, found))
    if best is not None:
        search.say(f"{best.newest.effect} in another form, without {' and '.join(_gone(found, best))}")
    return best


def _less_both(search: Search, found: Trial, better: Sequence[Trial], refuse: Refuse) -> Trial:
    """What is found, without the two noises that the first of ``better`` does for, if that surely leaves less."""
    before = found.model.build(search.base)
    sure = (one for one in better if surely_worse(search.validator, before, one.model.build(search.base)))
    if (one := next(sure, None)) is None:
        return found
    alone, others = one.newest.effect, found.model
    two = [alone, *_gone(found, one)]
    for number in reversed(range(len(found.model.parts))):
        if (effect := found.model.parts[number].effect) in two:
            beside = " and ".join(name for name in two if name != effect)
            closed = search.validated(found.model.less(number)).gap - found.gap
            refuse(effect, closed / search.whole, f"leaves more beside {beside} than {alone} alone, which is none")
            others = others.less(number)
    search.say(f"{' and '.join(two)} are no causes: {alone} alone leaves less, and is none")
    return search.validated(search.fit(others, 3) if others.parts else others)


def _gone(found: Trial, other: Trial) -> list[str]:
    """The causes that are found and that another trial is without."""
    kept = {part.effect for part in other.model.parts}
    return [part.effect for part in found.model.parts if part.effect not in kept]


def smoothed_in_one(search: Search, found: Trial) -> Trial:
    """What is found, or a filter in place of a noise and of what makes noise go together, where hardly more is left.

    A filter makes noise less and neighbours alike; a law of little noise in the simulator's place comes near to the
    first, and hides the filter from there on.
    """
    model, effects = found.model, found.model.effects
    there = {part.effect for part in model.parts}
    filters = [one for one in search.bank if is_filter(one.effect) and not one.in_place and one.effect not in there]
    laws = [k for k, one in enumerate(effects) if one.kinds[0] == "spread" and model.parts[k].replaces]
    pairs = [k for k, one in enumerate(effects) if one.kinds == ("correlation",)]
    ways = [
        (model.less(max(law, pair)).less(min(law, pair)), one)
        for law, pair, one in product(laws, pairs, filters)
        if effect_class(one.effect).axes[:1] == effects[pair].axes[:1]
    ]
    trials = search.evidence.side_by_side(lambda way: _with(search, *way, 4), ways)
    best = _first_that_acts(search, trials, _enough(search, found))
    if best is None:
        return found
    search.say(f"{best.newest.effect} in place of {' and '.join(_gone(found, best))}")
    return best


def holes_anywhere(search: Search, found: Trial) -> Trial:
    """What is found, or holes anywhere in place of as many of each material, where hardly more is left.

    A share for each material takes up holes that all materials have alike, beside those of a few of them; and beside
    what loses pixels of some of them by another formula, whatever that leaves there.
    """
    model = found.model
    enough = _enough(search, found)
    ways = [way for number in range(len(model.parts)) for way in _without_the_alike(search, model, number)]
    for less, one in product(ways, anywhere(search, model)):
        trial = _first_that_acts(search, [_with(search, less, one, 4)], enough)
        if trial is not None:
            gone = _gone(found, trial)
            search.say(f"{one.effect} {'in place of ' + ' and '.join(gone) if gone else 'beneath'}")
            return trial
    return found


def _without_the_alike(search: Search, model: Model, number: int) -> list[Model]:
    """The model without a cause of holes of each material, and with that of the materials alone that lose more than
    most; nothing of another cause, or where most lose none."""
    part, less = model.parts[number], model.less(number)
    if model.effects[number].kinds != ("missing",) or not part.free or not all(one.by_material for one in part.free):
        return []
    own = model.split(model.x)[number]
    rates = np.array([free.decode(value) for free, value in zip(part.free, own, strict=True)])
    level = float(np.median(rates))
    if level == 0:
        return []
    more = np.flatnonzero(rates > search.config.select.more_than_others * level).tolist()
    few = Model((part.only(more),), own[more])
    return [less, less.plus(few)] if more else [less]


def _enough(search: Search, found: Trial) -> float:
    """What leaves less than this leaves hardly more than what is found."""
    return found.gap + search.config.significance.faint * search.floor


def _first_that_acts(search: Search, trials: Iterable[Trial], enough: float) -> Trial | None:
    """The trial that leaves least, and less than ``enough``, of those whose newest part acts where the gap lies."""
    near = sorted((trial for trial in trials if trial.gap < enough), key=lambda trial: trial.gap)
    acts = (one for one in near if search.disagreement(one.model, len(one.model.parts) - 1, alone=True) is None)
    return next(acts, None)


def _with(search: Search, model: Model, candidate: Candidate, rounds: int) -> Trial:
    """A model with a candidate on top of it, fitted together."""
    return search.validated(search.fit(model.plus(search.begin(candidate, model.build(search.base))), rounds))
