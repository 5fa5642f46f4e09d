"""Named shapes: circle, line, lemniscate and hover."""

from functools import cached_property
from typing import Literal

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from depthsim.trajectory.curve import ArcLength
from depthsim.trajectory.motion import Length, Motion, Moving, Point
from depthsim.trajectory.poses import Trajectory
from depthsim.trajectory.rotation import Floats, view_rotations


class Circle(Moving):
    """A level circle, counter-clockwise seen from above, from the side of +x."""

    shape: Literal["circle"] = "circle"
    center: Point = Field(description="[m]")
    radius: Length = Field(description="[m]")
    laps: FiniteFloat = Field(1, gt=0, description="how often around")
    heading: Literal["tangent", "outward", "inward"] | None = None  # type: ignore[assignment]

    def _length(self) -> float:
        return 2 * np.pi * self.radius * self.laps

    def _path(self, arc: Floats) -> tuple[Floats, Floats]:
        angle = arc / self.radius
        zero = np.zeros_like(angle)
        out = np.stack([np.cos(angle), np.sin(angle), zero], axis=1)
        return np.array(self.center) + self.radius * out, np.stack([-out[:, 1], out[:, 0], zero], axis=1)

    def _facing(self, positions: Floats, travel: Floats) -> Floats:
        if self.heading in (None, "tangent"):
            return travel
        out = positions - np.array(self.center)
        return out if self.heading == "outward" else -out


class Line(Moving):
    """A straight line. On the way back of `there_and_back` the camera keeps its heading and flies backwards."""

    shape: Literal["line"] = "line"
    start: Point = Field(description="[m]")
    end: Point = Field(description="[m]")
    there_and_back: bool = Field(False, description="return to the start")

    @model_validator(mode="after")
    def _has_a_length(self) -> "Line":
        if self._length() < 1e-6:
            raise ValueError("start and end are the same point: use shape hover to stay there")
        return self

    def _length(self) -> float:
        return float(np.linalg.norm(np.subtract(self.end, self.start)))

    def _path(self, arc: Floats) -> tuple[Floats, Floats]:
        along = np.subtract(self.end, self.start) / self._length()
        return np.array(self.start) + arc[:, None] * along, np.broadcast_to(along, (len(arc), 3))

    @property
    def total_time(self) -> float:
        """From the first pose to the last [s]."""
        return super().total_time * (2 if self.there_and_back else 1)

    def _arc(self, stamps: Floats) -> Floats:
        return super()._arc(np.minimum(stamps, self.total_time - stamps) if self.there_and_back else stamps)


class Lemniscate(Moving):
    """A level figure of eight, the lemniscate of Gerono, from its centre."""

    shape: Literal["lemniscate"] = "lemniscate"
    center: Point = Field(description="[m]")
    size: tuple[Length, Length] = Field(description="of the whole figure along x and y [m]")
    laps: FiniteFloat = Field(1, gt=0, description="how often around")

    def _velocity(self, u: Floats) -> Floats:
        a, b = self.size
        return np.stack([a / 2 * np.cos(u), b * np.cos(2 * u), np.zeros_like(u)], axis=1)

    @cached_property
    def _lap(self) -> ArcLength:
        return ArcLength(self._velocity, np.linspace(0, 2 * np.pi, 257))

    def _length(self) -> float:
        return self._lap.length * self.laps

    def _path(self, arc: Floats) -> tuple[Floats, Floats]:
        u = self._lap.parameter(np.mod(arc, self._lap.length))
        a, b = self.size
        offset = np.stack([a / 2 * np.sin(u), b / 2 * np.sin(2 * u), np.zeros_like(u)], axis=1)
        return np.array(self.center) + offset, self._velocity(u)


class Hover(Motion):
    """Staying at one place."""

    shape: Literal["hover"] = "hover"
    position: Point = Field(description="[m]")
    look_at: Point = Field(description="the point that the camera looks at [m]")
    duration: FiniteFloat = Field(gt=0, description="[s]")

    @model_validator(mode="after")
    def _looks_elsewhere(self) -> "Hover":
        if np.linalg.norm(np.subtract(self.look_at, self.position)) < 1e-6:
            raise ValueError("position and look_at are the same point: move look_at")
        return self

    @property
    def total_time(self) -> float:
        """From the first pose to the last [s]."""
        return self.duration

    def sample(self, stamps: Floats, name: str = "trajectory") -> Trajectory:
        """The same pose at all ``stamps`` [s]."""
        direction = np.subtract(self.look_at, self.position)[None]
        count = len(stamps)
        turned = np.repeat(view_rotations(direction), count, axis=0)
        return Trajectory(stamps, np.tile(self.position, (count, 1)), turned, name)
