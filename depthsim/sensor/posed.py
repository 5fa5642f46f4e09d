"""What effects ask of a scene in which objects move."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthsim.moving import Mover, mover_of_face, poses
from depthsim.scene import Scene
from depthsim.sensor.frame import Surfaces
from depthsim.sensor.motion import Motion, velocity_of


@dataclass(frozen=True)
class Posed:
    """A scene at one time [s]; what is turned is turned when it is asked for."""

    scene: Scene
    stamp: float

    @property
    def tags(self) -> tuple[str, ...]:
        """The scene's."""
        return self.scene.tags

    @cached_property
    def normals(self) -> NDArray[np.float32]:
        """(F, 3) unit normals in the world, at that time."""
        return self.scene.normals_at(self.stamp)


def surfaces_at(scene: Surfaces, stamp: float) -> Surfaces:
    """The scene itself where nothing moves in it."""
    return Posed(scene, stamp) if isinstance(scene, Scene) and scene.movers else scene


def seen_from_objects(
    surfaces: Surfaces, face: NDArray[np.int32], motion: Motion
) -> list[tuple[NDArray[np.int64], tuple[NDArray[np.float64], NDArray[np.float64]]]]:
    """Of each object that moves and is seen: its pixels, and the camera's velocity as seen from it.

    face: (pixels,). The velocity is as of :meth:`~depthsim.sensor.motion.Motion.velocity`.
    """
    if not isinstance(surfaces, Posed):
        return []
    movers = surfaces.scene.movers
    whose = mover_of_face(movers, face)
    found = []
    for number in np.unique(whose[whose >= 0]):
        at = beside(movers, int(number), motion)
        found.append((np.flatnonzero(whose == number), velocity_of(at, surfaces.stamp)))
    return found


def beside(movers: tuple[Mover, ...], number: int, motion: Motion) -> Callable[[ArrayLike], NDArray[np.float64]]:
    """The camera's poses in the frame of an object."""

    def at(stamps: ArrayLike) -> NDArray[np.float64]:
        return np.linalg.inv(poses(movers, stamps)[:, number]) @ motion.at(stamps)

    return at
