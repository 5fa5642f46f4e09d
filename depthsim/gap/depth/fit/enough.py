"""Whether what an effect closes is enough to name it, beside the causes that are there.

What the formulas of others leave is closed a little by whatever is like them, or has many parameters. A further cause
closes more than that; or it is small, but acts where no other does, and no other effect closes as much there.
"""

from collections.abc import Sequence

from depthsim.gap.depth.fit.chain import Chain
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.search import GONE, Search
from depthsim.gap.depth.fit.traits import fills_besides, is_filling
from depthsim.gap.selection import closes_enough, closes_enough_alone
from depthsim.sensor.effect import effect_class
from depthsim.sensor.parameter import learned_of

_SMOOTHED = ("correlation", "spread")


def is_enough(search: Search, chain: Chain, trial: Trial, leaders: Sequence[Trial]) -> bool:
    """Whether what one of ``leaders`` closes is enough to name it."""
    if search.makes_steps(trial.model):  # which nothing else does, however little it closes
        return True
    others = [other for other in leaders if other.newest.effect != trial.newest.effect]
    if chain.model is None:
        return _is_enough_alone(search, chain, trial, others)
    if _is_for_filled_holes(search, chain, trial):
        return False
    limit, gained, left = search.config.select, chain.gap - trial.gap, max(chain.score.above, 1e-12)
    faint = search.config.significance.faint * chain.score.floor
    is_apart = gained >= max(faint, limit.further_apart * left)
    if is_apart and _stood_for_both(search, chain, trial):
        return True
    if _is_leftover(search, chain, trial, others, is_apart):
        return False
    if closes_enough(gained, left, search.whole, faint, limit):
        return True
    return is_apart and not _is_rivalled(search, chain, trial, others)


def _is_enough_alone(search: Search, chain: Chain, trial: Trial, others: Sequence[Trial]) -> bool:
    """Whether a first cause closes much, or more than any other; those of its kind that were refused make no room."""
    alike = [c for step in chain.looked[:1] for c in step if not is_other_kind(trial, c)]
    rivals = [*others, *(c for c in alike if c.newest.effect != trial.newest.effect)]
    most = max((chain.gap - c.gap for c in rivals), default=0.0)
    return closes_enough_alone(chain.gap - trial.gap, most, _closable(search, trial), search.config.select)


def _is_for_filled_holes(search: Search, chain: Chain, trial: Trial) -> bool:
    """Whether an effect is for fewer holes, where a cause fills them: by another formula none are left, or fewer."""
    if any(map(is_filling, chain.named)) and search.is_less(trial, GONE):
        return True
    little = chain.gap - trial.gap < search.config.select.further * search.whole
    return any(map(fills_besides, chain.named)) and search.is_less(trial) and little


def _is_leftover(search: Search, chain: Chain, trial: Trial, others: Sequence[Trial], is_apart: bool) -> bool:
    """Whether what an effect closes may be what the formulas of the causes leave. is_apart: whether it closes as much
    of what is left as one that acts by itself must."""
    effect, limit, gained = trial.newest.effect, search.config.select, chain.gap - trial.gap
    if gained < limit.alike * search.whole and is_alike(effect, chain.named) and not search.lies_apart(trial.model):
        return True
    kind, made = effect_class(effect).kinds[0], _made_by_formulas(chain)
    by_material = trial.newest.of_materials
    if kind in ("bias", "spread", "missing") and kind in made and gained < limit.least * search.whole:
        # As much is left by the formula of the first.
        is_its_own = _is_of_one_material if by_material else _is_by_its_own_axis
        return not (is_apart and is_its_own(search, chain, trial))
    # Geometry has no other formula: however many its parameters are, it takes up little of what is another's.
    is_flexible = by_material or (search.is_flexible(trial.newest) and not effect_class(effect).exact)
    little = gained < limit.further * search.whole
    return is_flexible and little and not _is_no_leftover(search, chain, trial, others, by_material)


