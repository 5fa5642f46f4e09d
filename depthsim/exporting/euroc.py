"""The folder of EuRoC MAV (Burri et al., IJRR 2016), with depth beside the camera.

    mav0/body.yaml
    mav0/cam0/        data/NANOSECONDS.png, data.csv, sensor.yaml: the intensity images
    mav0/depth0/      the same with 16-bit depth; EuRoC has none, so that the name is ours
    mav0/imu0/        data.csv, sensor.yaml: the run's imu.csv
    mav0/state_groundtruth_estimate0/   data.csv, sensor.yaml

The body is the camera's optical frame, and depthsim's IMU sits at its origin and is turned as it is: every T_BS is the
identity. Ground truth is as dense as groundtruth.txt; velocities are its central differences; biases are unknown to a
run and written as zero.
"""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from depthsim.exporting.tables import imu_columns, nanoseconds
from depthsim.flight.imu import ACCELEROMETER, GYROSCOPE
from depthsim.runs import Run
from depthsim.runs.png import encode_png
from depthsim.runs.storing import write_whole

_TRUTH = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
    "v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], "
    "b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]"
)
_IMU = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
)
_IDENTITY = {"cols": 4, "rows": 4, "data": np.eye(4).ravel().tolist()}


def write(run: Run, out: Path, _: object) -> str:
    """Write mav0/; says what the run lacks."""
    root = out / "mav0"
    root.mkdir()
    lacking = []
    _pictures(run, root / "depth0", "depth")
    if run.has("rgb"):
        _pictures(run, root / "cam0", "rgb")
    else:
        lacking.append("cam0, as the run has no rgb")
    if not _imu(run, root / "imu0"):
        lacking.append("imu0, as the run has no imu.csv (`depthsim fly` makes one)")
    _truth(run, root / "state_groundtruth_estimate0")
    write_whole(root / "body.yaml", _yaml({"comment": "the camera's optical frame"}))
    return f"{len(run)} frames" + "".join(f"; no {what}" for what in lacking)


def _pictures(run: Run, folder: Path, stream: str) -> None:
    (folder / "data").mkdir(parents=True)
    lines = ["#timestamp [ns],filename"]
    for index, stamp in enumerate(run.stamps):
        time = nanoseconds(stamp)
        picture = run.depth_raw(index) if stream == "depth" else run.rgb(index)
        assert picture is not None
        write_whole(folder / "data" / f"{time}.png", encode_png(picture))
        lines.append(f"{time},{time}.png")
    camera = run.camera
    count = 5 if camera.distortion[4] else 4  # EuRoC has k1 k2 p1 p2
    sensor: dict[str, Any] = {
        "sensor_type": "depth" if stream == "depth" else "camera",
        "comment": camera.name,
        "T_BS": _IDENTITY,
        "rate_hz": camera.rate,
        "resolution": [camera.width, camera.height],
        "camera_model": "pinhole",
        "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
        "distortion_model": "radial-tangential",
        "distortion_coefficients": list(camera.distortion[:count]),
    }
    if stream == "depth":
        sensor |= {"depth_scale": camera.depth_scale, "baseline": camera.baseline}
    _finish(folder, lines, sensor)


def _imu(run: Run, folder: Path) -> bool:
    columns = imu_columns(run)
    if columns is None:
        return False
    folder.mkdir()
    t = columns["t"]
    rows = np.stack([columns[name] for name in ("wx", "wy", "wz", "ax", "ay", "az")], axis=1)
    sensor = {
        "sensor_type": "imu",
        "comment": "BMI055",
        "T_BS": _IDENTITY,
        "rate_hz": round(1 / float(np.median(np.diff(t))), 3),
        "gyroscope_noise_density": GYROSCOPE.density,
        "gyroscope_random_walk": GYROSCOPE.walk,
        "accelerometer_noise_density": ACCELEROMETER.density,
        "accelerometer_random_walk": ACCELEROMETER.walk,
    }
    _finish(folder, [_IMU, *_csv(t, rows)], sensor)
    return True


def _truth(run: Run, folder: Path) -> None:
    truth = run.truth
    folder.mkdir()
    velocity = np.zeros_like(truth.positions)
    if len(truth) > 1:
        velocity = np.gradient(truth.positions, truth.stamps, axis=0)
    wxyz = truth.quaternions[:, [3, 0, 1, 2]]
    rows = np.hstack([truth.positions, wxyz, velocity, np.zeros((len(truth), 6))])
    sensor = {"sensor_type": "visual-inertial", "comment": "ground truth", "T_BS": _IDENTITY}
    _finish(folder, [_TRUTH, *_csv(truth.stamps, rows)], sensor)


def _csv(stamps: NDArray[np.float64], rows: NDArray[np.float64]) -> list[str]:
    pairs = zip(stamps, rows.tolist(), strict=True)
    return [",".join([str(nanoseconds(stamp)), *map(repr, row)]) for stamp, row in pairs]


def _finish(folder: Path, lines: list[str], sensor: dict[str, Any]) -> None:
    write_whole(folder / "data.csv", ("\n".join(lines) + "\n").encode())
    write_whole(folder / "sensor.yaml", _yaml(sensor))


def _yaml(keys: dict[str, Any]) -> bytes:
    # OpenCV's reader, which most systems use, wants this first line.
    return ("%YAML:1.0\n" + yaml.safe_dump(keys, sort_keys=False, default_flow_style=None)).encode()
