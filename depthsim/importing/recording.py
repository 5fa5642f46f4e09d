"""Writing a recording as a run folder, frame by frame, without knowing beforehand how many there are."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.flight.table import write_table
from depthsim.runs import layout
from depthsim.runs.folder import gap_remarks
from depthsim.runs.png import encode_png
from depthsim.runs.storing import write_whole
from depthsim.trajectory import Trajectory, tum_text
from depthsim.trajectory.poses import TOLERANCE
from depthsim.yamlfile import validate

Image = NDArray[np.uint8] | NDArray[np.uint16]


class Recording:
    """Depth and intensity images that go to disk as they come."""

    def __init__(self, folder: Path, source: Path) -> None:
        self._folder, self._source = folder, source
        self._stamps: dict[str, set[float]] = {}
        self.shape: tuple[int, ...] | None = None

    def add(self, stream: str, stamp: float, image: Image) -> None:
        """Write one image of ``depth`` (uint16) or ``rgb`` (uint8); ``stamp`` [s] is rounded to microseconds."""
        stamp = round(stamp, 6)
        if not math.isfinite(stamp):
            raise InputError(self._source, stream, "has a stamp that is no number", "correct the stamps")
        if stream == layout.DEPTH:
            if self.shape not in (None, image.shape):
                problem = f"the frame at {stamp:.6f} s is {_size(image.shape)}, those before {_size(self.shape or ())}"
                raise InputError(self._source, "", problem, "import one resolution at a time")
            self.shape = image.shape
        known = self._stamps.setdefault(stream, set())
        if not known:
            (self._folder / stream).mkdir(exist_ok=True)
        known.add(stamp)
        write_whole(self._folder / stream / layout.frame_name(stamp), encode_png(image))

    def count(self, stream: str = layout.DEPTH) -> int:
        """How many images there are."""
        return len(self._stamps.get(stream, ()))

    def stamps(self, stream: str = layout.DEPTH) -> NDArray[np.float64]:
        """(N,) increasing [s]."""
        return np.array(sorted(self._stamps.get(stream, ())))

    def drop(self, stream: str) -> None:
        """Forget a stream and remove its images."""
        for stamp in self._stamps.pop(stream, ()):
            (self._folder / stream / layout.frame_name(stamp)).unlink()
        (self._folder / stream).rmdir()

    def finish(
        self, camera: Camera, truth: Trajectory | None, imu: Mapping[str, NDArray[np.float64]] | None = None
    ) -> tuple[int, list[str]]:
        """Write camera, lists, poses and imu.csv; drop frames outside the poses. How many are left, and remarks."""
        notes = []
        if self.shape is None:
            raise InputError(self._source, "", "holds no depth image", "give a recording of a depth camera")
        if self.shape != camera.shape:
            wanted = f"the camera {camera.width}x{camera.height}"
            raise InputError(self._source, "", f"its depth is {_size(self.shape)}, {wanted}", "give the right `camera`")
        if truth is not None:
            early, late = truth.stamps[0] - TOLERANCE, truth.stamps[-1] + TOLERANCE
            outside = [s for s in self._stamps[layout.DEPTH] if not early <= s <= late]
            for stamp in outside:
                (self._folder / layout.DEPTH / layout.frame_name(stamp)).unlink()
            self._stamps[layout.DEPTH].difference_update(outside)
            if outside:
                notes.append(f"{len(outside)} frames outside the poses were left out")
            if not self._stamps[layout.DEPTH]:
                problem = f"no frame lies inside its poses, {truth.stamps[0]:.3f} to {truth.stamps[-1]:.3f} s"
                raise InputError(self._source, "", problem, "give poses with the stamps of the frames")
            notes += gap_remarks(truth, self.stamps())
            write_whole(self._folder / layout.GROUND_TRUTH, tum_text(truth).encode())
        else:
            notes.append("no poses: `depthsim reconstruct` or `depthsim slam` estimates them")
        if imu is not None:
            write_table(imu, self._folder / "imu.csv")
        write_whole(self._folder / layout.CAMERA, camera.to_yaml().encode())
        record = {"imported_from": self._source.name}
        write_whole(self._folder / layout.RECORD, yaml.safe_dump(record).encode())
        for stream in sorted(self._stamps, reverse=True):  # depth.txt last: it makes the folder a run
            text = layout.list_text(stream, self.stamps(stream))
            write_whole(self._folder / layout.list_name(stream), text.encode())
        return self.count(), notes


def _size(shape: tuple[int, ...]) -> str:
    return "x".join(map(str, reversed(shape[:2])))


def with_options(camera: Camera, given: Mapping[str, float | None]) -> Camera:
    """The camera with what was given on the command line in place of its own; None was not given."""
    stated = {key: value for key, value in given.items() if value is not None}
    return validate(Camera, {**camera.model_dump(), **stated}, Path("--" + ", --".join(stated or given)))


def to_units(metres: NDArray[np.floating], depth_scale: float) -> NDArray[np.uint16]:
    """Depth [m] as 16-bit units: what is not finite and positive is a hole, but +inf, which is too far."""
    units = np.rint(np.asarray(metres, np.float64) / depth_scale)
    with np.errstate(invalid="ignore"):
        far = units >= layout.SATURATED
        units[~(units > 0)] = 0
    units[far] = layout.SATURATED
    return units.astype(np.uint16)
