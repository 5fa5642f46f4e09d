"""Vehicles, and single flights without a controller, for the tests of flight."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.dynamics import Motion, simulate
from depthsim.flight.fleet import make_fleet
from depthsim.flight.vehicle import Vehicle, load_vehicle
from depthsim.flight.wind import Air, make_air

Array = NDArray[np.float64]


def vehicle(name: str = "f450", **changes: Any) -> Vehicle:
    """A preset with some keys changed; `drag` and `rotors` are merged or replaced as a whole where a law is given."""
    keys = load_vehicle(name).model_dump()
    for key, value in changes.items():
        keys[key] = {**keys[key], **value} if key == "rotors" else value
    return Vehicle.model_validate(keys)


def state(**parts: Any) -> Array:
    """(17,) a state at rest at the origin, with some parts set: p, v, q, w, thrust."""
    y = np.zeros(17)
    y[9] = 1
    places = {"p": slice(0, 3), "v": slice(3, 6), "q": slice(6, 10), "w": slice(10, 13), "thrust": slice(13, 17)}
    for name, value in parts.items():
        y[places[name]] = value
    return y


def drift(
    craft: Vehicle,
    start: Array,
    thrust: Any,
    seconds: float,
    step: float = 1e-3,
    air: Air | None = None,
    every: int = 1,
) -> Motion:
    """A flight with constant thrusts."""
    commands = np.broadcast_to(np.asarray(thrust, np.float64), (1, 4)).copy()
    steps = round(seconds / step)
    return simulate(
        make_fleet([craft]), air or make_air(None), start[None], step=step, steps=steps, every=every, commands=commands
    )


def random_quaternion(rng: np.random.Generator) -> Array:
    """(4,) a random unit quaternion."""
    q = rng.normal(size=4)
    return np.asarray(q / np.linalg.norm(q))
