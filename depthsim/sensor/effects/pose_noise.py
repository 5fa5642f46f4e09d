"""Poses that are off by a rigid motion of their own in every frame: tracking, motion capture, a robot's joints."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Draws
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.noise_field import frame_weights
from depthsim.sensor.view import View
from depthsim.trajectory.rotation import turned

_TICK = 2.0**-10
"""[s] Frames nearer in time than this have the same error, so that a process in time needs no other frame."""


class PoseNoise(Effect):
    """The camera is at pose · exp(ξ), ξ normal in six directions, correlated in time by exp(-|t| / correlation_time).

    The error is a function of the frame's stamp alone, so every frame can be made by itself; a run keeps its poses as
    they were given.
    """

    id: ClassVar[str] = "pose_noise"
    stage: ClassVar[Stage] = Stage.POSE
    rank: ClassVar[int] = 3
    source: ClassVar[str] = "a first-order Gauss-Markov process in each direction, in the camera's own axes"
    axes = ("time", "surface", "image_position", "edge_distance", "incidence", "image_row", "image_column")
    kinds = ("bias", "spread", "correlation", "tail")
    recording = "three walls of a corner in every picture, from a camera that stands still and then moves"
    shown: ClassVar = {"rotation": 1.0, "translation": 0.02}

    rotation: float = parameter(
        0.2,
        low=0,
        high=20,
        unit="deg",
        neutral=0,
        about="standard deviation of the turn about each of the camera's axes",
        source="assumed: within the 0.5 deg that Sturm 2012 gives for the motion capture of the TUM benchmark",
        starts=(0.05, 0.3, 1.0),
    )
    translation: float = parameter(
        0.003,
        low=0,
        high=0.5,
        unit="m",
        neutral=0,
        about="standard deviation of the shift along each of the camera's axes",
        source="assumed: within the 10 mm that Sturm 2012 gives for the motion capture of the TUM benchmark",
        starts=(0.001, 0.006),
    )
    correlation_time: float = parameter(
        0.5,
        low=0,
        high=1e4,
        unit="s",
        about="time after which the error is correlated by 1/e with what it was; 0: every frame has its own",
        source="assumed: that of tracking by filters; jitter of joints is shorter, drift of odometry longer",
        starts=(0.05, 0.5),
        scale="log",
    )

    @property
    def is_neutral(self) -> bool:
        """Whether the poses are right."""
        return self.rotation == self.translation == 0

    def bend(self, view: View) -> None:
        """Put the camera where it is."""
        elapsed = view.stamp - view.motion.start
        six = correlated(view.draws(self.id), elapsed, self.correlation_time, 6)
        error = np.eye(4)
        error[:3, :3] = turned(np.radians(self.rotation) * six[:3])
        error[:3, 3] = self.translation * six[3:]
        view.pose = view.pose @ error


def correlated(draws: Draws, elapsed: float, time: float, count: int) -> NDArray[np.float64]:
    """(count,) normal numbers with variance 1, correlated by exp(-|t| / time) with those at another ``elapsed`` [s]."""
    per_tick = float(np.exp(-_TICK / time)) if time > 0 else 0.0
    ticks, weights = frame_weights(int(np.floor(elapsed / _TICK)), per_tick)
    drawn = [draws.of_frame(int(tick)).normal((count,)) for tick in ticks]
    return np.asarray(weights.astype(np.float64) @ np.array(drawn, np.float64))
