"""Where the camera is against where its poses say: turned or shifted in its mount, or stamped at another time."""

from typing import ClassVar

import numpy as np

from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.parameter import Setting
from depthsim.sensor.view import View
from depthsim.trajectory.rotation import turned


class TimeOffset(Effect):
    """A frame is taken ``offset`` after the time on its stamp, so from the pose that the camera has then."""

    id: ClassVar[str] = "time_offset"
    stage: ClassVar[Stage] = Stage.POSE
    source: ClassVar[str] = "librealsense issue 11873: stamps that are off by a share of the exposure"
    axes = ("motion", "time", "surface", "edge_distance")
    kinds = ("bias", "spread", "tail")
    recording = "fast turns in several directions, with stops between them"
    shown: ClassVar = {"offset": 0.05}

    @classmethod
    def suggested(cls, setting: Setting) -> list[dict[str, float]]:
        """What registration finds."""
        return [] if setting.late is None else [{"offset": setting.late}]

    offset: float = parameter(
        0.0075,
        low=-0.5,
        high=0.5,
        unit="s",
        neutral=0,
        about="time of the picture minus its stamp",
        source="librealsense issue 11873: 7.5 ms at 20 ms of exposure on a D455",
        starts=(0.0, -0.03, 0.03),
    )

    def bend(self, view: View) -> None:
        """Put the pose of the true time in place of that of the stamp."""
        view.stamp += self.offset
        view.pose = view.motion.at(view.stamp)[0]


def _angle(axis: str, name: str) -> float:
    about = f"{name}: rotation about the camera's {axis} axis, a part of the rotation vector"
    angle: float = parameter(
        0.5, low=-45, high=45, unit="deg", neutral=0, about=about, source="assumed: a mount made by hand", starts=(0.0,)
    )
    return angle


class ExtrinsicRotation(Effect):
    """The camera is turned in its mount: true pose = pose · exp([x, y, z]×), in the camera's own axes."""

    id: ClassVar[str] = "extrinsic_rotation"
    stage: ClassVar[Stage] = Stage.POSE
    rank: ClassVar[int] = 2
    source: ClassVar[str] = "Rodrigues' formula; the size is assumed"
    axes = ("image_position", "image_row", "image_column", "incidence", "surface", "height", "edge_distance")
    kinds = ("bias", "spread", "tail")
    recording = "a camera that stands still before a wall and before a corner"
    exact = True
    shown: ClassVar = {"z": 2.0}

    x: float = _angle("x", "pitch")
    y: float = _angle("y", "yaw")
    z: float = _angle("z", "roll")

    @classmethod
    def suggested(cls, setting: Setting) -> list[dict[str, float]]:
        """What registration finds."""
        return [] if setting.turn is None else [dict(zip("xyz", setting.turn, strict=True))]

    @property
    def is_neutral(self) -> bool:
        """Whether no angle is left."""
        return self.x == self.y == self.z == 0

    def bend(self, view: View) -> None:
        """Turn every pose about the camera's own axes."""
        turn = np.eye(4)
        turn[:3, :3] = turned(np.radians([self.x, self.y, self.z]))
        view.pose = view.pose @ turn


def _shift(axis: str) -> float:
    shift: float = parameter(
        0.02, low=-0.5, high=0.5, unit="m", neutral=0, about=f"shift along the camera's {axis} axis",
        source="assumed: a hand-eye calibration that is off by centimetres", starts=(0.0,),
    )  # fmt: skip
    return shift


class ExtrinsicTranslation(Effect):
    """The camera is shifted in its mount: true pose = pose · (x, y, z), in the camera's own axes.

    So are pictures of one camera of a rig whose poses are another one's, such as the colour camera's.
    """

    id: ClassVar[str] = "extrinsic_translation"
    stage: ClassVar[Stage] = Stage.POSE
    rank: ClassVar[int] = 3
    source: ClassVar[str] = "geometry; the size is assumed"
    axes = ("surface", "incidence", "height", "image_position", "image_row", "image_column", "edge_distance", "range")
    kinds = ("bias", "spread", "tail")
    recording = "surfaces to all sides and below, near and far"
    exact = True
    shown: ClassVar = {"x": 0.1, "z": 0.0}

    x: float = _shift("x")
    y: float = _shift("y")
    z: float = _shift("z")

    @classmethod
    def suggested(cls, setting: Setting) -> list[dict[str, float]]:
        """What registration finds."""
        return [] if setting.shift is None else [dict(zip("xyz", setting.shift, strict=True))]

    @property
    def is_neutral(self) -> bool:
        """Whether there is no shift."""
        return self.x == self.y == self.z == 0

    def bend(self, view: View) -> None:
        """Move every pose along the camera's own axes."""
        shift = np.eye(4)
        shift[:3, 3] = self.x, self.y, self.z
        view.pose = view.pose @ shift
