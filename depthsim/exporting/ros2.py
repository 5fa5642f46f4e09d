"""ROS 2 bags with the topics that the RealSense wrapper (realsense2_camera 4) publishes for a camera named `camera`.

    /camera/camera/depth/image_rect_raw   16UC1 [mm], 0 is a hole
    /camera/camera/depth/image_rect       32FC1 [m], NaN is a hole and +inf too far (REP 118); not by the wrapper
    /camera/camera/depth/camera_info      and one for each imager
    /camera/camera/infra1/image_rect_raw  mono8, the run's grey rgb/; a colour one is /camera/camera/color/image_raw
    /camera/camera/infra2/camera_info     its P has the baseline, as that of any right imager
    /camera/camera/imu                    the run's imu.csv
    /camera/camera/depth/color/points     PointCloud2, where it is asked for
    /tf, /tf_static                       map -> camera_link -> camera_depth_frame -> camera_depth_optical_frame
    /ground_truth/odometry                nav_msgs/Odometry of the optical frame in map: the poses of groundtruth.txt

16UC1 is in millimetres by REP 118, so that of a camera with other units is rounded to them, as the wrapper does, and
the 32FC1 picture alone is exact. The bag's custom data `depth_scale` says what its units were.
"""

from pathlib import Path

from depthsim.exporting.options import ExportOptions
from depthsim.exporting.ros2_messages import MAP, Messages
from depthsim.exporting.tables import Floats, imu_columns, nanoseconds
from depthsim.extras import load_extra
from depthsim.runs import Run

NAMESPACE = "/camera/camera"
ODOMETRY = "/ground_truth/odometry"
MILLIMETRE = 0.001


def write_bag(run: Run, out: Path, options: ExportOptions, storage: str) -> str:
    """Write a bag into the empty folder ``out``; says what is in it."""
    rosbag2 = load_extra("rosbags.rosbag2", "ros")
    out.rmdir()  # the writer makes it
    writer = rosbag2.Writer(out, version=8, storage_plugin=rosbag2.StoragePlugin[storage])
    if storage == "MCAP":
        writer.set_compression(rosbag2.CompressionMode.STORAGE, rosbag2.CompressionFormat.ZSTD)
    writer.set_custom_data("depth_scale", repr(run.camera.depth_scale))
    with writer:
        bag = _Bag(run, writer, options)
        for time, kind, index in bag.timeline():
            bag.write(time, kind, index)
    exact = "" if options.metric or run.camera.depth_scale == MILLIMETRE else "; 16UC1 alone is rounded to 1 mm"
    return f"{len(run)} frames, {bag.count} messages{exact}"


class _Bag:
    """Puts the messages of a run into an open bag."""

    def __init__(self, run: Run, writer: object, options: ExportOptions) -> None:
        self._run, self._writer, self._options = run, writer, options
        self._make = Messages(run)
        self._truth = run.truth
        self._imu = imu_columns(run)
        self._connections: dict[str, object] = {}
        self.count = 0

    def timeline(self) -> list[tuple[int, int, int]]:
        """(nanoseconds, kind, number) in order of time: 0 a pose, 1 an IMU sample, 2 a frame."""
        events = [(nanoseconds(stamp), 0, index) for index, stamp in enumerate(self._truth.stamps)]
        if self._imu is not None:
            events += [(nanoseconds(stamp), 1, index) for index, stamp in enumerate(self._imu["t"])]
        events += [(nanoseconds(stamp), 2, index) for index, stamp in enumerate(self._run.stamps)]
        return sorted(events)

    def write(self, time: int, kind: int, index: int) -> None:
        """Write the messages of one moment."""
        if not self.count:
            self._put("/tf_static", "tf2_msgs/msg/TFMessage", time, self._make.static_transforms(time), latched=True)
        (self._pose, self._sample, self._frame)[kind](time, index)

    def _pose(self, time: int, index: int) -> None:
        position, quaternion = self._truth.positions[index], self._truth.quaternions[index]
        self._put("/tf", "tf2_msgs/msg/TFMessage", time, self._make.link_transform(time, position, quaternion))
        self._put(ODOMETRY, "nav_msgs/msg/Odometry", time, self._make.odometry(time, position, quaternion))

    def _sample(self, time: int, index: int) -> None:
        columns = self._imu
        assert columns is not None

        def axes(*names: str) -> list[float]:
            return [float(columns[name][index]) for name in names]

        message = self._make.imu(time, axes("wx", "wy", "wz"), axes("ax", "ay", "az"))
        self._put(f"{NAMESPACE}/imu", "sensor_msgs/msg/Imu", time, message)

    def _frame(self, time: int, index: int) -> None:
        raw, metres = self._run.depth_raw(index), self._run.depth(index)
        scale = self._run.camera.depth_scale
        self._image("depth/image_rect_raw", time, self._make.depth_millimetres(time, raw, scale))
        if self._options.metric:
            self._image("depth/image_rect", time, self._make.depth_metres(time, raw, metres))
        self._info("depth", time)
        rgb = self._run.rgb(index)
        if rgb is not None:
            grey = rgb.ndim == 2
            self._image("infra1/image_rect_raw" if grey else "color/image_raw", time, self._make.intensity(time, rgb))
            self._info("infra1" if grey else "color", time)
        self._info("infra2", time)
        if self._options.points:
            topic = f"{NAMESPACE}/depth/color/points"
            self._put(topic, "sensor_msgs/msg/PointCloud2", time, self._make.points(time, index))

    def _image(self, name: str, time: int, message: object) -> None:
        self._put(f"{NAMESPACE}/{name}", "sensor_msgs/msg/Image", time, message)

    def _info(self, imager: str, time: int) -> None:
        message = self._make.camera_info(time, right=imager == "infra2")
        self._put(f"{NAMESPACE}/{imager}/camera_info", "sensor_msgs/msg/CameraInfo", time, message)

    def _put(self, topic: str, kind: str, time: int, message: object, *, latched: bool = False) -> None:
        writer = self._writer
        if topic not in self._connections:
            qos = [self._make.latched()] if latched else []
            self._connections[topic] = writer.add_connection(  # type: ignore[attr-defined]
                topic, kind, typestore=self._make.store, offered_qos_profiles=qos
            )
        data = self._make.store.serialize_cdr(message, kind)
        writer.write(self._connections[topic], time, data)  # type: ignore[attr-defined]
        self.count += 1


__all__ = ["MAP", "NAMESPACE", "ODOMETRY", "Floats", "write_bag"]
