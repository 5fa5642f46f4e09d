"""How far a parameter's slider goes: its bounds, or where those are wide, what is usual; it grows when pushed."""

import math
from dataclasses import dataclass

from depthsim.sensor.effect import Effect, neutral_value

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
    field = kind.model_fields[name]
    by_tag = "dict" in str(field.annotation)
    low, high = _bounds(field.metadata if not by_tag else _value_metadata(field.annotation))
    whole = field.annotation is int
    if by_tag:
        return Range(low, high, min(high, 2.0), 0.005, low)
    default = field.default
    if whole:
        return Range(int(low), int(high), int(high), 1, int(default), whole=True)
    neutral = neutral_value(kind, name)
    centre = neutral if neutral is not None and low < neutral < high else low
    reach = _USUAL * abs(float(default) - centre)
    if reach <= 0 or (centre > low and reach >= centre - low):
        top = high
    else:
        top = min(high, _round_up(centre + reach) if centre in (0, low) else centre + reach)
    span = (top - low) if low >= 0 else max(top, -low)
    return Range(float(low), float(high), float(top), _step(span), float(default))


def _bounds(metadata: list) -> tuple[float, float]:
    low = next(item.ge for item in metadata if hasattr(item, "ge"))
    high = next(item.le for item in metadata if hasattr(item, "le"))
    return low, high


def _value_metadata(annotation: object) -> list:
    value = annotation.__args__[1]  # type: ignore[attr-defined]  # dict[str, Annotated[float, Field(...)]]
    return [item for part in value.__metadata__ for item in getattr(part, "metadata", [part])]


def _step(span: float) -> float:
    """A two-hundredth or less, as a round number."""
    fine = span / 200
    power = 10.0 ** math.floor(math.log10(fine))
    return next(power * step for step in (5, 2, 1) if power * step <= fine * (1 + 1e-9))


def _round_up(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return next(power * step for step in (1, 2, 5, 10) if power * step >= value * (1 - 1e-9))
