"""What may be wrong with a simulator: every effect that it lacks, and every value of those that it has."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.sensor.effect import Effect, effect_class, effect_ids, neutral_value

Vector = NDArray[np.float64]

_FROZEN = {
    "lens_distortion": {"k2"},
    "heavy_tails": {"search"},
    "edge_fattening": set(),
    "spatial_filter": {"iterations"},
    "material_noise": {"floor"},
    "material_dropout": {"rate", "dark"},
    "specular_dropout": {"matt"},
    "invalid_band": {"slope"},
}
"""Parameters that recordings hardly tell: they keep their value."""
_VARIANTS: dict[str, tuple[dict[str, float], ...]] = {
    "incidence_noise": ({"gain": 0.0}, {"sigma": 0.0}),
    "vignetting_noise": ({"gain": 0.0}, {"corner": 0.0}),
    "motion_noise": ({"gain": 0.0}, {"sigma": 0.0}),
    "ambient_light": ({"gain": 0.0}, {"noise": 0.0}),
    "heavy_tails": ({"spread": 0.0}, {}),
    "disparity_quantization": ({"origin": 0.0, "down": 0.0}, {"down": 0.0}, {"origin": 0.0}),
    "min_range": ({"softness": 0.0, "error": 1.0}, {"error": 1.0}, {"error": 0.0}),
    "max_range": ({"softness": 0.0, "error": 1.0}, {"error": 1.0}, {"error": 0.0}),
}
"""One effect may have several forms; each is a hypothesis of its own with these parameters held."""
_LOGS = {("heavy_tails", "spread"), ("min_range", "softness"), ("max_range", "softness")}
_OF_RANGES = 0.08
"""What part of the spread of the ranges in sight is a change that matters."""
_LAWS = {"material_noise", "disparity_noise"}
"""The laws of the basic noise, of which a sensor has one: each may stand in place of the other."""


@dataclass(frozen=True)
class Free:
    """A parameter that is fitted. key: name, or (name, tag) of one that every material has.

    log: whether its logarithm is what is varied. step: a change that matters. low, high: bounds. whole: only
    whole numbers are allowed.
    """

    key: str | tuple[str, str]
    low: float
    high: float
    log: bool
    step: float
    whole: bool = False

    @property
    def label(self) -> str:
        """As it is told: ``sigma`` or ``m.cement``."""
        return self.key if isinstance(self.key, str) else ".".join(self.key)

    def encode(self, value: float) -> float:
        """The parameter as the fit varies it: a change by 1 matters."""
        return float(np.log(max(value, self.low, 1e-12)) / 0.4) if self.log else value / self.step

    def decode(self, x: float) -> float:
        """Its value."""
        value = float(np.exp(min(x * 0.4, 50))) if self.log else x * self.step
        value = float(np.clip(value, self.low, self.high))
        return round(value) if self.whole else value


@dataclass(frozen=True)
class Hypothesis:
    """An effect to be added to a sensor, changed in it, or put in place of another.

    free: what is fitted; fixed: the other parameters; starts: where to begin, as vectors of values; replaces: the ids
    of effects that go.
    """

    effect: str
    free: tuple[Free, ...]
    fixed: Mapping[str, Any]
    starts: tuple[tuple[float, ...], ...]
    replaces: frozenset[str] = frozenset()

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


RANGES = (0, 0.02, 0.06, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95, 0.985, 0.996, 1)


@dataclass(frozen=True)
class Setting:
    """What of the recording decides where fits begin.

    tags: materials that are seen; ranges: the depth [m] at the shares RANGES of the pixels; span: time from first to
    last frame [s].
    m: m of each tag by the simulator. steps: of the disparities, see
    :func:`~depthsim.gap.depth.data.quantization.find_steps`.
    """

    tags: tuple[str, ...]
    ranges: NDArray[np.float64]
    span: float
    m: Mapping[str, float]
    steps: tuple[float, float] | None = None


def hypotheses(base: Sequence[Effect], setting: Setting, without: Sequence[str] = ()) -> list[Hypothesis]:
    """All that may be wrong with a sensor that has the effects ``base``."""
    present = {effect.id: effect for effect in base}
    found = []
    for name in effect_ids():
        if name in without:
            continue
        if name in present:
            found.append(_change(present[name], setting))
        else:
            other = _LAWS & set(present)
            ways = [frozenset(), frozenset(other)] if name in _LAWS and other else [frozenset()]
            found += [_add(name, setting, held, way) for held in _VARIANTS.get(name, ({},)) for way in ways]
    return [h for h in found if h.free]


def _add(name: str, setting: Setting, held: Mapping[str, float], replaces: frozenset[str]) -> Hypothesis:
    kind = effect_class(name)
    fixed = {k: f.get_default(call_default_factory=True) for k, f in kind.model_fields.items()} | dict(held)
    free = tuple(f for f in _free(kind, fixed, setting) if f.key not in held)
    if name == "material_dropout":
        fixed["rate"] = 0.0
    grids = [_grid(kind, f, fixed, setting) for f in free]
    for f in free:
        if isinstance(f.key, str):
            fixed.pop(f.key)
    starts = _product(grids)
    if name == "disparity_quantization" and setting.steps:
        seen = {"step": setting.steps[0], "origin": setting.steps[1], "down": 1.0}
        starts = (tuple(seen[str(f.key)] for f in free), *starts)
    return Hypothesis(name, free, fixed, starts, replaces)


def _change(effect: Effect, setting: Setting) -> Hypothesis:
    kind, values = type(effect), effect.model_dump()
    free = _free(kind, values, setting)
    start = tuple(_value(f, values, setting) for f in free)
    fixed = {k: v for k, v in values.items() if k not in {f.key for f in free}}
    starts = [start]
    if len(free) == 1 and free[0].log:
        starts += [(start[0] * k,) for k in (0.2, 3)]
    return Hypothesis(effect.id, free, fixed, tuple(starts))


def _value(free: Free, values: Mapping[str, Any], setting: Setting) -> float:
    if isinstance(free.key, str):
        return float(values[free.key])
    name, tag = free.key
    known = setting.m[tag] if name == "m" else 0.0
    return float(values[name].get(tag, known))


def _free(kind: type[Effect], values: Mapping[str, Any], setting: Setting) -> tuple[Free, ...]:
    found: list[Free] = []
    for name, field in kind.model_fields.items():
        if name in _FROZEN.get(kind.id, ()):
            continue
        if isinstance(values[name], Mapping):
            bounds = (0.0, 3.0, 0.02) if name == "m" else (0.0, 1.0, 0.02)
            found += [Free((name, tag), bounds[0], bounds[1], False, bounds[2]) for tag in setting.tags]
            continue
        if not isinstance(values[name], int | float) or isinstance(values[name], bool):
            continue
        low, high = (_bound(field.metadata, which) for which in ("ge", "le"))
        neutral, typical = neutral_value(kind, name), float(field.get_default(call_default_factory=True))
        extra = field.json_schema_extra
        in_metres = isinstance(extra, dict) and extra.get("unit") == "m"
        if isinstance(values[name], int) and field.annotation is int:
            found.append(Free(name, low, high, False, 1.0, whole=True))
        elif in_metres and (kind.id, name) not in _LOGS:
            # A range in the scene: what it is without effect, such as 1000 m, says nothing about how finely it matters.
            found.append(Free(name, low, high, False, max(_OF_RANGES * float(np.ptp(setting.ranges[[3, 7]])), 0.01)))
        elif (low >= 0 and neutral == 0) or (low > 0 and neutral is None) or (kind.id, name) in _LOGS:
            found.append(Free(name, max(low, 1e-6 * max(typical, 1e-3)), high, True, 1.0))
        else:
            step = abs(typical - neutral) / 4 if neutral is not None and typical != neutral else (high - low) / 20
            found.append(Free(name, low, high, False, step))
    return tuple(found)


def _bound(metadata: Sequence[Any], which: str) -> float:
    return next((float(getattr(m, which)) for m in metadata if getattr(m, which, None) is not None), np.inf)


_STARTS: dict[tuple[str, str], tuple[float, ...]] = {
    ("incidence_dropout", "start"): (30, 55, 75),
    ("incidence_dropout", "rate"): (0.5,),
    ("ambient_light", "azimuth"): (-135, -45, 45, 135),
    ("ambient_light", "elevation"): (20, 60),
    ("ambient_light", "noise"): (0.1,),
    ("ambient_light", "holes"): (0.1,),
    ("subpixel_bias", "phase"): (-0.25, 0, 0.25, 0.5),
    ("subpixel_bias", "amplitude"): (0.03,),
    ("stereo_shadow", "share"): (0.9,),
    ("stereo_shadow", "left"): (1.0,),
    ("stereo_shadow", "right"): (0.5,),
    ("specular_dropout", "rate"): (0.6,),
    ("specular_dropout", "width"): (10, 30),
    ("range_dropout", "rate"): (0.05,),
    ("spatial_filter", "alpha"): (0.5, 0.85),
    ("spatial_filter", "delta"): (0.2, 1.0),
    ("spatial_correlation", "x"): (0.7, 2, 6),
    ("spatial_correlation", "y"): (0.7, 2, 6),
    ("disparity_quantization", "step"): (0.03, 0.12, 0.5),
    ("disparity_quantization", "origin"): (-0.3, 0.3),
    ("disparity_quantization", "down"): (1.0,),
    ("temporal_correlation", "correlation"): (0.2, 0.6),
    ("time_offset", "offset"): (0.0, -0.03, 0.03),
    ("rolling_shutter", "readout"): (0.004, 0.03),
    ("extrinsic_rotation", "x"): (0.0,),
    ("extrinsic_rotation", "y"): (0.0,),
    ("extrinsic_rotation", "z"): (0.0,),
    ("baseline_scale", "scale"): (1.0, 0.95, 1.05),
    ("disparity_offset", "offset"): (0.0, -0.3, 0.3),
    ("lens_distortion", "k1"): (0.0, -0.03, 0.03),
    ("thermal_drift", "drift"): (-0.01, 0.01),
    ("heavy_tails", "spread"): (0.3, 3.0),
    ("min_range", "softness"): (0.03,),
    ("max_range", "softness"): (0.1,),
    ("incidence_noise", "gain"): (0.2, 1.0),
    ("vignetting_noise", "gain"): (0.5, 2.0),
    ("motion_noise", "gain"): (0.2, 2.0),
    ("ambient_light", "gain"): (1.0,),
    ("flying_pixels", "reach"): (1, 2, 3),
    ("flying_pixels", "rate"): (0.1,),
    ("flying_pixels", "step"): (0.3, 1.0),
    ("edge_fattening", "step"): (0.4,),
    ("stereo_shadow", "step"): (0.4,),
    ("invalid_band", "margin"): (0.5, 4.0, 12.0),
    ("edge_fattening", "radius"): (0.5, 2.0),
}


def _grid(kind: type[Effect], free: Free, fixed: Mapping[str, Any], setting: Setting) -> tuple[float, ...]:
    """Where to begin with one parameter."""
    if not isinstance(free.key, str):
        return (_value(free, fixed, setting) if free.key[0] == "m" else 0.02,)
    known = _STARTS.get((kind.id, free.key))
    if known:
        return known
    extra = kind.model_fields[free.key].json_schema_extra
    unit = extra.get("unit") if isinstance(extra, dict) else ""
    typical = float(fixed[free.key])
    neutral = neutral_value(kind, free.key)
    if unit == "m" and (neutral is None or neutral in (0, 1000)) and kind.id != "material_noise":
        q = setting.ranges
        chosen = q[[1, 2, 4]] if neutral == 0 else (q[[5, 7, 8, 9, 10]] if neutral else q[[2, 5]])
        return tuple(float(np.clip(v, free.low, free.high)) for v in chosen)
    if unit == "s" and neutral is None:
        return tuple(float(np.clip(setting.span * k, free.low, free.high)) for k in (0.3, 3.0))
    if free.log:
        return tuple(float(np.clip(typical * k, free.low, free.high)) for k in (0.3, 1.5, 8.0))
    if neutral is None:
        return (typical,)
    return tuple(
        neutral + (typical - neutral) * k
        for k in (0.0, 1.0, -1.0)
        if free.low <= neutral + (typical - neutral) * k <= free.high
    )


def _product(grids: Sequence[tuple[float, ...]]) -> tuple[tuple[float, ...], ...]:
    """All combinations; where they were more than ten, every parameter in turn from the middle of the others."""
    from itertools import product

    every = list(product(*grids))
    return tuple(every[:10])
