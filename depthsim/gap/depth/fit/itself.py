"""What an effect must be, as it is fitted, to be itself: each rule gives the reason why it is not in words, or None."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data import histograms
from depthsim.gap.depth.fit.asked import WORDS
from depthsim.gap.depth.fit.changes import (
    ALL,
    ENOUGH,
    GROWING,
    KINDS,
    Effects,
    against,
    cuts_along,
    done_by,
    has_effect,
    holes_made,
    holes_of,
    mean_over,
    more_holes,
    pixels_along,
    where_they_begin,
)
from depthsim.gap.depth.fit.traits import is_filling
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import Effect
from depthsim.sensor.pipeline import all_of, in_camera


def is_simulated(validator: Validator, effect: type[Effect]) -> bool:
    """Whether the simulator has an effect: an aligned camera has an alignment, whatever the profile says."""
    return has_effect(all_of(validator.evidence.camera, validator.evidence.base), effect.id)


def is_idle(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether an effect that the sensor has not, as it is fitted, changes nothing along the axis it is known by.

    Such as a drift over time that has come to its end with the first frame: any bias along range does as well.
    """
    if effect.kinds[0] not in ("bias", "missing"):
        return None  # noise is much the same all over where a camera moves evenly, or sees what is alike
    if is_simulated(validator, effect) or shows_itself(validator, effect, before, after):
        return None
    return f"changes nothing along {effect.axes[0].replace('_', ' ')} as it is fitted, by which it is known"


def is_outgrown(validator: Validator, effect: type[Effect], after: Effects) -> str | None:
    """Whether an effect that the sensor has not has a parameter that makes it another effect.

    Such as a nearest range that is soft over decimetres, for holes that become more the nearer something is.
    """
    if is_simulated(validator, effect):
        return None
    bounds = effect.outgrown
    reached = (name for one in after if one.id == effect.id for name in bounds if getattr(one, name) >= bounds[name])
    name = next(reached, None)
    return None if name is None else f"has a {name} of {bounds[name]:g} or more, from which on it is another effect"


