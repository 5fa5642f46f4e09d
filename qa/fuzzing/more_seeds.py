"""Small valid bags, logs, vehicles, winds and reports."""

import json
import struct
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml

from depthsim.exporting import export
from depthsim.runs import Run
from qa.fuzzing import seeds


def ros2(folder: Path, kind: str) -> None:
    """A ROS 2 bag of a run, with its metadata.yaml."""
    with TemporaryDirectory() as there:
        seeds.run(Path(there))
        rows = ["t,wx,wy,wz,ax,ay,az", *(f"{seeds.START + k / 50},0,0,0.1,0,0,9.8" for k in range(5))]
        (Path(there) / "imu.csv").write_text("\n".join(rows) + "\n")
        export(Run.open(Path(there)), kind, folder / "bag")


def mcap(folder: Path) -> None:
    """A bag in MCAP."""
    ros2(folder, "ros2")


def sqlite3(folder: Path) -> None:
    """A bag in sqlite3."""
    ros2(folder, "ros2-sqlite3")


def realsense(folder: Path) -> None:
    """A bag as RealSense Viewer records one: 4 bytes more to an image than its type has."""
    _ros1(
        folder / "viewer.bag",
        "/device_0/sensor_0/Depth_0/image/data",
        "/device_0/sensor_0/Depth_0/info/camera_info",
        "1",
    )


def ros1(folder: Path) -> None:
    """A bag of realsense2_camera with odometry and tf."""
    _ros1(
        folder / "recorded.bag",
        "/camera/depth/image_rect_raw",
        "/camera/depth/camera_info",
        "camera_depth_optical_frame",
    )


