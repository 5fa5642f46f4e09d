"""What any sensor makes of frames whose geometry is known: the sensor's own pipeline, with casts that are kept."""

import threading
from collections import OrderedDict
from collections.abc import Sequence

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
from depthsim.sensor.motion import Motion
from depthsim.sensor.noise_field import Fields
from depthsim.sensor.past import Past
from depthsim.sensor.pipeline import (
    Pipeline,
    after_camera,
    all_of,
    bending,
    camera_for,
    in_camera,
    measuring_camera,
)

SPREAD, FITTING, LOCATING = Seed("spread"), Seed("fitting"), (Seed("locating", 0), Seed("locating", 1))
"""The seeds of the simulations that the measure of errors is from, that parameters are fitted by, and of the two that
the gap is located by. No recording that is diagnosed can have been made by one of them."""
_CASTS = 2
"""How many casts of bent rays are kept of a frame that is fitted on; of another one it is the last."""
_KEPT = 1 << 27
"""Bytes of what straight rays meet that are kept."""
_FINISHED = 1 << 25
"""Bytes of finished pictures that a thread keeps, of each band of rows that is looked at."""
_BENT, _DECIMATED = 5, 3
"""Times what it takes to simulate a pixel, that it takes where rays are bent, and one of many that are made one."""
_BYTES = 24
"""Of a pixel in what its rays meet, and in what effects make of it once."""


def judging(run: int) -> Seed:
    """The seed of one of the simulations that sensors are validated by."""
    return Seed("judging", run)  # a key: another word, other draws


_SEEN_AGAIN = {FITTING, *map(judging, range(2))}
"""By these one sensor after the other is simulated, so that their pictures of noise are kept."""


