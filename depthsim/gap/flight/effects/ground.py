"""The ground, which lifts what flies close over it."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from depthsim.flight.ground_effect import GroundEffect
from depthsim.gap.flight.data.records import Records
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.effect import Candidate, FlightEffect, Parameter, Values

_REACH = 8.0
"""Rotor radii: above this no ground effect was ever measured (Sanchez-Cuevas 2017: below 5)."""
_SEEN = 0.02
"""Of the samples at least are that low."""


class NearGround(FlightEffect):
    """More lift near the ground."""

    id: ClassVar[str] = "ground_effect"
    title = "the ground effect"
    axes = ("altitude",)
    needs = ("thrust", "positions")
    most_left = 0.05  # what lies on height alone is the ground's; no other effect could be misattributed to it
    apart: ClassVar = {
        "thrust_scale": "Fly at several heights, the lowest within two rotor radii.",
        "mass": "Fly at several heights, the lowest within two rotor radii.",
    }
    rank = 80

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """By Cheeseman and Bennett with a strength, or falling off exponentially; none where no log goes that low."""
        if not _low(records, radius):
            return []

        def bennett(s: Settings, v: Values) -> Settings:
            return replace(s, ground=GroundEffect(law="cheeseman_bennett", strength=v[0], height=0.3))

        def exponential(s: Settings, v: Values) -> Settings:
            return replace(s, ground=GroundEffect(law="exponential", strength=v[0], height=max(v[1], 1e-3)))

        strength = Parameter("strength", "", 1.0, 0.3, 0.0, 20.0, neutral=0.0)
        height = Parameter("height", "m", 2 * radius, 0.1 * radius, 0.25 * radius, 0.75 * _REACH * radius)
        decay = (Parameter("strength", "", 0.1, 0.02, 0.0, 3.0, neutral=0.0), height)
        return [
            Candidate(cls.id, "cheeseman_bennett", (strength,), bennett, linear=False),
            Candidate(cls.id, "exponential", decay, exponential, linear=False),
        ]


def _low(records: Records, radius: float) -> bool:
    """Whether a log goes where there may be a ground effect; from above it a constant force would pass for one."""
    places = [part.log.position[part.rows, 2] for part in records.parts if part.log.position is not None]
    return min(float(np.quantile(place, _SEEN)) for place in places) < _REACH * radius
