"""A smooth path through way-points."""

from functools import cached_property
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from depthsim.trajectory.curve import ArcLength
from depthsim.trajectory.motion import Moving, Point
from depthsim.trajectory.rotation import Floats

_STEPS = 64
"""Intervals of the arc-length table from one way-point to the next."""


class Waypoints(Moving):
    """A C2 cubic spline through points, its parameter the length of the chords; natural at the ends, or closed.

    look_at may hold as many points as there are way-points; the point looked at moves along a spline of its own.
    """

    shape: Literal["waypoints"] = "waypoints"
    points: tuple[Point, ...] = Field(description="[m]")
    closed: bool = Field(False, description="return from the last point to the first")

    @model_validator(mode="after")
    def _points_make_a_path(self) -> "Waypoints":
        least = 3 if self.closed else 2
        if len(self.points) < least:
            raise ValueError(f"points holds {len(self.points)}: give {least} or more")
        same = np.flatnonzero(np.diff(self._knots) < 1e-6)
        if same.size:
            after = (same[0] + 1) % len(self.points)
            hint = "; closed joins the last to the first by itself" if after == 0 else ""
            raise ValueError(f"points {same[0]} and {after} are the same{hint}")
        return self

    def _target_counts(self) -> tuple[int, ...]:
        return 1, len(self.points)

    def _looped(self, points: tuple[Point, ...]) -> Floats:
        return np.array([*points, points[0]] if self.closed else points, dtype=np.float64)

    @cached_property
    def _knots(self) -> Floats:
        chords = np.linalg.norm(np.diff(self._looped(self.points), axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(chords)])

    def _spline(self, points: tuple[Point, ...]) -> Any:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self._knots, self._looped(points), bc_type="periodic" if self.closed else "natural")

    @cached_property
    def _position(self) -> Any:
        return self._spline(self.points)

    @cached_property
    def _curve(self) -> ArcLength:
        steps = np.arange(_STEPS) / _STEPS
        grid = np.append((self._knots[:-1, None] + np.diff(self._knots)[:, None] * steps).ravel(), self._knots[-1])
        velocity = self._position.derivative()
        if self.look_at is None:
            self._check_turns(velocity(grid))
        return ArcLength(velocity, grid)

    def _check_turns(self, travel: Floats) -> None:
        """A heading along the path needs a path that does not turn back on the spot."""
        ahead, behind = travel[1:], travel[:-1]
        lengths = np.linalg.norm(ahead, axis=1) * np.linalg.norm(behind, axis=1)
        sharp = np.flatnonzero(np.sum(ahead * behind, axis=1) < 0.5 * lengths + 1e-12)
        if sharp.size:
            place = f"the path turns back on the spot near point {round((sharp[0] + 0.5) / _STEPS)}"
            raise ValueError(f"{place}; add way-points to round the turn, or give look_at")

    def _length(self) -> float:
        return self._curve.length

    def _path(self, arc: Floats) -> tuple[Floats, Floats]:
        u = self._curve.parameter(arc)
        return self._position(u), self._position(u, 1)

    def _targets(self, arc: Floats) -> Floats:
        if self.look_at is None or len(self.look_at) == 1:
            return super()._targets(arc)
        return np.asarray(self._spline(self.look_at)(self._curve.parameter(arc)))
