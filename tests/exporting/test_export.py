"""Every export is read back by the programs and libraries that it is made for, to the bit."""

import csv
import importlib
import json
import pickle
import subprocess
import sys
import tarfile
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from recordings import CAMERA, FRAMES, depth_of, write_run
from typer.testing import CliRunner

from depthsim import extras
from depthsim.cli import app
from depthsim.dataset import DepthDataset
from depthsim.errors import InputError
from depthsim.exporting import FORMATS, ExportOptions, export
from depthsim.open3d_loader import load_open3d
from depthsim.runs import Run


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Run:
    return write_run(tmp_path_factory.mktemp("export") / "run")


def cv2_depth(file: Path) -> np.ndarray:
    return cv2.imread(str(file), cv2.IMREAD_UNCHANGED)


def test_a_distortion_that_open3d_has_not_is_reported(tmp_path):
    bent = CAMERA.model_copy(update={"model": "brown_conrady", "distortion": (0.1, 0, 0, 0, 0)})
    reported = export(write_run(tmp_path / "bent", bent), "open3d", tmp_path / "out")
    assert "the distortion is in camera.yaml alone" in reported
    assert "distortion" not in export(write_run(tmp_path / "plain"), "open3d", tmp_path / "straight")


def test_open3d_reads_its_folder_by_its_own_loaders(run, tmp_path):
    export(run, "open3d", tmp_path / "out")
    o3d = load_open3d()
    examples = Path(o3d.__file__).parent / "examples" / "t_reconstruction_system"
    if not examples.is_dir():
        pytest.skip("this Open3D comes without its examples")
    sys.path.insert(0, str(examples))
    try:
        common = importlib.import_module("common")
    finally:
        sys.path.remove(str(examples))
    config = SimpleNamespace(
        path_dataset=str(tmp_path / "out"),
        depth_folder="depth",
        color_folder="color",
        path_intrinsic=str(tmp_path / "out" / "intrinsic.json"),
        path_color_intrinsic="",
        engine="legacy",
    )
    depth, colour = common.load_rgbd_file_names(config)
    assert len(depth) == len(colour) == FRAMES
    for index, file in enumerate(depth):
        np.testing.assert_array_equal(np.asarray(o3d.io.read_image(file)), depth_of(index))
        assert np.asarray(o3d.io.read_image(colour[index])).shape == (*CAMERA.shape, 3)
    matrix = common.load_intrinsic(config).intrinsic_matrix
    np.testing.assert_array_equal(matrix, [[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1]])
    extrinsics = common.load_extrinsics(str(tmp_path / "out" / "trajectory.log"), config)
    np.testing.assert_allclose(np.linalg.inv(extrinsics), run.poses, atol=1e-9)


