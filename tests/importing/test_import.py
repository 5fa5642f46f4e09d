"""Recordings of others come in as runs; cut and damaged ones as far as they go."""

import re
import shutil
import sqlite3
import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from backports import zstd
from recordings import CAMERA, FRAMES, START, depth_of, path_of, write_run
from rosbags import rosbag1
from rosbags.typesys import Stores, get_typestore
from typer.testing import CliRunner

from benchmarks.tum_calibration import Sequence, distances, matches
from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.exporting import export
from depthsim.importing import ImportOptions, import_recording
from depthsim.runs import Run
from depthsim.runs.png import encode_png
from depthsim.trajectory import Trajectory, write_tum

FREIBURG1 = Path(__file__).parents[2] / "../shared/data/rgbd_dataset_freiburg1_xyz"


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Run:
    return write_run(tmp_path_factory.mktemp("import") / "run")


@pytest.fixture(scope="module")
def bags(run, tmp_path_factory) -> Path:
    """bag/ (MCAP) and db/ (sqlite3) of the run."""
    folder = tmp_path_factory.mktemp("bags")
    export(run, "ros2", folder / "bag")
    export(run, "ros2-sqlite3", folder / "db")
    return folder


def assert_same(back: Run, run: Run, frames: int = FRAMES) -> None:
    """Depth to the bit, poses to 1e-9, for the first frames."""
    assert len(back) == frames
    np.testing.assert_allclose(back.stamps, run.stamps[:frames], atol=1e-6, rtol=0)
    np.testing.assert_allclose(back.poses, run.poses[:frames], atol=1e-9)
    for index in range(frames):
        np.testing.assert_array_equal(back.depth_raw(index), run.depth_raw(index))


@pytest.mark.parametrize("name", ["bag", "db"])
def test_our_ros2_bags_come_back_whole(run, bags, tmp_path, name):
    made = import_recording(bags / name, tmp_path / "back")
    assert (made.frames, made.posed, made.cut) == (FRAMES, True, None)
    back = Run.open(tmp_path / "back")
    assert_same(back, run)
    same = {"name": CAMERA.name}
    assert back.camera.model_copy(update={**same, "baseline": CAMERA.baseline}) == run.camera
    assert back.camera.baseline == pytest.approx(CAMERA.baseline, abs=1e-12)
    for index in range(FRAMES):
        np.testing.assert_array_equal(back.rgb(index), run.rgb(index))
    ours, theirs = ((r.path / "imu.csv").read_text().splitlines()[1:] for r in (run, back))
    np.testing.assert_allclose(
        [[float(word) for word in line.split(",")] for line in theirs],
        [[float(word) for word in line.split(",")] for line in ours],
        atol=1e-6, rtol=0,
    )  # fmt: skip


def test_a_list_of_files_that_is_none_does_not_matter(run, bags, tmp_path):
    """rosbags needs it only to close the bag, and fails there."""
    shutil.copytree(bags / "bag", tmp_path / "bag")
    listed = tmp_path / "bag" / "metadata.yaml"
    facts = yaml.safe_load(listed.read_text())
    facts["rosbag2_bagfile_information"]["files"] = "none"
    listed.write_text(yaml.safe_dump(facts))
    import_recording(tmp_path / "bag", tmp_path / "back")
    assert_same(Run.open(tmp_path / "back"), run)


def test_a_storage_file_alone_and_poses_from_tf(run, bags, tmp_path):
    import_recording(bags / "bag" / "bag.mcap", tmp_path / "file")
    assert_same(Run.open(tmp_path / "file"), run)
    from depthsim.importing.bagfile import BagFile
    from depthsim.importing.messages import Decoder, pose_of, stamp_of
    from depthsim.importing.transforms import Transforms

    bag, decoder, tree = BagFile(bags / "db"), Decoder(ros1=False), Transforms()
    for message in bag.messages({"/tf", "/tf_static"}):
        for t in decoder.read(message).transforms:
            stamp = 0 if message.topic == "/tf_static" else stamp_of(t)
            tree.add(t.header.frame_id, t.child_frame_id, stamp, *pose_of(t))
    bag.close()
    poses = tree.poses("camera_depth_optical_frame")
    np.testing.assert_allclose(poses.matrices(), run.poses, atol=1e-9)
    assert tree.poses("nobody") is None


