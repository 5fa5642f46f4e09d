"""A multirotor: vehicle.yaml of docs/formats.md."""

from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from depthsim.errors import InputError
from depthsim.flight.constants import GRAVITY
from depthsim.flight.drag import AnyDragLaw, Floats
from depthsim.flight.ground_effect import GroundEffect
from depthsim.flight.measurement import Measurement
from depthsim.flight.wind import WindWithoutFile
from depthsim.yamlfile import read_model

_FOLDER = Path(__file__).with_name("vehicles")

Positive = Annotated[FiniteFloat, Field(gt=0)]
Vector = tuple[FiniteFloat, FiniteFloat, FiniteFloat]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Rotors(_Part):
    """Rotors of one kind, evenly around the centre of mass, their axes along body z.

    Rotor 1 is at ``first_angle`` from forward, seen from above counter-clockwise, and the others follow that way: for
    the default X of four, front left, rear left, rear right, front right. Every second one turns the other way.
    """

    count: int = Field(4, ge=4, le=12, multiple_of=2, description="how many")
    arm: Positive = Field(description="from the centre of mass to each [m]")
    radius: Positive = Field(description="of a propeller [m]")
    motor_time_constant: FiniteFloat = Field(ge=0, description="of the thrust, first order [s]; 0 is none")
    first_angle: FiniteFloat = Field(45, description="of the first rotor from forward [deg]")
    torque_ratio: Positive = Field(0.016, description="reaction torque over thrust, C_m / C_t [m]")
    thrust_coefficient: Positive | None = Field(None, description="C_t: thrust over speed squared [N/(rad/s)²]")
    max_thrust: Positive | None = Field(None, description="of one rotor [N]; that of twice the weight if not given")
    min_thrust: FiniteFloat = Field(0, ge=0, description="of one rotor [N]")
    thrust_scale: Positive | tuple[Positive, ...] = Field(
        1.0, description="thrust over what was commanded and logged; one number, or one a rotor"
    )

    @property
    def scales(self) -> tuple[float, ...]:
        """``thrust_scale`` of each."""
        return self.thrust_scale if isinstance(self.thrust_scale, tuple) else (self.thrust_scale,) * self.count


class ThrustCurve(_Part):
    """Thrust of one rotor from what a log has of it: Σ coefficients[i] · (input / full_scale)^i [N]."""

    input: str = Field("pwm", pattern="^(pwm|speed)$", description="pwm, or speed [rad/s]")
    full_scale: Positive = Field(65535, description="the input that counts as 1")
    coefficients: tuple[FiniteFloat, ...] = Field(min_length=1, max_length=6, description="[N]")


class Mount(_Part):
    """Where the camera sits. With both angles 0 it looks forward along body x, level."""

    position: Vector = Field((0.0, 0.0, 0.0), description="of the left imager in the body frame [m]")
    pitch: FiniteFloat = Field(0, ge=-90, le=90, description="above forward [deg], negative looks down")
    yaw: FiniteFloat = Field(0, description="to the left of forward [deg]")


class Tuning(_Part):
    """How fast the controller is; gains follow from these and the vehicle's mass and inertia."""

    position: Positive = Field(description="natural frequency of the position loop [rad/s]")
    attitude: Positive = Field(description="natural frequency of the attitude loop [rad/s]")
    damping: Positive = Field(0.9, description="of both")


