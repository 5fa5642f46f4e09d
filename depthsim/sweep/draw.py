"""Random draws that depend on their names alone, so that no draw moves when others are added or made elsewhere."""

import hashlib
from typing import Any

from pydantic import BaseModel, ConfigDict, FiniteFloat, model_validator

Name = str | int


def word(*names: Name) -> int:
    """64 random bits for a tuple of names: a keyed hash, as stateless as a counter-based generator."""
    text = "\0".join(f"{type(name).__name__}:{name}" for name in names)
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "little")


def uniform(*names: Name) -> float:
    """A number in [0, 1) for a tuple of names, with all 53 bits of a double."""
    return (word(*names) >> 11) * 2.0**-53


class Distribution(BaseModel):
    """What a value is drawn from: one of ``range`` (uniform), ``log_range`` (uniform in the logarithm), ``choice``."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    range: tuple[FiniteFloat, FiniteFloat] | None = None
    log_range: tuple[FiniteFloat, FiniteFloat] | None = None
    choice: tuple[Any, ...] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> "Distribution":
        if sum(value is not None for value in (self.range, self.log_range, self.choice)) != 1:
            raise ValueError("give one of range: [low, high], log_range: [low, high] and choice: [a, b, ...]")
        for low, high in filter(None, (self.range, self.log_range)):
            if low > high:
                raise ValueError(f"the range begins at {low:g}, above its end {high:g}")
        if self.log_range is not None and self.log_range[0] <= 0:
            raise ValueError("a log_range begins above 0")
        if self.choice is not None and not self.choice:
            raise ValueError("choice is empty")
        return self

    def value(self, share: float) -> Any:
        """The value at ``share``, from 0 up to 1, of the distribution."""
        if self.choice is not None:
            return self.choice[int(share * len(self.choice))]
        if self.log_range is not None:
            low, high = self.log_range
            return min(low * (high / low) ** share, high)
        assert self.range is not None
        low, high = self.range
        return min(low + share * (high - low), high)

    @property
    def extremes(self) -> tuple[Any, ...]:
        """The values that stand for all others when it is checked that they can be used."""
        return self.choice or self.log_range or self.range or ()
