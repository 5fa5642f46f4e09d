"""An effect that a simulator lacks, as one that may be added to it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

from depthsim.gap.config import DepthFit
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.free import Free, begin, free_of, one_by_one, value_of
from depthsim.sensor.effect import Effect
from depthsim.sensor.parameter import Setting, parameters_of


def added(
    kind: type[Effect], setting: Setting, config: DepthFit, held: Mapping[str, Any], replaces: frozenset[str]
) -> Candidate:
    """An effect with some parameters held, as it would be added to a sensor; replaces: effects that go for it."""
    known = parameters_of(kind)
    bounds = kind.bounds_in(setting)
    every = (f if f.name not in bounds else _between(f, *bounds[f.name]) for f in free_of(kind, setting, config))
    free = tuple(f for f in every if f.name not in held)
    starts = _product([begin(known[f.name], f, setting)[: 1 if known[f.name].by_material else None] for f in free])
    starts += one_by_one(starts[0], free, known, setting) if starts else ()
    suggested = [tuple(values[f.name] for f in free) for values in kind.suggested(setting)]
    varied = {f.name for f in free if not known[f.name].by_material}
    fixed = {name: one.default for name, one in known.items() if name not in varied} | dict(held)
    return Candidate(kind.id, free, fixed, (*suggested, *starts), replaces)


def as_learned(kind: type[Effect], values: Mapping[str, Any], setting: Setting, config: DepthFit) -> Candidate:
    """An effect with the parameters that the recording itself has shown, of which some may still be fitted."""
    free = free_of(kind, setting, config)
    fixed = {name: value for name, value in values.items() if name not in {f.key for f in free}}
    return Candidate(kind.id, free, fixed, (tuple(value_of(f, values, setting) for f in free),))


def _between(free: Free, low: float, high: float) -> Free:
    return replace(free, low=max(free.low, low), high=min(free.high, high))


def _product(grids: Sequence[tuple[float, ...]]) -> tuple[tuple[float, ...], ...]:
    """The first sixteen of all combinations."""
    every = list(product(*grids))
    return tuple(every[:16])