class Replay:
    """Cameras on their way through a scene; safe to be asked from many threads.

    Where effects resize a frame's picture or align it, another camera than the frame's is cast and measured.
    """

    def __init__(self, caster: Caster, materials: Materials, motion: Motion) -> None:
        self._caster, self._materials, self._motion = caster, materials, motion
        self._own = threading.local()
        self._casts: dict[int, list[tuple[Camera, list[Effect], int | Seed | None, bool, Geometry]]] = {}
        self._fields: dict[tuple[int, Seed], Fields] = {}
        self._met_straight: OrderedDict[tuple[object, ...], Geometry] = OrderedDict()
        self._lock = threading.Lock()

    @staticmethod
    def work(effects: Sequence[Effect], camera: Camera) -> int:
        """What a picture of ``camera`` takes: about as long as so many pixels of straight rays."""
        ordered, eye = _that_measure(effects, camera)
        pixels = eye.width * eye.height * (_DECIMATED if eye.width > camera.left.width else 1)
        return pixels * (_BENT if bending(ordered) else 1)

    def measure(self, effects: Sequence[Effect], frame: CleanFrame, seed: Seed) -> NDArray[np.uint16]:
        """(rows, width) what is looked at of a frame, as the sensor with ``effects`` stores it."""
        camera = frame.camera
        effects, pipeline = self._sensor(effects, camera)
        scratch = Scratch.of_thread(self._own)
        # Those of a picture that is decimated more are too many to keep.
        keeps = seed in _SEEN_AGAIN and pipeline.camera.width <= 2 * camera.width
        fields = self._fields.setdefault((frame.index, seed), {}) if keeps else None
        exposure = Exposure(frame.pose, self._motion, seed, frame.index, frame.stamp, 1, scratch, fields)
        if finishing := after_camera(effects):
            past = self._past_of(effects, pipeline)
            finished = past.of(exposure, lambda now: self._made(pipeline, effects, now, frame))
            raw = pipeline.store(pipeline.process(finished, finishing, exposure, past))
        else:
            raw = self._made(pipeline, effects, exposure, frame)
        return raw if raw.shape == camera.shape else np.ascontiguousarray(raw[: camera.height, : camera.width])

    def _sensor(self, effects: Sequence[Effect], camera: Camera) -> tuple[list[Effect], Pipeline]:
        """The effects that act, and what measures; the last ones of a thread are kept, for one frame after another."""
        known = getattr(self._own, "sensor", None)
        if known is None or known[0] is not effects or known[1] is not camera:
            ordered, eye = _that_measure(effects, camera)
            known = effects, camera, ordered, Pipeline(self._caster, eye, self._materials, self._caster.scene)
            self._own.sensor = known
        return known[2], known[3]

    def _made(
        self, pipeline: Pipeline, effects: Sequence[Effect], exposure: Exposure, known: CleanFrame | None = None
    ) -> NDArray[np.uint16]:
        """The picture as it leaves the camera. known: as in :meth:`_met`."""
        met = self._met(pipeline, effects, exposure, known)
        depth = exposure.scratch.empty(met.depth.shape)
        depth[:] = met.depth
        return pipeline.store(pipeline.apply(in_camera(effects), met, depth, exposure))

    def _met(
        self, pipeline: Pipeline, effects: Sequence[Effect], exposure: Exposure, known: CleanFrame | None = None
    ) -> Geometry:
        """What rays meet. known: the frame, of whose own camera what straight ones meet is known.

        The last casts of bent rays are kept: the bank is tried on top of one bent sensor, and a sensor is validated by
        several runs, whose rays are the same unless they are random. Those of the many more pixels that are decimated
        are not, unless they are of straight rays.
        """
        own, camera, right = bending(effects), pipeline.camera, any(effect.needs_right for effect in effects)
        if known is not None and camera == known.camera and not own:
            return known.geometry
        if not own:
            return self._straight(pipeline, exposure, right)
        keeps = known is not None and camera.width <= known.camera.left.width
        kept = self._casts.get(exposure.index, []) if keeps else []
        for eye, others, seed, with_right, cast in kept:
            if (eye, others) == (camera, own) and seed in (None, exposure.seed) and (with_right or not right):
                return cast
        view = pipeline.bend(effects, exposure)
        met = pipeline.cast_bent(view, exposure, right=right)
        seed = exposure.seed if view is not None and view.is_random else None
        if keeps and (seed is None or seed == FITTING):
            met.kept = {}
            most = _CASTS if exposure.seed == FITTING else 1
            self._casts[exposure.index] = [(camera, own, seed, right, met), *kept][:most]
        return met

    def _straight(self, pipeline: Pipeline, exposure: Exposure, right: bool) -> Geometry:
        """What straight rays meet in a frame that is not known; the last ones are kept."""
        camera = pipeline.camera
        key = camera, right, exposure.stamp, exposure.pose.tobytes()
        with self._lock:
            met = self._met_straight.pop(key, None)
        if met is None:
            met = pipeline.cast((), exposure, right=right)
            met.kept = {}
        with self._lock:
            self._met_straight[key] = met
            while (
                len(self._met_straight) * _BYTES * camera.width * camera.height > _KEPT and len(self._met_straight) > 1
            ):
                self._met_straight.popitem(last=False)
        return met

    def _past_of(self, effects: Sequence[Effect], pipeline: Pipeline) -> Past:
        """The finished pictures. Each thread keeps them while what is done to them changes, and nothing else."""
        making, camera = in_camera(effects), pipeline.camera
        of = making, bending(effects)

        def take(exposure: Exposure) -> NDArray[np.uint16]:
            return self._made(pipeline, effects, exposure)

        known: tuple[object, dict[Camera, Past]] | None = getattr(self._own, "finished", None)
        if known is None or known[0] != of:
            known = self._own.finished = of, {}
        kept = known[1]
        if camera not in kept:
            kept[camera] = Past(take, camera.rate, max(_FINISHED // (2 * camera.width * camera.height), 1))
        return kept[camera]


def _that_measure(effects: Sequence[Effect], stored: Camera) -> tuple[list[Effect], Camera]:
    """The effects that act, and the camera that measures, where pictures are stored as those of ``stored``."""
    ordered = all_of(stored, effects)
    return ordered, measuring_camera(camera_for(stored, ordered), ordered)
