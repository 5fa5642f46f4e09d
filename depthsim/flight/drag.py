"""The drag laws of the paper, and AirSim's: one small class each, found by the ``law:`` of vehicle.yaml.

v is the airspeed in the body frame, Rᵀ(V - wind); Π_e3 = diag(1, 1, 0) keeps what lies in the rotors' plane; d_i is
where rotor i sits, T_i its thrust, T the sum, n the number of rotors, and v_i = v + ω × d_i the rotor's own airspeed.

√T ≈ kT + b. The paper gives neither k nor b nor c_d1; c_d1 stands in vehicle.yaml, and k and b, where they are not
given, follow from the vehicle: they are the tangent of √T at hover. One rotor carries T0 = mg/n there, and

    √T_i ≈ √T0 + (T_i - T0) / (2 √T0) = k T_i + √T0 / 2    with    k = 1 / (2 √T0) = √n / (2 √(mg)).

Summed over the rotors that is kT + b with b = n √T0 / 2 = √(n mg) / 2. So k is the same for one rotor and for all of
them together, and b is the sum over the rotors; for four of them k = 1/√(mg) and b = √(mg).
"""

import math
from abc import ABC, abstractmethod
from typing import Annotated, ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from depthsim.flight.constants import AIR_DENSITY, GRAVITY
from depthsim.kernels import inlined, kernel

Floats = NDArray[np.float64]
Coefficient = Annotated[FiniteFloat, Field(ge=0)]
PerAxis = tuple[Coefficient, Coefficient, Coefficient]

(
    NONE,
    LINEAR,
    QUADRATIC,
    ROTOR_SQRT,
    ROTOR_EACH,
    ROTOR_DIFFERENCE,
    ROTOR_LUMPED,
    BODY_QUADRATIC,
    THRUST_DIFFERENCE,
) = range(9)
"""The laws as the kernel knows them."""


class Airframe(Protocol):
    """What a law needs to know of the vehicle."""

    @property
    def mass(self) -> float: ...  # noqa: D102
    @property
    def rotor_positions(self) -> Floats: ...  # noqa: D102


