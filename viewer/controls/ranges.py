"""How far a parameter's slider goes: its bounds, or where those are wide, what is usual; it grows when pushed."""

import math
from dataclasses import dataclass

from depthsim.sensor.effect import Effect, parameters_of

_USUAL = 4.0
"""A slider begins with this many times the default's distance from the neutral value."""


@dataclass(frozen=True)
class Range:
    """low, high: the bounds. top: where the slider ends at first. whole: only whole numbers."""

    low: float
    high: float
    top: float
    step: float
    default: float
    whole: bool = False

    def within(self, value: float) -> float:
        """A value as the parameter takes it."""
        inside = min(max(value, self.low), self.high)
        return round(inside) if self.whole else float(inside)


def parameter_range(kind: type[Effect], name: str) -> Range:
    """Of a parameter; of one that is by material, of its values."""
    one = parameters_of(kind)[name]
    low, high, neutral = one.low, one.high, one.neutral
    if one.by_material:
        return Range(low, high, min(high, 2.0), 0.005, low)
    default = one.default
    if one.whole:
        return Range(int(low), int(high), int(high), 1, int(default), whole=True)
    centre = neutral if neutral is not None and low < neutral < high else low
    reach = _USUAL * abs(float(default) - centre)
    if reach <= 0 or (centre > low and reach >= centre - low):
        top = high
    else:
        top = min(high, _round_up(centre + reach) if centre in (0, low) else centre + reach)
    span = (top - low) if low >= 0 else max(top, -low)
    return Range(float(low), float(high), float(top), _step(span), float(default))


def _step(span: float) -> float:
    """A two-hundredth or less, as a round number."""
    fine = span / 200
    power = 10.0 ** math.floor(math.log10(fine))
    return next(power * step for step in (5, 2, 1) if power * step <= fine * (1 + 1e-9))


def _round_up(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return next(power * step for step in (1, 2, 5, 10) if power * step >= value * (1 - 1e-9))
