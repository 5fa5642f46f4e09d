"""Reference paths: position with its derivatives up to snap as a function of time, and where the vehicle's nose points.

All start and end at rest. ``speed`` is the greatest speed along the path.
"""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from depthsim.flight.profile import Floats, Profile, compose
from depthsim.trajectory.motion import Length, Point

Speed = Annotated[FiniteFloat, Field(gt=0, le=200)]


class Path(BaseModel, ABC):
    """A flight's path in time, from 0 s."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    yaw: Literal["tangent"] | FiniteFloat = Field("tangent", description="tangent, or fixed [deg from +x]")
    look_at: Point | None = Field(None, description="the point that the nose turns to, in place of yaw [m]")

    @model_validator(mode="after")
    def _one_heading(self) -> "Path":
        if self.look_at is not None and "yaw" in self.model_fields_set:
            raise ValueError("look_at is given together with yaw: keep one of them")
        return self

    @property
    @abstractmethod
    def duration(self) -> float:
        """From the start to the end [s]."""

    @abstractmethod
    def flat(self, t: Floats) -> Floats:
        """(5, N, 3) position, velocity, acceleration, jerk and snap at the times (N,); at rest outside the duration."""

    def heading(self, flat: Floats) -> Floats:
        """(N,) yaw [rad], continuous. Where the path has no level direction, it is between those of its neighbours."""
        if self.look_at is not None:
            level = (np.array(self.look_at) - flat[0])[:, :2]
        elif self.yaw == "tangent":
            level = self._direction(flat)[:, :2]
        else:
            return np.full(flat.shape[1], np.radians(float(self.yaw)))
        size = np.hypot(level[:, 0], level[:, 1])
        there = np.flatnonzero(size > 1e-6 * max(float(size.max()), 1e-9))
        if not there.size:
            return np.zeros(flat.shape[1])
        angle = np.unwrap(np.arctan2(level[there, 1], level[there, 0]))
        return np.asarray(np.interp(np.arange(flat.shape[1]), there, angle))

    def _direction(self, flat: Floats) -> Floats:
        """(N, 3) of travel."""
        return np.asarray(flat[1])


class Moving(Path):
    """A path with a greatest speed."""

    speed: Speed = Field(description="the greatest along the path [m/s]")


class _Curve(Moving):
    """A curve γ(u) whose parameter starts and stops smoothly."""

    acceleration: Annotated[FiniteFloat, Field(gt=0, le=200)] = Field(
        5, description="of start and stop, at most [m/s²]"
    )

    @abstractmethod
    def _curve(self, u: Floats) -> Floats:
        """(5, N, 3) γ and its four derivatives in u."""

    @property
    @abstractmethod
    def _end(self) -> float:
        """The parameter where the path ends; it begins at 0."""

    @property
    @abstractmethod
    def _fastest(self) -> float:
        """|γ'| where it is greatest [m]."""

    @model_validator(mode="after")
    def _reaches_its_speed(self) -> "_Curve":
        try:
            _ = self._profile.duration
        except ZeroDivisionError:
            raise ValueError("speed or acceleration is too near to zero for this path") from None
        return self

    @cached_property
    def _profile(self) -> Profile:
        try:
            return Profile.limited(self._end, self.speed / self._fastest, self.acceleration / self._fastest)
        except ValueError as error:
            most = float(error.args[0]) * self._fastest
            raise ValueError(
                f"the path is too short to reach {self.speed:g} m/s with {self.acceleration:g} m/s²: "
                f"take a speed below {min(most, self.speed):.3g}, more acceleration, or a longer path"
            ) from None

    @property
    def duration(self) -> float:
        """From the start to the end [s]."""
        return self._profile.duration

    def flat(self, t: Floats) -> Floats:
        """(5, N, 3)."""
        along = self._profile(t)
        return compose(self._curve(along[0]), along)


class Circle(_Curve):
    """A level circle, counter-clockwise seen from above, from the side of +x."""

    shape: Literal["circle"] = "circle"
    center: Point = Field((0.0, 0.0, 2.0), description="[m]")
    radius: Length = Field(description="[m]")
    laps: Annotated[FiniteFloat, Field(gt=0, le=1000)] = Field(1, description="how often around")

    @property
    def _end(self) -> float:
        return 2 * np.pi * self.laps

    @property
    def _fastest(self) -> float:
        return self.radius

    def _curve(self, u: Floats) -> Floats:
        turned = u + np.pi / 2 * np.arange(5)[:, None]
        out = self.radius * np.stack([np.cos(turned), np.sin(turned), np.zeros_like(turned)], axis=-1)
        out[0] += np.array(self.center)
        return out


class Lemniscate(_Curve):
    """A level figure of eight, the lemniscate of Gerono, from its centre, where it is fastest."""

    shape: Literal["lemniscate"] = "lemniscate"
    center: Point = Field((0.0, 0.0, 2.0), description="[m]")
    size: tuple[Length, Length] = Field(description="of the whole figure along x and y [m]")
    laps: Annotated[FiniteFloat, Field(gt=0, le=1000)] = Field(1, description="how often around")

    @property
    def _end(self) -> float:
        return 2 * np.pi * self.laps

    @property
    def _fastest(self) -> float:
        return float(np.hypot(self.size[0] / 2, self.size[1]))

    def _curve(self, u: Floats) -> Floats:
        order = np.arange(5)[:, None]
        x = self.size[0] / 2 * np.sin(u + np.pi / 2 * order)
        y = self.size[1] / 2 * 2.0**order * np.sin(2 * u + np.pi / 2 * order)
        out = np.stack([x, y, np.zeros_like(x)], axis=-1)
        out[0] += np.array(self.center)
        return out


class Shuttle(_Curve):
    """A straight line, there and back, as in the paper's Table 2. The nose keeps its heading on the way back."""

    shape: Literal["shuttle"] = "shuttle"
    start: Point = Field((0.0, 0.0, 2.0), description="[m]")
    length: Length = Field(80, description="[m]")
    direction: FiniteFloat = Field(0, description="of the line [deg from +x]")

    @property
    def _end(self) -> float:
        return self.length

    @property
    def _fastest(self) -> float:
        return 1.0

    def _along(self) -> Floats:
        angle = np.radians(self.direction)
        return np.array([np.cos(angle), np.sin(angle), 0.0])

    def _curve(self, u: Floats) -> Floats:
        out = np.zeros((5, len(u), 3))
        out[0] = np.array(self.start) + u[:, None] * self._along()
        out[1] = self._along()
        return out

    def _direction(self, flat: Floats) -> Floats:
        return np.broadcast_to(self._along(), flat[1].shape)

    @property
    def duration(self) -> float:
        """There and back [s]."""
        return 2 * super().duration

    def flat(self, t: Floats) -> Floats:
        """(5, N, 3)."""
        back = t > self.duration / 2
        out = super().flat(np.where(back, self.duration - t, t))
        out[1::2, back] *= -1
        return out


class Hover(Path):
    """Staying at one place."""

    shape: Literal["hover"] = "hover"
    yaw: Literal["tangent"] | FiniteFloat = Field(0.0, description="[deg from +x]")
    position: Point = Field((0.0, 0.0, 2.0), description="[m]")
    time: Annotated[FiniteFloat, Field(gt=0, le=1e5)] = Field(10, description="[s]")

    @property
    def duration(self) -> float:
        """[s]."""
        return self.time

    def flat(self, t: Floats) -> Floats:
        """(5, N, 3)."""
        out = np.zeros((5, len(t), 3))
        out[0] = self.position
        return out
