"""What an importer can be given, and what it reports."""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.importing.transforms import mounted
from depthsim.runs import layout
from depthsim.trajectory import Trajectory, read_tum


@dataclass(frozen=True)
class ImportOptions:
    """Where the recording says nothing, or says it wrongly.

    camera: a camera.yaml or the name of a preset. depth: the topic of the depth images. poses: a TUM file, or the topic
    of odometry or poses. rate: frames a second of pictures without stamps. depth_scale: metres per unit. baseline [m].
    mount: the camera's optical frame (x right, y down, z forward) in the frame that the poses are of, as x, y, z [m]
    and the unit quaternion qx, qy, qz, qw; that frame is the child frame of a topic, the depth images' own for tf.
    """

    camera: str | None = None
    depth: str | None = None
    poses: str | None = None
    rate: float | None = None
    depth_scale: float | None = None
    baseline: float | None = None
    mount: tuple[float, ...] | None = None

    @property
    def pose_file(self) -> Path | None:
        """``poses`` where it is the path of a file."""
        return Path(self.poses) if self.poses and os.path.isfile(self.poses) else None

    def poses_of(self, folder: Path) -> Trajectory | None:
        """The poses of a folder of pictures: those of ``poses``, else of its groundtruth.txt, else none."""
        if self.poses and not self.pose_file:
            raise InputError(self.poses, "", "no such file", "give `poses` a TUM file")
        file = self.pose_file or folder / layout.GROUND_TRUTH
        return self.mounted(read_tum(file) if file.exists() else None)

    def mounted(self, poses: Trajectory | None) -> Trajectory | None:
        """The poses of the camera, of those of what it is mounted on; the same where nothing is said of a mounting."""
        if self.mount is None:
            return poses
        if poses is None:
            raise InputError("`mount`", "", "there are no poses that it could be applied to", "give `poses`, too")
        return mounted(poses, np.array(self.mount[:3]), np.array(self.mount[3:]))


def read_mount(text: str) -> tuple[float, ...]:
    """``x,y,z,qx,qy,qz,qw`` as numbers, the quaternion normalised; one that is off by more than 1 % is refused."""
    fix = "give x,y,z,qx,qy,qz,qw: the camera in the frame of the poses, metres and a unit quaternion"
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        raise InputError("`mount`", text, "holds something that is no number", fix) from None
    if len(numbers) != 7 or not all(map(math.isfinite, numbers)):
        raise InputError("`mount`", text, "is not seven finite numbers", fix)
    length = math.hypot(*numbers[3:])
    if abs(length - 1) > 1e-2:
        raise InputError("`mount`", text, f"its quaternion has length {length:.6g}", fix)
    return (*numbers[:3], *(number / length for number in numbers[3:]))


@dataclass(frozen=True)
class Imported:
    """What was imported: frames that are kept, whether they have poses, remarks for people, and where a cut was."""

    frames: int
    posed: bool
    notes: tuple[str, ...] = ()
    cut: InputError | None = None
