"""From flights to the drag of a vehicle: the coefficients of every law with intervals, and which law the flights bear.

The force of a flight is what its accelerometer shows, low-passed as the model is. Each flight keeps an offset and a
scale of its own, which belong to the sensors and the battery, not to the air. Everything rests on sums over blocks of
time (`sums.py`), so that the bootstrap and every split into fitted and held-out flights cost next to nothing.
"""

from depthsim.flight.fit.craft import Craft, craft_of
from depthsim.flight.fit.fit import DragFit, LawFit, fit_drag
from depthsim.flight.fit.thrust import ThrustMap, fit_thrust_map

__all__ = ["Craft", "DragFit", "LawFit", "ThrustMap", "craft_of", "fit_drag", "fit_thrust_map"]
