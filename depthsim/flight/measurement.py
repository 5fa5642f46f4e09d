"""How a log differs from what happened: the thrust it shows, and an accelerometer that is biased, turned or late."""

from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from depthsim.flight.table import Floats

Vector = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
Late = Literal["accelerometer", "thrust", "recorder"]


class Measurement(BaseModel):
    """What the recorder of a vehicle writes; all of it neutral by default.

    thrust: what the log calls thrust: that of the rotors, or what they were commanded, which the motors lag behind.
    late: what has its stamps late against the rest; ``recorder`` is accelerometer and thrust against the poses.
    What a rotor makes is ``rotors.thrust_scale`` · ((1 - thrust_fade · t) · logged + thrust_offset), as batteries fade.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    thrust: Literal["actual", "command"] = "actual"
    imu_bias: Vector = Field((0.0, 0.0, 0.0), description="of the accelerometer along body x, y, z [m/s²]")
    imu_drift: Vector = Field((0.0, 0.0, 0.0), description="how the bias grows from the log's start [m/s² per s]")
    imu_rotation: Vector = Field((0.0, 0.0, 0.0), description="rotation vector, accelerometer against body [rad]")
    time_offset: FiniteFloat = Field(0, ge=-1, le=1, description="[s] that ``late`` is late by")
    late: Late = "accelerometer"
    thrust_offset: FiniteFloat = Field(0, description="[N] that each rotor makes over what is logged")
    thrust_fade: FiniteFloat = Field(0, ge=-0.01, le=0.01, description="of the thrust, lost each second [1/s]")

    def of_thrusts(self, thrusts: Floats, lag: float, step: float) -> Floats:
        """(N, K) what is logged of the rotors' thrusts, ``step`` [s] apart, behind motors with a ``lag`` [s]."""
        if self.thrust == "command":
            thrusts = thrusts + lag * np.gradient(thrusts, step, axis=0)
        if self.thrust_offset or self.thrust_fade:
            left = np.maximum(1 - self.thrust_fade * step * np.arange(len(thrusts)), 0.1)
            thrusts = (thrusts - self.thrust_offset) / left[:, None]
        late = self.late in ("thrust", "recorder") and self.time_offset
        return shifted(thrusts, 1 / step, self.time_offset) if late else thrusts

    def of_force(self, force: Floats, step: float) -> Floats:
        """(N, 3) what the accelerometer reads of the specific force in the body [m/s²]."""
        if any(self.imu_rotation):
            force = turned(force, self.imu_rotation)
        if self.late in ("accelerometer", "recorder") and self.time_offset:
            force = shifted(force, 1 / step, self.time_offset)
        if any(self.imu_drift):
            force = force + step * np.arange(len(force))[:, None] * np.array(self.imu_drift)
        return force + np.array(self.imu_bias) if any(self.imu_bias) else force


def lagged(columns: Floats, lag: float, step: float, order: int = 1) -> Floats:
    """Columns (N, K) behind a lag of ``lag`` [s] in all: ``order`` equal lags of first order, one after the other.

    Exact for an input that goes in straight lines between its samples, ``step`` [s] apart; in steady state before.
    """
    from scipy.signal import lfilter

    h = step * order / lag
    keep = np.exp(-h)
    share = -np.expm1(-h) / h
    for _ in range(order):
        state = (columns[:1] - (1 - share) * columns[:1]).copy()
        columns = np.asarray(lfilter([1 - share, share - keep], [1, -keep], columns, axis=0, zi=state)[0])
    return columns


def shifted(columns: Floats, rate: float, late: float) -> Floats:
    """Columns (N, K) as they were ``late`` [s] ago, by straight lines; held at the ends."""
    count = len(columns)
    at = np.clip(np.arange(count) - late * rate, 0, count - 1)
    low = np.minimum(at.astype(int), count - 2)
    share = (at - low)[:, None]
    return np.asarray((1 - share) * columns[low] + share * columns[low + 1])


def turned(vectors: Floats, rotation: Vector) -> Floats:
    """(N, 3) vectors of the body in a frame that is turned by the rotation vector [rad]: exp(rotation)ᵀ v."""
    from scipy.spatial.transform import Rotation

    return np.asarray(vectors @ Rotation.from_rotvec(rotation).as_matrix())
