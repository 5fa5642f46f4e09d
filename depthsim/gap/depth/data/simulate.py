"""What any sensor makes of frames whose geometry is known: the sensor's own pipeline, with casts that are kept."""

import threading
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.draws import Seed
from depthsim.gap.depth.data.frames import CleanFrame
from depthsim.materials import Materials
from depthsim.raycast import Caster, Geometry
from depthsim.scratch import Scratch
from depthsim.sensor.effect import Effect
from depthsim.sensor.exposure import Exposure
from depthsim.sensor.frame import Frame
from depthsim.sensor.motion import Motion
from depthsim.sensor.past import Past
from depthsim.sensor.pipeline import Pipeline, bending, imager_camera, in_camera

SPREAD, FITTING, LOCATING = Seed("spread"), Seed("fitting"), (Seed("locating", 0), Seed("locating", 1))
"""The seeds of the simulations that the measure of errors is from, that parameters are fitted by, and of the two that
the gap is located by. No recording that is diagnosed can have been made by one of them."""
_CASTS = 2
"""How many casts of bent rays are kept of a frame."""
_KEPT = 1 << 28
"""Bytes of pictures that are kept of frames before those that are looked at."""


class Replay:
    """A camera on its way through a scene; safe to be asked from many threads.

    camera: of the recording. Where effects resize the picture, the frame is cast by the camera that they begin with.
    """

    def __init__(self, caster: Caster, materials: Materials, camera: Camera, motion: Motion) -> None:
        self._pipeline, self._motion = Pipeline(caster, camera, materials, caster.scene), motion
        self._own = threading.local()
        self._casts: dict[int, list[tuple[list[Effect], bool, Geometry]]] = {}
        self._past: tuple[list[Effect], Camera, Past] | None = None

    def measure(self, effects: Sequence[Effect], frame: CleanFrame, seed: Seed) -> NDArray[np.uint16]:
        """(height, width) the frame as the sensor with ``effects``, as :func:`acting` orders them, stores it."""
        scratch = Scratch.of_thread(self._own)
        exposure = Exposure(frame.pose, self._motion, seed, frame.index, frame.stamp, 1, scratch)
        camera = self._pipeline.camera
        imager = imager_camera(camera, effects)
        pipeline = self._pipeline if imager == camera else replace(self._pipeline, camera=imager)
        past = self._past_of(effects, pipeline) if any(effect.looks_back for effect in effects) else None
        raw = pipeline.store(self._made(pipeline, effects, exposure, frame.geometry, past))
        return raw if raw.shape == camera.shape else np.ascontiguousarray(raw[: camera.height, : camera.width])

    def _made(
        self,
        pipeline: Pipeline,
        effects: Sequence[Effect],
        exposure: Exposure,
        known: Geometry | None,
        past: Past | None,
    ) -> Frame:
        """The frame. known: what straight rays of the recording's camera meet, where that is known."""
        right = any(effect.needs_right for effect in effects)
        if pipeline is not self._pipeline:  # casts of so many more pixels are not kept
            met = pipeline.cast(effects, exposure, right=right)
        elif bending(effects):
            met = self._bent(effects, exposure, right)
        else:
            met = known if known is not None else pipeline.cast(effects, exposure, right=right)
        depth = exposure.scratch.empty(met.depth.shape)
        depth[:] = met.depth
        return pipeline.apply(effects, met, depth, exposure, past)

    def _bent(self, effects: Sequence[Effect], exposure: Exposure, right: bool) -> Geometry:
        """What bent rays meet. The last few casts for fitting are kept: the bank is tried on top of one bent sensor."""
        own = bending(effects)
        kept = self._casts.get(exposure.index, []) if exposure.seed == FITTING else []
        for others, with_right, known in kept:
            if others == own and (with_right or not right):
                return known
        met = self._pipeline.cast(own, exposure, right=right)
        if exposure.seed == FITTING:
            self._casts[exposure.index] = [(own, right, met), *kept][:_CASTS]
        return met

    def _past_of(self, effects: Sequence[Effect], pipeline: Pipeline) -> Past:
        """The frames before. They are kept while what the filters after them are fitted changes, and nothing else."""
        own, camera = in_camera(effects), pipeline.camera

        def take(exposure: Exposure) -> NDArray[np.uint16]:
            return pipeline.store(self._made(pipeline, own, exposure, None, None))

        past = self._past
        if past is None or past[:2] != (own, camera):
            most = max(_KEPT // (2 * camera.width * camera.height), 1)
            past = self._past = own, camera, Past(take, camera.rate, most)
        return past[2]
