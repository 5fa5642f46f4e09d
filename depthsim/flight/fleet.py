"""Vehicles as the kernel reads them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.vehicle import Vehicle

Floats = NDArray[np.float64]


class Fleet(NamedTuple):
    """V vehicles of K rotors each.

    mass: (V,). inertia: (V, 3). places: (V, K, 3) of the rotors. radius: (V,) of a propeller. allocation: (V, 4, K).
    mixer: (V, K, 4). lag: (V,). limits: (V, 2) least and greatest thrust of a rotor. law: (V,), drag: (V, 3).
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
    law: NDArray[np.int64]
    drag: Floats
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
    law: int
    drag: Floats
    gains: Floats


def make_fleet(vehicles: Sequence[Vehicle]) -> Fleet:
    """Vehicles with the same number of rotors, side by side; one that comes often is worked out once."""
    unique = list({id(vehicle): vehicle for vehicle in vehicles}.values())
    if len({vehicle.rotors.count for vehicle in unique}) != 1:
        raise ValueError("all vehicles of a fleet must have the same number of rotors")
    place = {id(vehicle): index for index, vehicle in enumerate(unique)}
    rows = np.array([place[id(vehicle)] for vehicle in vehicles])
    columns = zip(*(_row(vehicle) for vehicle in unique), strict=True)
    return Fleet(*(np.ascontiguousarray(np.stack(column)[rows]) for column in columns))


def _row(vehicle: Vehicle) -> tuple[NDArray, ...]:
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
    )
    values = [np.asarray(item, np.float64) for item in numbers]
    return *values, np.asarray(vehicle.drag.code, np.int64), vehicle.drag_parameters, np.array(gains)
