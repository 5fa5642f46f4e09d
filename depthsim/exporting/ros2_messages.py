"""The ROS 2 messages of a run."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.exporting.tables import Floats, colour, points_of
from depthsim.extras import load_extra
from depthsim.runs import Run, layout
from depthsim.trajectory.rotation import multiply

MAP, LINK, DEPTH, OPTICAL = "map", "camera_link", "camera_depth_frame", "camera_depth_optical_frame"
OPTICAL_IN_LINK = np.array([-0.5, 0.5, -0.5, 0.5])
"""x y z w: the optical frame (x right, y down, z forward) in a body frame (x forward, y left, z up)."""


class Messages:
    """Makes messages of a run's data; every ``time`` is in nanoseconds."""

    def __init__(self, run: Run) -> None:
        typesys = load_extra("rosbags.typesys", "ros")
        self.store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
        self._run = run

    def _new(self, kind: str, **fields: Any) -> Any:
        return self.store.types[kind](**fields)

    def _header(self, time: int, frame: str = OPTICAL) -> Any:
        stamp = self._new("builtin_interfaces/msg/Time", sec=time // 10**9, nanosec=time % 10**9)
        return self._new("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def _image(self, time: int, encoding: str, picture: NDArray[Any]) -> Any:
        data = np.ascontiguousarray(picture).view(np.uint8).reshape(-1)
        height, width = picture.shape[:2]
        return self._new(
            "sensor_msgs/msg/Image",
            header=self._header(time),
            height=height,
            width=width,
            encoding=encoding,
            is_bigendian=0,
            step=len(data) // height,
            data=data,
        )

    def depth_millimetres(self, time: int, raw: NDArray[np.uint16], scale: float) -> Any:
        """16UC1: the picture itself where its unit is 1 mm; saturation stays 65535."""
        if scale != 0.001:
            far = raw == layout.SATURATED
            raw = np.clip(np.rint(raw * (scale * 1000)), 0, layout.SATURATED).astype(np.uint16)
            raw[far] = layout.SATURATED
        return self._image(time, "16UC1", raw)

    def depth_metres(self, time: int, raw: NDArray[np.uint16], metres: NDArray[np.float32]) -> Any:
        """32FC1."""
        picture = metres.copy()
        picture[raw == 0] = np.nan
        picture[raw == layout.SATURATED] = np.inf
        return self._image(time, "32FC1", picture)

    def intensity(self, time: int, image: NDArray[np.uint8]) -> Any:
        """mono8 or rgb8."""
        return self._image(time, "mono8" if image.ndim == 2 else "rgb8", image)

    def camera_info(self, time: int, *, right: bool) -> Any:
        """CameraInfo; that of the right imager has -fx b in its P."""
        c = self._run.camera
        shift = -c.focal_baseline if right else 0.0
        no = self._new("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        return self._new(
            "sensor_msgs/msg/CameraInfo",
            header=self._header(time),
            height=c.height,
            width=c.width,
            distortion_model="plumb_bob",
            d=np.array(c.distortion),
            k=np.array([c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1.0]),
            r=np.eye(3).ravel(),
            p=np.array([c.fx, 0, c.cx, shift, 0, c.fy, c.cy, 0, 0, 0, 1.0, 0]),
            binning_x=0,
            binning_y=0,
            roi=no,
        )

    def imu(self, time: int, rates: Sequence[float], force: Sequence[float]) -> Any:
        """Imu without orientation, which its covariance of -1 says."""
        unknown = np.zeros(9)
        return self._new(
            "sensor_msgs/msg/Imu",
            header=self._header(time, "camera_imu_optical_frame"),
            orientation=self._quaternion(np.array([0, 0, 0, 1.0])),
            orientation_covariance=np.array([-1.0, *[0.0] * 8]),
            angular_velocity=self._vector(rates),
            angular_velocity_covariance=unknown,
            linear_acceleration=self._vector(force),
            linear_acceleration_covariance=unknown,
        )

    def odometry(self, time: int, position: Floats, quaternion: Floats) -> Any:
        """The optical frame in map; the twist is left at zero."""
        pose = self._new(
            "geometry_msgs/msg/Pose", position=self._point(position), orientation=self._quaternion(quaternion)
        )
        zero = self._vector((0.0, 0.0, 0.0))
        twist = self._new("geometry_msgs/msg/Twist", linear=zero, angular=zero)
        return self._new(
            "nav_msgs/msg/Odometry",
            header=self._header(time, MAP),
            child_frame_id=OPTICAL,
            pose=self._new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36)),
            twist=self._new("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
        )

    def link_transform(self, time: int, position: Floats, quaternion: Floats) -> Any:
        """map -> camera_link."""
        back = OPTICAL_IN_LINK * [-1, -1, -1, 1]
        return self._transforms(time, [(MAP, LINK, position, multiply(quaternion, back))])

    def static_transforms(self, time: int) -> Any:
        """What does not move: the frames inside the camera; the IMU sits in the optical frame."""
        zero, one = np.zeros(3), np.array([0, 0, 0, 1.0])
        edges = [
            (LINK, DEPTH, zero, one),
            (DEPTH, OPTICAL, zero, OPTICAL_IN_LINK),
            (OPTICAL, "camera_imu_optical_frame", zero, one),
        ]
        return self._transforms(time, edges)

    def _transforms(self, time: int, edges: list[tuple[str, str, Floats, Floats]]) -> Any:
        made = []
        for parent, child, position, quaternion in edges:
            transform = self._new(
                "geometry_msgs/msg/Transform",
                translation=self._vector(position),
                rotation=self._quaternion(quaternion),
            )
            made.append(
                self._new(
                    "geometry_msgs/msg/TransformStamped",
                    header=self._header(time, parent),
                    child_frame_id=child,
                    transform=transform,
                )
            )
        return self._new("tf2_msgs/msg/TFMessage", transforms=made)

    def points(self, time: int, index: int) -> Any:
        """PointCloud2 with x, y, z and, where there is an image, rgb: those pixels that have a return."""
        points, seen = points_of(self._run, index)
        table = np.zeros(len(points), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
        table["x"], table["y"], table["z"] = points.T
        image = self._run.rgb(index)
        if image is not None:
            r, g, b = colour(image)[seen].astype(np.uint32).T
            table["rgb"] = r << 16 | g << 8 | b
        names = ("x", "y", "z") if image is None else ("x", "y", "z", "rgb")
        fields = [
            self._new("sensor_msgs/msg/PointField", name=name, offset=4 * place, datatype=7, count=1)
            for place, name in enumerate(names)
        ]
        data = np.frombuffer(table.tobytes(), np.uint8)
        return self._new(
            "sensor_msgs/msg/PointCloud2",
            header=self._header(time),
            height=1,
            width=len(points),
            fields=fields,
            is_bigendian=False,
            point_step=16,
            row_step=len(data),
            data=data,
            is_dense=True,
        )

    def latched(self) -> Any:
        """The quality of service of /tf_static: late subscribers get it, too."""
        q = load_extra("rosbags.interfaces", "ros")
        never = q.QosTime(2147483647, 4294967295)
        return q.Qos(
            q.QosHistory.KEEP_LAST,
            1,
            q.QosReliability.RELIABLE,
            q.QosDurability.TRANSIENT_LOCAL,
            never,
            never,
            q.QosLiveliness.SYSTEM_DEFAULT,
            never,
            False,
        )

    def _vector(self, values: Sequence[float] | Floats) -> Any:
        x, y, z = map(float, values)
        return self._new("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def _point(self, values: Floats) -> Any:
        x, y, z = map(float, values)
        return self._new("geometry_msgs/msg/Point", x=x, y=y, z=z)

    def _quaternion(self, values: Floats) -> Any:
        x, y, z, w = map(float, values)
        return self._new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
