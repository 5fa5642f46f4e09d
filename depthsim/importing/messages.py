"""What is in the ROS messages of a depth camera."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.extras import load_extra
from depthsim.importing.salvage import Damaged, Message

_BYTES = {"mono8": 1, "8UC1": 1, "Y8": 1, "rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}
_DEPTH = {"16UC1": np.uint16, "mono16": np.uint16, "Z16": np.uint16, "32FC1": np.float32}
_UNITS_TAIL = 4


@dataclass(frozen=True)
class Picture:
    """An image: stamp [ns], frame of reference, pixels; ``unit`` is metres per unit where the message says it."""

    stamp: int
    frame: str
    pixels: NDArray[Any]
    unit: float | None = None


@cache
def _types(ros1: bool) -> Any:
    """The standard types. What they compile for a kind of message is kept for the next bag."""
    typesys = load_extra("rosbags.typesys", "ros")
    return typesys.get_typestore(typesys.Stores.ROS1_NOETIC if ros1 else typesys.Stores.ROS2_HUMBLE)


class Decoder:
    """Decodes messages of the standard types; every method raises :class:`Damaged` for bytes that do not fit.

    The types are ROS's own, not those that a bag carries along: those of RealSense Viewer do not match its bytes.
    """

    def __init__(self, ros1: bool) -> None:
        self._ros1 = ros1
        self._store = _types(ros1)
        self._error = load_extra("rosbags.serde", "ros").SerdeError

    def read(self, message: Message) -> Any:
        """The message as an object."""
        return self._read(message.data, message)

    def _read(self, data: bytes, message: Message) -> Any:
        try:
            if self._ros1:
                return self._store.deserialize_ros1(data, message.kind)
            return self._store.deserialize_cdr(data, message.kind)
        except Exception as error:  # AssertionError and IndexError, too, on broken bytes
            raise Damaged(f"has a {message.kind} on {message.topic} that cannot be read ({error})") from None

    def image(self, message: Message) -> Picture | None:
        """An image of depth (uint16, or float32 in metres) or intensity (uint8); None for another encoding.

        librealsense writes a float32, the metres per unit, behind the data of every image of its bags, marks them by
        the frame_id "1", and says nothing of it in the message's definition (librealsense, ros_writer.cpp, Image.h).
        """
        unit = None
        try:
            found = self.read(message)
        except Damaged:
            if not self._ros1 or len(message.data) < _UNITS_TAIL:
                raise
            found = self._read(message.data[:-_UNITS_TAIL], message)
            if found.header.frame_id != "1":
                raise
            unit = float(np.frombuffer(message.data[-_UNITS_TAIL:], "<f4")[0])
        stamp = stamp_of(found) or message.time
        pixels = _pixels(found, message)
        return None if pixels is None else Picture(stamp, found.header.frame_id, pixels, unit)


def _pixels(image: Any, message: Message) -> NDArray[Any] | None:
    encoding = image.encoding
    depth = _DEPTH.get(encoding)
    if depth is None and encoding not in _BYTES:
        return None
    width = image.width * (np.dtype(depth).itemsize if depth else _BYTES[encoding])
    step = image.step or width
    if step < width or image.height * step > len(image.data) or image.height * image.width == 0:
        raise Damaged(f"has an image on {message.topic} that is shorter than it says")
    rows = np.ascontiguousarray(image.data[: image.height * step].reshape(image.height, step)[:, :width])
    if depth:
        return rows.view(np.dtype(depth).newbyteorder(">" if image.is_bigendian else "<")).astype(depth)
    if _BYTES[encoding] == 1:
        return rows
    colour = rows.reshape(image.height, image.width, -1)[..., :3]
    return np.ascontiguousarray(colour[..., ::-1] if encoding.startswith("bgr") else colour)


def stamp_of(message: Any) -> int:
    """The stamp in a message's header [ns]."""
    stamp = message.header.stamp
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def pose_of(message: Any) -> tuple[list[float], list[float]]:
    """Position and quaternion (x y z w) of an Odometry, a PoseStamped, a PoseWithCovarianceStamped or a Transform."""
    if hasattr(message, "transform"):
        p, q = message.transform.translation, message.transform.rotation
    else:
        pose = message.pose
        pose = getattr(pose, "pose", pose)
        p, q = pose.position, pose.orientation
    return [p.x, p.y, p.z], [q.x, q.y, q.z, q.w]


_BROWN_CONRADY = ("", "plumb_bob", "rational_polynomial", "Brown Conrady")
"""Names of the model whose first five terms are k1 k2 p1 p2 k3: ROS's, with its default of no name, librealsense's."""


def calibration(info: Any, source: Path) -> Mapping[str, Any]:
    """The keys of camera.yaml that a CameraInfo has; fx is 0 for a camera without calibration.

    Raises :class:`InputError` for a distortion that is not zero and not Brown-Conrady's with up to five terms.
    """
    k = info.k if hasattr(info, "k") else info.K
    d = [float(value) for value in (info.d if hasattr(info, "d") else info.D)]
    while d and d[-1] == 0:
        d.pop()
    if d and (info.distortion_model not in _BROWN_CONRADY or len(d) > 5):
        problem = f"its distortion is {info.distortion_model or 'of no name'} with {len(d)} terms"
        fix = "depthsim has plumb_bob, k1 k2 p1 p2 k3: rectify the images, or give a `camera` with such terms"
        raise InputError(source, "CameraInfo", problem, fix)
    distortion = (*d, *[0.0] * (5 - len(d)))
    keys: dict[str, Any] = {
        "width": int(info.width),
        "height": int(info.height),
        **{name: float(k[place]) for name, place in (("fx", 0), ("fy", 4), ("cx", 2), ("cy", 5))},
    }
    if any(distortion):
        keys |= {"model": "brown_conrady", "distortion": distortion}
    return keys


def right_baseline(info: Any) -> float | None:
    """The baseline [m] that the P of a right imager's CameraInfo holds, if it is one."""
    p = info.p if hasattr(info, "p") else info.P
    return -float(p[3]) / float(p[0]) if p[0] > 0 and p[3] < 0 else None
