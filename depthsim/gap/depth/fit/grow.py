"""A chain of causes grows, as long as what is left would be a gap if it were alone."""

from collections.abc import Sequence

import numpy as np

from depthsim.gap.depth.fit.chain import Chain
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.hiding import beneath_a_filter, cancelling
from depthsim.gap.depth.fit.in_one import law_in_place
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import GONE, Search
from depthsim.gap.depth.fit.traits import fills_besides, has_more_pixels, is_filling, is_filter
from depthsim.gap.selection import closes_enough, closes_enough_alone
from depthsim.sensor.effect import effect_class
from depthsim.sensor.parameter import learned_of

_SMOOTHED = ("correlation", "spread")


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
        if found is not None and _closes_enough(search, chain, found, leaders):
            return found
    itself = next((one for one in leaders if not _is_for_another(search, one)), None)
    if itself and _is_far_ahead(search, itself, selected) and _closes_enough(search, chain, itself, leaders):
        return itself
    return None


def _is_for_another(search: Search, trial: Trial) -> bool:
    """Whether what closes most is not to be taken for the moment: it is not itself, or another must come first."""
    return search.stands_for_another(trial.model) or search.is_early(trial.model)


def _is_far_ahead(search: Search, itself: Trial, selected: Trial | None) -> bool:
    """Whether what closes most is no rival of the leader that acts where the gap lies, if there is one.

    One that makes another kind of error and acts is there whatever else is, and shows what is left of the others.
    """
    if selected is None:
        return True
    return not _is_other_kind(itself, selected) and selected.gap - itself.gap > search.config.select.near * search.whole


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


def _closes_enough(search: Search, chain: Chain, trial: Trial, leaders: Sequence[Trial]) -> bool:
    """Whether what one of ``leaders`` closes is enough to name it."""
    limit, gap = search.config.select, chain.gap
    gained, left = gap - trial.gap, max(chain.score.above, 1e-12)
    others = [c for c in leaders if c.newest.effect != trial.newest.effect]
    if search.makes_steps(trial.model):  # which nothing else does, however little it closes
        return True
    if chain.model is None:
        # Those of its kind that were refused do not make room for it.
        alike = [c for step in chain.looked[:1] for c in step if not _is_other_kind(trial, c)]
        rivals = [*others, *(c for c in alike if c.newest.effect != trial.newest.effect)]
        most = max((gap - c.gap for c in rivals), default=0.0)
        return closes_enough_alone(gained, most, _closable(search, trial), limit)
    # What is filled by another formula has no holes, and what is filled besides has fewer.
    if any(map(is_filling, chain.named)) and search.is_less(trial, GONE):
        return False
    if any(map(fills_besides, chain.named)) and search.is_less(trial) and gained < limit.further * search.whole:
        return False
    faint = search.config.significance.faint * chain.score.floor
    enough_apart = max(faint, limit.further_apart * left)
    if gained >= enough_apart and _stood_for_both(search, chain, trial):
        return True
    little = gained < limit.alike * search.whole
    if little and is_alike(trial.newest.effect, chain.named) and not search.lies_apart(trial.model):
        return False
    kind = effect_class(trial.newest.effect).kinds[0]
    named = {one for name in chain.named for one in _formula_of(name)}
    by_material = any(isinstance(free.key, tuple) for free in trial.newest.free)
    flexible = by_material or search.is_flexible(trial.newest)
    if kind in ("bias", "spread", "missing") and kind in named and gained < limit.least * search.whole:
        # As much is left by the formula of the first.
        is_its_own = _is_of_one_material if by_material else _is_by_its_own_axis
        is_no_leftover = gained >= enough_apart and is_its_own(search, chain, trial)
    else:
        little = gained < limit.further * search.whole
        is_no_leftover = not (flexible and little) or _is_no_leftover(search, chain, trial, by_material)
    if not is_no_leftover:
        return False
    if closes_enough(gained, left, search.whole, faint, limit):
        return True
    if gained < enough_apart:
        return False
    if not search.is_flexible(trial.newest):  # with many parameters as much is closed of anything
        others = [other for other in others if other.gap < trial.gap or not search.is_flexible(other.newest)]
    if search.acts(trial.model):  # two that act where errors of different kinds lie are no rivals
        others = [other for other in others if not (_is_other_kind(trial, other) and search.acts(other.model))]
    along = search.left_along(trial.model)
    learned = learned_of(effect_class(trial.newest.effect))  # as much as other frames say for sure is there
    acts = along is not None and (bool(learned) or along <= limit.left_alone)
    anywhere = not effect_class(trial.newest.effect).axes and (kind not in named or kind == "missing")
    if anywhere and search.acts(trial.model):
        acts, others = True, [other for other in others if not _is_outdone(other, trial)]

    def is_rivalled(other: Trial) -> bool:
        """Not by what acts elsewhere, or is known by another axis than that on which what is left changes first."""
        if _stays(search, gap, trial, other):
            return False
        known = search.is_known(trial.model) and not search.is_known(other.model)
        return not acts or (search.acts(other.model) and not known)

    return not any(map(is_rivalled, others))


