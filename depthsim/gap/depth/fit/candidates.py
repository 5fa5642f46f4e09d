"""What may be wrong with a simulator: every effect that it lacks, and every value of those that it has."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.config import DepthFit
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.sensor.parameter import Parameter, Setting, learned_of, parameters_of

Vector = NDArray[np.float64]
_NOTHING = 0.5
"""Of the least value of a parameter that is varied by its logarithm: so much stands for 0."""
_SAME = 0.02
"""By which what a recording shows of a parameter may differ from its value."""


def setting_of(
    evidence: Evidence,
    learned: Mapping[str, Sequence[Mapping[str, Any]]] | None = None,
    errors: PoseErrors | None = None,
) -> Setting:
    """What of the recording decides where fits begin. learned: what was, by effect; errors: of the poses."""
    tags = tuple(t for i, t in enumerate(evidence.scene.tags) if evidence.cuts.shown_tags[i] >= 0)
    quantiles = np.quantile(evidence.depths, Setting.SHARES).astype(float)
    stamps = [frame.stamp for frame in evidence.frames.values()]
    span, camera = max(stamps) - min(stamps), evidence.camera
    left, doubled = camera.left, evidence.doubled
    late = errors.late if errors and abs(errors.late) < span else None
    return Setting(
        tags, quantiles, span, evidence.materials, evidence.cuts.own_steps, learned or {},
        size=(left.width, left.height), doubled=doubled, undoubled=doubled is None and evidence.shows_doubling,
        zoom=camera.color.fy / left.fy if camera.color is not None else None, late=late,
        turn=errors.turn if errors else None, shift=errors.shift if errors else None,
        border=evidence.border, tiled=evidence.tiled, aligned=camera.aligned,
    )  # fmt: skip


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


@dataclass(frozen=True)
class Candidate:
    """An effect to be added to a sensor, changed in it, or put in place of another.

    free: what is fitted; fixed: the other parameters; starts: where to begin, as vectors of values; replaces: the ids
    of effects that go. in_place: whether it is tried only in place of another form of the effect: one that is
    refused, or one and the biases beside it.
    """

    effect: str
    free: tuple[Free, ...]
    fixed: Mapping[str, Any]
    starts: tuple[tuple[float, ...], ...]
    replaces: frozenset[str] = frozenset()
    in_place: bool = False

    def parameters(self, x: Vector) -> dict[str, Any]:
        """The effect's parameters at ``x``."""
        values: dict[str, Any] = {k: dict(v) if isinstance(v, Mapping) else v for k, v in self.fixed.items()}
        for free, at in zip(self.free, x, strict=True):
            if isinstance(free.key, str):
                values[free.key] = free.decode(at)
            else:
                values.setdefault(free.key[0], {})[free.key[1]] = free.decode(at)
        return values

    def build(self, base: Sequence[Effect], x: Vector) -> tuple[Effect, ...]:
        """The sensor's effects with this one as it is at ``x``."""
        kept = [e for e in base if e.id != self.effect and e.id not in self.replaces]
        return (*kept, effect_class(self.effect)(**self.parameters(x)))

    def encode(self, values: Sequence[float]) -> Vector:
        """Values of the free parameters as the fit varies them."""
        return np.array([free.encode(value) for free, value in zip(self.free, values, strict=True)])


def candidates(
    base: Sequence[Effect],
    setting: Setting,
    without: Sequence[str] = (),
    config: DepthFit = DepthFit(),  # noqa: B008 - frozen
) -> list[Candidate]:
    """All that may be wrong with a sensor that has the effects ``base``."""
    present = {effect.id: effect for effect in base}
    found = []
    for name in effect_ids():
        if name in without:
            continue
        kind = effect_class(name)
        if name not in present and not kind.possible(setting):
            continue
        if name in setting.learned:
            forms = [_learned(kind, values, setting, config) for values in setting.learned[name]]
            found += [replace(form, in_place=number > 0) for number, form in enumerate(forms)]
        if name in present:
            found += _otherwise(present[name], setting, config)
        elif not learned_of(kind):  # whose table is none of this recording's otherwise
            others = frozenset(effect.id for effect in base if kind.law and effect.law == kind.law)
            ways = dict.fromkeys((frozenset(), others))
            found += [_add(kind, setting, config, held, way) for held in kind.forms_in(setting) for way in ways]
            spare = (_add(kind, setting, config, held, way) for held in kind.spare_forms for way in ways)
            found += [replace(one, in_place=True) for one in spare]
    return [h for h in found if h.free]


