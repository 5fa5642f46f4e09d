"""What any sensor makes of frames whose geometry is known: the sensor's own pipeline, with casts that are kept."""

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Seed
from depthsim.gap.depth.data.frames import CleanFrame
from depthsim.materials import Materials
from depthsim.raycast import Caster, Geometry
from depthsim.scratch import Scratch
from depthsim.sensor.effect import Effect
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import Exposure, Pipeline, bending

SPREAD, FITTING, LOCATING = Seed("spread"), Seed("fitting"), (Seed("locating", 0), Seed("locating", 1))
"""The seeds of the simulations that the measure of errors is from, that parameters are fitted by, and of the two that
the gap is located by. No recording that is diagnosed can have been made by one of them."""
_CASTS = 2
"""How many casts of bent rays are kept of a frame."""


class Replay:
    """A camera on its way through a scene; safe to be asked from many threads."""

    def __init__(self, caster: Caster, materials: Materials, motion: Motion) -> None:
        self._caster, self._materials, self._motion = caster, materials, motion
        self._own = threading.local()
        self._casts: dict[int, list[tuple[list[Effect], bool, Geometry]]] = {}

    def measure(self, effects: Sequence[Effect], frame: CleanFrame, seed: Seed) -> NDArray[np.uint16]:
        """(rows, width) what is looked at of a frame, as a sensor with ``effects``, in :func:`acting` order, has it."""
        scratch = Scratch.of_thread(self._own)
        pipeline = Pipeline(self._caster, frame.camera, self._materials)
        effects = pipeline.all_of(effects)
        exposure = Exposure(frame.pose, self._motion, seed, frame.index, frame.stamp, 1, scratch)
        met = self._bent(pipeline, effects, exposure) if bending(effects) else frame.geometry
        depth = scratch.empty(met.depth.shape)
        depth[:] = met.depth
        return pipeline.apply(effects, met, depth, exposure)

    def _bent(self, pipeline: Pipeline, effects: Sequence[Effect], exposure: Exposure) -> Geometry:
        """What bent rays meet. The last few casts for fitting are kept: the bank is tried on top of one bent sensor."""
        own, right = bending(effects), any(effect.needs_right for effect in effects)
        kept = self._casts.get(exposure.index, []) if exposure.seed == FITTING else []
        for others, with_right, known in kept:
            if others == own and (with_right or not right):
                return known
        met = pipeline.cast_bent(own, exposure, right=right)
        if exposure.seed == FITTING:
            self._casts[exposure.index] = [(own, right, met), *kept][:_CASTS]
        return met
