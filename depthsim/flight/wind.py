"""Wind: constant, in gusts, growing with height, or a field on a grid; the air's velocity in the world frame."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from depthsim.flight.dryden import GUST_STEP, first_order, second_order
from depthsim.kernels import inlined

Floats = NDArray[np.float64]
Positive = Annotated[FiniteFloat, Field(gt=0)]
_Speed = Annotated[FiniteFloat, Field(ge=-200, le=200)]
Velocity = tuple[_Speed, _Speed, _Speed]

FOOT = 0.3048
"""[m]"""


class Air(NamedTuple):
    """Wind as the kernel reads it: mean + gust(t) + field(place), for each of V vehicles.

    mean: (V, 3). gusts: (V, M, 3), ``GUST_STEP`` apart; M is 0 for none. field: (nx, ny, nz, 3) velocities at
    ``origin`` + index · ``spacing``; nx is 0 for none. All [m/s] and [m]. ground: the height of level ground [m] for
    the ground effect; -inf for none.
    """

    mean: Floats
    gusts: Floats
    field: Floats
    origin: Floats
    spacing: Floats
    ground: float


@dataclass(frozen=True)
class WindField:
    """Velocities on a regular grid; straight lines in between, and beyond the grid what is at its edge.

    velocity: (nx, ny, nz, 3) [m/s] at ``origin`` + (i, j, k) · ``spacing`` [m].
    """

    velocity: Floats
    origin: Floats
    spacing: Floats

    @classmethod
    def sampled(
        cls, function: Callable[[Floats], Floats], low: Sequence[float], high: Sequence[float], spacing: float
    ) -> "WindField":
        """The grid of an analytic field: ``function`` takes (N, 3) places [m] to (N, 3) velocities [m/s]."""
        counts = [max(1, math.ceil((b - a) / spacing - 1e-9) + 1) for a, b in zip(low, high, strict=True)]
        axes = [a + spacing * np.arange(count) for a, count in zip(low, counts, strict=True)]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        velocity = np.asarray(function(places.reshape(-1, 3)), np.float64).reshape(places.shape)
        return cls(velocity, np.array(low, np.float64), np.full(3, float(spacing)))


class Wind(BaseModel, ABC):
    """A wind as a user writes it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @property
    @abstractmethod
    def mean(self) -> Velocity:
        """What is everywhere and always there [m/s]."""

    def gusts(self, duration: float, altitude: float, airspeed: float, seeds: Sequence[int]) -> Floats:
        """(V, M, 3) what time adds, [m/s], one series a seed; M is 0 for a wind without gusts."""
        return np.empty((len(seeds), 0, 3))

    def grid(self) -> WindField | None:
        """What the place adds."""
        return None


class ConstantWind(Wind):
    """The same everywhere and always."""

    kind: Literal["constant"] = "constant"
    velocity: Velocity = Field(description="of the air, world frame [m/s]")

    @property
    def mean(self) -> Velocity:
        """The velocity."""
        return self.velocity


class Gusts(ConstantWind):
    """A constant wind with Dryden turbulence: MIL-F-8785C, low altitude model (below 1,000 ft).

    σ_w = 0.1 W20 and L_w = h; σ_u = σ_v = σ_w / (0.177 + 0.000823 h)^0.4 and L_u = L_v = h / (0.177 + 0.000823 h)^1.2,
    h in feet and no less than 10. The wind at 20 ft, W20, is that of ``velocity``, and u blows along it. The vehicle
    flies through frozen turbulence at one airspeed V and one height, so u is a first-order process of time constant
    L_u/V, and v and w have the filter (1 + √3 τ s) / (1 + τ s)²; both are discretised exactly, started in their
    stationary distribution, and so have the variance σ² at any step. Gusts that were measured have their σ_u in
    ``intensity`` and their L_u/V in ``correlation_time``, whatever the mean wind; σ_w keeps its share of σ_u.
    """

    kind: Literal["gusts"] = "gusts"  # type: ignore[assignment]
    altitude: Positive | None = Field(None, description="above the ground [m]; the mean of the flight if not given")
    airspeed: Positive | None = Field(None, description="[m/s]; the mean of the flight if not given")
    intensity: Positive | None = Field(None, description="σ_u = σ_v [m/s]; from the velocity if not given")
    correlation_time: Positive | None = Field(None, description="L_u/V [s]; from height and airspeed if not given")

    def scales(self, altitude: float) -> tuple[float, float, float, float]:
        """σ_u = σ_v, σ_w [m/s] and L_u = L_v, L_w [m] at a height [m]."""
        h = min(max((self.altitude or altitude) / FOOT, 10.0), 1000.0)
        shape = 0.177 + 0.000823 * h
        vertical = 0.1 * math.hypot(*self.velocity)
        return vertical / shape**0.4, vertical, FOOT * h / shape**1.2, FOOT * h

    def gusts(self, duration: float, altitude: float, airspeed: float, seeds: Sequence[int]) -> Floats:
        """Turbulence; the same seed gives the same gusts, whatever the others are."""
        count = math.ceil(duration / GUST_STEP) + 2
        draws = np.stack([np.random.Generator(np.random.Philox(key=seed)).normal(size=(count, 5)) for seed in seeds])
        along, vertical, length, length_w = self.scales(altitude)
        speed = max(self.airspeed or airspeed, 0.5)
        if self.intensity is not None:
            along, vertical = self.intensity, self.intensity * vertical / along if along else 0.0
        if self.correlation_time is not None:
            length, length_w = (self.correlation_time * speed * part / length for part in (length, length_w))
        series = np.stack(
            [
                first_order(draws[..., 0], along, length / speed),
                second_order(draws[..., 1:3], along, length / speed),
                second_order(draws[..., 3:5], vertical, length_w / speed),
            ],
            axis=-1,
        )
        heading = math.atan2(self.velocity[1], self.velocity[0])
        c, s = math.cos(heading), math.sin(heading)
        u, v, w = np.moveaxis(series, -1, 0)
        return np.stack([c * u - s * v, s * u + c * v, w], axis=-1)


