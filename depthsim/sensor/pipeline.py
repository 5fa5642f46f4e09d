"""The one way that a frame takes: what the rays meet, the effects in their order, and whole units of depth.

The sensor takes it for every frame, with what its rays or its stereo matcher have found. The diagnosis takes it with
casts that it keeps. So both make the same bits.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.materials import Materials
from depthsim.raycast import Caster, Geometry
from depthsim.sensor.effect import Effect, Stage, physical_order
from depthsim.sensor.effects.align import AlignToColor
from depthsim.sensor.exposure import Exposure
from depthsim.sensor.frame import Frame, Surfaces
from depthsim.sensor.past import Past
from depthsim.sensor.posed import surfaces_at
from depthsim.sensor.seen import Seen
from depthsim.sensor.view import View
from depthsim.units import to_depth_raw, to_metres

_OF_OTHER_SUNS = 200_000
"""Bytes of what the sun reaches from other sides in a frame, that are kept where many sensors see it."""


def acting(effects: Sequence[Effect]) -> list[Effect]:
    """Those that change anything, in the order in which they act."""
    return sorted((e for e in effects if not e.is_neutral), key=physical_order)


def in_camera(effects: Sequence[Effect]) -> list[Effect]:
    """Those that make the picture; the others, :func:`after_camera`, are done to it when it is finished."""
    return [effect for effect in effects if effect.stage < Stage.PROCESSING]


def after_camera(effects: Sequence[Effect]) -> list[Effect]:
    """Those that are done to the finished picture, which has whole units."""
    return [effect for effect in effects if effect.stage >= Stage.PROCESSING]


def bending(effects: Sequence[Effect]) -> list[Effect]:
    """Those that move the camera or bend its rays, so that the frame has to be cast with them."""
    return [effect for effect in effects if effect.stage <= Stage.OPTICS or effect.moves_camera]


def all_of(camera: Camera, effects: Sequence[Effect]) -> list[Effect]:
    """Those that act in a sensor with this camera, which brings its resampling where it is aligned."""
    found = acting(effects)
    return acting([*found, AlignToColor()]) if camera.aligned and not _aligning(found) else found


def measuring_camera(camera: Camera, effects: Sequence[Effect]) -> Camera:
    """The camera that measures in a sensor that is given ``camera``: its left imager, before anything is resized."""
    for effect in _aligning(acting(effects)):
        camera = effect.stored(camera)
    return camera.left


def stored_camera(camera: Camera, effects: Sequence[Effect]) -> Camera:
    """The camera of the pictures that are stored, of a sensor that is given ``camera``.

    Where nothing is known of its colour camera, pictures that are aligned to it are those of ``camera`` itself.
    """
    effects = acting(effects)
    if camera.color is None and _aligning(effects):
        return camera
    for effect in effects:
        camera = effect.stored(camera)
    return camera


def camera_for(stored: Camera, effects: Sequence[Effect]) -> Camera:
    """The camera to give a sensor whose pictures are to be those of ``stored``: what undoes :func:`stored_camera`.

    A camera that does not say that it is aligned is so by the effect's parameters, and its pictures stay as they are.
    """
    effects = acting(effects)
    if not stored.aligned and _aligning(effects):
        return _without_color(stored)
    for effect in reversed(effects):
        stored = effect.imager(stored)
    return stored


def _aligning(effects: Sequence[Effect]) -> list[Effect]:
    return [effect for effect in effects if effect.moves_camera]


@lru_cache(maxsize=8)
def _without_color(camera: Camera) -> Camera:
    return camera if camera.color is None else camera.model_copy(update={"color": None})


@dataclass(frozen=True)
class Pipeline:
    """The camera that measures, in a scene. The effects that its methods take are those of :func:`all_of`, in order.

    Poses are of the pictures that are stored: where those are aligned to colour, the colour camera's.
    caster: or the image that stands for the scene; None where nothing is cast.
    """

    caster: Caster | Seen | None
    camera: Camera
    materials: Materials
    scene: Surfaces

    def cast(
        self, effects: Sequence[Effect], exposure: Exposure, *, right: bool, out: Geometry | None = None
    ) -> Geometry:
        """What the rays meet, those that are :func:`bending` have bent. out: an earlier result, to be written over."""
        view = self.bend(effects, exposure)
        return self.cast_bent(view, exposure, right=right, out=out)

    def bend(self, effects: Sequence[Effect], exposure: Exposure) -> View | None:
        """What the frame is cast with; None where nothing is bent."""
        e, camera, bent = exposure, self.camera, bending(effects)
        if not bent:
            return None
        view = View(e.pose, camera.rays, camera, e.motion, e.seed, e.index, e.stamp, e.threads, e.scratch)
        for effect in bent:
            effect.bend(view)
        return view

    def cast_bent(self, view: View | None, e: Exposure, *, right: bool, out: Geometry | None = None) -> Geometry:
        """As :meth:`cast`, of what :meth:`bend` has found."""
        if self.caster is None:
            raise ValueError("there is no scene to cast rays into")
        camera = self.camera
        if view is None:
            return self.caster.cast(camera, e.pose, right=right, stamps=e.stamp, threads=e.threads, out=out)
        # A batch of one, whether there is a pose a frame or a pose a row, so that the same memory fits both.
        poses = view.pose[None]
        fits = out is not None and out.depth.size == camera.width * camera.height
        batch = out.reshaped((1, *camera.shape)) if out is not None and fits else None
        stamps = view.stamp if view.rows is None else view.rows[None]
        met = self.caster.cast(camera, poses, right=right, rays=view.rays, stamps=stamps, threads=e.threads, out=batch)
        return met[0]

    def apply(
        self,
        effects: Sequence[Effect],
        geometry: Geometry,
        depth: NDArray[np.float32],
        exposure: Exposure,
        past: Past | None = None,
    ) -> Frame:
        """The frame once the effects that bend no rays have acted.

        geometry: what the rays met. depth: (height, width) float32 what the effects begin with [m], changed in place
        into what is stored, before it was rounded; where effects resize the picture, ``depth`` of the frame is another.
        past: gives the frames before, to effects that look back.
        """
        frame = self._frame(geometry, depth, exposure)
        if isinstance(self.caster, Caster):
            frame.reached = partial(self._reached, self.caster, effects, geometry, exposure)
        finishing = after_camera(effects)
        for effect in in_camera(effects):
            if effect.stage > Stage.OPTICS:
                effect.apply(frame)
        if finishing:
            self._finish(frame, exposure, past if any(e.looks_back for e in finishing) else None)
            self._process(frame, finishing, exposure, past)
        return frame

    def process(self, raw: NDArray[np.uint16], effects: Sequence[Effect], exposure: Exposure, past: Past) -> Frame:
        """The frame of a finished picture, (height, width) ``raw``, with the effects that are done to such pictures.

        What it was cast from is not known any more.
        """
        depth = exposure.scratch.empty(raw.shape)
        to_metres(raw, self.camera, depth)
        frame = self._frame(Geometry.empty((0, 0), right=False), depth, exposure)
        self._process(frame, effects, exposure, past)
        return frame

    def store(self, frame: Frame, out: NDArray[np.uint16] | None = None) -> NDArray[np.uint16]:
        """(height, width) a frame as the camera stores it. out: memory for the result."""
        return to_depth_raw(frame.depth, frame.camera, frame.threads, out)

    def _frame(self, geometry: Geometry, depth: NDArray[np.float32], e: Exposure) -> Frame:
        scene = surfaces_at(self.scene, e.stamp)
        return Frame(
            depth, geometry, self.camera, scene, self.materials, e.motion, e.seed, e.index, e.stamp, e.threads,
            e.scratch, e.fields,
        )  # fmt: skip

    def _reached(
        self,
        caster: Caster,
        effects: Sequence[Effect],
        geometry: Geometry,
        e: Exposure,
        direction: NDArray[np.float32],
    ) -> NDArray[np.uint8]:
        def cast() -> NDArray[np.uint8]:
            view, depth, clear = self.bend(effects, e), geometry.depth, self.materials.clear
            if view is None:
                return caster.reached(self.camera, e.pose, depth, direction, e.threads, e.stamp, through=clear)
            stamps = view.stamp if view.rows is None else view.rows
            return caster.reached(self.camera, view.pose, depth, direction, e.threads, stamps, view.rays, clear)

        if geometry.kept is None:
            return cast()
        of, size = tuple(map(float, direction)), geometry.depth.size
        packed = geometry.once("reached", of, lambda: np.packbits(cast()), _OF_OTHER_SUNS)
        return np.unpackbits(packed, count=size).reshape(geometry.depth.shape)

    def _finish(self, frame: Frame, exposure: Exposure, past: Past | None) -> None:
        """Round to whole units: what is done to a picture after it has left the camera is done to those."""
        raw = self.store(frame, None if past else frame.empty(np.uint16))
        if past:
            past.keep(exposure, raw)
        to_metres(raw, self.camera, frame.depth)

    def _process(self, frame: Frame, effects: Sequence[Effect], exposure: Exposure, past: Past | None) -> None:
        for number, effect in enumerate(effects):
            if effect.looks_back and past is not None:
                frame.before = partial(self._earlier, effects[:number], exposure, past)
            effect.apply(frame)

    def _earlier(self, effects: Sequence[Effect], now: Exposure, past: Past, count: int) -> Iterator[Frame]:
        """The frames before one, with those of the effects on the finished picture that have acted so far."""
        for back in range(min(count, now.index), 0, -1):
            raw = past.picture(now, back)
            if raw is not None:
                then = replace(now, index=now.index - back, scratch=now.scratch.inner())
                yield self.process(raw, effects, then, past)
