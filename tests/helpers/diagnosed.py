"""Logs for the tests of the flight diagnosis, and the gap of one without a diagnosis."""

import numpy as np

from benchmarks.withheld_flight_data import Noise, Path, Truth, flight
from depthsim.flight.log import FlightLog
from depthsim.flight.vehicle import Vehicle
from depthsim.gap.config import FlightConfig
from depthsim.gap.flight.data.evidence import make_problem
from depthsim.gap.flight.data.records import prepare
from depthsim.gap.flight.data.settings import base_settings
from depthsim.gap.flight.data.simulate import Model

EIGHT = Path("lemniscate", 8.0, 18.0, 3.0, 1.2, turning=True, phase=0.7)
"""A figure of eight of 20 s."""
SECONDS = 25


def log_of(truth: Truth, path: Path = EIGHT, seed: int = 1, **noise: float) -> FlightLog:
    """A flight from the simulator that shares nothing with the diagnosis: as long as it must be for these tests."""
    return flight(path, truth, Noise(**noise), seed).select(slice(None, 100 * SECONDS))


def gap_of(log: FlightLog, vehicle: Vehicle) -> float:
    """What a diagnosis calls the gap before [m/s²]."""
    config = FlightConfig()
    base = base_settings(vehicle, [log.duration])
    problem = make_problem(prepare([log], vehicle, config), Model(vehicle), base, config)
    return float(np.sqrt(((problem.measured - problem.predict(base))[:, 0] ** 2).mean()))
