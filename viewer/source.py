"""Where the viewer's frames come from: a run on disk, or a sensor that measures while one looks."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.runs import Run
from depthsim.scene import Scene
from depthsim.sensor import Sensor
from depthsim.stereo.sensor import StereoSensor
from depthsim.trajectory import Trajectory


@dataclass(frozen=True)
class Shot:
    """One frame. pose: (4, 4) camera to world. depth: (height, width) float32 [m], 0 where there is no return."""

    pose: NDArray[np.float64]
    depth: NDArray[np.float32]


class Source(Protocol):
    """Frames by number, and the scene they were taken in, if it is known."""

    @property
    def camera(self) -> Camera:
        """The camera of every frame."""

    @property
    def scene(self) -> Scene | None:
        """The scene, if it is known."""

    def __len__(self) -> int: ...

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 3) the camera's path [m]."""

    def shot(self, index: int) -> Shot:
        """Frame ``index``."""


class RunSource:
    """The frames of a run folder."""

    def __init__(self, run: Run, scene: Scene | None) -> None:
        self._run = run
        self.camera: Camera = run.camera
        self.scene: Scene | None = scene

    def __len__(self) -> int:
        return len(self._run)

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 3) the camera's path [m]."""
        return self._run.trajectory.positions

    def shot(self, index: int) -> Shot:
        """Frame ``index``."""
        return Shot(self._run.poses[index], self._run.depth(index))


class SceneSource:
    """Frames that a sensor measures along a trajectory when they are asked for."""

    def __init__(self, sensor: Sensor | StereoSensor, trajectory: Trajectory) -> None:
        self._sensor, self._trajectory = sensor, trajectory
        self.camera: Camera = sensor.camera
        self.scene: Scene | None = sensor.caster.scene

    def __len__(self) -> int:
        return len(self._trajectory)

    @cached_property
    def _poses(self) -> NDArray[np.float64]:
        return self._trajectory.matrices()

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 3) the camera's path [m]."""
        return self._trajectory.positions

    def shot(self, index: int) -> Shot:
        """Frame ``index``."""
        return Shot(self._poses[index], self._sensor.measure(self._poses[index], index=index).depth)
