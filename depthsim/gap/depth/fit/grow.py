"""A chain of causes grows, as long as what is left would be a gap if it were alone."""

from collections.abc import Sequence

import numpy as np

from depthsim.gap.depth.fit.chain import Chain
from depthsim.gap.depth.fit.enough import is_enough, is_other_kind
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.hiding import beneath_a_filter, cancelling
from depthsim.gap.depth.fit.in_one import law_in_place
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.traits import has_more_pixels, is_filter
from depthsim.sensor.effect import effect_class


def grow(search: Search, chain: Chain) -> None:
    """Every cause that is supported, into the chain.

    Two causes may each leave what is the other's. So where none of the leaders acts where the gap lies, or one that is
    far behind, the one that closes most is taken all the same, a few times, and asked again when the others are there;
    and so is a filter before what takes many times the pixels, as all that follows would beside that.
    """
    while chain.model is None or len(chain.model.parts) < search.config.select.most_causes:
        if not search.leaves(chain.model, chain.score):
            break
        if search.is_spent:
            chain.is_unfinished = True
            break
        leaders = _leaders(search, chain)
        selected = _first_supported(search, chain, leaders)
        if selected is None:
            selected = beneath_a_filter(search, chain)
        if (taken := _for_the_moment(search, chain, leaders, selected)) is not None:
            selected = taken
            chain.trust(taken.newest.effect)
        if chain.model is None or selected is None:
            selected = cancelling(search, chain, selected) or selected
        if selected is None:
            break
        selected = _in_best_form(search, chain, selected)
        polished = search.validated(search.fit(selected.model, 4))  # other minima are looked for near the best only
        selected = min(selected, polished, key=lambda trial: trial.gap)
        chain.model, chain.gap = selected.model, selected.gap
        if len(chain.model.parts) > 1:
            _prune(search, chain)
            whole = law_in_place(search, Trial(chain.model, chain.gap))
            chain.model, chain.gap = whole.model, whole.gap
        chain.score = search.validator.score(chain.model.build(search.base))


def _for_the_moment(search: Search, chain: Chain, leaders: Sequence[Trial], selected: Trial | None) -> Trial | None:
    """What is taken in the place of what acts where the gap lies, if that is far behind or makes all else slow."""
    if len(chain.trusted) >= search.config.select.trusted:
        return None
    if selected is not None and has_more_pixels(selected.newest.effect, search.evidence.camera):
        filters = (one for one in leaders if is_filter(one.newest.effect))
        found = next((one for one in filters if not _is_for_another(search, one)), None)
        if found is not None and is_enough(search, chain, found, leaders):
            return found
    if selected is None and (held := _what_holds(search, leaders)) is not None:
        return held
    itself = next((one for one in leaders if not _is_for_another(search, one)), None)
    itself = _plainer(search, chain, leaders, itself) if itself else None
    if itself and _is_far_ahead(search, itself, selected) and is_enough(search, chain, itself, leaders):
        return itself
    return None


def _what_holds(search: Search, leaders: Sequence[Trial]) -> Trial | None:
    """The bias by which errors stay where the recording's do, where what closes most makes them go together and is too
    early for that: a filter of a noise that is larger than the bias, such as that of a mount."""
    best = min(leaders, key=lambda one: one.gap, default=None)
    if best is None or not search.is_early(best.model):
        return None
    biases = (one for one in leaders if effect_class(one.newest.effect).kinds[0] == "bias")
    holding = (one for one in biases if not search.is_early(best.model, beside=one.model))
    return min(holding, key=lambda one: one.gap, default=None)


def _plainer(search: Search, chain: Chain, leaders: Sequence[Trial], itself: Trial) -> Trial:
    """What is taken for the moment, or where that has many parameters, what has few, makes the same kind of errors and
    comes near: an effect with many comes near to two causes together, and leaves nothing by which the second shows."""
    if not search.is_flexible(itself.newest):
        return itself
    enough = (1 - search.config.select.near_of_cause) * (chain.gap - itself.gap)
    alike = (one for one in leaders if not (search.is_flexible(one.newest) or is_other_kind(one, itself)))
    near = (one for one in alike if chain.gap - one.gap >= enough and not _is_for_another(search, one))
    return min(near, key=lambda one: one.gap, default=itself)


def _is_for_another(search: Search, trial: Trial) -> bool:
    """Whether what closes most is not to be taken for the moment: it is not itself, or another must come first."""
    return search.stands_for_another(trial.model) or search.is_early(trial.model)


def _is_far_ahead(search: Search, itself: Trial, selected: Trial | None) -> bool:
    """Whether what closes most is no rival of the leader that acts where the gap lies, if there is one.

    One that makes another kind of error and acts is there whatever else is, and shows what is left of the others.
    """
    if selected is None:
        return True
    return not is_other_kind(itself, selected) and selected.gap - itself.gap > search.config.select.near * search.whole


def _leaders(search: Search, chain: Chain) -> list[Trial]:
    """The leaders of the bank on top of the causes so far, but for what was dropped."""
    if chain.model is None and chain.looked:  # they were fitted at the beginning
        leaders = chain.looked[0]
    else:
        leaders = tuple(search.step(chain.model, chain.looked[-1] if chain.looked else (), chain.is_out, chain.trusted))
        chain.looked.append(leaders)
        chain.before.append(chain.gap)
    return [trial for trial in leaders if not chain.is_out(trial.newest.effect)]


def _first_supported(search: Search, chain: Chain, leaders: Sequence[Trial]) -> Trial | None:
    """The leader that closes most of those that close enough and act where the gap lies."""
    timely = (trial for trial in leaders if not search.is_early(trial.model))
    left = sorted(timely, key=lambda trial: (trial is not leaders[0], trial.gap))
    asked = left[:]
    while asked:
        best = asked.pop(0)
        if not is_enough(search, chain, best, left):
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


def _in_best_form(search: Search, chain: Chain, trial: Trial) -> Trial:
    """What has a parameter for each material, or many, in the form that closes most, if that acts, or neither does: by
    few frames another came first.

    With the wrong one, such as a factor for an m that is wrong, it takes up what another cause does. What is taken for
    the moment acts in no form yet.
    """
    has_many = trial.newest.of_materials or search.is_flexible(trial.newest)
    other = search.in_other_form(chain.model, trial) if has_many else None
    if other is None:
        return trial
    return other if search.acts(other.model) or not search.acts(trial.model) else trial


def _prune(search: Search, chain: Chain) -> None:
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