def test_open3d_folders_and_tum_sequences_come_back(run, tmp_path):
    export(run, "open3d", tmp_path / "folder")
    import_recording(tmp_path / "folder", tmp_path / "back")
    assert_same(Run.open(tmp_path / "back"), run)
    import_recording(run.path, tmp_path / "again")
    assert_same(Run.open(tmp_path / "again"), run)


def test_a_tum_sequence_as_it_is_downloaded(tmp_path):
    source = tmp_path / "rgbd_dataset_freiburg2_xyz"
    (source / "depth").mkdir(parents=True)
    stamps = START + np.arange(8) / 30
    depth = [np.full((480, 640), 5000 + k, np.uint16) for k in range(8)]
    for stamp, picture in zip(stamps, depth, strict=True):
        (source / "depth" / f"{stamp:.6f}.png").write_bytes(encode_png(picture))
    lines = [f"{stamp:.6f} depth/{stamp:.6f}.png\n" for stamp in stamps]
    (source / "depth.txt").write_text("# depth maps\n" + "".join(lines))
    write_tum(path_of(3), source / "groundtruth.txt")  # 0.2 s: the last frame is outside
    made = import_recording(source, tmp_path / "run")
    assert made.frames == 7 and "1 frames outside the poses" in made.notes[0]
    run = Run.open(tmp_path / "run")
    assert (run.camera.fx, run.camera.depth_scale) == (520.9, 1 / 5000)
    assert run.camera.distortion == (0.2312, -0.7849, -0.0033, -0.0001, 0.9172), "as the colour images were taken"
    np.testing.assert_array_equal(run.depth_raw(3), depth[3])
    assert run.depth(0)[0, 0] == pytest.approx(1.0)
    nameless = source.rename(tmp_path / "xyz")
    with pytest.raises(InputError, match=r"has no camera.yaml; give `camera`"):
        import_recording(nameless, tmp_path / "run2")


