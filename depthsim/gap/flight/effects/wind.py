"""Winds: one that lasts, and one that gusts."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from depthsim.gap.flight.data.records import Records
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.effect import Candidate, FlightEffect, Parameter, Values

_STORM = 40.0
"""[m/s]"""


class ConstantWind(FlightEffect):
    """A level wind that lasts."""

    id: ClassVar[str] = "constant_wind"
    title = "a constant wind"
    axes = ("airspeed_direction", "axis", "place", "speed")
    family = "wind"
    most_left = 0.15  # hardly any wind is steady: what swings about its mean is left, and is no other effect's
    recording = "Fly again in still air, or give the wind that was measured."
    rank = 30

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """A level wind, the same everywhere or by the power law of the height; x and y are it at the median height."""
        found, level = [cls.level()], cls.level().parameters
        places = [part.log.position[part.rows, 2] for part in records.parts if part.log.position is not None]
        if len(places) < len(records.parts) or base.shear is not None:
            return found
        middle = max(float(np.median(np.concatenate(places))), 0.1)

        def sheared(s: Settings, v: Values) -> Settings:
            return replace(_wind(s, v), shear=(middle, v[2]))

        exponent = Parameter("exponent", "", 1 / 7, 0.05, 0.0, 1.0, shape=True, neutral=0.0, spare=True)
        return [*found, Candidate(cls.id, "growing with height", (*level, exponent), sheared, linear=False)]

    @classmethod
    def level(cls) -> Candidate:
        """The same everywhere."""
        level = tuple(Parameter(name, "m/s", 0.0, 0.2, -_STORM, _STORM) for name in "xy")
        return Candidate(cls.id, "level", level, _wind)


class GustingWind(FlightEffect):
    """A wind that changes in time. It is no candidate: gap/flight/fit/series.py fits it at knots in time."""

    id: ClassVar[str] = "gusting_wind"
    title = "a wind that gusts"
    axes = ("time",)
    family = "wind"
    recording = "Fly again in still air: what is left then is not the wind."
    rank = 40

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """None."""
        return []


def _wind(s: Settings, v: Values) -> Settings:
    return replace(s, wind=(s.wind[0] + v[0], s.wind[1] + v[1], s.wind[2]))
