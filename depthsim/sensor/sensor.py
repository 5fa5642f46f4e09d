"""The sensor: a camera and effects, from poses to measured depth."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.kernels import kernel
from depthsim.materials import Materials, load_materials
from depthsim.parallel import core_count, split
from depthsim.raycast import Caster, Geometry
from depthsim.sensor.draws import Seed
from depthsim.sensor.effect import Effect, Stage, physical_order
from depthsim.sensor.frame import Frame
from depthsim.sensor.motion import Motion
from depthsim.sensor.scratch import Scratch
from depthsim.sensor.view import View

SATURATED = 65535
"""The 16-bit value of a depth that is too far for the unit."""


@kernel
def _through_disparity(start, stop, focal_baseline, clean, depth):
    """Z -> disparity f·b / Z -> Z (Eq. 2 of the paper: Z = b·f / (x_R - x_L)); 0 stays 0."""
    z, out = clean[start:stop], depth[start:stop]
    for i in range(z.size):
        disparity = focal_baseline / z[i]
        out[i] = focal_baseline / disparity if z[i] > np.float32(0) else np.float32(0)


@kernel
def _round_to_units(start, stop, units_per_metre, depth, units):
    """Depth [m] as the camera stores it: whole units, 0 for no return, 65535 where it would not fit."""
    z, out = depth[start:stop], units[start:stop]
    for i in range(z.size):
        value = z[i] * units_per_metre + np.float32(0.5)
        # Written so that what is not a number becomes no return.
        value = value if value > np.float32(0) else np.float32(0)
        value = value if value < np.float32(SATURATED) else np.float32(SATURATED)
        out[i] = np.uint16(np.int32(value))


def through_disparity(
    clean: NDArray[np.float32], camera: Camera, threads: int, out: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Clean depth [m] written to ``out`` as what a disparity gives back: the same but for the last bit."""
    split(_through_disparity, out.size, threads, np.float32(camera.focal_baseline), clean.reshape(-1), out.reshape(-1))
    return out


def to_units(
    depth: NDArray[np.float32], camera: Camera, threads: int = 1, out: NDArray[np.uint16] | None = None
) -> NDArray[np.uint16]:
    """Depth [m] as the camera's 16-bit picture, halves rounded up; 0 is no return, 65535 too far for the unit."""
    out = np.empty(depth.shape, np.uint16) if out is None else out
    per_metre = np.float32(1 / camera.depth_scale)
    split(_round_to_units, depth.size, threads, per_metre, depth.reshape(-1), out.reshape(-1))
    return out


@dataclass(frozen=True)
class Measurement:
    """What the sensor gives for one pose.

    units: (height, width) uint16, depth in units of camera.depth_scale; 0 is no return, 65535 too far.
    depth: (height, width) float32, the same before it was rounded [m].
    given: ``clean``, or what casts it.
    """

    units: NDArray[np.uint16]
    depth: NDArray[np.float32]
    given: Geometry | Callable[[], Geometry]

    @cached_property
    def clean(self) -> Geometry:
        """The geometry as it is, along the rays and from the pose that the camera believes in.

        Where effects bend the rays or move the camera the frame is made without it; then it is cast when it is first
        asked for.
        """
        return self.given() if callable(self.given) else self.given

    @property
    def cast_already(self) -> Geometry | None:
        """``clean`` if that was cast, for the next frame to write over."""
        return vars(self).get("clean") if callable(self.given) else self.given


class Sensor:
    """Measures depth in a scene.

    The order of the effects is the physical one (:func:`~depthsim.sensor.effect.physical_order`), whatever the order
    in which they were given. Effects at their neutral value are left out. A tag that is not among the materials is an
    :class:`~depthsim.errors.InputError`; a parameter for a material that this scene does not have is not.
    """

    def __init__(
        self, caster: Caster, camera: Camera, effects: Sequence[Effect] = (), materials: Materials | None = None
    ) -> None:
        self.caster, self.camera = caster, camera
        self.materials = materials or load_materials()
        self.effects = sorted((e for e in effects if not e.is_neutral), key=physical_order)
        self._check_tags()
        self._own = threading.local()

    def _check_tags(self) -> None:
        """Raise :class:`InputError` where the scene or an effect names a tag that is no material."""
        scene = self.caster.scene
        places = [(str(scene.source or scene.name), "", tag) for tag in scene.tags]
        places += [("sensor profile", effect.id, tag) for effect in self.effects for tag in effect.material_tags]
        for file, place, tag in places:
            if tag not in self.materials:
                mend = f"the tags are {', '.join(self.materials.tags)}"
                raise InputError(file, place, f"there is no material {tag!r}", mend)

    def measure(
        self,
        pose: NDArray[np.float64],
        *,
        index: int = 0,
        stamp: float = 0.0,
        seed: int | Seed = 0,
        motion: Motion | None = None,
        threads: int | None = None,
        out: Measurement | None = None,
    ) -> Measurement:
        """One frame.

        pose: (4, 4) camera to world. index: the number of the frame in its run; with ``seed`` it keys the random
        numbers. stamp: when the frame is taken [s]. motion: the camera's path around ``stamp``, for effects of motion
        and time; it stands still without. out: an earlier result of the same camera, to be written over.
        """
        threads = threads or core_count()
        if out is not None and out.depth.shape != self.camera.shape:
            raise ValueError(f"out has pictures of {out.depth.shape}, the camera of {self.camera.shape}")
        pose = np.array(pose, np.float64)  # a copy, because the caller may change his before ``clean`` is asked for
        motion = motion or Motion.still(pose)
        right = any(effect.needs_right for effect in self.effects)
        bending = [effect for effect in self.effects if effect.stage <= Stage.OPTICS]
        scratch, before = Scratch.of_thread(self._own), out.cast_already if out else None
        cast = partial(self.caster.cast, self.camera, pose, right=right and not bending, threads=threads, out=before)
        clean: Geometry | Callable[[], Geometry] = cast
        if bending:
            view = View(pose, self.camera.rays, self.camera, motion, seed, index, stamp, threads, scratch)
            for effect in bending:
                effect.bend(view)
            poses = view.pose if view.pose.ndim == 2 else view.pose[None]
            met = self.caster.cast(
                self.camera, poses, right=right, rays=view.rays, threads=threads, out=getattr(self._own, "met", None)
            )
            self._own.met = met
            met = met if view.pose.ndim == 2 else met[0]
        else:
            clean = met = cast()
        depth = out.depth if out else np.empty(self.camera.shape, np.float32)
        units = out.units if out else np.empty(self.camera.shape, np.uint16)
        through_disparity(met.depth, self.camera, threads, depth)
        frame = Frame(
            depth, met, self.camera, self.caster.scene, self.materials, motion, seed, index, stamp, threads, scratch
        )
        for effect in self.effects[len(bending) :]:
            effect.apply(frame)
        return Measurement(to_units(frame.depth, self.camera, threads, units), frame.depth, clean)