def _is_outdone(other: Trial, by: Trial) -> bool:
    """Whether a trial makes the same kind of error with more parameters, and closes no more."""
    more = len(other.newest.free) > len(by.newest.free)
    return more and other.gap >= by.gap and not _is_other_kind(other, by)


def _is_no_leftover(search: Search, chain: Chain, trial: Trial, by_material: bool) -> bool:
    """Whether an effect with so many parameters, which takes up some of what the formulas of others leave, is a cause.

    It closes all that is left, or leaves little along an axis that is no other's, beside which the others stay causes.
    """
    if chain.gap - trial.gap >= search.config.agreement.nearly_all * chain.score.above:
        return search.acts(trial.model)
    return _is_of_one_material(search, chain, trial) if by_material else _leaves_little_of_its_own(search, chain, trial)


def _is_of_one_material(search: Search, chain: Chain, trial: Trial) -> bool:
    """Whether an effect with a parameter for each material is one for one of them.

    Materials that lie at other ranges show another formula of the range, but each of them some of it. One that lies at
    a slant shows another formula of that alone, but less than the slant does.
    """
    if search.is_theirs(trial.model) or not search.closes_by_one_material(trial, chain.gap):
        return False
    return _leaves_little_of_its_own(search, chain, trial)


def _stood_for_both(search: Search, chain: Chain, trial: Trial) -> bool:
    """Whether a cause that was taken for the moment, as its shape along its axis was wrong, is right beside an effect
    that makes the same errors along the same axis: such as what is lost by the range and beyond a range."""
    alike = [k for k, name in enumerate(chain.named) if name in chain.trusted and is_alike(name, [trial.newest.effect])]
    return bool(alike) and not any(
        search.disagreement(trial.model, k, alone=True) for k in (*alike, len(trial.model.parts) - 1)
    )


def _is_by_its_own_axis(search: Search, chain: Chain, trial: Trial) -> bool:
    """Whether an effect with few parameters is for what changes along its own axis, such as the phase of the disparity,
    along which no other cause acts."""
    is_plain = not search.is_flexible(trial.newest)
    return is_plain and search.is_its_own(trial.model) and _leaves_little_of_its_own(search, chain, trial)


def _leaves_little_of_its_own(search: Search, chain: Chain, trial: Trial) -> bool:
    """Whether an effect leaves little along an axis that is no other's, beside which the others stay causes."""
    if not search.acts(trial.model):
        return False
    along = search.left_along(trial.model)
    if along is None or along > search.config.select.left_alone:
        return False
    return not any(search.disagreement(trial.model, k, alone=True) for k in range(len(chain.named)))


def _formula_of(effect: str) -> Sequence[str]:
    """The kinds of error that an effect makes by a formula of its own; a filter takes spread away by one."""
    known = effect_class(effect)
    first = known.kinds[0]
    return [kind for kind in known.kinds if known.inseparable or kind == first or (first, kind) == _SMOOTHED]


def _is_other_kind(one: Trial, other: Trial) -> bool:
    return effect_class(one.newest.effect).kinds[0] != effect_class(other.newest.effect).kinds[0]


def is_alike(effect: str, named: Sequence[str]) -> bool:
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
