"""Scenes made from primitives and noise: ``build(name, **parameters)`` gives the tagged mesh of one."""

from depthsim.procedural.part import Part
from depthsim.procedural.registry import BUILDERS, build

__all__ = ["BUILDERS", "Part", "build"]
