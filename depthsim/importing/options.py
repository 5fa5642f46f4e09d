"""What an importer can be told, and what it tells."""

import os
from dataclasses import dataclass
from pathlib import Path

from depthsim.errors import InputError
from depthsim.runs import layout
from depthsim.trajectory import Trajectory, read_tum


@dataclass(frozen=True)
class ImportOptions:
    """Where the recording says nothing, or says it wrongly.

    camera: a camera.yaml or the name of a preset. depth: the topic of the depth images. poses: a TUM file, or the topic
    of odometry or poses. rate: frames a second of pictures without stamps. depth_scale: metres per unit. baseline [m].
    """

    camera: str | None = None
    depth: str | None = None
    poses: str | None = None
    rate: float | None = None
    depth_scale: float | None = None
    baseline: float | None = None

    @property
    def pose_file(self) -> Path | None:
        """``poses`` where it is the path of a file."""
        return Path(self.poses) if self.poses and os.path.isfile(self.poses) else None

    def poses_of(self, folder: Path) -> Trajectory | None:
        """The poses of a folder of pictures: those of ``poses``, else of its groundtruth.txt, else none."""
        if self.poses and not self.pose_file:
            raise InputError(self.poses, "", "no such file", "give `poses` a TUM file")
        file = self.pose_file or folder / layout.GROUND_TRUTH
        return read_tum(file) if file.exists() else None


@dataclass(frozen=True)
class Imported:
    """What was imported: frames that are kept, whether they have poses, remarks for people, and where a cut was."""

    frames: int
    posed: bool
    notes: tuple[str, ...] = ()
    cut: InputError | None = None