def test_the_calibration_of_freiburg1_fits_real_frames(tmp_path):
    """Better than the driver's default, by which the data set's page makes clouds, and than itself without distortion.

    By how far points of one frame lie from the surface in another on average, at the motion capture's poses 18 ms
    earlier, where every candidate fits best (benchmarks/tum_calibration.py): 6.67 mm, and 7.34 and 6.92 mm by those.
    """
    if not FREIBURG1.exists():
        pytest.skip(f"the real frames are not there ({FREIBURG1.name} in ../shared/data)")
    few = tmp_path / FREIBURG1.name
    (few / "depth").mkdir(parents=True)
    shutil.copy(FREIBURG1 / "groundtruth.txt", few)
    lines = [line for line in (FREIBURG1 / "depth.txt").read_text().splitlines() if line[0] != "#"][::4]
    (few / "depth.txt").write_text("\n".join(lines))
    for line in lines:
        shutil.copy(FREIBURG1 / line.split()[1], few / "depth")
    import_recording(few, tmp_path / "run")
    ours, seen, late = Run.open(tmp_path / "run").camera, Sequence(few), np.array([-0.018, *[0] * 6])
    straight = {"model": "pinhole", "distortion": (0,) * 5}
    driver = straight | {"fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5}
    found = []
    for change in ({}, straight, driver):
        camera = ours.model_copy(update=change)
        sizes = [np.abs(distances(late, seen, matches(seen, camera, late, seed))) for seed in range(4)]
        found.append(1000 * np.concatenate(sizes).mean())
    assert found[0] < 0.98 * found[1] and found[0] < 0.95 * found[2]


def test_folders_of_npy_and_png(run, tmp_path):
    source = tmp_path / "arrays"
    source.mkdir()
    for index in range(11):
        depth = depth_of(index)
        if index % 2:
            np.save(source / f"{index}.npy", depth)
        else:
            metres = depth * 0.001
            metres[depth == 0], metres[depth == 65535] = np.nan, np.inf
            np.save(source / f"{index}.npy", metres)
    (tmp_path / "camera.yaml").write_text(CAMERA.to_yaml())
    made = import_recording(source, tmp_path / "out", ImportOptions(camera=str(tmp_path / "camera.yaml"), rate=20))
    assert made.frames == 11 and not made.posed
    with pytest.raises(InputError, match="is missing from the run"):
        Run.open(tmp_path / "out")
    back = Run.open(tmp_path / "out", posed=False)
    np.testing.assert_allclose(back.stamps, np.arange(11) / 20)
    for index in range(11):  # 10 comes after 9
        np.testing.assert_array_equal(back.depth_raw(index), depth_of(index))
    write_tum(path_of(), tmp_path / "poses.txt")
    shutil.copytree(run.path / "depth", tmp_path / "pictures")
    shutil.copy(run.path / "camera.yaml", tmp_path / "pictures")
    import_recording(tmp_path / "pictures", tmp_path / "posed", ImportOptions(poses=str(tmp_path / "poses.txt")))
    assert_same(Run.open(tmp_path / "posed"), run)


ROS1 = get_typestore(Stores.ROS1_NOETIC)


def ros1(kind: str, **fields) -> object:
    return ROS1.types[kind](**fields)


def header(time: int, frame: str) -> object:
    stamp = ros1("builtin_interfaces/msg/Time", sec=time // 10**9, nanosec=time % 10**9)
    return ros1("std_msgs/msg/Header", seq=0, stamp=stamp, frame_id=frame)


def write_viewer_bag(
    file: Path,
    unit: float = 0.001,
    model: str = "Brown Conrady",
    terms: tuple[float, ...] = (0, 0, 0, 0, 0),
    poses: Trajectory | None = None,
) -> None:
    """A bag as RealSense Viewer records one: librealsense's topics, and 4 bytes more to an image than it defines.

    poses are put beside them on /mocap/pose, a PoseStamped, as motion capture gives them.
    """
    depth_topic = "/device_0/sensor_0/Depth_0"
    with rosbag1.Writer(file) as bag:
        connections: dict[str, object] = {}

        def put(topic: str, kind: str, time: int, message: object, tail: bytes = b"") -> None:
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=ROS1)
            bag.write(connections[topic], time, bytes(ROS1.serialize_ros1(message, kind)) + tail)

        def image(topic: str, time: int, encoding: str, pixels: np.ndarray, tail: bytes) -> None:
            height, width = pixels.shape
            data = np.ascontiguousarray(pixels).view(np.uint8).ravel()
            message = ros1(
                "sensor_msgs/msg/Image", header=header(time, "1"), height=height, width=width, encoding=encoding,
                is_bigendian=0, step=data.size // height, data=data,
            )  # fmt: skip
            put(topic, "sensor_msgs/msg/Image", time, message, tail)

        roi = ros1("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        info = ros1(
            "sensor_msgs/msg/CameraInfo", header=header(0, ""), height=CAMERA.height, width=CAMERA.width,
            distortion_model=model, D=np.array(terms, np.float64),
            K=np.array([CAMERA.fx, 0, CAMERA.cx, 0, CAMERA.fy, CAMERA.cy, 0, 0, 1.0]), R=np.zeros(9), P=np.zeros(12),
            binning_x=0, binning_y=0, roi=roi,
        )  # fmt: skip
        put(f"{depth_topic}/info/camera_info", "sensor_msgs/msg/CameraInfo", 1, info)
        for name, value in (("Depth Units", unit), ("Stereo Baseline", 49.9)):
            topic = f"/device_0/sensor_0/option/{name}/value"
            put(topic, "std_msgs/msg/Float32", 2, ros1("std_msgs/msg/Float32", data=value))
        zero = ros1("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        for stamp, p, q in zip(poses.stamps, poses.positions, poses.quaternions, strict=True) if poses else ():
            pose = ros1(
                "geometry_msgs/msg/Pose",
                position=ros1("geometry_msgs/msg/Point", x=p[0], y=p[1], z=p[2]),
                orientation=ros1("geometry_msgs/msg/Quaternion", x=q[0], y=q[1], z=q[2], w=q[3]),
            )
            kind, time = "geometry_msgs/msg/PoseStamped", round(stamp * 1e9)
            put("/mocap/pose", kind, time, ros1(kind, header=header(time, "map"), pose=pose))
        for index in range(FRAMES):
            time = round((START + index / 10) * 1e9)
            for kind, rate in (("Gyro", 200), ("Accel", 250)):
                for sample in range(rate // 10):
                    now = time + sample * 10**9 // rate
                    vector = ros1("geometry_msgs/msg/Vector3", x=float(now - time), y=0.0, z=-9.8)
                    message = ros1(
                        "sensor_msgs/msg/Imu", header=header(now, "1"),
                        orientation=ros1("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
                        orientation_covariance=np.zeros(9), angular_velocity_covariance=np.zeros(9),
                        linear_acceleration_covariance=np.zeros(9),
                        angular_velocity=vector if kind == "Gyro" else zero,
                        linear_acceleration=vector if kind == "Accel" else zero,
                    )  # fmt: skip
                    put(f"/device_0/sensor_2/{kind}_0/imu/data", "sensor_msgs/msg/Imu", now, message)
            tail = struct.pack("<f", unit)
            image(f"{depth_topic}/image/data", time, "mono16", depth_of(index), tail)
            grey = np.full(CAMERA.shape, index, np.uint8)
            image("/device_0/sensor_0/Infrared_1/image/data", time, "8UC1", grey, struct.pack("<f", 0))


def test_a_bag_of_realsense_viewer(tmp_path):
    write_viewer_bag(tmp_path / "viewer.bag")
    made = import_recording(tmp_path / "viewer.bag", tmp_path / "run")
    assert made.frames == FRAMES and not made.posed and made.cut is None
    run = Run.open(tmp_path / "run", posed=False)
    for index in range(FRAMES):
        np.testing.assert_array_equal(run.depth_raw(index), depth_of(index))
        assert (run.rgb(index) == index).all()
    np.testing.assert_allclose(run.stamps, path_of().stamps, atol=1e-6, rtol=0)
    assert (run.camera.fx, run.camera.cy, run.camera.baseline) == (CAMERA.fx, CAMERA.cy, 0.0499)
    assert run.camera.depth_scale == 0.001
    imu = np.loadtxt(tmp_path / "run" / "imu.csv", delimiter=",", skiprows=1)
    assert imu.shape[1] == 7 and len(imu) >= 115
    np.testing.assert_allclose(imu[:, 6], -9.8)
    write_viewer_bag(tmp_path / "d405.bag", unit=0.0001)
    import_recording(tmp_path / "d405.bag", tmp_path / "d405")
    assert Run.open(tmp_path / "d405", posed=False).camera.depth_scale == 0.0001


@pytest.mark.parametrize(
    ("model", "terms", "reported"),
    [
        ("equidistant", (0.1, 0.01, -0.01, 0.001), "equidistant with 4 terms"),
        ("rational_polynomial", (0.1, 0, 0, 0, 0.1, 0.2, 0, 0.01), "rational_polynomial with 8 terms"),
        ("Inverse Brown Conrady", (0.1, 0, 0, 0, 0), "Inverse Brown Conrady with 1 terms"),
    ],
)
def test_a_distortion_of_another_model_is_refused_and_reported(tmp_path, model, terms, reported):
    write_viewer_bag(tmp_path / "fish.bag", model=model, terms=terms)
    with pytest.raises(
        InputError, match=f"CameraInfo: its distortion is {reported}; .*rectify the images, or give a `cam"
    ):
        import_recording(tmp_path / "fish.bag", tmp_path / "run")
    assert not (tmp_path / "run").exists()
    CAMERA.write(tmp_path / "camera.yaml")
    import_recording(tmp_path / "fish.bag", tmp_path / "run", ImportOptions(camera=str(tmp_path / "camera.yaml")))
    assert not any(Run.open(tmp_path / "run", posed=False).camera.distortion)


@pytest.mark.parametrize(
    ("model", "terms", "distortion"),
    [
        ("plumb_bob", (0.1, -0.01, 0.001, 0.002), (0.1, -0.01, 0.001, 0.002, 0)),
        ("rational_polynomial", (0.1, -0.01, 0, 0, 0.02, 0, 0, 0), (0.1, -0.01, 0, 0, 0.02)),
        ("equidistant", (0, 0, 0, 0), (0,) * 5),
        ("Inverse Brown Conrady", (0,) * 5, (0,) * 5),
    ],
)
def test_a_distortion_that_is_plumb_bobs_or_zero_is_kept(tmp_path, model, terms, distortion):
    write_viewer_bag(tmp_path / "viewer.bag", model=model, terms=terms)
    import_recording(tmp_path / "viewer.bag", tmp_path / "run")
    assert Run.open(tmp_path / "run", posed=False).camera.distortion == distortion


MOUNT = "0.1,-0.02,0.3,-0.5,0.5,-0.5,0.5"
"""A camera that looks along a body's x axis: x right is the body's -y, y down its -z."""


def forward_of(poses: np.ndarray) -> np.ndarray:
    """(N, 4, 4) poses of the camera of MOUNT, of those of its body, written out by hand."""
    there = np.array([[0, 0, 1, 0.1], [-1, 0, 0, -0.02], [0, -1, 0, 0.3], [0, 0, 0, 1]])
    return poses @ there


def test_poses_that_name_no_frame_are_reported_and_a_mounting_is_applied(tmp_path):
    write_viewer_bag(tmp_path / "mocap.bag", poses=path_of())
    note = "/mocap/pose does not say what its poses are of: taken as the camera's optical frame; else give `mount`"
    made = import_recording(tmp_path / "mocap.bag", tmp_path / "plain")
    assert made.posed and note in made.notes
    np.testing.assert_allclose(Run.open(tmp_path / "plain").poses, path_of().matrices(), atol=1e-6)
    words = ["import", str(tmp_path / "mocap.bag"), "--mount", MOUNT, "--out", str(tmp_path / "mounted")]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0 and "--mount" not in result.output
    np.testing.assert_allclose(Run.open(tmp_path / "mounted").poses, forward_of(path_of().matrices()), atol=1e-6)


def test_a_mounting_serves_every_source_of_poses(run, bags, tmp_path):
    write_tum(path_of(), tmp_path / "body.txt")
    mount = tuple(float(word) for word in MOUNT.split(","))
    options = [ImportOptions(mount=mount), ImportOptions(mount=mount, poses=str(tmp_path / "body.txt"))]
    for number, source in enumerate((run.path, bags / "bag", bags / "bag" / "bag.mcap")):
        for other, option in enumerate(options):
            import_recording(source, tmp_path / f"{number}{other}", option)
            back = Run.open(tmp_path / f"{number}{other}")
            np.testing.assert_allclose(back.poses, forward_of(run.poses), atol=1e-9)
    write_viewer_bag(tmp_path / "viewer.bag")
    with pytest.raises(InputError, match="`mount`: there are no poses"):
        import_recording(tmp_path / "viewer.bag", tmp_path / "run", options[0])
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("mount", "message"),
    [
        ("0,0,0,0,0,1", "is not seven finite numbers; give x,y,z,qx,qy,qz,qw"),
        ("0,0,nan,0,0,0,1", "is not seven finite numbers"),
        ("0,0,0,0,0,0,up", "is no number"),
        ("0,0,0,1,1,0,0", "its quaternion has length 1.41421"),
    ],
)
def test_a_mounting_that_is_none_is_one_line(run, tmp_path, mount, message):
    result = CliRunner().invoke(app, ["import", str(run.path), "--mount", mount, "--out", str(tmp_path / "run")])
    assert isinstance(result.exception, InputError) and message in str(result.exception)
    assert not (tmp_path / "run").exists()


def cut(file: Path, share: float, to: Path) -> Path:
    data = file.read_bytes()
    to.write_bytes(data[: int(len(data) * share)])
    return to


@pytest.mark.parametrize("share", [0.5, 0.8, 0.97])
def test_a_cut_ros1_bag_keeps_the_frames_before_the_cut(tmp_path, share):
    write_viewer_bag(tmp_path / "whole.bag")
    file = cut(tmp_path / "whole.bag", share, tmp_path / "cut.bag")
    made = import_recording(file, tmp_path / "run")
    assert made.cut is not None and "\n" not in str(made.cut)
    assert str(made.cut).startswith(f"{file}: after {made.frames} frames")
    assert int(share * FRAMES) - 2 <= made.frames <= FRAMES
    run = Run.open(tmp_path / "run", posed=False)
    for index in range(made.frames):
        np.testing.assert_array_equal(run.depth_raw(index), depth_of(index))


def test_cut_ros2_bags_keep_the_frames_before_the_cut(run, tmp_path):
    big = CAMERA.model_copy(update={"width": 320, "height": 240})
    source = _long_run(tmp_path / "long", big)
    for form, name in (("ros2", "bag.mcap"), ("ros2-sqlite3", "bag.db3")):
        export(source, form, tmp_path / form / "bag")
        file = cut(tmp_path / form / "bag" / name, 0.6, tmp_path / f"cut{Path(name).suffix}")
        for place in (file, tmp_path / form / "bag"):  # the file alone, and the folder with its list
            shutil.copy(file, tmp_path / form / "bag" / name)
            out = tmp_path / f"run_{form}_{place.name}"
            made = import_recording(place, out)
            assert made.cut is not None and "cut off or damaged" in str(made.cut), form
            assert 3 <= made.frames < len(source), form
            back = Run.open(out)
            for index in range(made.frames):
                np.testing.assert_array_equal(back.depth_raw(index), source.depth_raw(index))


def _packed_by_message(bag: Path, of: Callable[[bytes], bytes]) -> None:
    """Turn a rosbag2 folder of ours into one with every message packed by zstd, as ``ros2 bag record`` can."""
    base = sqlite3.connect(next(bag.glob("*.db3")))
    for key, data in base.execute("SELECT id, data FROM messages").fetchall():
        base.execute("UPDATE messages SET data = ? WHERE id = ?", (of(data), key))
    base.commit()
    base.close()
    text = (bag / "metadata.yaml").read_text()
    for key, value in (("format", "zstd"), ("mode", "MESSAGE")):
        text = re.sub(rf"compression_{key}:.*", f"compression_{key}: {value}", text)
    (bag / "metadata.yaml").write_text(text)


def test_a_bag_packed_message_by_message_comes_back_and_a_bomb_in_it_does_not(run, bags, tmp_path):
    shutil.copytree(bags / "db", tmp_path / "bag")
    _packed_by_message(tmp_path / "bag", zstd.compress)
    import_recording(tmp_path / "bag", tmp_path / "back")
    assert_same(Run.open(tmp_path / "back"), run)
    bomb = zstd.compress(bytes(1 << 28))
    assert len(bomb) < 1 << 15
    shutil.copytree(bags / "db", tmp_path / "bomb")
    _packed_by_message(tmp_path / "bomb", lambda data: bomb)
    tracemalloc.start()
    with pytest.raises(InputError, match="bomb"):
        import_recording(tmp_path / "bomb", tmp_path / "out")
    assert tracemalloc.get_traced_memory()[1] < 1.1e9
    tracemalloc.stop()
    assert not (tmp_path / "out").exists()


def _long_run(folder: Path, camera) -> Run:
    from depthsim.runs import RunWriter

    with RunWriter(folder, camera, path_of(16), {"scene": "none"}) as writer:
        for index in writer.missing():
            writer.write_frame(
                index, {"depth": np.random.default_rng(index).integers(0, 65536, camera.shape).astype(np.uint16)}
            )
        writer.finish()
    return Run.open(folder)


@pytest.mark.parametrize("suffix", [".bag", ".mcap", ".db3"])
@pytest.mark.parametrize("content", [b"", b"nonsense" * 50, b"#ROSBAG V2.0\n" + b"\xff" * 64])
def test_nonsense_is_one_line(tmp_path, suffix, content):
    file = tmp_path / f"broken{suffix}"
    file.write_bytes(content)
    result = CliRunner().invoke(app, ["import", str(file), "--out", str(tmp_path / "run")])
    assert isinstance(result.exception, InputError)
    assert str(file) in str(result.exception) and "\n" not in str(result.exception)
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


def test_damage_in_the_middle_keeps_what_was_before(tmp_path):
    write_viewer_bag(tmp_path / "viewer.bag")
    data = bytearray((tmp_path / "viewer.bag").read_bytes())
    middle = len(data) * 6 // 10
    data[middle : middle + 4000] = b"\xff" * 4000
    (tmp_path / "viewer.bag").write_bytes(data)
    try:
        made = import_recording(tmp_path / "viewer.bag", tmp_path / "run")
    except InputError as error:
        pytest.fail(f"the frames before the damage are lost: {error}")
    assert 1 <= made.frames <= FRAMES


def test_the_command_keeps_a_cut_bag_and_ends_with_status_2(tmp_path, monkeypatch, capsys):
    import sys

    from depthsim.__main__ import main

    write_viewer_bag(tmp_path / "whole.bag")
    file = cut(tmp_path / "whole.bag", 0.7, tmp_path / "cut.bag")
    monkeypatch.setattr(sys, "argv", ["depthsim", "import", str(file), "--out", str(tmp_path / "run")])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    reported = capsys.readouterr()
    assert "frames, without poses" in reported.out
    assert reported.err.splitlines()[-1].startswith(f"{file}: after ")
    assert "the frames before that are kept" in reported.err
    assert len(Run.open(tmp_path / "run", posed=False)) >= 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"depth": "/nothing"}, "has no images on /nothing; give `depth`, one of /camera"),
        ({"poses": "/nothing"}, "has no poses on /nothing"),
        ({"camera": "d435"}, "its depth is 32x24, the camera 848x480"),
        ({"depth": "/camera/camera/infra1/image_rect_raw"}, "holds no depth of 16UC1"),
    ],
)
def test_wrong_options_are_reported(bags, tmp_path, options, message):
    with pytest.raises(InputError, match=message):
        import_recording(bags / "bag", tmp_path / "run", ImportOptions(**options))
    assert not (tmp_path / "run").exists()


def test_sqlite_without_the_tables(tmp_path):
    base = sqlite3.connect(tmp_path / "other.db3")
    base.execute("CREATE TABLE cats (name TEXT)")
    base.commit()
    base.close()
    with pytest.raises(InputError, match="no such table"):
        import_recording(tmp_path / "other.db3", tmp_path / "run")
