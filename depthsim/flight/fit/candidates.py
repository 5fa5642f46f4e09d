"""The drag laws as linear models: the force of each coefficient at 1, the others at 0."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from depthsim.flight.drag import (
    AirsimQuadratic,
    DragLaw,
    Linear,
    NoDrag,
    RotorLinear,
    RotorLinearDifference,
    RotorLinearEach,
    RotorSqrt,
)
from depthsim.flight.fit.motion import Motion
from depthsim.flight.table import Floats
from depthsim.flight.vehicle import Vehicle


@dataclass(frozen=True)
class Candidate:
    """A law whose force is linear in its coefficients.

    names and unit: of the coefficients. make: the law from their values, all at or above 0. along: for each
    coefficient, the only body axis it acts along, or None where it acts along x and y.
    """

    name: str
    names: tuple[str, ...]
    unit: str
    make: Callable[[Sequence[float]], DragLaw]
    along: tuple[int | None, ...]

    def columns(self, motion: Motion, vehicle: Vehicle, thrusts: Floats) -> Floats:
        """(n, 3, P) low-passed specific force [m/s²] in the body, of each coefficient at 1; the air is at rest.

        thrusts: (N, K) of the rotors over the whole log [N].
        """
        forces = [
            self.make(unit).force(vehicle, motion.velocity, motion.log.rates, thrusts)
            for unit in np.eye(len(self.names)).tolist()
        ]
        shape = (len(motion.log), 3, len(self.names))
        return motion.smooth(np.stack(forces, axis=-1) / vehicle.mass) if forces else np.zeros(shape)[motion.airborne]


def _axes(stem: str) -> tuple[str, str, str]:
    return f"{stem}x", f"{stem}y", f"{stem}z"


def _per_axis(law: type[DragLaw], key: str) -> Callable[[Sequence[float]], DragLaw]:
    return lambda values: law.model_validate({key: tuple(values)})


def _one(law: type[DragLaw]) -> Callable[[Sequence[float]], DragLaw]:
    return lambda values: law.model_validate({"c_d1": values[0]})


CANDIDATES = (
    Candidate("none", (), "", lambda _: NoDrag(), ()),
    Candidate("linear", _axes("D"), "N s/m", _per_axis(Linear, "D"), (0, 1, 2)),
    Candidate("rotor_linear", ("c_d1",), "√N s/m", _one(RotorLinear), (None,)),
    Candidate("rotor_linear_difference", ("c_d1",), "√N s/m", _one(RotorLinearDifference), (None,)),
    Candidate("rotor_linear_each", ("c_d1",), "√N s/m", _one(RotorLinearEach), (None,)),
    Candidate("rotor_sqrt", ("c_d1",), "√N s/m", _one(RotorSqrt), (None,)),
    Candidate("airsim_quadratic", _axes("A"), "m²", _per_axis(AirsimQuadratic, "area"), (0, 1, 2)),
)
"""In the order in which a tie is broken: the ones that need to know less come first."""
