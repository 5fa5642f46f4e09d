"""One thing that may be wrong with a simulator, with what of it is fitted and where that begins."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.fit.free import Free
from depthsim.sensor.effect import Effect, effect_class

Vector = NDArray[np.float64]


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

    @property
    def of_materials(self) -> bool:
        """Whether it has a parameter for each material."""
        return any(free.by_material for free in self.free)

    def only(self, kept: Sequence[int]) -> "Candidate":
        """The same with some of its free parameters alone, by number; the others stay at what has no effect."""
        starts = dict.fromkeys(tuple(values[k] for k in kept) for values in self.starts)
        return replace(self, free=tuple(self.free[k] for k in kept), starts=tuple(starts))

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
