"""A step in depth, and one effect on it: what the tests of the effects share."""

from typing import Any

import numpy as np
from shapes import MATERIALS, Array, as_scene, camera, quad, wall

from depthsim.materials import Materials
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.sensor import Measurement

CAMERA = camera(240, 120, 200)
"""f·b = 10 px m: a wall at 1 m has a disparity of 10 px, at 2.5 m of 4 px."""
NEAR, FAR, STEP = 1.0, 2.5, 6.0
LEFT, RIGHT = 100, 160
"""The first column of the near wall, and the first one behind it."""


def column(u: float, depth: float) -> float:
    """World x of the left border of column ``u`` at ``depth``, seen from eye(4)."""
    return (u - 0.5 - CAMERA.cx) / CAMERA.fx * depth


def plate() -> Any:
    """A near wall, all rows high, as vertices and faces."""
    left, right = column(LEFT, NEAR), column(RIGHT, NEAR)
    return quad((left, -5, NEAR), (0, 10, 0), (right - left, 0, 0))


STEP_CASTER = Caster(as_scene(plate(), wall(FAR), tags=["plastic", "cement"]))
"""The near wall before a far one."""
OPEN_CASTER = Caster(as_scene(plate(), tags=["plastic"]))
"""The near wall before nothing."""


def measure(
    *effects: Effect, caster: Caster = STEP_CASTER, materials: Materials = MATERIALS, **keys: Any
) -> Measurement:
    """One frame from eye(4)."""
    return Sensor(caster, CAMERA, effects, materials).measure(np.eye(4), **keys)


def disparity(measured: Measurement) -> Array:
    """(H, W) measured disparity [px], 0 for a hole."""
    z = measured.depth.astype(np.float64)
    return np.where(z > 0, CAMERA.focal_baseline / np.maximum(z, 1e-9), 0)


def z_score(count: float, chances: Array) -> float:
    """How far ``count`` is from what independent events of these chances give, in standard deviations."""
    return float((count - chances.sum()) / np.sqrt((chances * (1 - chances)).sum() + 1e-9))
