"""Rotors that push unevenly."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from depthsim.flight.drag import THRUST_DIFFERENCE
from depthsim.gap.flight.data.records import Records
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.effect import Candidate, FlightEffect, Parameter, Values

UNEVEN, EACH = "rotors uneven as logged", "each rotor"
_EVEN = 0.01
"""Of the mean thrust: rotors that differ by less are alike."""


class RotorThrustDifference(FlightEffect):
    """Rotors that push unevenly."""

    id: ClassVar[str] = "rotor_thrust_difference"
    title = "rotors that push unevenly"
    axes = ("thrust", "axis", "angular_rate")
    family = "rotors"
    needs = ("rotors",)
    apart: ClassVar = {
        "thrust_scale": "Log each rotor's thrust in fast turns about all axes.",
        "mass": "Weigh the vehicle, and log each rotor's thrust.",
    }
    rank = 99

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """Eq. 12 less Eq. 13 of the paper, rotors as uneven as their logged thrusts, and each its own."""

        def turning(s: Settings, v: Values) -> Settings:
            return s.with_law("difference", (THRUST_DIFFERENCE, (v[0], 0.0, 0.0)))

        found = [Candidate(cls.id, "thrust_difference", (Parameter("c", "s/m", 0.0, 0.02),), turning)]
        logged = logged_shares(records)
        if logged is not None:

            def each(s: Settings, v: Values) -> Settings:
                return replace(s, scales=tuple(scale * v[0] / one for scale, one in zip(s.scales, logged, strict=True)))

            found.append(Candidate(cls.id, UNEVEN, (Parameter("level", "", 1.0, 0.01, 0.3, 3.0),), each))

        def own(s: Settings, v: Values) -> Settings:
            return replace(s, scales=tuple(scale * one for scale, one in zip(s.scales, v, strict=True)))

        rotors = tuple(Parameter(f"rotor {n}", "", 1.0, 0.01, 0.3, 3.0) for n in range(1, len(base.scales) + 1))
        return [*found, Candidate(cls.id, EACH, rotors, own)]


def logged_shares(records: Records) -> list[float] | None:
    """The thrust that the log has of each rotor over the mean one's; None where all are alike.

    Over a flight that does not tumble the moments add up to nothing, so rotors on a circle push alike on average. Where
    the log has them differ for good, they are made otherwise than the log believes, in inverse proportion; how much
    they push together, moments do not say.
    """
    found = []
    for part in records.parts:
        thrusts = part.thrusts[part.rows]
        shares = thrusts / thrusts.mean(axis=1, keepdims=True)
        pieces = np.array_split(shares, max(round(part.seconds / 2.5), 3))
        found.append(np.array([piece.mean(axis=0) for piece in pieces]))
    blocks = np.concatenate(found)
    mean = blocks.mean(axis=0)
    error = blocks.std(axis=0, ddof=1) / np.sqrt(len(blocks))
    sure = (np.abs(mean - 1) > 4 * error + _EVEN).any()
    return mean.tolist() if sure else None
