"""What any simulated sensor makes of frames whose geometry is known: Sensor.measure without casting, bit for bit."""

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.stills import Still
from depthsim.materials import Materials
from depthsim.raycast import Caster, Geometry
from depthsim.scene import Scene
from depthsim.sensor.draws import Seed
from depthsim.sensor.effect import Effect, Stage, physical_order
from depthsim.sensor.frame import Frame
from depthsim.sensor.motion import Motion
from depthsim.sensor.scratch import Scratch
from depthsim.sensor.sensor import through_disparity, to_units
from depthsim.sensor.view import View

SPREAD, FITTING, LOCATING = Seed("spread"), Seed("fitting"), (Seed("locating", 0), Seed("locating", 1))
"""The seeds of the simulations that the measure of errors is from, that parameters are fitted by, and of the two that
the gap is located by. No recording that is diagnosed can have been made by one of them."""
_CASTS = 2
"""How many casts of bent rays are kept of a frame."""


class Replay:
    """A camera on its way through a scene; safe to be asked from many threads."""

    def __init__(self, caster: Caster, scene: Scene, materials: Materials, camera: Camera, motion: Motion) -> None:
        self._caster, self._scene, self._materials = caster, scene, materials
        self._camera, self._motion = camera, motion
        self._own = threading.local()
        self._casts: dict[int, list[tuple[list[Effect], bool, Geometry]]] = {}

    def measure(self, effects: Sequence[Effect], still: Still, seed: Seed) -> NDArray[np.uint16]:
        """(height, width) the frame as the sensor with ``effects``, as :func:`acting` orders them, stores it."""
        bending = [effect for effect in effects if effect.stage <= Stage.OPTICS]
        met, scratch = still.geometry, Scratch.of_thread(self._own)
        if bending:
            met = self._bent(bending, still, seed, scratch, any(effect.needs_right for effect in effects))
        depth = through_disparity(met.depth, self._camera, 1, scratch.empty(met.depth.shape))
        frame = Frame(
            depth, met, self._camera, self._scene, self._materials, self._motion, seed, still.index, still.stamp, 1,
            scratch,
        )  # fmt: skip
        for effect in effects[len(bending) :]:
            effect.apply(frame)
        return to_units(frame.depth, self._camera)

    def _bent(self, bending: list[Effect], still: Still, seed: Seed, scratch: Scratch, right: bool) -> Geometry:
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
