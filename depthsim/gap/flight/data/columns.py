"""Columns that a recorder filled with one value all along: they were not measured, and are read as not there.

A sensor that is not connected, or a channel that was never written, has the same number in every row. Taken at its word
it would be diagnosed: as a bias, a drag, a wind. A vehicle that stands in the air without any noise is the one log in
which it may be true, and then there is no motion that speaks against it.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.flight.log import FlightLog, rates_from_attitude
from depthsim.flight.table import Floats
from depthsim.flight.vehicle import Vehicle

_MOST = {
    "velocity": (300.0, "vx vy vz", "m/s"),
    "rates": (200.0, "wx wy wz", "rad/s"),
    "position": (1e6, "px py pz", "m"),
    "specific_force": (2000.0, "ax ay az", "m/s²"),
    "thrust": (1e5, "thrust", "N"),
    "rotor_thrusts": (1e5, "T1 T2 ...", "N"),
}
"""No multirotor has more; what is beyond is a broken cell, and its square may overflow."""
_MOVED = 0.5
"""[m/s] or [m] over the whole log: less than this may be a hover."""
_OFF = 4.0
"""A thrust that is so many times off its vehicle's weight is in other units, or of another vehicle."""


def measured_columns(log: FlightLog) -> tuple[FlightLog, list[str]]:
    """The log without columns that never change although the vehicle moves, and what was left out, in words.

    Raises :class:`~depthsim.errors.InputError` where what is left cannot be diagnosed.
    """
    for name, (most, columns, unit) in _MOST.items():
        values = getattr(log, name)
        if values is not None and np.abs(values).max() > most:
            row = int(np.argmax(np.abs(values).reshape(len(log), -1).max(axis=1)))
            problem = f"holds {np.abs(values[row]).max():.3g} {unit}, which no multirotor has"
            raise InputError(log.source, f"{columns}, t {log.t[row]:.6g}", problem, "leave such cells empty")
    moved = _range(log.velocity) > _MOVED or (log.position is not None and _range(log.position) > _MOVED)
    if not moved:
        return log, []
    if _constant(log.quaternion):
        problem = "the attitude is the same in every row, and the vehicle moves"
        raise InputError(log.source, "qx qy qz qw", problem, "write the attitude as it was measured, body to world")
    said: list[str] = []
    if _constant(log.velocity):
        assert log.position is not None
        log = replace(log, velocity=np.gradient(log.position, log.t, axis=0))
        said.append("velocities that never change: taken from positions")
    if _constant(log.position):
        log = replace(log, position=None)
        said.append("positions that never change: not used")
    if _constant(log.rates):
        log = replace(log, rates=rates_from_attitude(log.t, log.quaternion))
        said.append("angular rates that never change: taken from the attitude")
    if _constant(log.specific_force):
        log = replace(log, specific_force=None)
        said.append("an accelerometer that never changes: not used")
    if log.total_thrust is not None and _constant(log.total_thrust[:, None]):
        log = replace(log, thrust=None, rotor_thrusts=None)
        said.append("a thrust that never changes: not used")
    return log, [f"{Path(log.source).name}: {one}" for one in said]


def check_units(log: FlightLog, vehicle: Vehicle) -> None:
    """Refuse what cannot be this vehicle in these units: a thrust far from its weight, an accelerometer upside down.

    Raises :class:`~depthsim.errors.InputError`.
    """
    if log.specific_force is not None:
        up = float(np.median(log.specific_force[:, 2]))
        if up < 0:
            problem = f"az is {up:.3g} m/s² at the median, where thrust pushes upwards"
            raise InputError(log.source, "ax ay az", problem, "write body axes x forward, y left, z up")
    if log.total_thrust is not None:
        carried = float(np.median(log.total_thrust)) / vehicle.weight
        if not 1 / _OFF < carried < _OFF and carried > 0:  # none at all is reported where the thrust is read
            place = "thrust" if log.thrust is not None else "T1 T2 ..."
            problem = f"the thrust is {carried:.3g} of the weight of {vehicle.name} ({vehicle.weight:.3g} N)"
            raise InputError(log.source, place, problem, "write it in N, or give the vehicle that flew")


def _constant(values: Floats | None) -> bool:
    return values is not None and bool((values == values[:1]).all())


def _range(values: Floats) -> float:
    return float(np.ptp(values, axis=0).max())