def _ros1(file: Path, images: str, infos: str, frame: str) -> None:
    from rosbags import rosbag1
    from rosbags.typesys import Stores, get_typestore

    store, camera, viewer = get_typestore(Stores.ROS1_NOETIC), seeds.CAMERA, frame == "1"

    def made(kind: str, **fields: object) -> object:
        return store.types[kind](**fields)

    def header(time: int, name: str = frame) -> object:
        stamp = made("builtin_interfaces/msg/Time", sec=time // 10**9, nanosec=time % 10**9)
        return made("std_msgs/msg/Header", seq=0, stamp=stamp, frame_id=name)

    with rosbag1.Writer(file) as bag:
        connections: dict[str, object] = {}

        def put(topic: str, kind: str, time: int, message: object, tail: bytes = b"") -> None:
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=store)
            bag.write(connections[topic], time, bytes(store.serialize_ros1(message, kind)) + tail)

        roi = made("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        k = np.array([camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1.0])
        info = made(
            "sensor_msgs/msg/CameraInfo", header=header(0, ""), height=camera.height, width=camera.width,
            distortion_model="Brown Conrady", D=np.zeros(5), K=k, R=np.zeros(9), P=np.zeros(12), binning_x=0,
            binning_y=0,
            roi=roi,
        )  # fmt: skip
        put(infos, "sensor_msgs/msg/CameraInfo", 1, info)
        if viewer:
            for name, value in (("Depth Units", 0.001), ("Stereo Baseline", 49.9)):
                message = made("std_msgs/msg/Float32", data=value)
                put(f"/device_0/sensor_0/option/{name}/value", "std_msgs/msg/Float32", 2, message)
        vector = made("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=9.8)
        turn = made("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        for index in range(seeds.FRAMES):
            time = round((seeds.START + index / 10) * 1e9)
            pixels = seeds.depth()
            data = np.ascontiguousarray(pixels).view(np.uint8).ravel()
            message = made(
                "sensor_msgs/msg/Image", header=header(time), height=camera.height, width=camera.width,
                encoding="mono16",
                is_bigendian=0, step=2 * camera.width, data=data,
            )  # fmt: skip
            put(images, "sensor_msgs/msg/Image", time, message, struct.pack("<f", 0.001) if viewer else b"")
            sample = made(
                "sensor_msgs/msg/Imu", header=header(time), orientation=turn, orientation_covariance=np.zeros(9),
                angular_velocity_covariance=np.zeros(9), linear_acceleration_covariance=np.zeros(9),
                angular_velocity=vector, linear_acceleration=vector,
            )  # fmt: skip
            put(
                "/camera/imu" if not viewer else "/device_0/sensor_2/Gyro_0/imu/data",
                "sensor_msgs/msg/Imu",
                time,
                sample,
            )
            if not viewer:
                point = made("geometry_msgs/msg/Point", x=float(index), y=0.0, z=1.0)
                pose = made("geometry_msgs/msg/Pose", position=point, orientation=turn)
                stamped = made("geometry_msgs/msg/PoseStamped", header=header(time, "map"), pose=pose)
                put("/pose", "geometry_msgs/msg/PoseStamped", time, stamped)


def flight(folder: Path) -> None:
    """A flight.csv with every column."""
    names = "t,px,py,pz,vx,vy,vz,qx,qy,qz,qw,wx,wy,wz,ax,ay,az,T1,T2,T3,T4,pwm1,battery,note"
    rows = [f"{k / 100},{k},0,1,1,0,0,0,0,0,1,0,0,0.1,0,0,9.8,3,3,3,3,30000,11.1,x" for k in range(8)]
    (folder / "flight.csv").write_text("\n".join(["# a flight", names, *rows, ""]))


def nanobench(folder: Path) -> None:
    """A NanoBench log."""
    names = ["t", "px", "py", "pz", "vx", "vy", "vz", "qx", "qy", "qz", "qw", "pwr_pm_vbat"]
    names += [f"imu_{kind}_{axis}" for kind in ("gyro", "acc") for axis in "xyz"]
    names += [f"motor_motor_m{number}" for number in range(1, 5)]
    rows = [f"{k / 100},{k},0,1,1,0,0,0,0,0,1,3.9,0,0,0.1,0,0,1,30000,30000,30000,30000" for k in range(8)]
    (folder / "flight.csv").write_text("\n".join([",".join(names), *rows, ""]))


def vehicle(folder: Path) -> None:
    """A vehicle with all that is optional."""
    keys = yaml.safe_load(
        "{name: mine, mass: 1.4, inertia: [0.0211, 0.0219, 0.0366], rotors: {count: 4, arm: 0.225, radius: 0.14,"
        " motor_time_constant: 0.02, thrust_coefficient: 1.105e-5, torque_ratio: 0.016, max_thrust: 11.2,"
        " min_thrust: 0.1,"
        " thrust_scale: [1, 1, 0.9, 1]}, drag: {law: rotor_linear, c_d1: 0.05, k: 0.27, b: 3.7},"
        " more_drag: [{law: linear, D: [0.1, 0.1, 0.05]}, {law: airsim_quadratic, area: [0.05, 0.05, 0.1]}],"
        " ground_effect: {},"
        " thrust_curve: {input: pwm, full_scale: 65535, coefficients: [0.0, 1.2, 5.0]},"
        " camera: {position: [0.1, 0, 0.02],"
        " pitch: -10}, controller: {position: 4, attitude: 20}, wind: {kind: gusts, velocity: [3, 0, 0]},"
        " body_radius: 0.4,"
        " sources: {mass: scales}}"
    )
    (folder / "vehicle.yaml").write_text(yaml.safe_dump(keys, sort_keys=False))


def wind(folder: Path) -> None:
    """A wind that names a grid."""
    (folder / "wind.yaml").write_text(yaml.safe_dump({"kind": "field", "file": "grid.csv"}))
    rows = [f"{x},{y},{z},{x},0,{z / 2}" for x in (0, 1, 2) for y in (0, 1) for z in (0, 5)]
    (folder / "grid.csv").write_text("\n".join(["x,y,z,wx,wy,wz", *rows, ""]))
    (folder / "shear.yaml").write_text(
        yaml.safe_dump({"kind": "shear", "velocity": [8, 0, 0], "height": 10, "exponent": 0.14})
    )


def flight_spec(folder: Path) -> None:
    """A flight's YAML file that names its path, its vehicle and its wind."""
    vehicle(folder)
    wind(folder)
    path = {"shape": "minimum_snap", "points": [[0, 0, 2], [3, 1, 2], [5, 0, 3]], "speed": 3}
    (folder / "path.yaml").write_text(yaml.safe_dump(path))
    keys = {
        "path": "path.yaml",
        "vehicle": "vehicle.yaml",
        "speed": 2.0,
        "wind": "wind.yaml",
        "seed": 1,
        "imu_rate": 200,
    }
    (folder / "flight.yaml").write_text(yaml.safe_dump(keys, sort_keys=False))
    keys |= {"path": {"shape": "circle", "radius": 3, "center": [0, 0, 2], "laps": 1, "yaw": 20}}
    keys |= {"wind": {"kind": "constant", "velocity": [1, 0, 0]}, "vehicle": "f450"}
    (folder / "inline.yaml").write_text(yaml.safe_dump(keys, sort_keys=False))


def report(folder: Path) -> None:
    """A report and the run that it is of."""
    (folder / "run").mkdir()
    seeds.run(folder / "run")
    there = folder / "report"
    there.mkdir()
    cut = {"axis": "range", "interval": [0.5, 1.0], "unit": "m", "share_of_gap": 0.4, "what": "spread", "text": "near"}
    cause = {"effect": "disparity_noise", "parameters": {"sigma": 0.05}, "ci95": {"sigma": [0.04, 0.06]},
    "closed_fraction": 0.5,
             "ci95_closed": [0.4, 0.6], "indistinguishable_from": ["incidence_noise"], "advice": ""}  # fmt: skip
    gap = {
        "measure": "bits",
        "unit": "bit",
        "before": 0.5,
        "after": 0.2,
        "floor": 0.01,
        "closed_fraction": 0.6,
        "ci95": [0.5, 0.7],
    }
    diagnosis = {"version": 1, "verdict": "partly_explained", "gap": gap, "where": [cut], "causes": [cause],
                 "unexplained": {"fraction": 0.4, "where": [cut], "description": "rest", "learnable": None},
                 "notes": []}  # fmt: skip
    (there / "diagnosis.json").write_text(json.dumps(diagnosis, indent=1))
    (there / "report.yaml").write_text(
        yaml.safe_dump({"run": "../run", "scene": "../run/scene.obj", "sensor": "before.yaml"})
    )
    (there / "before.yaml").write_text(yaml.safe_dump({"name": "paper", "effects": ["material_noise", "fill_rate"]}))
    sensor = {"name": "fitted", "effects": ["material_noise", {"disparity_noise": {"sigma": 0.05}}]}
    (there / "sensor.yaml").write_text(yaml.safe_dump(sensor))
    np.savez_compressed(
        there / "where.npz", face_share=np.zeros(16, np.float32), image_share=np.zeros((4, 6), np.float32)
    )


PROFILE = {
    "name": "mine", "camera": "d435", "description": "x",
    "effects": [
        {"disparity_noise": {"sigma": 0.05}}, "spatial_correlation", {"effect": "fill_rate",
        "parameters": {"rate": 0.01}},
        {"material_noise": {"floor": 0.005}}, {"stereo_shadow": {"left": 1.6, "right": 3.0}}, "disparity_quantization",
    ],
}  # fmt: skip
STEREO = {
    "name": "stereo", "effects": [],
    "camera": {"sensor": "active_stereo", "preset": "d435", "light": {"ambient": 0}, "projector": {"power": 0.1,
    "field": [86, 57]},
               "matcher": {"window": [7, 5], "disparities": 64}, "imager": {"exposure": "auto", "samples": 1}},
}  # fmt: skip


def profile(folder: Path) -> None:
    """A profile with effects, one of active stereo, and one whose camera is a file."""
    (folder / "camera.yaml").write_text(seeds.CAMERA.to_yaml())
    for name, keys in (("mine", PROFILE), ("stereo", STEREO), ("given", {**PROFILE, "camera": "camera.yaml"})):
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(keys, sort_keys=False))


def materials(folder: Path) -> None:
    """Two materials."""
    keys = {
        "cement": {"m": 0.35, "source": "x", "gloss": 0.1, "color": "#9a9a9a", "more": [1, 2]},
        "glass": {"m": 1, "ir_reflectance": 0.1},
    }
    (folder / "materials.yaml").write_text(yaml.safe_dump(keys, sort_keys=False))


def matcher(folder: Path) -> None:
    """What a matcher should do differently."""
    (folder / "settings.yaml").write_text(
        yaml.safe_dump({"window": [7, 5], "disparities": 64, "preset": "high_density", "second_peak": 0.05, "steps": 2})
    )


SWEEP = {
    "name": "mine", "scenes": [{"scene": "scene.obj", "tags": {"*": "cement"}, "units": "m"}],
    "trajectories": [{"shape": "hover", "position": [3, 3, 3], "look_at": [0, 0, 0], "duration": 1.0}],
    "profiles": ["paper", "mine.yaml"], "seeds": [0, 1], "draws": 2, "seed": 1, "resolution": [64, 48],
    "camera": "d435",
    "rate": 5, "frames": 2, "streams": ["depth", "clean"], "with_scene": True,
    "random": {"effects": {"fill_rate": {"rate": {"range": [0.0, 0.02]}}}, "materials": {"cement": ["cement",
    "plastic"]},
               "trajectory": {"duration": {"choice": [1.0, 2.0]}}, "surfaces": {"cement": {"m": {"log_range": [0.2,
               0.5]}}}},
}  # fmt: skip


def sweep(folder: Path) -> None:
    """A sweep over a scene and two profiles beside it."""
    seeds.obj(folder)
    (folder / "mine.yaml").write_text(yaml.safe_dump({"effects": ["fill_rate"]}))
    (folder / "SWEEP.yaml").write_text(yaml.safe_dump(SWEEP, sort_keys=False))


SHAPES = (
    {"shape": "waypoints", "speed": 0.6, "points": [[9.2, 2.6, 1.5], [7.6, 2.2, 1.7], [5.8, 2.4, 1.4]], "closed": True},
    {"shape": "circle", "center": [5.0, 3.6, 2.0], "radius": 2.4, "speed": 0.8, "look_at": [5.0, 4.7, 0.8], "laps": 2},
    {"shape": "line", "start": [0, 0, 1], "end": [2, 1, 1], "speed": 1, "there_and_back": True, "ease": True,
    "pitch": 10},
    {"shape": "lemniscate", "center": [0, 0, 1], "size": [4, 2], "speed": 1.5, "heading": "tangent"},
    {"shape": "hover", "position": [9.2, 2.6, 1.5], "look_at": [5.0, 4.7, 0.8], "duration": 10.0},
)  # fmt: skip


def shapes(folder: Path) -> None:
    """A specification of every shape, and one that names a TUM file."""
    for spec in (*SHAPES, {"file": "poses.txt"}):
        (folder / f"{spec.get('shape', 'given')}.yaml").write_text(yaml.safe_dump(spec, sort_keys=False))
    seeds.poses(folder, "poses.txt")


def words(*choices: str) -> Callable[[Path], None]:
    """What is given in a line, a line a choice."""

    def write(folder: Path) -> None:
        for number, choice in enumerate(choices):
            (folder / f"choice{number}.txt").write_text(choice)

    return write
