"""What a formula of an effect is: parameters with bounds, and how they change the model's settings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from depthsim.gap.flight.data.simulate import Settings

Values = Sequence[float]


@dataclass(frozen=True)
class Parameter:
    """A number that a formula has. start: where a fit begins. step: for derivatives. low, high: what makes sense.

    shape: whether a value at the bounds makes sense too, as that of an exponent or a share does.
    """

    name: str
    unit: str
    start: float
    step: float
    low: float = -np.inf
    high: float = np.inf
    shape: bool = False


@dataclass(frozen=True)
class Formula:
    """One way to write an effect.

    apply: the settings with these values of the parameters. linear: whether the force is linear in them.
    """

    effect: str
    name: str
    parameters: tuple[Parameter, ...]
    apply: Callable[[Settings, Values], Settings]
    linear: bool = True

    def astray(self, values: Values) -> bool:
        """Whether a fit ended at a bound; 0, where an effect is not there, is none."""
        return any(
            not one.shape and (value >= one.high or (value <= one.low and one.low != 0))
            for one, value in zip(self.parameters, values, strict=True)
        )

    @property
    def starts(self) -> list[float]:
        """Where a fit begins."""
        return [parameter.start for parameter in self.parameters]
