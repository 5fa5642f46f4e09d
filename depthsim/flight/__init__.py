"""Flights: vehicles and their drag, logs, fits of one to the other, and the diagnosis of what is missing between them.

    from depthsim.flight import diagnose, fit_drag, fly

    fly("lemniscate:size=20/10,center=0/0/3", "f450", wind="3/0/0").write("flight")
    fit_drag(["log1.csv", "log2.csv"], "f450")
    diagnose(["log1.csv", "log2.csv"], "f450", out="report")

A vehicle, a path, a wind or a log is a name, a path of a file, or the object.
"""

from typing import TYPE_CHECKING, Any

_HOMES = {
    "FlightLog": ("flight.log", "FlightLog"),
    "Vehicle": ("flight.vehicle", "Vehicle"),
    "diagnose": ("gap.flight", "diagnose_flight"),
    "fit_drag": ("flight.fit.fit", "fit_drag"),
    "fly": ("flight.flying", "fly"),
}
"""The module of each name, and what it is called there."""

if TYPE_CHECKING:
    from depthsim.flight.fit.fit import fit_drag
    from depthsim.flight.flying import fly
    from depthsim.flight.log import FlightLog
    from depthsim.flight.vehicle import Vehicle
    from depthsim.gap.flight import diagnose_flight as diagnose

__all__ = ["FlightLog", "Vehicle", "diagnose", "fit_drag", "fly"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    module, there = _HOMES[name]
    found = globals()[name] = getattr(import_module(f"depthsim.{module}"), there)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
