"""A depth sensor: a camera and an ordered set of effects."""

from depthsim.sensor.effect import Axis, Effect, Kind, Stage, effect_class, effect_ids
from depthsim.sensor.frame import Frame
from depthsim.sensor.parameter import Setting, by_material, learned, learned_of, parameter, parameters_of
from depthsim.sensor.profile import Profile, load_profile
from depthsim.sensor.sensor import Sensor
from depthsim.sensor.view import View

__all__ = [
    "Axis",
    "Effect",
    "Frame",
    "Kind",
    "Profile",
    "Sensor",
    "Setting",
    "Stage",
    "View",
    "by_material",
    "effect_class",
    "effect_ids",
    "learned",
    "learned_of",
    "load_profile",
    "parameter",
    "parameters_of",
]
