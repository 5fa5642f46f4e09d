"""The parameters of an effect that are fitted: how they vary, and where they begin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from depthsim.gap.config import DepthFit
from depthsim.sensor.effect import Effect
from depthsim.sensor.parameter import Parameter, Setting, parameters_of

_NOTHING = 0.5
"""Of the least value of a parameter that is varied by its logarithm: so much stands for 0."""


@dataclass(frozen=True)
class Free:
    """A parameter that is fitted. key: name, or (name, tag) of one that every material has.

    log: whether its logarithm is what is varied. step: a change that matters. low, high: bounds. whole: only
    whole numbers are allowed. vanishes: whether 0 is allowed beside what lies within the bounds.
    """

    key: str | tuple[str, str]
    low: float
    high: float
    log: bool
    step: float
    whole: bool = False
    vanishes: bool = False

    @property
    def name(self) -> str:
        """Of the parameter."""
        return self.key if isinstance(self.key, str) else self.key[0]

    @property
    def by_material(self) -> bool:
        """Whether every material has one."""
        return isinstance(self.key, tuple)

    @property
    def label(self) -> str:
        """As it is reported: ``sigma`` or ``m.cement``."""
        return self.key if isinstance(self.key, str) else ".".join(self.key)

    def encode(self, value: float) -> float:
        """The parameter as the fit varies it: a change by 1 matters."""
        if not self.log:
            return value / self.step
        least = _NOTHING * self.low if self.vanishes and value < self.low else self.low
        return float(np.log(max(value, least)) / 0.4)

    def decode(self, x: float) -> float:
        """Its value."""
        value = float(np.exp(min(x * 0.4, 50))) if self.log else x * self.step
        if self.vanishes and value < _NOTHING**0.5 * self.low:  # nearer to nothing than to the least
            return 0.0
        value = float(np.clip(value, self.low, self.high))
        return round(value) if self.whole else value


def free_of(kind: type[Effect], setting: Setting, config: DepthFit) -> tuple[Free, ...]:
    """The parameters of a kind of effect that are fitted to a recording, one for each of its materials where they are
    of a material."""
    found: list[Free] = []
    for one in parameters_of(kind).values():
        if one.frozen and one.name not in kind.thawed_in(setting):
            continue
        if one.by_material:
            high = one.high if one.likely is None else one.likely
            step = _step(one, setting, config)
            found += [Free((one.name, tag), one.low, high, False, step) for tag in setting.tags]
        elif one.scaled == "log":
            found.append(
                Free(one.name, max(one.low, 1e-6 * max(one.default, 1e-3)), one.high, True, 1.0, vanishes=one.low == 0)
            )
        else:
            found.append(Free(one.name, one.low, one.high, False, _step(one, setting, config), one.whole))
    return tuple(found)


def _step(one: Parameter, setting: Setting, config: DepthFit) -> float:
    """A change of a parameter that matters, where it is not a part of its value."""
    if one.step is not None:
        return one.step
    if one.whole:
        return 1.0
    if one.scaled == "range":
        # What a range is without effect, such as 1000 m, says nothing about how finely it matters.
        return max(config.range_step * float(np.ptp(setting.depths(0.15, 0.85))), 0.01)
    if one.neutral is not None and one.default != one.neutral:
        return abs(one.default - one.neutral) / 4
    return (one.high - one.low) / 20


def begin(one: Parameter, free: Free, setting: Setting) -> tuple[float, ...]:
    """Where to begin with one parameter."""
    known = _of_material(free.key, {}, setting) if isinstance(free.key, tuple) else None
    starts = one.begin(setting) if known is None else [known]
    return tuple(dict.fromkeys(float(np.clip(value, free.low, free.high)) for value in starts))


def one_by_one(
    start: tuple[float, ...], free: Sequence[Free], known: Mapping[str, Parameter], setting: Setting
) -> tuple[tuple[float, ...], ...]:
    """``start`` with one material at a time where else fits of its parameter begin."""
    return tuple(
        (*start[:k], value, *start[k + 1 :])
        for k, f in enumerate(free)
        if known[f.name].by_material
        for value in begin(known[f.name], f, setting)[1:]
    )


def value_of(free: Free, values: Mapping[str, Any], setting: Setting) -> float:
    """What a parameter is now; 0 for a material of which nothing says anything."""
    if isinstance(free.key, str):
        return float(values[free.key])
    return _of_material(free.key, values[free.name], setting) or 0.0


def _of_material(key: tuple[str, str], given: Mapping[str, float], setting: Setting) -> float | None:
    """What a profile says of a material, or else materials.yaml, or nothing."""
    name, tag = key
    value = given.get(tag, getattr(setting.materials[tag], name, None))
    return None if value is None else float(value)