def test_euroc_is_read_by_evo_and_keeps_depth_and_imu(run, tmp_path):
    from evo.tools import file_interface

    export(run, "euroc", tmp_path / "out")
    root = tmp_path / "out" / "mav0"
    truth = file_interface.read_euroc_csv_trajectory(root / "state_groundtruth_estimate0" / "data.csv")
    np.testing.assert_allclose(truth.timestamps, run.stamps, atol=1e-6, rtol=0)
    np.testing.assert_allclose(truth.poses_se3, run.poses, atol=1e-9)
    rows = list(csv.reader((root / "depth0" / "data.csv").read_text().splitlines()[1:]))
    for index, (nanoseconds, name) in enumerate(rows):
        assert int(nanoseconds) == round(run.stamps[index] * 1e6) * 1000
        np.testing.assert_array_equal(cv2_depth(root / "depth0" / "data" / name), depth_of(index))
        image = cv2.imread(str(root / "cam0" / "data" / name), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(image, run.rgb(index))
    imu = np.loadtxt(root / "imu0" / "data.csv", delimiter=",", comments="#")
    table = np.loadtxt(run.path / "imu.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(imu[:, 1:], table[:, 1:])
    np.testing.assert_allclose(imu[:, 0] / 1e9, table[:, 0], atol=1e-6, rtol=0)
    settings = cv2.FileStorage(str(root / "depth0" / "sensor.yaml"), cv2.FILE_STORAGE_READ)
    assert settings.getNode("depth_scale").real() == CAMERA.depth_scale


@pytest.mark.parametrize("form", ["ros2", "ros2-sqlite3"])
def test_rosbags_reads_the_bag(run, tmp_path, form):
    from rosbags.highlevel import AnyReader

    export(run, form, tmp_path / "bag", ExportOptions(points=True))
    seen: dict[str, list] = {}
    with AnyReader([tmp_path / "bag"]) as reader:
        for connection, time, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            seen.setdefault(connection.topic, []).append((time, message))
    depth = seen["/camera/camera/depth/image_rect_raw"]
    metric = seen["/camera/camera/depth/image_rect"]
    assert len(depth) == len(metric) == FRAMES
    for index, ((time, raw), (_, metres)) in enumerate(zip(depth, metric, strict=True)):
        wanted = depth_of(index)
        assert raw.encoding == "16UC1" and raw.header.frame_id == "camera_depth_optical_frame"
        assert time == round(run.stamps[index] * 1e6) * 1000
        np.testing.assert_array_equal(raw.data.view(np.uint16).reshape(wanted.shape), wanted)
        picture = metres.data.view(np.float32).reshape(wanted.shape)
        assert metres.encoding == "32FC1"
        assert np.isnan(picture[wanted == 0]).all() and np.isposinf(picture[wanted == 65535]).all()
        inside = (wanted > 0) & (wanted < 65535)
        np.testing.assert_array_equal(np.rint(picture[inside] / np.float32(0.001)), wanted[inside])
    info = seen["/camera/camera/depth/camera_info"][0][1]
    np.testing.assert_array_equal(info.k, [CAMERA.fx, 0, CAMERA.cx, 0, CAMERA.fy, CAMERA.cy, 0, 0, 1])
    right = seen["/camera/camera/infra2/camera_info"][0][1]
    assert right.p[3] == pytest.approx(-CAMERA.fx * CAMERA.baseline)
    assert len(seen["/camera/camera/imu"]) == 101
    assert len(seen["/tf_static"]) == 1 and len(seen["/tf"]) == FRAMES
    for index, (_, message) in enumerate(seen["/ground_truth/odometry"]):
        p, q = message.pose.pose.position, message.pose.pose.orientation
        assert [p.x, p.y, p.z] == run.trajectory.positions[index].tolist()
        assert [q.x, q.y, q.z, q.w] == run.trajectory.quaternions[index].tolist()


def test_the_mcap_library_and_evo_read_the_bag(run, tmp_path):
    from evo.tools import file_interface
    from mcap.reader import make_reader
    from rosbags.rosbag2 import Reader

    export(run, "ros2", tmp_path / "bag")
    with (tmp_path / "bag" / "bag.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        topics = [channel.topic for _, channel, _ in reader.iter_messages()]
    assert summary is not None and summary.statistics is not None
    assert summary.statistics.message_count == len(topics)
    assert topics.count("/camera/camera/depth/image_rect_raw") == FRAMES
    with Reader(tmp_path / "bag") as bag:
        found = file_interface.read_bag_trajectory(bag, "/ground_truth/odometry")
    np.testing.assert_allclose(found.poses_se3, run.poses, atol=1e-9)


@pytest.mark.filterwarnings("ignore:Input line:UserWarning", "ignore:invalid escape:DeprecationWarning")
def test_kiss_icp_reads_runs_clouds_and_bags_by_its_own_loaders(run, tmp_path, capfd):
    from kiss_icp.datasets import dataset_factory

    export(run, "ros2", tmp_path / "bag", ExportOptions(points=True))
    export(run, "ply", tmp_path / "ply")
    load_open3d()
    for kind, path in (("rosbag", "bag"), ("generic", "ply/clouds")):
        data = dataset_factory(kind, tmp_path / path, topic="")
        assert len(data) == FRAMES
        points = np.array(data[0][0])
        valid = run.depth(0) > 0
        np.testing.assert_array_equal(points[:, 2].astype(np.float32), run.depth(0)[valid])
    data = dataset_factory("tum", run.path)
    assert len(data) == FRAMES
    np.testing.assert_allclose(data.gt_poses, run.poses, atol=1e-9)


def test_clouds_hold_every_depth_to_the_bit(run, tmp_path):
    export(run, "ply", tmp_path / "out")
    o3d = load_open3d()
    for index in range(FRAMES):
        cloud = o3d.t.io.read_point_cloud(str(tmp_path / "out" / "clouds" / f"{index:06d}.ply"))
        x, y, z = cloud.point.positions.numpy().astype(np.float64).T
        u, v = np.rint(x / z * CAMERA.fx + CAMERA.cx).astype(int), np.rint(y / z * CAMERA.fy + CAMERA.cy).astype(int)
        units = np.zeros(CAMERA.shape, np.uint16)
        units[v, u] = np.rint(z / CAMERA.depth_scale)
        wanted = depth_of(index)
        wanted[wanted == 65535] = 0  # too far is no point
        np.testing.assert_array_equal(units, wanted)
        np.testing.assert_array_equal(cloud.point.colors.numpy()[:, 0], run.rgb(index)[wanted > 0])
    poses = np.loadtxt(tmp_path / "out" / "poses.txt").reshape(-1, 3, 4)
    np.testing.assert_array_equal(poses, run.poses[:, :3])


def test_shards_hold_everything_and_are_the_same_bytes_again(run, tmp_path):
    for name in ("one", "two"):
        export(run, "webdataset", tmp_path / name, ExportOptions(shard=4))
    shards = sorted((tmp_path / "one").iterdir())
    assert [shard.name for shard in shards] == ["shard-000000.tar", "shard-000001.tar"]
    samples: dict[str, dict[str, bytes]] = {}
    for shard in shards:
        assert shard.read_bytes() == (tmp_path / "two" / shard.name).read_bytes()
        with tarfile.open(shard) as tar:
            for entry in tar:
                key, _, suffix = entry.name.partition(".")
                samples.setdefault(key, {})[suffix] = tar.extractfile(entry).read()
    assert len(samples) == FRAMES
    for index, (_, files) in enumerate(sorted(samples.items())):
        assert set(files) == {"depth.png", "clean.png", "rgb.png", "json"}
        depth = cv2.imdecode(np.frombuffer(files["depth.png"], np.uint8), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(depth, depth_of(index))
        keys = json.loads(files["json"])
        np.testing.assert_array_equal(keys["pose"], run.poses[index])
        assert keys["stamp"] == run.stamps[index]


def test_the_data_set_gives_items_that_stack_and_survives_a_worker(run):
    data = DepthDataset([run.path, run.path], streams=("clean", "rgb"))
    assert len(data) == 2 * FRAMES
    data = pickle.loads(pickle.dumps(data))
    items = [data[index] for index in range(len(data))]
    depth = np.stack([item["depth"] for item in items])
    assert depth.shape == (2 * FRAMES, 1, *CAMERA.shape) and depth.dtype == np.float32
    np.testing.assert_array_equal(depth[:FRAMES, 0], [run.depth(index) for index in range(FRAMES)])
    np.testing.assert_array_equal(depth[FRAMES:], depth[:FRAMES])
    assert [(item["run"], item["frame"]) for item in items[FRAMES - 1 : FRAMES + 1]] == [(0, FRAMES - 1), (1, 0)]
    np.testing.assert_array_equal(items[2]["pose"], run.poses[2])
    assert items[0]["rgb"].shape == (1, *CAMERA.shape) and 0 <= items[0]["rgb"].min() <= items[0]["rgb"].max() <= 1
    np.testing.assert_array_equal(data[-1]["depth"], items[-1]["depth"])
    with pytest.raises(IndexError):
        data[2 * FRAMES]
    with pytest.raises(InputError, match="mask: is not there"):
        DepthDataset(run.path, streams=("mask",))


def test_units_other_than_millimetres_come_back_from_metres(tmp_path):
    from depthsim.importing import import_recording

    run = write_run(tmp_path / "run", CAMERA.model_copy(update={"depth_scale": 0.0001}))
    export(run, "ros2", tmp_path / "bag")
    import_recording(tmp_path / "bag", tmp_path / "back")
    back = Run.open(tmp_path / "back")
    assert back.camera.depth_scale == 0.0001
    for index in range(FRAMES):
        np.testing.assert_array_equal(back.depth_raw(index), depth_of(index))


def test_evo_reads_a_run_from_the_command_line(run):
    truth = str(run.path / "groundtruth.txt")
    command = [str(Path(sys.executable).with_name("evo_ape")), "tum", truth, truth]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "rmse\t0.000000" in done.stdout


@pytest.mark.parametrize("form", sorted(FORMATS))
def test_a_run_with_depth_alone_is_written_in_every_format(tmp_path, form):
    export(write_run(tmp_path / "run", imu=False, rgb=False), form, tmp_path / "out")
    assert any((tmp_path / "out").iterdir())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "run"]


def test_faults_are_one_line_and_leave_nothing(run, tmp_path, monkeypatch):
    runner = CliRunner()

    def fault(*words: str) -> str:
        result = runner.invoke(app, ["export", *words])
        assert isinstance(result.exception, InputError)
        return str(result.exception)

    assert "is no format; give one of open3d" in fault(str(run.path), "--to", "vhs", "--out", str(tmp_path / "o"))
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    assert "holds files" in fault(str(run.path), "--to", "ply", "--out", str(tmp_path / "full"))
    monkeypatch.setattr(extras.importlib, "import_module", _missing)
    reported = fault(str(run.path), "--to", "ros2", "--out", str(tmp_path / "o"))
    assert "pip install '.[ros]'" in reported
    monkeypatch.undo()
    broken = write_run(tmp_path / "broken")
    broken.files[3].write_bytes(b"no PNG")
    assert "000.png" in fault(str(broken.path), "--to", "webdataset", "--out", str(tmp_path / "o"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["broken", "full"]


_import = importlib.import_module


def _missing(name: str, package: str | None = None):
    if name.startswith("rosbags"):
        raise ModuleNotFoundError(f"No module named {name!r}")
    return _import(name, package)


def test_the_command_says_what_it_wrote(run, tmp_path):
    result = CliRunner().invoke(app, ["export", str(run.path), "--to", "euroc", "--out", str(tmp_path / "out")])
    assert result.exit_code == 0
    assert result.stdout == f"{tmp_path / 'out'}: {FRAMES} frames\n"