def is_alike_for_all(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether a factor of each material is much the same for all: such as the spread that a filter takes away."""
    if not effect.gain_of_material:
        return None
    was, now = ([getattr(one, effect.gain_of_material) for one in s if one.id == effect.id] for s in (before, after))
    if (was or [{}]) == now:
        return None
    k, axes = KINDS.index(effect.kinds[0]), validator.evidence.axes
    does = validator.once(done_by, before, after)
    own = [n for n, axis in enumerate(axes) if axis.kind == histograms.ERROR and axis.names <= set(effect.axes)]
    varies = float(does.varies[k, own].max(initial=0.0))
    if varies >= validator.evidence.config.agreement.of_material * float(does.whole[k]):
        return None
    return f"changes {WORDS[KINDS[k]]} by much the same on all materials"


def lacks_a_kind(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether an effect that makes several kinds of error together, as it is fitted, makes none of one.

    Such as sunlight that loses no pixels, for more noise of another kind, or has no noise where the recording has no
    more than the simulator, for holes of another. It is asked without what is done to the finished picture, which may
    fill the holes.
    """
    if not effect.inseparable or is_simulated(validator, effect):
        return None
    before, after = (tuple(in_camera(sensor)) for sensor in (before, after))
    least = validator.evidence.config.agreement.inseparable

    def has(kind: str, whole: NDArray[np.float64]) -> bool:
        return bool(whole[KINDS.index(kind)] >= least * whole[ALL])

    does, first = validator.once(done_by, before, after).whole, effect.kinds[0]
    none = next((kind for kind in effect.kinds if not has(kind, does)), None)
    # Beside many holes some noise may not be found, or be named as another.
    if none is None or (none == first and has(first, validator.once(against, validator.evidence.base).whole)):
        return None
    return f"makes none of the {WORDS[none]} that go with its {WORDS[next(k for k in effect.kinds if k != none)]}"


def is_mostly_besides(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether an effect loses most pixels beside those that it is known by.

    Such as a shadow that hardly loses the background, and all of the near things: they are lost by themselves.
    """
    if not effect.besides or is_simulated(validator, effect):
        return None
    less = {name: 0.0 for name in effect.besides}
    itself = tuple(one.model_copy(update=less) if one.id == effect.id else one for one in after)
    if itself == tuple(after):
        return None
    none, some, whole = (validator.once(holes_of, sensor) for sensor in (before, itself, after))
    if whole <= none or some - none >= validator.evidence.config.agreement.mostly * (whole - none):
        return None
    return f"loses {(whole - some) / (whole - none):.0%} of its pixels by {' and '.join(effect.besides)} alone"


def takes_all(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether the many pixels that the simulator loses anywhere are all there, and something else is left.

    Hardly a sensor loses none: they have been filled, by a formula that what is left is of.
    """
    if effect.axes or effect.kinds != ("missing",) or not is_simulated(validator, effect):
        return None
    without = validator.once(holes_of, [one for one in after if one.id != effect.id])
    was, now = (validator.once(holes_of, one) - without for one in (before, after))
    limit = validator.evidence.config.agreement
    if was < limit.many_holes or now > limit.gone * was or not validator.score(after).stands_out(validator.config):
        return None
    return f"loses no pixel where the simulator loses {was:.0%}, which is filling rather"


def takes_what_is_filled(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether holes that the simulator makes are fewer, beside what fills holes: by its own formula it fills them."""
    if effect.kinds[0] != "missing" or not is_simulated(validator, effect):
        return None
    base = validator.evidence.base
    filling = next((one.id for one in before if is_filling(one.id) and one not in base), None)
    if filling is None:
        return None
    was, now = (validator.once(holes_of, tuple(in_camera(sensor))) for sensor in (before, after))
    return f"takes away holes, which {filling} fills" if now < was else None


def lies_elsewhere(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether holes that an effect makes at any range, say, are hardly there, where those of another cause that grow
    along the range begin.

    By another formula these are fewer there from the beginning, and more farther on.
    """
    limit = validator.evidence.config.agreement
    if effect.kinds != ("missing",):
        return None
    for cause in _causes_of_holes(validator, before):
        cuts = known_by(validator, type(cause))
        if not cuts or cause.axes[0] not in GROWING or cause.axes[0] in effect.axes:
            continue
        number, pixels = cuts[0], pixels_along(validator, cuts[0], validator.real)
        grown = holes_made(validator, number, [one for one in before if one is not cause], before)
        begins, goes_on = where_they_begin(grown, pixels, limit.begins)
        made, more = holes_made(validator, number, before, after), more_holes(validator, number, before)
        there, farther = (mean_over(some, pixels, more) for some in (begins, goes_on))
        alike = mean_over(begins, pixels, made)
        if alike > 0 and there < limit.where_others_begin * max(alike, 0.0 if effect.axes else farther):
            return f"loses {alike:.1%} of the pixels where those that {cause.id} loses begin, the recording {there:.1%}"
    return None


def _causes_of_holes(validator: Validator, before: Effects) -> list[Effect]:
    """The causes so far that mainly lose pixels."""
    return [one for one in before if one not in validator.evidence.base and one.kinds[0] == "missing"]


def is_of_its_materials(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether holes that an effect makes on all materials are hardly there on those where another cause makes none.

    On the others they are what that one's formula leaves, such as a range along which a material is lost.
    """
    limit, cuts = validator.evidence.config.agreement, cuts_along(validator, "material")
    if effect.kinds != ("missing",) or "material" in effect.axes or not cuts:
        return None
    causes = [one for one in _causes_of_holes(validator, before) if "material" in one.axes]
    if not causes:
        return None
    number, pixels = cuts[0], pixels_along(validator, cuts[0], validator.real)
    made, more = holes_made(validator, number, before, after), more_holes(validator, number, before)
    for cause in causes:
        theirs = holes_made(validator, number, [one for one in before if one is not cause], before)
        spared = np.flatnonzero((theirs <= limit.begins * theirs.max(initial=0.0)) & (pixels >= ENOUGH))
        there, alike = (mean_over(spared, pixels, one) for one in (more, made))
        if alike > limit.begins * made.max(initial=0.0) and there < limit.where_others_begin * alike:
            return f"loses {alike:.1%} of the pixels of materials that {cause.id} spares, the recording {there:.1%}"
    return None


def shows_itself(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether an effect, as it is fitted, changes something along the axis it is known by, if that is seen at all.

    What acts on one material changes little along such an axis where all of them are counted: it does so on that
    material, beyond what material by itself says.
    """
    if not effect.axes or effect.axes[0] == "range":
        return True
    does = validator.once(done_by, before, after)
    varies, least = does.varies[ALL], validator.evidence.config.agreement.known_by * (does.mean + does.varies)[ALL]
    own = known_by(validator, effect)
    changes = {n: varies[n] for n in own}
    changes |= {n: varies[n] - varies[alone].max(initial=0.0) for n, alone in _crossings(validator, effect)}
    return not own or any(change >= least[n] for n, change in changes.items())


def _crossings(validator: Validator, effect: type[Effect]) -> Iterator[tuple[int, list[int]]]:
    """The cuts along the axis that an effect is known by and others of its own together, each with those along the
    others alone."""
    for number, axis in enumerate(validator.evidence.axes):
        others = axis.names - {effect.axes[0]}
        if effect.axes[0] in axis.names and others and others <= set(effect.axes):
            yield number, [n for other in others for n in cuts_along(validator, other)]


def known_by(validator: Validator, effect: type[Effect]) -> list[int]:
    """The cuts of errors along the axis that an effect is known by."""
    return cuts_along(validator, effect.axes[0]) if effect.axes else []
