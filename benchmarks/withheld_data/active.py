"""Active stereo as the real camera: depth from matched images, which have no list of effects.

The one file here that uses a sensor of depthsim's: there is no effect in it, and no formula to give away.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from benchmarks.withheld_data.film import Film


def shoot(film: Film) -> Callable[[int], NDArray[np.uint16]]:
    """Takes a frame of the film by its number, in 16-bit units."""
    from depthsim.sensor import Sensor
    from depthsim.sensor.motion import Motion

    sensor = Sensor(film.world.caster, film.camera, "active_stereo")
    motion = Motion.along(film.route.trajectory(film.stamps))

    def take(index: int) -> NDArray[np.uint16]:
        stamp = float(film.stamps[index])
        measured = sensor.measure(film.poses[index], index=index, stamp=stamp, seed=film.seed, motion=motion)
        return np.asarray(measured.depth_raw)

    return take


def profile_text(name: str) -> str:
    """A profile that comes with depthsim, without its camera."""
    from depthsim.sensor import load_profile

    profile = load_profile(name)
    return profile.model_copy(update={"camera": None}).to_yaml()
