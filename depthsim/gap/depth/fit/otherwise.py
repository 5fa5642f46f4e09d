"""An effect that a simulator has, as it may be otherwise: by slopes, and where none leads."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from depthsim.gap.config import DepthFit
from depthsim.gap.depth.fit.added import added
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.free import begin, free_of, one_by_one, value_of
from depthsim.sensor.effect import Effect
from depthsim.sensor.parameter import Setting, parameters_of

_SAME = 0.02
"""By which what a recording shows of a parameter may differ from its value."""


def otherwise(effect: Effect, setting: Setting, config: DepthFit) -> list[Candidate]:
    """Every way in which an effect that there is may have other values: by slopes, and where none leads."""
    by_material = {one.name for one in parameters_of(type(effect)).values() if one.by_material}
    ways_to_hold = [held for held in effect.forms if held and held.keys() <= by_material] or [{}]
    return [
        *(_change(effect, setting, config, held) for held in ways_to_hold),
        *_other_whole_numbers(effect, setting, config),
        *_held_gone(effect, setting, config),
        *_as_shown(effect, setting, config),
    ]


def _change(effect: Effect, setting: Setting, config: DepthFit, held: Mapping[str, Any]) -> Candidate:
    """Other values of an effect that there is. held: parameters that stay as they are."""
    free = tuple(f for f in free_of(type(effect), setting, config) if f.name not in held)
    values = effect.model_dump()
    start = tuple(value_of(f, values, setting) for f in free)
    starts = [start]
    if len(free) == 1 and free[0].log:
        starts += [(start[0] * k,) for k in (0.2, 3, *((0,) if free[0].vanishes else ()))]
    starts += one_by_one(start, free, parameters_of(type(effect)), setting)
    fixed = {name: value for name, value in values.items() if name not in {f.key for f in free}}
    return Candidate(effect.id, free, fixed, tuple(starts))


def _other_whole_numbers(effect: Effect, setting: Setting, config: DepthFit) -> list[Candidate]:
    """An effect that there is with one whole number at a time at its other values, to which no slope leads."""
    known = parameters_of(type(effect))
    values = (
        (f.name, value)
        for f in free_of(type(effect), setting, config)
        if f.whole
        for value in begin(known[f.name], f, setting)
    )
    others = [(name, round(value)) for name, value in values if getattr(effect, name) != value]
    return [_change(effect.model_copy(update={name: value}), setting, config, {}) for name, value in others]


def _held_gone(effect: Effect, setting: Setting, config: DepthFit) -> list[Candidate]:
    """An effect that there is without what fits hold, where it goes on by that alone, such as a band as wide as the
    disparity."""
    known, free = parameters_of(type(effect)), {f.name for f in free_of(type(effect), setting, config)}
    neutral = {name: one.neutral for name, one in known.items() if one.neutral is not None and not one.by_material}
    if not free <= neutral.keys() or effect.model_copy(update={name: neutral[name] for name in free}).is_neutral:
        return []
    held = {name: value for name, value in neutral.items() if name not in free and getattr(effect, name) != value}
    return [_change(effect.model_copy(update=held), setting, config, {})] if held else []


def _as_shown(effect: Effect, setting: Setting, config: DepthFit) -> list[Candidate]:
    """An effect that there is with what the recording itself shows of it, such as how wide its steps are.

    No slope leads there from other values. Not of what has forms of its own, and no value that is seen: those that are
    possible say how the effect is added.
    """
    kind, bounds = type(effect), type(effect).bounds_in(setting)
    shown = {name: low for name, (low, high) in bounds.items() if low == high}
    if not shown and (kind.forms != Effect.forms or kind.forms_in(setting) == kind.forms):
        return []
    values = effect.model_dump()

    def is_there(form: Mapping[str, Any]) -> bool:
        return all(np.isclose(values[name], value, rtol=_SAME, atol=_SAME) for name, value in form.items())

    forms = (held for held in kind.forms_in(setting) if not is_there({**held, **shown}))
    return [added(kind, setting, config, held, frozenset()) for held in forms]
