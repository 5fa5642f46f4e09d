"""Which vehicle flew: its rotors and its mass, from what was given, the log, or an assumption that is reported."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import ValidationError

from depthsim.errors import InputError
from depthsim.flight.fit.motion import motion_of
from depthsim.flight.log import FlightLog
from depthsim.flight.nanobench import ASSUMED_MASS, KIND
from depthsim.flight.vehicle import Vehicle, load_vehicle, vehicle_names


@dataclass(frozen=True)
class Craft:
    """A vehicle with the mass to fit with, where that mass is from, and what else is assumed."""

    vehicle: Vehicle
    mass_from: str
    notes: tuple[str, ...]


def craft_of(logs: Sequence[FlightLog], choice: str | None = None, mass: float | None = None) -> Craft:
    """The vehicle of some logs. choice: a name or a vehicle.yaml. mass: [kg], goes before the vehicle's.

    Without either: NanoBench is a Crazyflie of an assumed mass; a log with thrust in N gives the mass by its
    accelerometer. Raises :class:`InputError` where the mass is not known.
    """
    if mass is not None and not 0 < mass < 1000:
        raise InputError("`mass`", "", f"is {mass:g}", "give the mass in kg, such as 0.035")
    vehicle = load_vehicle(choice) if choice else None
    if mass is not None:
        mass_from = "as given"
    elif vehicle is not None:
        mass, mass_from = vehicle.mass, f"of {vehicle.name}"
    elif all(log.kind == KIND for log in logs):
        mass, mass_from = ASSUMED_MASS, "assumed, it is not in the NanoBench data: `mass` gives another"
    else:
        mass, mass_from = _weighed(logs), "from thrust over specific force in the log"
    notes = []
    if vehicle is None:
        named = [name for name in vehicle_names() if all(log.kind == KIND for log in logs) and "crazyflie" in name]
        known = [load_vehicle(name) for name in named or vehicle_names()]
        vehicle = min(known, key=lambda one: abs(np.log(one.mass / mass)))
        notes.append(f"inertia and rotors are those of {vehicle.name}; give the vehicle by `choice`")
    return Craft(_with_mass(vehicle, mass), mass_from, tuple(notes))


def _weighed(logs: Sequence[FlightLog]) -> float:
    masses = []
    for log in logs:
        if log.total_thrust is None:
            fix = "give `mass` or `choice`: without thrust in N a log shows force over mass alone"
            raise InputError(log.source, "", "does not give the mass", fix)
        motion = motion_of(log)
        total = motion.log.total_thrust
        assert total is not None
        thrust = motion.smooth(total)
        masses.append(float(thrust @ motion.force[:, 2] / (motion.force[:, 2] @ motion.force[:, 2])))
    mass = float(np.mean(masses))
    if not mass > 0:
        raise InputError(logs[0].source, "thrust", "is not along the specific force", "write the thrust [N], up is +")
    return mass


def _with_mass(vehicle: Vehicle, mass: float) -> Vehicle:
    """The vehicle at another mass; limits of thrust that cannot be at that mass are left to their defaults."""
    keys = vehicle.model_dump()
    keys["mass"] = mass
    try:
        return Vehicle.model_validate(keys)
    except ValidationError:
        keys["rotors"] |= {"max_thrust": None, "min_thrust": 0.0}
        return Vehicle.model_validate(keys)
