"""What any simulated sensor makes of frames whose geometry is known: Sensor.measure without the casting."""

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.depth.data.frames import Still
from depthsim.materials import Materials
from depthsim.raycast import Caster, Geometry
from depthsim.scene import Scene
from depthsim.sensor.effect import Effect, Stage, physical_order
from depthsim.sensor.frame import Frame
from depthsim.sensor.motion import Motion
from depthsim.sensor.scratch import Scratch
from depthsim.sensor.sensor import to_units
from depthsim.sensor.view import View

FITTING = 1
"""The seed of the simulations that parameters are fitted by."""
_CASTS = 2
"""How many casts of bent rays are kept of a frame."""


class Replay:
    """A camera on its way through a scene; safe to be asked from many threads."""

    def __init__(self, caster: Caster, scene: Scene, materials: Materials, camera: Camera, motion: Motion) -> None:
        self._caster, self._scene, self._materials = caster, scene, materials
        self._camera, self._motion = camera, motion
        self._own = threading.local()
        self._casts: dict[int, list[tuple[list[Effect], bool, Geometry]]] = {}

    def measure(self, effects: Sequence[Effect], still: Still, seed: int) -> NDArray[np.uint16]:
        """(height, width) the frame as the sensor with ``effects``, as :func:`acting` orders them, stores it."""
        bending = [effect for effect in effects if effect.stage <= Stage.OPTICS]
        met, scratch = still.geometry, Scratch.of_thread(self._own)
        if bending:
            met = self._bent(bending, still, seed, scratch, any(effect.needs_right for effect in effects))
        depth = scratch.empty(met.depth.shape)
        depth[:] = met.depth
        frame = Frame(
            depth, met, self._camera, self._scene, self._materials, self._motion, seed, still.index, still.stamp, 1,
            scratch,
        )  # fmt: skip
        for effect in effects[len(bending) :]:
            effect.apply(frame)
        return to_units(frame.depth, self._camera)

    def _bent(self, bending: list[Effect], still: Still, seed: int, scratch: Scratch, right: bool) -> Geometry:
        """What bent rays meet. The last few casts for fitting are kept: the bank is tried on top of one bent sensor."""
        kept = self._casts.get(still.index, []) if seed == FITTING else []
        for effects, with_right, known in kept:
            if effects == bending and (with_right or not right):
                return known
        camera = self._camera
        view = View(still.pose, camera.rays, camera, self._motion, seed, still.index, still.stamp, 1, scratch)
        for effect in bending:
            effect.bend(view)
        poses = view.pose if view.pose.ndim == 2 else view.pose[None]
        met = self._caster.cast(camera, poses, right=right, rays=view.rays, threads=1)
        met = met if view.pose.ndim == 2 else met[0]
        if seed == FITTING:
            self._casts[still.index] = [(bending, right, met), *kept][:_CASTS]
        return met


def acting(effects: Sequence[Effect]) -> list[Effect]:
    """Those that change anything, in the order in which they act."""
    return sorted((e for e in effects if not e.is_neutral), key=physical_order)
