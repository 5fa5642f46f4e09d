"""Which topics of a bag are what, by their types and names.

Known are those of realsense2_camera (ROS 1 and 2), of librealsense's own .bag files (librealsense, ros_file_format.h),
and what is named like them.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from depthsim.errors import InputError
from depthsim.importing.options import ImportOptions

_IMAGE, _INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
_IMU, _TF = "sensor_msgs/msg/Imu", "tf2_msgs/msg/TFMessage"
_POSES = (
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
)
_DEPTH = (
    r"/depth/image_rect_raw$",
    r"/Depth_\d+/image/data$",
    r"/depth/image_raw$",
    r"/aligned_depth_to_\w+/image_raw$",
    r"/depth\w*/image\w*$",
    r"[Dd]epth",
)
_INTENSITY = (
    r"/infra1?/image_rect_raw$",
    r"/Infrared_[01]/image/data$",
    r"/color/image_raw$",
    r"/Color_\d+/image/data$",
    r"/(rgb|left|cam0)/image",
)
_OPTIONS = {r"/option/Depth[ _]Units/value$": "depth_scale", r"/option/Stereo[ _]Baseline/value$": "baseline"}
_METRIC = r"/depth/image_rect$"


@dataclass(frozen=True)
class Topics:
    """The topics by their use; ``images`` are all that could be depth."""

    depth: str
    images: tuple[str, ...]
    info: str | None
    infos: tuple[str, ...]
    intensity: str | None
    imu: Mapping[str, str]
    poses: str | None
    tf: tuple[str, ...]
    options: Mapping[str, str]

    @property
    def all(self) -> set[str]:
        """Everything that is to be read."""
        one = {self.depth, self.info, self.intensity, self.poses} - {None}
        return {str(topic) for topic in one} | {*self.infos, *self.imu, *self.tf, *self.options}


def find(source: Path, kinds: Mapping[str, str], options: ImportOptions, scale: float | None) -> Topics:
    """The topics of a bag; ``scale`` is set where the bag says that its depth is not in millimetres."""
    of: dict[str, list[str]] = {}
    for topic, kind in sorted(kinds.items()):
        of.setdefault(kind, []).append(topic)
    images = of.get(_IMAGE, [])
    depth = _depth(source, images, options, scale, kinds)
    infos = of.get(_INFO, [])
    info = max(infos, key=lambda topic: _alike(topic, depth), default=None)
    others = [topic for topic in images if topic != depth]
    poses = _poses(source, options, [topic for kind in _POSES for topic in of.get(kind, [])])
    found = ((topic, _option(topic)) for topic in of.get("std_msgs/msg/Float32", []))
    return Topics(
        depth,
        tuple(images),
        info,
        tuple(infos),
        _first(_INTENSITY, others),
        {topic: _imu_kind(topic) for topic in of.get(_IMU, [])},
        poses,
        tuple(topic for topic in of.get(_TF, []) + of.get("tf/msg/tfMessage", [])),
        {topic: name for topic, name in found if name},
    )


def _depth(
    source: Path, images: list[str], options: ImportOptions, scale: float | None, kinds: Mapping[str, str]
) -> str:
    if options.depth is not None:
        if options.depth not in images:
            problem = f"has no images on {options.depth}"
            raise InputError(source, "", problem, f"give `depth`, one of {', '.join(images) or 'none'}")
        return options.depth
    exact = (_METRIC,) if scale not in (None, 0.001) else ()
    found = _first((*exact, *_DEPTH), images)
    if found is None:
        squeezed = [topic for topic, kind in kinds.items() if kind.endswith("/CompressedImage")]
        problem = "has no depth images" + (f", only compressed ones on {squeezed[0]}" if squeezed else "")
        fix = f"give `depth`, one of {', '.join(images)}" if images else "record the depth stream, uncompressed"
        raise InputError(source, "", problem, fix)
    return found


def _alike(topic: str, other: str) -> int:
    """How many parts of their names agree, from the front."""
    pairs = zip(topic.split("/"), other.split("/"), strict=False)
    return next((place for place, (a, b) in enumerate(pairs) if a != b), len(other))


def _first(patterns: tuple[str, ...], topics: list[str]) -> str | None:
    return next((topic for pattern in patterns for topic in topics if re.search(pattern, topic)), None)


def _poses(source: Path, options: ImportOptions, there: list[str]) -> str | None:
    if options.poses is not None and options.pose_file is None:
        if options.poses not in there:
            problem = f"has no poses on {options.poses}, and there is no such file"
            raise InputError(source, "", problem, f"give `poses` a TUM file, or one of {', '.join(there) or 'none'}")
        return options.poses
    truth = [topic for topic in there if re.search(r"ground_?truth", topic)]
    chosen = truth or there
    if len(chosen) > 1:
        raise InputError(source, "", f"has poses on {' and '.join(chosen)}", "choose one by `poses` TOPIC")
    return chosen[0] if chosen else None


def _imu_kind(topic: str) -> str:
    """both, gyro or accel."""
    name = topic.lower()
    return "gyro" if "gyro" in name else "accel" if "accel" in name else "both"


def _option(topic: str) -> str | None:
    return next((name for pattern, name in _OPTIONS.items() if re.search(pattern, topic)), None)
