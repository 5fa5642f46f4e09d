"""The ground effect: near the ground a rotor pushes harder at the same power.

Cheeseman and Bennett 1955: T / T∞ = 1 / (1 - (R / 4z)²) for a rotor of radius R at the height z above level ground. The
formula has a pole at z = R/4 and was confirmed above z = R/2 only, so the ratio is held at its value there, 4/3. A
``strength`` before the square is for several rotors together: Sanchez-Cuevas, Heredia and Ollero 2017 measured more
than the formula of one rotor says. The other law, T / T∞ = 1 + strength · exp(-z / height), is for data alone.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from depthsim.flight.table import Floats
from depthsim.kernels import kernel

LEAST_HEIGHT = 0.5
"""Over the rotor's radius."""
_STEEPEST = 0.25
"""What is left of 1 - strength · (R / 4z)² at least."""
_CODES = {"cheeseman_bennett": 0, "exponential": 1}


class GroundEffect(BaseModel):
    """The ground effect of a vehicle over level ground at z = 0, unless a flight has it at another height."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    law: Literal["cheeseman_bennett", "exponential"] = "cheeseman_bennett"
    strength: FiniteFloat = Field(1.0, description="before (R / 4z)², or of the exponential")
    height: Annotated[FiniteFloat, Field(gt=0)] = Field(0.3, description="of the exponential [m]")

    @property
    def numbers(self) -> tuple[float, float, float]:
        """For the kernel."""
        return float(_CODES[self.law]), self.strength, self.height

    def factors(self, heights: Floats, radius: float) -> Floats:
        """Thrust near the ground over thrust far from it, for heights [m] of rotors of a ``radius`` [m]."""
        if self.law == "exponential":
            return 1 + self.strength * np.exp(-np.maximum(heights, LEAST_HEIGHT * radius) / self.height)
        part = radius / (4 * np.maximum(heights, LEAST_HEIGHT * radius))
        return 1 / np.maximum(1 - self.strength * part * part, _STEEPEST)


@kernel
def ground_factor(height, radius, law=0.0, strength=1.0, decay=1.0):  # noqa: ANN201 - numba
    """Thrust near the ground over thrust far from it; 1 to 4/3 for one rotor by Cheeseman and Bennett."""
    height = max(height, LEAST_HEIGHT * radius)
    if law == 1.0:
        return 1 + strength * np.exp(-height / decay)
    part = radius / (4 * height)
    return 1 / max(1 - strength * part * part, _STEEPEST)
