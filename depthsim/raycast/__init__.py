"""Rays in, clean geometry out: Embree through numba, with embreex's own call as fallback and cross-check."""

from depthsim.raycast.caster import Caster
from depthsim.raycast.geometry import Geometry

__all__ = ["Caster", "Geometry"]
