"""ROS 1 and ROS 2 bags of depth cameras, and those that RealSense Viewer records (ROS 1 with librealsense's topics).

Of the topics are taken: depth, the CameraInfo nearest to it by name, an intensity image of the same size, the IMU, and
odometry or poses (or else tf). `topics.py` says by which names they are found.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.importing import topics as names
from depthsim.importing.bagfile import BagFile
from depthsim.importing.imu import ImuStreams
from depthsim.importing.messages import Decoder, Picture, calibration, pose_of, right_baseline, stamp_of
from depthsim.importing.options import Imported, ImportOptions
from depthsim.importing.recording import Recording, to_units, with_options
from depthsim.importing.salvage import Damaged, Message
from depthsim.importing.transforms import Transforms, mounted, trajectory_of
from depthsim.presets import preset, resolve_camera
from depthsim.runs import layout
from depthsim.trajectory import Trajectory, read_tum
from depthsim.yamlfile import read_mapping, validate

_MILLIMETRE = 0.001
_MEND = "the frames before that are kept; record it again for the rest"


def read_bag(source: Path, folder: Path, options: ImportOptions) -> Imported:
    """Read a bag into ``folder`` as a run; a damaged one as far as it goes."""
    bag = BagFile(source)
    try:
        reading = _Reading(source, folder, options, bag)
        damage: tuple[Path, str] | None = None
        try:
            for message in bag.messages(reading.wanted):
                reading.take(message)
        except Damaged as fault:
            damage = source, str(fault)
        return reading.finish(damage or bag.damage)
    finally:
        bag.close()


class _Reading:
    """What has been read of a bag."""

    def __init__(self, source: Path, folder: Path, options: ImportOptions, bag: BagFile) -> None:
        self._source, self._options = source, options
        self._found = names.find(source, bag.topics, options, self._exact_scale(source))
        self.wanted = self._found.all
        self._decoder = Decoder(bag.ros1)
        self._recording = Recording(folder, source)
        self._scale = options.depth_scale or self._exact_scale(source)
        self._info: Any = None
        self._baseline: float | None = None
        self._frame = ""
        self._rgb_shape: tuple[int, ...] = ()
        self._imu = ImuStreams()
        self._poses: dict[int, tuple[list[float], list[float]]] = {}
        self._body = ""
        self._transforms = Transforms()
        self._waiting: list[Message] = []
        self._notes: list[str] = []

    @staticmethod
    def _exact_scale(source: Path) -> float | None:
        """The metres per unit that a bag of `depthsim export` gives in its custom data."""
        file = source / "metadata.yaml"
        if not file.is_file():
            return None
        try:
            found = read_mapping(file, "a metadata.yaml")["rosbag2_bagfile_information"]["custom_data"]["depth_scale"]
            return float(found)
        except (InputError, KeyError, TypeError, ValueError):
            return None

    def take(self, message: Message) -> None:
        """Take a message in."""
        found, topic = self._found, message.topic
        if topic == found.depth:
            self._take_depth(message)
        elif topic == found.intensity:
            self._take_intensity(message)
        elif topic in found.infos:
            info = self._decoder.read(message)
            if topic == found.info:
                self._info = info
            if "2" in topic.rpartition("/")[0].rpartition("/")[2]:  # infra2/camera_info
                self._baseline = right_baseline(info) or self._baseline
        elif topic in found.imu:
            self._imu.add(found.imu[topic], self._decoder.read(message))
        elif topic == found.poses:
            pose = self._decoder.read(message)
            self._poses[stamp_of(pose)] = pose_of(pose)
            self._body = getattr(pose, "child_frame_id", "")
        elif topic in found.tf:
            for transform in self._decoder.read(message).transforms:
                stamp = stamp_of(transform) if "static" not in topic else 0
                parent, child = transform.header.frame_id, transform.child_frame_id
                self._transforms.add(parent, child, stamp, *pose_of(transform))
        elif topic in found.options:
            value = float(f"{self._decoder.read(message).data:.7g}")
            if found.options[topic] == "depth_scale":
                self._scale = self._options.depth_scale or value
            else:
                self._baseline = value / 1000  # librealsense gives it in millimetres

    def _take_depth(self, message: Message) -> None:
        picture = self._decoder.image(message)
        if picture is None or picture.pixels.dtype == np.uint8:
            problem = f"{message.topic} holds no depth of 16UC1, mono16 or 32FC1"
            raise InputError(self._source, "", problem, f"give `depth`, one of {', '.join(self._found.images)}")
        self._frame = picture.frame
        if picture.unit:
            self._scale = self._options.depth_scale or float(f"{picture.unit:.7g}")
        self._recording.add(layout.DEPTH, picture.stamp / 10**9, self._units(picture))

    def _units(self, picture: Picture) -> NDArray[np.uint16]:
        if picture.pixels.dtype == np.uint16:
            return picture.pixels
        return to_units(picture.pixels, self._scale or _MILLIMETRE)

    def _take_intensity(self, message: Message) -> None:
        picture = self._decoder.image(message)
        if picture is not None and picture.pixels.dtype == np.uint8:
            self._rgb_shape = picture.pixels.shape[:2]
            self._recording.add("rgb", picture.stamp / 10**9, picture.pixels)

    def finish(self, damage: tuple[Path, str] | None) -> Imported:
        """Write what is not a picture; the run is whole then."""
        recording = self._recording
        if not recording.count():
            problem = damage[1] + " before its first depth image" if damage else f"{self._found.depth} has no message"
            raise InputError(damage[0] if damage else self._source, "", problem, "give another recording")
        if self._rgb_shape and self._rgb_shape != recording.shape:
            recording.drop("rgb")
            self._notes.append(f"{self._found.intensity} has another size than the depth and was left out")
        truth = self._truth()
        frames, notes = recording.finish(self._camera(), truth, self._imu.columns())
        cut = None
        if damage:
            end = recording.stamps()[-1] - recording.stamps()[0]
            place = f"after {frames} frames, {end:.2f} s"
            cut = InputError(damage[0], place, damage[1], _MEND)
        return Imported(frames, truth is not None, (*self._notes, *notes), cut)

    def _truth(self) -> Trajectory | None:
        if self._options.pose_file:
            return self._options.mounted(read_tum(self._options.pose_file))
        if not self._poses:
            return self._options.mounted(self._transforms.poses(self._frame))
        poses = trajectory_of(self._poses)
        if self._options.mount is not None:
            return self._options.mounted(poses)
        body, frame = self._body.lstrip("/"), self._frame.lstrip("/")
        if body and body == frame:
            return poses
        there = self._transforms.fixed(body, frame) if body and frame else None
        if there is not None:
            return mounted(poses, *there)
        what = "does not say what its poses are of" if not body else f"is of {body}, and tf has no way to the camera"
        self._notes.append(f"{self._found.poses} {what}: taken as the camera's optical frame; else give `mount`")
        return poses

    def _camera(self) -> Camera:
        options = self._options
        camera = resolve_camera(options.camera) if options.camera is not None else self._camera_of_info()
        given = {"rate": options.rate, "depth_scale": options.depth_scale, "baseline": options.baseline}
        return with_options(camera, given)

    def _camera_of_info(self) -> Camera:
        keys = dict(calibration(self._info, self._source)) if self._info is not None else {}
        if not keys.get("fx"):
            problem = f"has no calibration of {self._found.depth}"
            raise InputError(self._source, "", problem, "give `camera`, a camera.yaml or a preset such as d435")
        if self._baseline is None and self._options.baseline is None:
            self._notes.append("the baseline is unknown, that of a D435 is taken; give `baseline`")
        keys |= {"baseline": self._baseline or preset("d435").baseline, "depth_scale": self._scale or _MILLIMETRE}
        stamps = self._recording.stamps()
        if len(stamps) > 1:
            rate = 1 / float(np.median(np.diff(stamps)))
            keys["rate"] = round(rate, 2) or rate
        return validate(Camera, {"name": self._source.stem, **keys}, self._source, "CameraInfo")