class Vehicle(_Part):
    """A multirotor. Body frame: x forward, y left, z up, origin at the centre of mass."""

    name: str
    mass: Positive = Field(description="[kg]")
    inertia: tuple[Positive, Positive, Positive] = Field(description="about body x, y, z [kg m²]")
    rotors: Rotors
    drag: AnyDragLaw
    more_drag: tuple[AnyDragLaw, ...] = Field((), description="forces of the air besides ``drag``")
    ground_effect: GroundEffect | None = Field(None, description="over level ground at z = 0")
    measurement: Measurement = Field(
        default_factory=lambda: Measurement.model_validate({}), description="how its logs differ from what happened"
    )
    thrust_curve: ThrustCurve | None = None
    camera: Mount = Field(default_factory=lambda: Mount.model_validate({}))
    controller: Tuning | None = Field(None, description="from the motors' time constant if not given")
    wind: WindWithoutFile | None = None
    body_radius: Positive | None = Field(None, description="of the sphere that must not touch anything [m]")
    sources: dict[str, str] = Field({}, description="where each value is from")

    @model_validator(mode="after")
    def _can_fly(self) -> "Vehicle":
        x, y, z = self.inertia
        if 2 * max(x, y, z) > 1.05 * (x + y + z):  # measured ones may be off by a little
            raise ValueError(f"no body has the inertia {list(self.inertia)}: each must be at most the others' sum")
        if len(self.rotors.scales) != self.rotors.count:
            given = len(self.rotors.scales)
            raise ValueError(f"rotors.thrust_scale has {given} numbers for {self.rotors.count} rotors")
        if self.max_thrust * self.rotors.count <= self.mass * GRAVITY:
            weight = self.mass * GRAVITY / self.rotors.count
            raise ValueError(f"the rotors cannot lift it: rotors.max_thrust must be above {weight:.3g} N")
        if self.rotors.min_thrust * self.rotors.count >= self.mass * GRAVITY:
            raise ValueError("it cannot come down: rotors.min_thrust is above its weight")
        return self

    @property
    def weight(self) -> float:
        """[N]."""
        return self.mass * GRAVITY

    @property
    def max_thrust(self) -> float:
        """Of one rotor [N]."""
        return self.rotors.max_thrust or 2 * self.weight / self.rotors.count

    @property
    def radius(self) -> float:
        """Of the sphere around everything [m]: the tips of the propellers, unless given otherwise."""
        return self.body_radius or self.rotors.arm + self.rotors.radius

    @property
    def tuning(self) -> Tuning:
        """The controller's; by itself the attitude is 0.4 / time constant, at most 20 rad/s, the position a fifth."""
        if self.controller is not None:
            return self.controller
        attitude = min(20.0, 0.4 / max(self.rotors.motor_time_constant, 1e-3))
        return Tuning(position=attitude / 5, attitude=attitude, damping=0.9)

    @cached_property
    def rotor_positions(self) -> Floats:
        """(K, 3) in the body frame [m]."""
        angle = np.radians(self.rotors.first_angle) + 2 * np.pi * np.arange(self.rotors.count) / self.rotors.count
        places = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
        return np.asarray(self.rotors.arm * places)

    @cached_property
    def allocation(self) -> Floats:
        """(4, K): total thrust and the moments about body x, y, z from the rotors' thrusts."""
        x, y, _ = self.rotor_positions.T
        spin = np.where(np.arange(self.rotors.count) % 2 == 0, 1.0, -1.0)
        return np.stack([np.ones_like(x), y, -x, spin * self.rotors.torque_ratio])

    @property
    def mixer(self) -> Floats:
        """(K, 4): thrusts of the least squares that make a total thrust and three moments."""
        return np.asarray(np.linalg.pinv(self.allocation))

    @property
    def drag_parameters(self) -> Floats:
        """(3,) of the drag law, for the kernel."""
        return self.drag.parameters(self)

    @property
    def drag_laws(self) -> tuple[AnyDragLaw, ...]:
        """``drag`` and ``more_drag``."""
        return (self.drag, *self.more_drag)

    def to_yaml(self) -> str:
        """The text of vehicle.yaml; parts that are neutral and that most vehicles do without are left out."""
        keys = self.model_dump(mode="json", exclude_defaults=False, exclude_none=True)
        for name in ("more_drag", "measurement"):
            if keys[name] == Vehicle.model_fields[name].get_default(call_default_factory=True) or not keys[name]:
                del keys[name]
        if keys["rotors"]["thrust_scale"] == 1:
            del keys["rotors"]["thrust_scale"]
        return yaml.safe_dump(keys, sort_keys=False, allow_unicode=True, width=110, default_flow_style=None)


def vehicle_names() -> tuple[str, ...]:
    """The vehicles that come with depthsim."""
    return tuple(sorted(file.stem for file in _FOLDER.glob("*.yaml")))


def load_vehicle(choice: str | Path | Vehicle) -> Vehicle:
    """A vehicle by name, or from a vehicle.yaml; a :class:`Vehicle` stays as it is. Raises :class:`InputError`."""
    if isinstance(choice, Vehicle):
        return choice
    path = Path(choice)
    if str(choice).lower() in vehicle_names():
        path = _FOLDER / f"{str(choice).lower()}.yaml"
    elif path.suffix.lower() not in (".yaml", ".yml"):
        fix = f"name one of {', '.join(vehicle_names())}, or give a vehicle.yaml"
        raise InputError(str(choice), "", "is no vehicle", fix)
    return read_model(Vehicle, path, "a vehicle.yaml")
