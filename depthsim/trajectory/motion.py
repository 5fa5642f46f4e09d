"""What all made trajectories have in common: speed along a path, and where the camera looks."""

from abc import ABC, abstractmethod
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, model_validator

from depthsim.trajectory.curve import eased_arc, eased_duration
from depthsim.trajectory.poses import Trajectory
from depthsim.trajectory.rotation import Floats, view_rotations

Length = Annotated[FiniteFloat, Field(gt=0, le=1e6)]
"""[m]"""

_Coordinate = Annotated[FiniteFloat, Field(ge=-1e6, le=1e6)]
Point = tuple[_Coordinate, _Coordinate, _Coordinate]
"""[m]"""


def _as_points(value: Any) -> Any:
    """One point as a list of one."""
    single = isinstance(value, list | tuple) and len(value) > 0 and not isinstance(value[0], list | tuple)
    return [value] if single else value


Points = Annotated[tuple[Point, ...], BeforeValidator(_as_points)]


class Motion(BaseModel, ABC):
    """A made trajectory, continuous in time from 0 s."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @property
    @abstractmethod
    def total_time(self) -> float:
        """From the first pose to the last [s]."""

    @abstractmethod
    def sample(self, stamps: Floats, name: str = "trajectory") -> Trajectory:
        """The exact poses at ``stamps`` [s]. Raises ValueError, as "problem; fix", where there is no such pose."""


class Moving(Motion):
    """A path flown at a constant speed. The camera is level: no roll, its y axis points down as far as it can."""

    speed: FiniteFloat = Field(gt=0, description="along the path [m/s]")
    ease: bool = Field(False, description="start and stop smoothly, over one second each")
    look_at: Points | None = Field(None, description="the point that the camera looks at [m]")
    heading: Literal["tangent"] | None = Field(None, description="where it looks without look_at; tangent if left out")
    pitch: FiniteFloat = Field(0, ge=-90, le=90, description="the view against the heading [deg], negative looks down")

    @model_validator(mode="after")
    def _one_view(self) -> "Moving":
        if self.look_at is not None and (self.heading is not None or self.pitch != 0):
            raise ValueError("look_at is given together with heading or pitch: keep one of them")
        if self.look_at is not None and len(self.look_at) not in self._target_counts():
            counts = " or ".join(map(str, self._target_counts()))
            raise ValueError(f"look_at holds {len(self.look_at)} points: give {counts}")
        return self

    @abstractmethod
    def _length(self) -> float:
        """Of the whole path [m]."""

    @abstractmethod
    def _path(self, arc: Floats) -> tuple[Floats, Floats]:
        """(N,) arc lengths [m] to (N, 3) positions [m] and (N, 3) directions of travel."""

    def _target_counts(self) -> tuple[int, ...]:
        return (1,)

    def _targets(self, arc: Floats) -> Floats:
        """The points that the camera looks at, (N, 3) or (1, 3)."""
        return np.array(self.look_at, dtype=np.float64)

    def _facing(self, positions: Floats, travel: Floats) -> Floats:
        """Where the camera looks without look_at."""
        return travel

    @property
    def total_time(self) -> float:
        """From the first pose to the last [s]."""
        return eased_duration(self._length(), self.speed) if self.ease else self._length() / self.speed

    def _arc(self, stamps: Floats) -> Floats:
        arc = eased_arc(stamps, self._length(), self.speed) if self.ease else stamps * self.speed
        return np.clip(arc, 0, self._length())

    def sample(self, stamps: Floats, name: str = "trajectory") -> Trajectory:
        """The exact poses at ``stamps`` [s]."""
        arc = self._arc(stamps)
        positions, travel = self._path(arc)
        if self.look_at is None:
            directions = self._facing(positions, travel)
        else:
            directions = self._targets(arc) - positions
            met = np.flatnonzero(np.linalg.norm(directions, axis=1) < 1e-6)
            if met.size:
                raise ValueError(f"the camera is at the point it looks at at {stamps[met[0]]:.3f} s; move look_at")
        return Trajectory(stamps, positions, view_rotations(directions, np.radians(self.pitch)), name)
