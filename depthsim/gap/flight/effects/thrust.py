"""Thrust that is not what the log says: more or less of it, or late; and the mass that it lifts."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from depthsim.gap.flight.data.records import Records
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.effect import Candidate, FlightEffect, Parameter, Values


class ThrustScale(FlightEffect):
    """More or less thrust than the log says, or thrust that fades."""

    id: ClassVar[str] = "thrust_scale"
    title = "more or less thrust than logged"
    axes = ("thrust", "axis")
    family = "scale"
    needs = ("newtons",)
    apart: ClassVar = {
        "mass": "Weigh the vehicle, or fly fast as well: mass divides the drag, a thrust scale does not."
    }
    rank = 50

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """In proportion, by newtons, by both, or fading as the battery empties."""
        rotor = float(np.mean([part.thrusts[part.rows].mean() for part in records.parts]))
        offset = Parameter("offset", "N", base.offset, 0.01 * rotor, -0.7 * rotor, 0.7 * rotor, spare=True)
        scale = Parameter("scale", "", 1.0, 0.01, 0.3, 3.0, spare=True)
        loss = Parameter("loss", "1/s", 0.0, 1e-3, -0.01, 0.01, spare=True)

        def fading(s: Settings, v: Values) -> Settings:
            return replace(_scale(s, v), fade=s.fade + v[1] / v[0])

        return [
            Candidate(cls.id, "scale", (scale,), _scale),
            Candidate(cls.id, "offset", (offset,), lambda s, v: replace(s, offset=v[0])),
            Candidate(
                cls.id,
                "scale and offset",
                (scale, offset),
                lambda s, v: replace(_scale(s, v), offset=v[1]),
                linear=False,
            ),
            Candidate(cls.id, "fading", (scale, loss), fading),
        ]


class Mass(FlightEffect):
    """Another mass than the vehicle's file has."""

    id: ClassVar[str] = "mass"
    title = "another mass"
    axes = ("thrust", "axis")
    family = "scale"
    needs = ("newtons",)
    recording = "Weigh the vehicle."
    rank = 55

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """The mass itself."""
        mass = Parameter("mass", "kg", base.mass, 0.01 * base.mass, 0.3 * base.mass, 3 * base.mass)
        return [Candidate(cls.id, "mass", (mass,), lambda s, v: replace(s, mass=v[0]), linear=False)]


class ThrustLag(FlightEffect):
    """Thrust that comes after what the log says."""

    id: ClassVar[str] = "thrust_lag"
    title = "thrust that lags behind the log"
    axes = ("thrust", "acceleration", "angular_rate")
    needs = ("thrust",)
    apart: ClassVar = {
        "log_time_offset": "Step the thrust sharply, as in hops: a lag rounds the edges, an offset only moves them."
    }
    rank = 60

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """As of first order, as a dead time, and both."""
        lag = Parameter("time_constant", "s", 0.03, 0.003, 1e-3, 0.5, neutral=1e-3)
        late = Parameter("dead_time", "s", 0.03, 0.003, 1e-3, 0.3, neutral=1e-3)
        dead = Parameter("dead_share", "", 0.3, 0.1, 0.0, 1.0, shape=True, neutral=0.0, spare=True)
        return [
            Candidate(cls.id, "first order", (lag,), _lag, linear=False),
            Candidate(cls.id, "dead time", (late,), _dead, linear=False),
            Candidate(cls.id, "first order and dead time", (lag, dead), _lag_and_dead, linear=False),
        ]


def _scale(s: Settings, v: Values) -> Settings:
    return replace(s, scales=tuple(scale * v[0] for scale in s.scales))


def _lag(s: Settings, v: Values) -> Settings:
    return replace(s, lag=max(v[0], 0.0))


def _dead(s: Settings, v: Values) -> Settings:
    return replace(s, delays={**s.delays, "thrust": s.delays.get("thrust", 0.0) + v[0]})


def _lag_and_dead(s: Settings, v: Values) -> Settings:
    """Lags of higher order begin like a dead time; it is a share of the time constant at most as long."""
    return replace(_lag(s, v), delays={**s.delays, "thrust": s.delays.get("thrust", 0.0) + v[0] * v[1]})