def _is_rivalled(search: Search, chain: Chain, trial: Trial, others: Sequence[Trial]) -> bool:
    """Whether one of the other leaders may be what a small further cause stands for."""
    limit, effect = search.config.select, effect_class(trial.newest.effect)
    if not search.is_flexible(trial.newest):  # with many parameters as much is closed of anything
        others = [other for other in others if other.gap < trial.gap or not search.is_flexible(other.newest)]
    if search.acts(trial.model):  # two that act where errors of different kinds lie are no rivals
        others = [other for other in others if not (is_other_kind(trial, other) and search.acts(other.model))]
    along = search.left_along(trial.model)
    learned = learned_of(effect)  # as much as other frames say for sure is there
    acts = along is not None and (bool(learned) or along <= limit.left_alone)
    made = _made_by_formulas(chain)
    anywhere = not effect.axes and (effect.kinds[0] not in made or effect.kinds[0] == "missing")
    if anywhere and search.acts(trial.model):
        acts, others = True, [other for other in others if not _is_outdone(other, trial)]

    def rivals(other: Trial) -> bool:
        """Not what acts elsewhere, or is known by another axis than that on which what is left changes first."""
        if _stays(search, chain.gap, trial, other):
            return False
        known = search.is_known(trial.model) and not search.is_known(other.model)
        return not acts or (search.acts(other.model) and not known)

    return any(map(rivals, others))


def _is_outdone(other: Trial, by: Trial) -> bool:
    """Whether a trial makes the same kind of error with more parameters, and closes no more."""
    more = len(other.newest.free) > len(by.newest.free)
    return more and other.gap >= by.gap and not is_other_kind(other, by)


def _is_no_leftover(search: Search, chain: Chain, trial: Trial, others: Sequence[Trial], by_material: bool) -> bool:
    """Whether an effect with so many parameters, which takes up some of what the formulas of others leave, is a cause.

    It closes all that is left, or leaves little along an axis that is no other's, beside which the others stay causes.
    What a formula leaves, many come near to. So where no other does, it may lie along axes that are others' as well;
    and if the effect leaves nearly none of its kind of errors, it need not be of one material.
    """
    if chain.gap - trial.gap >= search.config.agreement.nearly_all * chain.score.above:
        return search.acts(trial.model)
    is_alone = _is_alone(search, chain, trial, others)
    if by_material:
        most = 1 - search.config.agreement.nearly_all
        if not (is_alone and search.left_in_all(trial.model) <= most):
            return _is_of_one_material(search, chain, trial)
    return _leaves_little_of_its_own(search, chain, trial, is_alone=is_alone)


def _is_alone(search: Search, chain: Chain, trial: Trial, others: Sequence[Trial]) -> bool:
    """Whether an effect closes most of what is left, and so many times what any other does."""
    gained, limit = chain.gap - trial.gap, search.config.select
    most = max((chain.gap - other.gap for other in others), default=0.0)
    return gained >= max(limit.further_of_left * chain.score.above, limit.first_apart_times * most)


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


def _leaves_little_of_its_own(search: Search, chain: Chain, trial: Trial, *, is_alone: bool = False) -> bool:
    """Whether an effect leaves little along an axis that is no other's, beside which the others stay causes.

    is_alone: whether there need not be such an axis.
    """
    if not search.acts(trial.model):
        return False
    along = search.left_along(trial.model)
    if not (is_alone if along is None else along <= search.config.select.left_alone):
        return False
    return not any(search.disagreement(trial.model, k, alone=True) for k in range(len(chain.named)))


def _made_by_formulas(chain: Chain) -> set[str]:
    return {kind for name in chain.named for kind in _formula_of(name)}


def _formula_of(effect: str) -> Sequence[str]:
    """The kinds of error that an effect makes by a formula of its own; a filter takes spread away by one."""
    known = effect_class(effect)
    first = known.kinds[0]
    return [kind for kind in known.kinds if known.inseparable or kind == first or (first, kind) == _SMOOTHED]


def is_other_kind(one: Trial, other: Trial) -> bool:
    """Whether the newest effects of two trials mainly make errors of different kinds."""
    return effect_class(one.newest.effect).kinds[0] != effect_class(other.newest.effect).kinds[0]


def is_alike(effect: str, named: Sequence[str]) -> bool:
    """Whether a cause makes the same kind of error along the same axis first: an effect may be for what it leaves.

    What a learned pattern leaves is due to no formula.
    """
    formulas = (one for one in map(effect_class, named) if not learned_of(one))
    kinds = [(one.kinds[0], one.axes[:1]) for one in (effect_class(effect), *formulas)]
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
    newest = other.model.newest
    both = search.validated(best.model.plus(newest)).gap
    apart = other.gap - both >= limit.stays * gained
    needless = best.gap - both <= (1 - limit.stays) * theirs
    return apart or (needless and other.gap - min(both, best.gap) >= (1 - limit.stays) * gained)