class Shear(Wind):
    """A wind that grows with height by the power law: velocity · (z / height)^exponent, nothing below z = 0."""

    kind: Literal["shear"] = "shear"
    velocity: Velocity = Field(description="at ``height`` [m/s]")
    height: Positive = Field(10.0, description="[m]")
    exponent: FiniteFloat = Field(1 / 7, ge=0, le=1, description="1/7 over open land")

    @property
    def mean(self) -> Velocity:
        """None; all of it depends on the place."""
        return (0.0, 0.0, 0.0)

    def grid(self) -> WindField:
        """A column of 200 m, 0.1 m apart."""
        top = np.array(self.velocity)
        return WindField.sampled(
            lambda p: (np.maximum(p[:, 2:], 0) / self.height) ** self.exponent * top, (0, 0, 0), (0, 0, 200), 0.1
        )


class GriddedWind(Wind):
    """A field from a CSV file of columns x y z wx wy wz [m, m/s], a regular grid in any order."""

    kind: Literal["field"] = "field"
    file: str = Field(description="in the folder of the file that names it")

    @property
    def mean(self) -> Velocity:
        """None; all of it depends on the place."""
        return (0.0, 0.0, 0.0)

    def grid(self) -> WindField:
        """The grid in the file."""
        from depthsim.flight.windfile import read_grid

        return read_grid(Path(self.file))


AnyWind = Annotated[ConstantWind | Gusts | Shear | GriddedWind, Field(discriminator="kind")]
WindWithoutFile = Annotated[ConstantWind | Gusts | Shear, Field(discriminator="kind")]


def make_air(
    wind: Wind | None,
    seeds: Sequence[int] = (0,),
    *,
    duration: float = 0.0,
    altitude: float = 10.0,
    airspeed: float = 5.0,
    ground: float = -math.inf,
) -> Air:
    """Wind for the kernel, for as many vehicles as ``seeds``; the rest is for gusts and the ground effect."""
    wind = wind or ConstantWind(velocity=(0, 0, 0))
    grid = wind.grid() or WindField(np.empty((0, 0, 0, 3)), np.zeros(3), np.ones(3))
    mean = np.tile(np.array(wind.mean, np.float64), (len(seeds), 1))
    gusts = np.ascontiguousarray(wind.gusts(duration, altitude, airspeed, seeds))
    return Air(mean, gusts, grid.velocity, grid.origin, grid.spacing, ground)


@inlined
def wind_at(air, vehicle, time, x, y, z):  # noqa: ANN201 - numba
    """The air's velocity at a time and place [m/s]."""
    wx, wy, wz = air.mean[vehicle, 0], air.mean[vehicle, 1], air.mean[vehicle, 2]
    count = air.gusts.shape[1]
    if count > 0:
        at = min(max(time / GUST_STEP, 0.0), count - 1.0)
        before = min(int(at), count - 2)
        share = at - before
        wx += (1 - share) * air.gusts[vehicle, before, 0] + share * air.gusts[vehicle, before + 1, 0]
        wy += (1 - share) * air.gusts[vehicle, before, 1] + share * air.gusts[vehicle, before + 1, 1]
        wz += (1 - share) * air.gusts[vehicle, before, 2] + share * air.gusts[vehicle, before + 1, 2]
    nx, ny, nz, _ = air.field.shape
    if nx > 0:
        i, fx = _cell((x - air.origin[0]) / air.spacing[0], nx)
        j, fy = _cell((y - air.origin[1]) / air.spacing[1], ny)
        k, fz = _cell((z - air.origin[2]) / air.spacing[2], nz)
        for corner in range(8):
            a, b, c = corner & 1, (corner >> 1) & 1, (corner >> 2) & 1
            weight = (fx if a else 1 - fx) * (fy if b else 1 - fy) * (fz if c else 1 - fz)
            if weight > 0:
                wx += weight * air.field[i + a, j + b, k + c, 0]
                wy += weight * air.field[i + a, j + b, k + c, 1]
                wz += weight * air.field[i + a, j + b, k + c, 2]
    return wx, wy, wz


@inlined
def _cell(at, count):
    """The cell of a grid that a coordinate is in, and its share of the way through; the edge beyond the edge."""
    at = min(max(at, 0.0), count - 1.0)
    before = max(min(int(at), count - 2), 0)
    return before, at - before