def _add(
    kind: type[Effect], setting: Setting, config: DepthFit, held: Mapping[str, Any], replaces: frozenset[str]
) -> Candidate:
    known = parameters_of(kind)
    bounds = kind.bounds_in(setting)
    every = (f if f.name not in bounds else _between(f, *bounds[f.name]) for f in _free(kind, setting, config))
    free = tuple(f for f in every if f.name not in held)
    starts = _product([_begin(known[f.name], f, setting)[: 1 if known[f.name].by_material else None] for f in free])
    starts += _one_by_one(starts[0], free, known, setting) if starts else ()
    suggested = [tuple(values[f.name] for f in free) for values in kind.suggested(setting)]
    varied = {f.name for f in free if not known[f.name].by_material}
    fixed = {name: one.default for name, one in known.items() if name not in varied} | dict(held)
    return Candidate(kind.id, free, fixed, (*suggested, *starts), replaces)


def _between(free: Free, low: float, high: float) -> Free:
    return replace(free, low=max(free.low, low), high=min(free.high, high))


def _learned(kind: type[Effect], values: Mapping[str, Any], setting: Setting, config: DepthFit) -> Candidate:
    free = _free(kind, setting, config)
    fixed = {name: value for name, value in values.items() if name not in {f.key for f in free}}
    return Candidate(kind.id, free, fixed, (tuple(_value(f, values, setting) for f in free),))


def _otherwise(effect: Effect, setting: Setting, config: DepthFit) -> list[Candidate]:
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
    free = tuple(f for f in _free(type(effect), setting, config) if f.name not in held)
    values = effect.model_dump()
    start = tuple(_value(f, values, setting) for f in free)
    starts = [start]
    if len(free) == 1 and free[0].log:
        starts += [(start[0] * k,) for k in (0.2, 3, *((0,) if free[0].vanishes else ()))]
    starts += _one_by_one(start, free, parameters_of(type(effect)), setting)
    fixed = {name: value for name, value in values.items() if name not in {f.key for f in free}}
    return Candidate(effect.id, free, fixed, tuple(starts))


def _other_whole_numbers(effect: Effect, setting: Setting, config: DepthFit) -> list[Candidate]:
    """An effect that there is with one whole number at a time at its other values, to which no slope leads."""
    known = parameters_of(type(effect))
    values = (
        (f.name, value)
        for f in _free(type(effect), setting, config)
        if f.whole
        for value in _begin(known[f.name], f, setting)
    )
    others = [(name, round(value)) for name, value in values if getattr(effect, name) != value]
    return [_change(effect.model_copy(update={name: value}), setting, config, {}) for name, value in others]


def _held_gone(effect: Effect, setting: Setting, config: DepthFit) -> list[Candidate]:
    """An effect that there is without what fits hold, where it goes on by that alone, such as a band as wide as the
    disparity."""
    known, free = parameters_of(type(effect)), {f.name for f in _free(type(effect), setting, config)}
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
    return [_add(kind, setting, config, held, frozenset()) for held in forms]


def _value(free: Free, values: Mapping[str, Any], setting: Setting) -> float:
    """What a parameter is now; 0 for a material of which nothing says anything."""
    if isinstance(free.key, str):
        return float(values[free.key])
    return _of_material(free.key, values[free.name], setting) or 0.0


def _of_material(key: tuple[str, str], given: Mapping[str, float], setting: Setting) -> float | None:
    """What a profile says of a material, or else materials.yaml, or nothing."""
    name, tag = key
    value = given.get(tag, getattr(setting.materials[tag], name, None))
    return None if value is None else float(value)


def _free(kind: type[Effect], setting: Setting, config: DepthFit) -> tuple[Free, ...]:
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


def _begin(one: Parameter, free: Free, setting: Setting) -> tuple[float, ...]:
    """Where to begin with one parameter."""
    known = _of_material(free.key, {}, setting) if isinstance(free.key, tuple) else None
    starts = one.begin(setting) if known is None else [known]
    return tuple(dict.fromkeys(float(np.clip(value, free.low, free.high)) for value in starts))


def _one_by_one(
    start: tuple[float, ...], free: Sequence[Free], known: Mapping[str, Parameter], setting: Setting
) -> tuple[tuple[float, ...], ...]:
    """``start`` with one material at a time where else fits of its parameter begin."""
    return tuple(
        (*start[:k], value, *start[k + 1 :])
        for k, f in enumerate(free)
        if known[f.name].by_material
        for value in _begin(known[f.name], f, setting)[1:]
    )


def _product(grids: Sequence[tuple[float, ...]]) -> tuple[tuple[float, ...], ...]:
    """The first ten of all combinations."""
    every = list(product(*grids))
    return tuple(every[:10])
