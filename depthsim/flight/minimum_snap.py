"""A path through way-points with the least snap."""

from functools import cached_property
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from depthsim.flight.paths import Moving
from depthsim.flight.profile import Floats
from depthsim.trajectory.motion import Point


class MinimumSnap(Moving):
    """Through way-points with the least integral of the squared snap (Mellinger and Kumar 2011), at rest at both ends.

    Between way-points the least is a polynomial of degree 7, and where the way-points leave the derivatives free the
    pieces join with six equal derivatives: it is the interpolating spline of degree 7 whose velocity, acceleration and
    jerk are zero at the ends, so the quadratic programme has this closed form. The time from one point to the next goes
    with the distance (and the root of it at the ends, where the flight is slow); then all is scaled to the speed.
    """

    shape: Literal["minimum_snap"] = "minimum_snap"
    points: tuple[Point, ...] = Field(min_length=2, max_length=1000, description="[m]")

    @model_validator(mode="after")
    def _points_differ(self) -> "MinimumSnap":
        same = np.flatnonzero(np.linalg.norm(np.diff(self.points, axis=0), axis=1) < 1e-6)
        if same.size:
            raise ValueError(f"points {same[0]} and {same[0] + 1} are the same")
        return self

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import make_interp_spline

        points = np.array(self.points, np.float64)
        times = np.linalg.norm(np.diff(points, axis=0), axis=1)
        times[[0, -1]] *= 1.0 + np.array([0.5, 0.5])
        knots = np.concatenate([[0.0], np.cumsum(times)]) / times.sum()
        rest = [(order, np.zeros(3)) for order in (1, 2, 3)]

        def spline(scale: float) -> Any:
            return make_interp_spline(knots * scale, points, k=7, bc_type=(rest, rest))

        fine = np.linspace(0, 1, 200 * len(points) + 1)
        return spline(float(np.linalg.norm(spline(1.0)(fine, 1), axis=1).max()) / self.speed)

    @property
    def duration(self) -> float:
        """From the first point to the last [s]."""
        return float(self._spline.t[-1])

    def flat(self, t: Floats) -> Floats:
        """(5, N, 3)."""
        inside = (t >= 0) & (t <= self.duration)
        at = np.clip(t, 0, self.duration)
        out = np.stack([self._spline(at, order) for order in range(5)])
        out[1:, ~inside] = 0
        return out
