"""How far along its path a flight is: from rest to a constant rate and to rest again, smooth up to the snap."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_STEP = np.polynomial.Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
"""From 0 to 1 over 0 to 1, the first three derivatives zero at both ends."""
_STEEPEST = float(_STEP.deriv()(0.5))
_CURVES = (_STEP.integ(), _STEP, _STEP.deriv(), _STEP.deriv(2), _STEP.deriv(3))


@dataclass(frozen=True)
class Profile:
    """A parameter that runs from 0 to ``length``, at ``rate`` but for the start and the stop.

    ramp: how long the start takes, and the stop [s].
    """

    length: float
    rate: float
    ramp: float

    @classmethod
    def limited(cls, length: float, rate: float, most: float) -> "Profile":
        """The profile whose second derivative peaks at ``most``. Raises ValueError where ``rate`` is not reached."""
        ramp = _STEEPEST * rate / most
        if rate * ramp > length:
            raise ValueError(length / ramp)
        return cls(length, rate, ramp)

    @property
    def duration(self) -> float:
        """[s]."""
        return self.length / self.rate + self.ramp

    def __call__(self, t: Floats) -> Floats:
        """(5, N): the parameter and its four derivatives at the times (N,) [s]; at rest before 0 and after the end."""
        late = t > self.duration / 2
        near = np.clip(np.where(late, self.duration - t, t), 0.0, None)
        share = np.minimum(near / self.ramp, 1.0)
        out = np.stack([self.rate * self.ramp ** (1 - order) * curve(share) for order, curve in enumerate(_CURVES)])
        out[0] += self.rate * np.maximum(near - self.ramp, 0.0)
        out[0, late] = self.length - out[0, late]
        out[2::2, late] *= -1
        return out


def compose(curve: Floats, along: Floats) -> Floats:
    """(5, N, D) position to snap in time, of a curve with derivatives (5, N, D) in u and a profile u (5, N)."""
    c = curve
    u1, u2, u3, u4 = along[1:, :, None]
    return np.stack(
        [
            c[0],
            c[1] * u1,
            c[2] * u1**2 + c[1] * u2,
            c[3] * u1**3 + 3 * c[2] * u1 * u2 + c[1] * u3,
            c[4] * u1**4 + 6 * c[3] * u1**2 * u2 + c[2] * (3 * u2**2 + 4 * u1 * u3) + c[1] * u4,
        ]
    )
