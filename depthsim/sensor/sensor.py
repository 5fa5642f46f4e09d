"""The sensor: a camera in a scene, from poses to measured depth."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.materials import Materials, load_materials
from depthsim.parallel import core_count, run_threads
from depthsim.presets import load_camera
from depthsim.raycast import Caster, Geometry
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.scratch import Scratch
from depthsim.sensor.effect import Effect
from depthsim.sensor.exposure import Exposure
from depthsim.sensor.frame import Frame
from depthsim.sensor.given import as_depth, as_tags
from depthsim.sensor.motion import Motion
from depthsim.sensor.past import Past
from depthsim.sensor.pipeline import Pipeline, acting, all_of, bending, in_camera, measuring_camera, stored_camera
from depthsim.sensor.profile import Profile, load_profile
from depthsim.sensor.seen import Seen
from depthsim.stereo.stereo import Stereo

_NOWHERE = Scene("nowhere", np.empty((0, 3)), np.empty((0, 3), np.uint32), np.empty(0, np.uint8), ())
_LEVEL = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""A camera that looks along the world's x, z up."""
_KEPT = 64
"""Frames of which the pictures are kept for those after them, where effects look back."""


@dataclass(frozen=True)
class Stored:
    """What the sensor gives for one frame, or for N.

    camera: of the pictures: the sensor's own, or another one where effects decimate them or align them to colour.
    depth_raw: (height, width) uint16, depth in units of camera.depth_scale; 0 is a hole, 65535 too far.
    depth: (height, width) float32, the same before it was rounded [m]. Both are (N, height, width) for N frames.
    """

    camera: Camera
    depth_raw: NDArray[np.uint16]
    depth: NDArray[np.float32]


@dataclass(frozen=True)
class Measurement(Stored):
    """What the sensor gives for one pose.

    given: ``clean``, or what casts it.
    left, right: (height, width) uint8, the infrared images that active stereo has matched; None for other sensors.
    """

    given: Geometry | Callable[[], Geometry]
    left: NDArray[np.uint8] | None = None
    right: NDArray[np.uint8] | None = None

    @cached_property
    def clean(self) -> Geometry:
        """The geometry as it is, along the rays and from the pose that the camera believes in.

        Where effects bend the rays, move the camera or resize the picture, and where active stereo has no effects, the
        frame is made without it; then it is cast when it is first asked for.
        """
        return self.given() if callable(self.given) else self.given

    @property
    def cast_already(self) -> Geometry | None:
        """``clean`` if that was cast, for the next frame to write over."""
        return vars(self).get("clean") if callable(self.given) else self.given


def check_tags(scene: Scene | None, effects: Sequence[Effect], materials: Materials) -> None:
    """Raise :class:`InputError` where the scene or an effect names a tag that is no material."""
    places = [(str(scene.source or scene.name), "", tag) for tag in scene.tags] if scene else []
    places += [("sensor profile", effect.id, tag) for effect in effects for tag in effect.material_tags]
    for file, place, tag in places:
        if tag not in materials:
            fix = f"the tags are {', '.join(materials.tags)}"
            raise InputError(file, place, f"there is no material {tag!r}", fix)


