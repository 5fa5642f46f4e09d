"""What is on show: a scene, a recording, or both, and the camera's path through it. All browsers share it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.materials import Materials
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.scene import Scene
from depthsim.sensor import Profile
from depthsim.sensor.motion import Motion
from depthsim.trajectory import Trajectory
from viewer.report import Report


@dataclass(frozen=True, eq=False)
class Stage:
    """What the viewer was asked to show.

    scene: where frames are simulated; None for a recording without one. trajectory: the camera at each frame.
    camera: of the recording, or what the simulation begins with. profile: the sensor that the simulation begins with.
    run: the recording, if there is one. report: a diagnosis of it. name: what the page is called.
    """

    name: str
    materials: Materials
    trajectory: Trajectory
    camera: Camera
    profile: Profile
    scene: Scene | None = None
    run: Run | None = None
    report: Report | None = None

    @cached_property
    def caster(self) -> Caster | None:
        """Of the scene; made when it is first asked for, which takes a second for a million faces."""
        return None if self.scene is None else Caster(self.scene)

    @cached_property
    def objects(self) -> dict[int, str]:
        """The names of the objects by their numbers; none where all is one."""
        if self.run is not None and self.run.instances:
            return {number: one.name for number, one in self.run.instances.items()}
        if self.scene is None or len(self.scene.objects) == 1:
            return {}
        return {number: one.name for number, one in enumerate(self.scene.objects, start=1)}

    def instances(self, face: NDArray[np.int32]) -> NDArray[np.uint16] | None:
        """The number of the object of each face, -1 for none; None where the scene is one."""
        if self.scene is None or len(self.scene.objects) == 1:
            return None
        return self.scene.instance_of_face[face + 1]

    @cached_property
    def motion(self) -> Motion:
        """The camera's way; that of a recording has all its poses."""
        return Motion.along(self.trajectory, None if self.run is None else self.run.truth)

    @property
    def tags(self) -> tuple[str, ...]:
        """The material tags that the pictures of tags mean."""
        if self.scene is not None:
            return self.scene.tags
        return self.run.tags if self.run is not None else ()

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) the corners of the scene [m], or of what lies 3 m around the path where there is no scene."""
        if self.scene is not None:
            standing = self.scene.vertices[: self.scene.standing[0]]
            return np.stack([standing.min(axis=0), standing.max(axis=0)])
        path = self.trajectory.positions
        return np.stack([path.min(axis=0) - 3, path.max(axis=0) + 3])