class DragLaw(BaseModel, ABC):
    """A law of the air's force on the vehicle."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    equation: ClassVar[str]
    """The number in the paper."""
    code: ClassVar[int]

    @abstractmethod
    def parameters(self, airframe: Airframe) -> Floats:
        """(3,) what the kernel needs."""

    def force(self, airframe: Airframe, airspeed: Floats, rates: Floats, thrusts: Floats) -> Floats:
        """(N, 3) force in the body frame [N].

        airspeed: (N, 3) in the body frame [m/s]. rates: (N, 3) [rad/s]. thrusts: (N, K) of the rotors [N]; a log that
        has only the sum gives it in equal parts.
        """
        return drag_force(self.code, self.parameters(airframe), airframe.rotor_positions, airspeed, rates, thrusts)


class NoDrag(DragLaw):
    """No force at all."""

    equation = "-"
    code = NONE
    law: Literal["none"] = "none"

    def parameters(self, airframe: Airframe) -> Floats:
        """Nothing."""
        return np.zeros(3)


class Linear(DragLaw):
    """Eq. 5, AirSim as the paper writes it: F = -D Rᵀ(V - wind)."""

    equation = "5"
    code = LINEAR
    law: Literal["linear"] = "linear"
    D: PerAxis = Field(description="along body x, y, z [N/(m/s)]")

    def parameters(self, airframe: Airframe) -> Floats:
        """D."""
        return np.array(self.D, dtype=np.float64)


class AirsimQuadratic(DragLaw):
    """AirSim as its code is: each face of a box feels -½ ρ C A |v_i| v_i.

    Source: AirSim, MultiRotorPhysicsBody.hpp, createDragVertices (area · linear_drag_coefficient / 2), and
    FastPhysicsEngine.hpp, getDragWrench (times air density and the square of the speed along the face's normal). In
    spite of its name the coefficient's law is quadratic. Left out are the moment of the faces in a turning vehicle, and
    AirSim's own leaving out of what is slower than 0.1 m/s.
    """

    equation = "AirSim's code"
    code = QUADRATIC
    law: Literal["airsim_quadratic"] = "airsim_quadratic"
    area: PerAxis = Field(description="of the faces across body x, y, z [m²]")
    coefficient: Coefficient = Field(1.3 / 4, description="AirSim's linear_drag_coefficient")
    density: Coefficient = Field(AIR_DENSITY, description="of the air [kg/m³]")

    def parameters(self, airframe: Airframe) -> Floats:
        """½ ρ C A for each axis."""
        return 0.5 * self.density * self.coefficient * np.array(self.area, dtype=np.float64)


class BodyQuadratic(DragLaw):
    """Drag of a blunt body: F = -½ ρ A |v| v, A an area for each body axis, |v| the whole airspeed.

    Unlike the box of ``airsim_quadratic`` the force of a round body is along the air that comes at it.
    Source: the drag equation with the areas C_d A lumped, as in Kai, Allibert, Hua and Hamel 2017 (IFAC).
    """

    equation = "-"
    code = BODY_QUADRATIC
    law: Literal["body_quadratic"] = "body_quadratic"
    area: PerAxis = Field(description="C_d A along body x, y, z [m²]")
    density: Coefficient = Field(AIR_DENSITY, description="of the air [kg/m³]")

    def parameters(self, airframe: Airframe) -> Floats:
        """½ ρ A for each axis."""
        return 0.5 * self.density * np.array(self.area, dtype=np.float64)


class RotorSqrt(DragLaw):
    """Eq. 6, exact: F = -Σ √T_i c_d1 Π_e3 v_i, each rotor's part at its place, so that turning is damped too."""

    equation = "6"
    code = ROTOR_SQRT
    law: Literal["rotor_sqrt"] = "rotor_sqrt"
    c_d1: Coefficient = Field(description="[√N s/m]")

    def parameters(self, airframe: Airframe) -> Floats:
        """c_d1."""
        return np.array([self.c_d1, 0.0, 0.0])


class _Linearised(DragLaw):
    """√T as kT + b; see the head of this file."""

    c_d1: Coefficient = Field(description="[√N s/m]")
    k: Coefficient | None = Field(None, description="slope of √T over T [1/√N]; of hover if not given")
    b: Coefficient | None = Field(None, description="its offset, all rotors together [√N]; of hover if not given")

    def parameters(self, airframe: Airframe) -> Floats:
        """c_d1, k, b."""
        k, b = hover_tangent(airframe.mass, len(airframe.rotor_positions))
        return np.array([self.c_d1, k if self.k is None else self.k, b if self.b is None else self.b])


class RotorLinearEach(_Linearised):
    """Eq. 8 to 11: F = -Σ (k T_i + b/n) c_d1 Π_e3 v_i, each rotor's part at its place."""

    equation = "8 to 11"
    code = ROTOR_EACH
    law: Literal["rotor_linear_each"] = "rotor_linear_each"


class RotorLinearDifference(_Linearised):
    """Eq. 12, one force with the thrust difference kept: F = -c_d1 Π_e3 ((kT + b) v + k ω × Σ T_i d_i).

    It is the sum of Eq. 8 to 11 where the rotors' places add up to zero, without their moment.
    """

    equation = "12"
    code = ROTOR_DIFFERENCE
    law: Literal["rotor_linear_difference"] = "rotor_linear_difference"


class RotorLinear(_Linearised):
    """Eq. 13, the paper's final law: F = -(kT + b) c_d1 Π_e3 v."""

    equation = "13"
    code = ROTOR_LUMPED
    law: Literal["rotor_linear"] = "rotor_linear"


class ThrustDifference(DragLaw):
    """What Eq. 12 has beyond Eq. 13, alone: F = -c Π_e3 (ω × Σ T_i d_i), from rotors that push unevenly in a turn."""

    equation = "12 less 13"
    code = THRUST_DIFFERENCE
    law: Literal["thrust_difference"] = "thrust_difference"
    c: FiniteFloat = Field(description="c_d1 k of Eq. 12 [s/m]")

    def parameters(self, airframe: Airframe) -> Floats:
        """c."""
        return np.array([self.c, 0.0, 0.0])


AnyDragLaw = Annotated[
    NoDrag
    | Linear
    | AirsimQuadratic
    | BodyQuadratic
    | RotorSqrt
    | RotorLinear
    | RotorLinearEach
    | RotorLinearDifference
    | ThrustDifference,
    Field(discriminator="law"),
]
LAWS: dict[str, type[DragLaw]] = {
    law.model_fields["law"].default: law
    for law in (
        NoDrag,
        Linear,
        AirsimQuadratic,
        BodyQuadratic,
        RotorSqrt,
        RotorLinearEach,
        RotorLinearDifference,
        RotorLinear,
        ThrustDifference,
    )
}


def drag_force(
    code: int, parameters: Floats, places: Floats, airspeed: Floats, rates: Floats, thrusts: Floats
) -> Floats:
    """(N, 3) force of a law by its code and parameters, of any sign; the rest as in :meth:`DragLaw.force`.

    places: (K, 3) of the rotors in the body [m].
    """
    out = np.empty((len(airspeed), 3))
    c, v, w, t = (np.ascontiguousarray(item, np.float64) for item in (parameters, airspeed, rates, thrusts))
    _forces(code, c, places, v, w, t, out)
    return out


def hover_tangent(mass: float, rotors: int) -> tuple[float, float]:
    """k [1/√N] and b [√N, all rotors together] of the tangent of √T at hover; see the head of this file."""
    weight = mass * GRAVITY
    return math.sqrt(rotors / weight) / 2, math.sqrt(rotors * weight) / 2


@inlined
def drag(law, c0, c1, c2, places, vx, vy, vz, wx, wy, wz, thrusts, first):  # noqa: ANN201 - numba
    """A law's force along body x, y, z and its moment about them.

    thrusts: an array that has the rotors' from place ``first`` on. A view of them would cost more than the law, and so
    would arrays for the results: numba counts the references to each.
    """
    fx, fy, fz, mx, my, mz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if law == LINEAR:
        fx, fy, fz = -c0 * vx, -c1 * vy, -c2 * vz
    elif law == QUADRATIC:
        fx, fy, fz = -c0 * abs(vx) * vx, -c1 * abs(vy) * vy, -c2 * abs(vz) * vz
    elif law == BODY_QUADRATIC:
        speed = math.sqrt(vx * vx + vy * vy + vz * vz)
        fx, fy, fz = -c0 * speed * vx, -c1 * speed * vy, -c2 * speed * vz
    elif law in (ROTOR_SQRT, ROTOR_EACH):
        rotors = places.shape[0]
        for rotor in range(rotors):
            thrust, x, y, z = max(thrusts[first + rotor], 0.0), places[rotor, 0], places[rotor, 1], places[rotor, 2]
            strength = math.sqrt(thrust) if law == ROTOR_SQRT else c1 * thrust + c2 / rotors
            px = -c0 * strength * (vx + wy * z - wz * y)
            py = -c0 * strength * (vy + wz * x - wx * z)
            fx += px
            fy += py
            mx -= z * py
            my += z * px
            mz += x * py - y * px
    elif law in (ROTOR_DIFFERENCE, ROTOR_LUMPED, THRUST_DIFFERENCE):
        total, x, y, z = 0.0, 0.0, 0.0, 0.0
        for rotor in range(places.shape[0]):
            thrust = thrusts[first + rotor]
            total += thrust
            x += thrust * places[rotor, 0]
            y += thrust * places[rotor, 1]
            z += thrust * places[rotor, 2]
        strength, turn = c1 * total + c2, c1 if law == ROTOR_DIFFERENCE else 0.0
        if law == THRUST_DIFFERENCE:
            strength, turn = 0.0, 1.0
        fx = -c0 * (strength * vx + turn * (wy * z - wz * y))
        fy = -c0 * (strength * vy + turn * (wz * x - wx * z))
    return fx, fy, fz, mx, my, mz


@kernel
def drag_slopes(law, c, rotors, v, thrust):  # noqa: ANN201 - numba
    """The force over -v along body x, y, z [N/(m/s)], the thrust in equal parts and the vehicle not turning."""
    if law == LINEAR:
        return c[0], c[1], c[2]
    if law == QUADRATIC:
        return c[0] * abs(v[0]), c[1] * abs(v[1]), c[2] * abs(v[2])
    if law == BODY_QUADRATIC:
        speed = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        return c[0] * speed, c[1] * speed, c[2] * speed
    slope = 0.0
    if law == ROTOR_SQRT:
        slope = c[0] * math.sqrt(rotors * max(thrust, 0.0))
    elif law in (ROTOR_EACH, ROTOR_DIFFERENCE, ROTOR_LUMPED):
        slope = c[0] * (c[1] * thrust + c[2])
    return slope, slope, 0.0


@kernel
def _forces(law, c, places, v, w, thrusts, out):
    c0, c1, c2, rotors = c[0], c[1], c[2], len(places)
    flat = thrusts.ravel()
    for n in range(len(v)):
        vx, vy, vz, wx, wy, wz = v[n, 0], v[n, 1], v[n, 2], w[n, 0], w[n, 1], w[n, 2]
        fx, fy, fz, _, _, _ = drag(law, c0, c1, c2, places, vx, vy, vz, wx, wy, wz, flat, n * rotors)
        out[n, 0], out[n, 1], out[n, 2] = fx, fy, fz
