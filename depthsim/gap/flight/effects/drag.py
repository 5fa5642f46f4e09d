"""The forces of the air: drag of the rotors and of the body, and damping of climbs."""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from depthsim.flight.constants import AIR_DENSITY, GRAVITY
from depthsim.flight.drag import BODY_QUADRATIC, LINEAR, QUADRATIC, ROTOR_SQRT
from depthsim.gap.flight.data.records import Records
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.effect import Candidate, FlightEffect, Parameter, Values

_DRAG = "N s/m"
_HALF_RHO = 0.5 * AIR_DENSITY
_STRONGEST = 5.0
"""[1/s] drag over mass and speed; a quadrotor's is 0.1 to 0.6, and a fit must not wander off to where it overflows."""
_BLUNTEST = 2.0
"""[m²/kg] drag area over mass; a quadrotor's is 0.01 to 0.1."""


class RotorDrag(FlightEffect):
    """In proportion to the airspeed in the rotors' plane."""

    id: ClassVar[str] = "rotor_drag"
    title = "drag of the rotors"
    axes = ("speed", "airspeed_direction")
    family = "drag"
    apart: ClassVar = {
        "body_drag_quadratic": "Fly the same path at two speeds or more: one force grows with the speed, the "
        "other with its square."
    }
    rank = 10

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """With the root of the thrust or without."""
        code, now = base.laws.get("rotor", (ROTOR_SQRT, (0.0, 0.0, 0.0)))
        strength = float(np.sqrt(len(base.scales) * base.mass * GRAVITY))
        if code == LINEAR:
            lateral = 0.5 * (now[0] + now[1])
            rotor = lateral / strength
        else:
            rotor = now[0]
            lateral = rotor * strength
        along = (now[0], now[1]) if code == LINEAR else (lateral, lateral)
        c, d = 0.02 * 4 / strength, 0.05

        def sqrt(s: Settings, v: Values) -> Settings:
            return s.with_law("rotor", (ROTOR_SQRT, (v[0], 0.0, 0.0)))

        def both(s: Settings, v: Values) -> Settings:
            return s.with_law("rotor", (LINEAR, (v[0], v[0], 0.0)))

        def each(s: Settings, v: Values) -> Settings:
            return s.with_law("rotor", (LINEAR, (v[0], v[1], 0.0)))

        high = _STRONGEST * base.mass
        apart = tuple(
            Parameter(f"D_{name}", _DRAG, start, d, 0.0, high, spare=True)
            for name, start in zip("xy", along, strict=True)
        )
        return [
            Candidate(cls.id, "rotor_sqrt", (Parameter("c_d1", "√N s/m", rotor, c, 0.0, high / strength),), sqrt),
            Candidate(cls.id, "linear", (Parameter("D", _DRAG, lateral, d, 0.0, high),), both),
            Candidate(cls.id, "linear, x and y", apart, each),
        ]


class BodyDragQuadratic(FlightEffect):
    """With the square of the airspeed."""

    id: ClassVar[str] = "body_drag_quadratic"
    title = "drag of the body, with the square of the speed"
    axes = ("speed", "airspeed_direction")
    family = "drag"
    rank = 20

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """Along the air, face by face, and both."""
        code, now = base.laws.get("body", (BODY_QUADRATIC, (0.0, 0.0, 0.0)))
        a = [value / _HALF_RHO for value in now]
        mean, high = sum(a) / 3, _BLUNTEST * base.mass

        def candidate(name: str, code: int, starts: Sequence[float], places: tuple[int, int, int]) -> Candidate:
            names = {1: ("A",), 2: ("A_xy", "A_z"), 3: ("A_x", "A_y", "A_z")}[len(starts)]

            def apply(s: Settings, v: Values) -> Settings:
                c = tuple(_HALF_RHO * v[place] for place in places)
                return s.with_law("body", (code, (c[0], c[1], c[2])))

            parameters = tuple(
                Parameter(each, "m²", start, 0.01, 0.0, high, spare=True)
                for each, start in zip(names, starts, strict=True)
            )
            return Candidate(cls.id, name, parameters, apply)

        def mixed(s: Settings, v: Values) -> Settings:
            c = [_HALF_RHO * value for value in v]
            return s.with_law("body", (BODY_QUADRATIC, (c[0], c[0], c[1]))).with_law(
                "box", (QUADRATIC, (c[2], c[2], c[3]))
            )

        level = 0.5 * (a[0] + a[1])
        both = [Parameter(name, "m²", 0.0, 0.01, 0.0, high, spare=True) for name in ("A_xy", "A_z", "box_xy", "box_z")]
        first = 0 if code == BODY_QUADRATIC else 2
        both[first], both[first + 1] = replace(both[first], start=level), replace(both[first + 1], start=a[2])
        return [
            candidate("round body", BODY_QUADRATIC, [mean], (0, 0, 0)),
            candidate("round body, z apart", BODY_QUADRATIC, [level, a[2]], (0, 0, 1)),
            candidate("box", QUADRATIC, [level, a[2]], (0, 0, 1)),
            candidate("box, each axis", QUADRATIC, a, (0, 1, 2)),
            candidate("round body, each axis", BODY_QUADRATIC, a, (0, 1, 2)),
            Candidate(cls.id, "round body and box", tuple(both), mixed),
        ]


class VerticalDamping(FlightEffect):
    """Against climbs and descents alone."""

    id: ClassVar[str] = "vertical_damping"
    title = "damping of climb and descent"
    axes = ("speed", "airspeed_direction")
    family = "drag"
    needs = ("thrust",)
    apart: ClassVar = {"body_drag_quadratic": "Climb and sink at two rates or more."}
    rank = 70

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """Linear, with the thrust (a rotor's inflow), with the square, and mixed."""
        code, now = base.laws.get("vertical", (LINEAR, (0.0, 0.0, 0.0)))
        starts = (now[2], 0.0) if code == LINEAR else (0.0, now[2] / _HALF_RHO)
        linear = Parameter("D_z", _DRAG, starts[0], 0.05, 0.0, 2 * _STRONGEST * base.mass, spare=True)
        square = Parameter("A_z", "m²", starts[1], 0.01, 0.0, 2 * _BLUNTEST * base.mass, spare=True)

        def first(s: Settings, v: Values) -> Settings:
            return s.with_law("vertical", (LINEAR, (0.0, 0.0, v[0])))

        def second(s: Settings, v: Values) -> Settings:
            return s.with_law("vertical", (QUADRATIC, (0.0, 0.0, _HALF_RHO * v[0])))

        def both(s: Settings, v: Values) -> Settings:
            return first(s, v).with_law("face", (QUADRATIC, (0.0, 0.0, _HALF_RHO * v[1])))

        inflow = Parameter("inflow", "s/m", base.inflow, 0.005, 0.0, 2 * _STRONGEST / GRAVITY)
        return [
            Candidate(cls.id, "linear", (linear,), first),
            Candidate(cls.id, "with the thrust", (inflow,), lambda s, v: replace(s, inflow=v[0])),
            Candidate(cls.id, "square", (square,), second),
            Candidate(cls.id, "linear and square", (linear, square), both),
        ]
