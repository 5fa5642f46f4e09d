"""Two causes as one, where one of them does as well alone.

A pattern with all that the biases beside it explain, such as an offset of the disparities for a pattern whose mean is
not 0, or a turned mount for one that is a ramp. A noise in another form, beside which another noise was for what the
one form leaves, such as that of each material for one that grows to the corners in proportion to what is there. Or a
law of the noise in place of the simulator's own, to which it was added before the other causes were there. A filter,
for less noise that goes together.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import permutations, product

import numpy as np

from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.ties import surely_worse
from depthsim.gap.depth.fit.traits import is_anywhere, is_filter
from depthsim.gap.selection import is_tie
from depthsim.sensor.effect import effect_class

Refuse = Callable[[str, float, str], None]
"""Hears of an effect that is no cause, the share of the gap that it closes, and why."""


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
    model = found.model
    noises = [number for number, one in enumerate(model.effects) if one.kinds[0] == "spread"]
    others = [(model.parts[k], model.less(max(k, n)).less(min(k, n))) for k, n in permutations(noises, 2)]
    tried = [(less, form) for part, less in others for form in search.other_forms(part)]
    enough = found.gap + search.config.significance.faint * search.floor
    trials = list(search.evidence.side_by_side(lambda one: _with(search, *one, 4), tried))
    best = _first_that_acts(search, trials, enough)
    if best is None:
        return _less_both(search, found, [trial for trial in trials if trial.gap < found.gap], refuse)
    gone = _gone(found, best)
    search.say(f"{best.newest.effect} in another form, without {' and '.join(gone)}")
    return best


def _less_both(search: Search, found: Trial, better: Sequence[Trial], refuse: Refuse) -> Trial:
    """What is found, without the two noises that the first of ``better`` does for, if that surely leaves less."""
    model = found.model
    before = model.build(search.base)
    sure = (one for one in better if surely_worse(search.validator, before, one.model.build(search.base)))
    if (one := next(sure, None)) is None:
        return found
    two = {one.newest.effect, *_gone(found, one)}
    for number in reversed(range(len(model.parts))):
        if (effect := found.model.parts[number].effect) in two:
            without = search.validated(found.model.less(number)).gap
            why = f"leaves more beside {' and '.join(two - {effect})} than {one.newest.effect} alone, which is none"
            refuse(effect, (without - found.gap) / search.whole, why)
            model = model.less(number)
    search.say(f"{' and '.join(two)} are no causes: {one.newest.effect} alone leaves less, and is none")
    return search.validated(search.fit(model, 3) if model.parts else model)


def _gone(found: Trial, best: Trial) -> set[str]:
    return {part.effect for part in found.model.parts} - {part.effect for part in best.model.parts}


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
    enough = found.gap + search.config.significance.faint * search.floor
    best = _first_that_acts(search, trials, enough)
    if best is None:
        return found
    search.say(f"{best.newest.effect} in place of {' and '.join(there - {one.effect for one in best.model.parts})}")
    return best


def holes_anywhere(search: Search, found: Trial) -> Trial:
    """What is found, or holes anywhere in place of as many of each material, where hardly more is left.

    A share for each material takes up holes that all materials have alike, beside those of a few of them; and beside
    what loses pixels of some of them by another formula, whatever that leaves there.
    """
    model = found.model
    there = {part.effect for part in model.parts}
    anywhere = [c for c in search.bank if is_anywhere(c.effect) and c.effect not in there and not c.in_place]
    ways = []
    for number, own in enumerate(model.split(model.x)):
        part, less = model.parts[number], model.less(number)
        rates = [f.decode(v) for f, v in zip(part.free, own, strict=True) if isinstance(f.key, tuple)]
        if model.effects[number].kinds != ("missing",) or len(rates) < len(part.free) or not rates:
            continue
        level = float(np.median(rates))
        more = [k for k, rate in enumerate(rates) if rate > search.config.select.more_than_others * level]
        few = Model((replace(part, free=tuple(part.free[k] for k in more)),), own[more])
        ways += [(begun, one) for one in anywhere for begun in (less, less.plus(few)) if level > 0]
    enough = found.gap + search.config.significance.faint * search.floor
    for less, one in ways:
        trial = _first_that_acts(search, [_with(search, less, one, 4)], enough)
        if trial is not None:
            gone = _gone(found, trial)
            search.say(f"{one.effect} {'in place of ' + gone.pop() if gone else 'beneath'}")
            return trial
    return found


def _first_that_acts(search: Search, trials: Iterable[Trial], enough: float) -> Trial | None:
    """The trial that leaves least, and less than ``enough``, of those whose newest part acts where the gap lies."""
    near = sorted((trial for trial in trials if trial.gap < enough), key=lambda trial: trial.gap)
    acts = (one for one in near if search.disagreement(one.model, len(one.model.parts) - 1, alone=True) is None)
    return next(acts, None)


def _with(search: Search, model: Model, candidate: Candidate, rounds: int) -> Trial:
    """A model with a candidate on top of it, fitted together."""
    return search.validated(search.fit(model.plus(search.begin(candidate, model.build(search.base))), rounds))
