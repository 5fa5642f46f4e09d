"""Vehicles as the kernel reads them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.ground_effect import GroundEffect
from depthsim.flight.vehicle import Vehicle

Floats = NDArray[np.float64]


class Fleet(NamedTuple):
    """V vehicles of K rotors each.

    mass: (V,). inertia: (V, 3). places: (V, K, 3) of the rotors. radius: (V,) of a propeller. allocation: (V, 4, K).
    mixer: (V, K, 4). lag: (V,). limits: (V, 2) least and greatest thrust of a rotor. scale: (V, K) of the thrust.
    law: (V, L), drag: (V, L, 3) of L drag laws at once. ground: (V, 3) the ground effect's law and numbers.
    gains: (V, 4) over mass or inertia: of position [1/s²], velocity [1/s], attitude [1/s²] and rates [1/s].
    """

    mass: Floats
    inertia: Floats
    places: Floats
    radius: Floats
    allocation: Floats
    mixer: Floats
    lag: Floats
    limits: Floats
    scale: Floats
    law: NDArray[np.int64]
    drag: Floats
    ground: Floats
    gains: Floats


class Craft(NamedTuple):
    """One of them, within the kernel."""

    mass: float
    inertia: Floats
    places: Floats
    radius: float
    allocation: Floats
    mixer: Floats
    lag: float
    limits: Floats
    scale: Floats
    law: NDArray[np.int64]
    drag: Floats
    ground: Floats
    gains: Floats


def make_fleet(vehicles: Sequence[Vehicle]) -> Fleet:
    """Vehicles with the same number of rotors, side by side; one that comes often is worked out once."""
    unique = list({id(vehicle): vehicle for vehicle in vehicles}.values())
    if len({vehicle.rotors.count for vehicle in unique}) != 1:
        raise ValueError("all vehicles of a fleet must have the same number of rotors")
    place = {id(vehicle): index for index, vehicle in enumerate(unique)}
    rows = np.array([place[id(vehicle)] for vehicle in vehicles])
    laws = max(len(vehicle.drag_laws) for vehicle in unique)
    columns = zip(*(_row(vehicle, laws) for vehicle in unique), strict=True)
    return Fleet(*(np.ascontiguousarray(np.stack(column)[rows]) for column in columns))


def _row(vehicle: Vehicle, laws: int) -> tuple[NDArray, ...]:
    rotors, tuning = vehicle.rotors, vehicle.tuning
    gains = [
        tuning.position**2,
        2 * tuning.damping * tuning.position,
        tuning.attitude**2,
        2 * tuning.damping * tuning.attitude,
    ]
    numbers = (
        vehicle.mass,
        vehicle.inertia,
        vehicle.rotor_positions,
        rotors.radius,
        vehicle.allocation,
        vehicle.mixer,
        rotors.motor_time_constant,
        (rotors.min_thrust, vehicle.max_thrust),
        rotors.scales,
    )
    values = [np.asarray(item, np.float64) for item in numbers]
    codes, parameters = np.zeros(laws, np.int64), np.zeros((laws, 3))
    for index, law in enumerate(vehicle.drag_laws):
        codes[index], parameters[index] = law.code, law.parameters(vehicle)
    ground = (vehicle.ground_effect or GroundEffect.model_validate({})).numbers
    return *values, codes, parameters, np.array(ground), np.array(gains)
