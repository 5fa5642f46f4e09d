"""The one way that a frame takes: what the rays meet, the effects in their order, and whole units of depth.

The sensor takes it for every frame, with what its rays or its stereo matcher have found. The diagnosis takes it with
casts that it keeps. So both make the same bits.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.draws import Seed
from depthsim.kernels import kernel
from depthsim.materials import Materials
from depthsim.parallel import split
from depthsim.raycast import Caster, Geometry
from depthsim.scratch import Scratch
from depthsim.sensor.effect import Effect, Stage, physical_order
from depthsim.sensor.effects.align import AlignToColor
from depthsim.sensor.frame import Frame
from depthsim.sensor.motion import Motion
from depthsim.sensor.view import View

SATURATED = 65535
"""The 16-bit value of a depth that is too far for the unit."""


@kernel
def _round_to_units(start, stop, units_per_metre, depth, units):
    """Depth [m] as the camera stores it: whole units, 0 for a hole, 65535 where it would not fit."""
    z, out = depth[start:stop], units[start:stop]
    for i in range(z.size):
        value = z[i] * units_per_metre + np.float32(0.5)
        # Written so that what is not a number becomes a hole.
        value = value if value > np.float32(0) else np.float32(0)
        value = value if value < np.float32(SATURATED) else np.float32(SATURATED)
        out[i] = np.uint16(np.int32(value))


def to_depth_raw(
    depth: NDArray[np.float32], camera: Camera, threads: int = 1, out: NDArray[np.uint16] | None = None
) -> NDArray[np.uint16]:
    """Depth [m] as the camera's 16-bit picture, halves rounded up; 0 is a hole, 65535 too far for the unit."""
    out = np.empty(depth.shape, np.uint16) if out is None else out
    per_metre = np.float32(1 / camera.depth_scale)
    split(_round_to_units, depth.size, threads, per_metre, depth.reshape(-1), out.reshape(-1))
    return out


def acting(effects: Sequence[Effect]) -> list[Effect]:
    """Those that change anything, in the order in which they act."""
    return sorted((e for e in effects if not e.is_neutral), key=physical_order)


def bending(effects: Sequence[Effect]) -> list[Effect]:
    """Those that move the camera or bend its rays, so that the frame has to be cast with them."""
    return [effect for effect in effects if effect.stage <= Stage.OPTICS or effect.moves_camera]


def storing(camera: Camera, effects: Sequence[Effect]) -> Camera:
    """The camera whose pictures are stored: that of the colour pictures where the depth is aligned to them."""
    aligns = any(isinstance(effect, AlignToColor) for effect in effects)
    return camera.aligned_to_color() if aligns and camera.color is not None else camera


@dataclass(frozen=True)
class Exposure:
    """One frame to be taken. pose: (4, 4) camera to world. index, seed: the key of its random numbers. stamp: [s].

    motion: where the camera is, in time. scratch: memory for arrays that are done with when the frame is.
    """

    pose: NDArray[np.float64]
    motion: Motion
    seed: int | Seed = 0
    index: int = 0
    stamp: float = 0.0
    threads: int = 1
    scratch: Scratch = field(default_factory=Scratch)


@dataclass(frozen=True)
class Pipeline:
    """A camera in a scene. The effects that its methods take are ordered by :func:`acting`.

    Where the pictures are aligned to colour, by the camera or by an effect, the left imager is cast and measured.
    """

    caster: Caster
    camera: Camera
    materials: Materials

    def all_of(self, effects: Sequence[Effect]) -> Sequence[Effect]:
        """The effects, with the resampling that an aligned camera brings."""
        if not self.camera.aligned or any(isinstance(effect, AlignToColor) for effect in effects):
            return effects
        return [*effects, AlignToColor()]

    def measuring(self, effects: Sequence[Effect]) -> Camera:
        """The camera that measures."""
        camera = self.camera
        for effect in effects:
            camera = effect.camera_of(camera)
        return camera.left

    def place_of(self, effects: Sequence[Effect], pose: NDArray[np.float64]) -> NDArray[np.float64]:
        """(4, 4) the pose of the camera that measures, where that of the pictures is ``pose``."""
        color = self.measuring(effects).color
        aligns = any(isinstance(effect, AlignToColor) for effect in self.all_of(effects))
        return pose @ np.linalg.inv(color.pose) if aligns and color is not None else pose

    def cast_bent(
        self, effects: Sequence[Effect], exposure: Exposure, *, right: bool, out: Geometry | None = None
    ) -> Geometry:
        """What the rays meet that :func:`bending` effects have bent. out: an earlier result, to be written over."""
        effects = self.all_of(effects)
        e, camera = exposure, self.measuring(effects)
        view = View(e.pose, camera.rays, camera, e.motion, e.seed, e.index, e.stamp, e.threads, e.scratch)
        for effect in bending(effects):
            effect.bend(view)
        # A batch of one, whether there is a pose a frame or a pose a row, so that the same memory fits both.
        poses = view.pose[None]
        fits = out is not None and out.depth.size == camera.width * camera.height
        batch = out.reshaped((1, *camera.shape)) if out is not None and fits else None
        met = self.caster.cast(camera, poses, right=right, rays=view.rays, threads=e.threads, out=batch)
        return met[0]

    def apply(
        self,
        effects: Sequence[Effect],
        geometry: Geometry,
        depth: NDArray[np.float32],
        exposure: Exposure,
        out: NDArray[np.uint16] | None = None,
    ) -> NDArray[np.uint16]:
        """(height, width) the frame as the camera stores it, once the effects that bend no rays have acted.

        As :meth:`measured`. out: memory for the result.
        """
        depth = self.measured(effects, geometry, depth, exposure)
        return to_depth_raw(depth, self.camera, exposure.threads, out)

    def measured(
        self, effects: Sequence[Effect], geometry: Geometry, depth: NDArray[np.float32], exposure: Exposure
    ) -> NDArray[np.float32]:
        """(height, width) float32 what is stored, before it is rounded [m].

        geometry: what the rays met. depth: float32, of its size: what the effects begin with [m]. It is changed in
        place and is the result, unless the pictures are aligned to colour.
        """
        effects, e = self.all_of(effects), exposure
        frame = Frame(
            depth, geometry, self.measuring(effects), self.caster.scene, self.materials, e.motion, e.seed, e.index,
            e.stamp, e.threads, e.scratch,
        )  # fmt: skip
        for effect in effects:
            if effect.stage > Stage.OPTICS:
                effect.apply(frame)
        return frame.depth
