"""Errors of the recording: an accelerometer with a bias or mounted turned, and clocks that differ."""

from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.flight.data.records import ACCELEROMETER, Records
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.effect import Candidate, FlightEffect, Parameter, Values

_KNOTS = 10.0
"""[s] between knots of a bias that wanders."""
_MOST_KNOTS = 45
"""Numbers of such a bias in all; with more logs it costs more than it is worth."""


class ImuBias(FlightEffect):
    """A bias of the accelerometer, each log's own."""

    id: ClassVar[str] = "imu_bias"
    title = "a bias of the accelerometer"
    axes = ("axis", "time")
    family = "sensor"
    needs = ("accelerometer",)
    apart: ClassVar = {
        "imu_misalignment": "Climb and brake hard, so that the thrust changes: a turned sensor's error goes with it, "
        "a bias does not.",
        "constant_wind": "Turn on the spot: the wind's force turns against the body, a bias does not.",
        "thrust_scale": "Fly hops: a scale grows with the thrust, a bias does not.",
        "mass": "Weigh the vehicle, or fly hops: a wrong mass grows with the thrust.",
    }
    rank = 90

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """Constant, drifting in a straight line, and wandering between knots."""

        def candidate(name: str, knots: int) -> Candidate:
            names = [
                f"{axis}{file or ''} {knot}" for file in range(base.files) for knot in range(knots) for axis in "xyz"
            ]
            parameters = tuple(Parameter(name, "m/s²", 0.0, 0.1) for name in names)
            return Candidate(cls.id, name, parameters, _with_bias, columns=_columns, named=_named)

        found = [candidate("constant", 1), candidate("straight line in time", 2)]
        knots = max(round(max(base.seconds) / _KNOTS) + 1, 3)
        if 3 * knots * base.files <= _MOST_KNOTS:
            found.append(candidate("wandering", knots))
        return found


class ImuMisalignment(FlightEffect):
    """An accelerometer mounted turned."""

    id: ClassVar[str] = "imu_misalignment"
    title = "an accelerometer mounted turned"
    axes = ("axis", "thrust", "acceleration")
    family = "sensor"
    needs = ("accelerometer",)
    apart: ClassVar = {
        "constant_wind": "Turn on the spot: the wind's force turns against the body, a sensor's error does not."
    }
    rank = 95

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """A small rotation."""
        turn = tuple(Parameter(axis, "rad", 0.0, 0.01, -0.5, 0.5) for axis in "xyz")
        return [Candidate(cls.id, "small rotation", turn, lambda s, v: replace(s, rotation=(v[0], v[1], v[2])))]


class LogTimeOffset(FlightEffect):
    """Stamps that are late."""

    id: ClassVar[str] = "log_time_offset"
    title = "stamps that are late"
    axes = ("thrust", "acceleration", "angular_rate")
    rank = 97

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """The accelerometer late, both it and the thrust, or the thrust; those that the logs have."""
        imu, thrust = records.channels[0] == ACCELEROMETER, not records.lacks(("thrust",))
        there = {"accelerometer": imu, "recorder": imu and thrust, "thrust": thrust}
        return [_offset(cls.id, late) for late, known in there.items() if known]


def _offset(effect: str, late: str) -> Candidate:
    def apply(s: Settings, v: Values) -> Settings:
        return replace(s, delays={**s.delays, late: v[0]})

    parameter = Parameter("seconds", "s", 0.0, 0.01, -0.5, 0.5)
    return Candidate(effect, f"{late} late", (parameter,), apply, linear=False)


def _with_bias(s: Settings, v: Values) -> Settings:
    return replace(s, bias=tuple(v))


def _columns(records: Records, out: Floats) -> Floats:
    out[:] = 0.0
    knots = out.shape[-1] // (3 * len(records.files))
    at = 0
    for part in records.parts:
        hats = part.hats(knots)
        for axis, body in enumerate(records.axes):
            first = 3 * knots * part.file + body
            out[at : at + len(part), 0, axis, first : first + 3 * knots : 3] = hats
        at += len(part)
    return out


def _named(values: Values, records: Records, base: Settings) -> dict[str, list[float]]:
    """A list for each log and each time that biases are given at."""
    biases = np.reshape(values, (len(records.files), -1, 3))
    knots = biases.shape[1]
    found = {}
    for name, seconds, log in zip(records.files, base.seconds, biases, strict=True):
        for at, bias in zip(np.linspace(0, seconds, knots), log, strict=True):
            when = f" at {at:.0f} s" if knots > 1 else ""
            whose = f", {Path(name).name}" if len(biases) > 1 else ""
            found[f"bias{when}{whose}"] = bias.tolist()
    return found