class Sensor:
    """Measures depth in a scene, or makes measured depth of the clean one that another simulator has.

        Sensor("office", camera="d435", profile="paper").measure(pose).depth_raw
        Sensor(profile="d435").apply(depth, camera).depth_raw

    scene: the name of a built-in scene, the path of one, a :class:`~depthsim.scene.Scene`, or a
    :class:`~depthsim.raycast.Caster` where there is one already; None for :meth:`apply` alone. camera: a preset, the
    path of a camera.yaml, or a :class:`~depthsim.camera.Camera`; by default the profile's, or a D435. profile: a name,
    a path, a :class:`~depthsim.sensor.Profile`, or effects alone; ``()`` is a perfect camera. materials: those that
    come with depthsim, a path, or :class:`~depthsim.materials.Materials`.

    The order of the effects is the physical one (:func:`~depthsim.sensor.effect.physical_order`), whatever the order
    in which they were given. Effects at their neutral value are left out. A profile of active stereo renders and
    matches images in place of casting depth; its effects follow, and none of them may bend rays or move the camera.
    With ``align_to_color``, or a camera that is aligned, the pictures and the poses are those of the colour camera.
    A tag that is not among the materials is an :class:`~depthsim.errors.InputError`; a parameter for a material that
    this scene does not have is not.
    """

    def __init__(
        self,
        scene: str | Path | Scene | Caster | None = None,
        camera: str | Path | Camera | None = None,
        profile: str | Path | Profile | Sequence[Effect] = "paper",
        materials: str | Path | Materials | None = None,
    ) -> None:
        self.materials, self.profile = load_materials(materials), load_profile(profile)
        self.camera = load_camera(camera or self.profile.camera or "d435")
        self.effects = all_of(self.camera, self.profile.effects)
        bent, settings = bending(self.effects), self.profile.stereo
        if settings is not None and (wrong := [effect for effect in bent if not effect.moves_camera]):
            raise InputError("sensor profile", wrong[0].id, "cannot follow active_stereo", "leave that effect out")
        self._caster: Caster | None = None
        if scene is not None:
            self._caster = scene if isinstance(scene, Caster) else Caster(load_scene(scene, materials=self.materials))
        check_tags(self._caster.scene if self._caster else None, self.effects, self.materials)
        eye, caster = measuring_camera(self.camera, self.effects), self._caster
        self._pipeline = Pipeline(caster, eye, self.materials, caster.scene if caster else _NOWHERE)
        self._stereo = Stereo(caster, eye, settings, self.materials) if settings and caster else None
        self._bends, self._asks_right = bool(bent), any(effect.needs_right for effect in self.effects)
        self.stored_camera = stored_camera(self.camera, self.effects)
        self._resizes = self.stored_camera.shape != eye.shape
        self.looks_back = sum(effect.looks_back for effect in self.effects)
        self._past = Past(self._take_raw, self.camera.rate, _KEPT) if self.looks_back else None
        self._own = threading.local()

    @property
    def caster(self) -> Caster:
        """The scene's."""
        if self._caster is None:
            raise InputError("sensor", "", "has no scene to measure in", "give `scene`, or use apply(depth)")
        return self._caster

    def measure(
        self,
        pose: NDArray[np.float64],
        *,
        index: int = 0,
        stamp: float = 0.0,
        seed: int = 0,
        motion: Motion | None = None,
        threads: int | None = None,
        out: Measurement | None = None,
    ) -> Measurement:
        """One frame.

        pose: (4, 4) camera to world. index: the number of the frame in its run; with ``seed`` it keys the random
        numbers. stamp: when the frame is taken [s], and where objects that move are. motion: the camera's path around
        ``stamp``, for effects of motion and time; it stands still without. out: an earlier result of the same camera,
        to be written over.
        """
        threads, stored = threads or core_count(), self.stored_camera
        if out is not None and out.depth.shape != stored.shape:
            raise ValueError(f"out has pictures of {out.depth.shape}, the camera of {stored.shape}")
        pose = np.array(pose, np.float64)  # a copy, because the caller may change his before ``clean`` is asked for
        motion = motion or Motion.still(pose)
        exposure = Exposure(pose, motion, seed, index, stamp, threads, Scratch.of_thread(self._own))
        apart, before = self._bends or self._resizes, out.cast_already if out else None
        right = self._asks_right and not apart
        cast = partial(self.caster.cast, stored, pose, right=right, stamps=stamp, threads=threads, out=before)
        given: Geometry | Callable[[], Geometry] = cast
        if apart:
            met = getattr(self._own, "met", None)
            met = self._own.met = self._pipeline.cast(self.effects, exposure, right=self._asks_right, out=met)
        elif self._stereo is not None and not self.effects:
            met = Geometry.empty((0, 0), right=False)
        else:
            given = met = cast()
        whole = exposure.scratch.empty(self._pipeline.camera.shape) if self._resizes else None
        depth = out.depth if out else np.empty(stored.shape, np.float32)
        frame, left, right_image = self._take(self.effects, met, depth if whole is None else whole, exposure)
        if frame.depth is not depth:
            depth[:] = frame.depth
        raw = self._pipeline.store(frame, out.depth_raw if out else None)
        return Measurement(stored, raw, depth, given, left, right_image)

    def _take(
        self, effects: Sequence[Effect], met: Geometry, depth: NDArray[np.float32], exposure: Exposure
    ) -> tuple[Frame, NDArray[np.uint8] | None, NDArray[np.uint8] | None]:
        """The frame, made in the memory of ``depth``, and the images that it was matched from."""
        left = right = None
        e = exposure
        if self._stereo is not None:
            depth[:], left, right = self._stereo.measure(self._place(e.pose), e.seed, e.index, e.threads, e.stamp)
        else:
            depth[:] = met.depth
        return self._pipeline.apply(effects, met, depth, exposure, self._past), left, right

    def _place(self, pose: NDArray[np.float64]) -> NDArray[np.float64]:
        """(4, 4) the pose of the camera that measures, where that of the pictures is ``pose``."""
        color = self._pipeline.camera.color
        aligns = any(effect.moves_camera for effect in self.effects)
        return pose @ np.linalg.inv(color.pose) if aligns and color is not None else pose

    def _take_raw(self, exposure: Exposure) -> NDArray[np.uint16]:
        """(height, width): the frame before anything is done to the finished picture."""
        met = self._own.past = self._pipeline.cast(
            self.effects, exposure, right=self._asks_right, out=getattr(self._own, "past", None)
        )
        depth = exposure.scratch.empty(self._pipeline.camera.shape)
        return self._pipeline.store(self._take(in_camera(self.effects), met, depth, exposure)[0])

    def apply(
        self,
        depth: Any,
        camera: str | Path | Camera | None = None,
        *,
        tag: Any = None,
        tags: Sequence[str] = ("cement",),
        index: int | Sequence[int] = 0,
        seed: int | Sequence[int] = 0,
        motion: Motion | Sequence[Motion] | None = None,
        stamps: Sequence[float] | None = None,
        threads: int | None = None,
    ) -> Stored:
        """What the camera would store of clean depth from any simulator.

        depth: (height, width) or (N, height, width) floats [m] along the optical axis, 0 where there is nothing: NumPy,
        or what has DLPack or ``__array__``, as a torch tensor on the CPU. camera: of that depth; the sensor's own by
        default. tag: whole numbers of one frame's shape or of all, of each pixel the material in ``tags``; the first
        one everywhere by default.

        N frames follow each other: their numbers go on from ``index``, and their stamps [s] by the camera's rate. N
        cameras at one moment are given by a ``seed`` and an ``index`` for each. Random numbers depend on both, as of
        :meth:`measure`; filters in time look back at the frames of this call that have the same seed.
        motion: where the camera is in time, or each one's, for effects of motion, time and sunlight; without it cameras
        stand, and look along the world's x.

        Incidence, the right imager's view, and what bent rays or a moved camera meet are worked out from the depth, as
        of :class:`~depthsim.sensor.seen.Seen`. With ``align_to_color`` the depth and the motion are the left imager's,
        and what is stored are pictures of its ``color``. Raises :class:`InputError` for arrays that are no depth, for a
        camera that is aligned already, as they do not show its left imager's view, and for active stereo, which needs
        the scene.
        """
        eye, effects = load_camera(camera) if camera is not None else self.camera, acting(self.profile.effects)
        if self.profile.stereo is not None:
            raise InputError("sensor profile", "", "is active stereo, which takes the scene", "give one of effects")
        if eye.aligned:
            fix = "give the left imager's depth and camera, with the colour camera as `color`, and align_to_color"
            raise InputError(eye.name, "aligned", "is true: the left imager measures, and its view is not given", fix)
        if eye.color is None and (aligning := [effect for effect in effects if effect.moves_camera]):
            fix = "write the colour camera's intrinsics and its pose there"
            raise InputError(eye.name, "color", f"is not given, and {aligning[0].id} needs it", fix)
        frames, single = as_depth(depth, eye)
        ids, names = as_tags(tag, tags, frames.shape), tuple(tags)
        for name in names:
            if name not in self.materials:
                raise InputError("tags", "", f"there is no material {name!r}", f"name {', '.join(self.materials.tags)}")
        count, threads = len(frames), threads or core_count()
        exposures = self._exposures(count, eye.rate, index, seed, motion, stamps, threads if count == 1 else 1)
        places = {(e.seed, e.index): k for k, e in enumerate(exposures)}
        pipeline, stored = replace(self._pipeline, camera=eye), stored_camera(eye, effects)

        def take(k: int, effects: Sequence[Effect], scratch: Scratch, past: Past | None) -> Frame:
            exposure = replace(exposures[k], scratch=scratch)
            seen = Seen(frames[k], eye, ids[k], names, exposure.pose, exposure.threads)
            own = replace(pipeline, caster=seen, scene=seen)
            # The poses are those of the camera that the depth is of: no effect is to go there from the colour camera.
            met = own.cast([e for e in effects if not e.moves_camera], exposure, right=self._asks_right)
            picture = scratch.empty(eye.shape)
            picture[:] = met.depth
            return own.apply(effects, met, picture, exposure, past)

        def raw(e: Exposure) -> NDArray[np.uint16] | None:
            k = places.get((e.seed, e.index))
            return None if k is None else pipeline.store(take(k, in_camera(effects), e.scratch, None))

        past = Past(raw, eye.rate, max(count, _KEPT)) if self._past is not None else None
        out = Stored(stored, np.empty((count, *stored.shape), np.uint16), np.empty((count, *stored.shape), np.float32))

        def work(part: int) -> None:
            for k in range(part * count // parts, (part + 1) * count // parts):
                frame = take(k, effects, Scratch.of_thread(self._own), past)
                out.depth[k] = frame.depth
                pipeline.store(frame, out.depth_raw[k])

        parts = min(threads, count)
        run_threads(work, parts)
        return Stored(stored, out.depth_raw[0], out.depth[0]) if single else out

    def _exposures(
        self,
        count: int,
        rate: float,
        index: int | Sequence[int],
        seed: int | Sequence[int],
        motion: Motion | Sequence[Motion] | None,
        stamps: Sequence[float] | None,
        threads: int,
    ) -> list[Exposure]:
        def each(name: str, values: Sequence[Any]) -> Sequence[Any]:
            if len(values) != count:
                raise InputError(name, "", f"has {len(values)} values for {count} frames", "give one for each frame")
            return values

        numbers = [index + k for k in range(count)] if isinstance(index, int) else each("index", index)
        seeds = [seed] * count if isinstance(seed, int) else each("seed", seed)
        motions = each("motion", motion) if isinstance(motion, Sequence) else [motion or Motion.still(_LEVEL)] * count
        times = [number / rate for number in numbers] if stamps is None else each("stamps", stamps)
        return [
            Exposure(m.at(time)[0], m, int(own), int(number), float(time), threads)
            for m, own, number, time in zip(motions, seeds, numbers, times, strict=True)
        ]
