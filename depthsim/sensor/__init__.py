"""A depth sensor: a camera and an ordered set of effects."""

from depthsim.sensor.effect import Effect, Stage, effect_class, effect_ids
from depthsim.sensor.frame import Frame
from depthsim.sensor.profile import Profile, load_profile
from depthsim.sensor.sensor import Sensor

__all__ = ["Effect", "Frame", "Profile", "Sensor", "Stage", "effect_class", "effect_ids", "load_profile"]
