"""Logs of the NanoBench data set: a Crazyflie 2.1 under motion capture.

Source: syediu/nanobench-iros2026, arXiv 2603.09908.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.flight.constants import GRAVITY
from depthsim.flight.log import FlightLog, log_from_table, read_flight
from depthsim.flight.table import Table, header, read_table

ASSUMED_MASS = 0.035
"""[kg]; the data set gives none. A Crazyflie 2.1 weighs 0.027 kg bare, and carries markers and decks here."""
KIND = "NanoBench"
_POSE = ("t", "px", "py", "pz", "vx", "vy", "vz", "qx", "qy", "qz", "qw")
_OTHER_NAMES = {
    **{f"imu_gyro_{axis}": f"w{axis}" for axis in "xyz"},
    **{f"imu_acc_{axis}": f"a{axis}" for axis in "xyz"},
    **{f"motor_motor_m{number}": f"pwm{5 - number}" for number in range(1, 5)},
    "pwr_pm_vbat": "battery",
}
"""A Crazyflie numbers its motors clockwise from the front right, a vehicle here the other way from the front left."""
_FULL = 65535


def is_nanobench(names: Sequence[str]) -> bool:
    """Whether a file with these columns is a NanoBench log."""
    return any(name in names for name in _OTHER_NAMES)


def read_nanobench(path: str | Path, *, drop_unmeasured: bool = False) -> FlightLog:
    """Read a NanoBench log.

    The accelerometer is in g there. Rates are the gyroscope's, which is less noisy than the motion capture's rates.
    The mass is not in the data set, so there is no thrust, only ``pwm1`` to ``pwm4`` and ``battery``.
    Raises :class:`InputError` as :func:`~depthsim.flight.log.read_flight`, and for units that are not NanoBench's.
    """
    path = Path(path)
    wanted = {*_POSE, *_OTHER_NAMES}
    raw = read_table(path, "a NanoBench log", wanted.__contains__, drop_unmeasured=drop_unmeasured)
    columns = {_OTHER_NAMES.get(name, name): column for name, column in raw.columns.items()}
    if all(f"a{axis}" in columns for axis in "xyz") and len(raw):
        length = float(np.median(np.linalg.norm([columns[f"a{axis}"] for axis in "xyz"], axis=0)))
        if not 0.3 < length < 3:
            problem = f"the accelerometer shows {length:.3g} at the median, where NanoBench is in g"
            raise InputError(path, "imu_acc_x", problem, "divide it by 9.80665, or name the columns ax ay az")
    for name, column in columns.items():
        if name.startswith("pwm") and (column.min(initial=0) < 0 or column.max(initial=0) > _FULL):
            problem = f"goes from {column.min():g} to {column.max():g}"
            raise InputError(path, f"motor_motor_m{5 - int(name[3:])}", problem, "write PWM from 0 to 65535")
        if name in ("ax", "ay", "az"):
            columns[name] = column * GRAVITY
    log = log_from_table(Table(path, columns, raw.lines, raw.left_out, raw.dropped))
    return replace(log, kind=KIND)


def read_any(path: str | Path | FlightLog, *, drop_unmeasured: bool = False) -> FlightLog:
    """Read a flight.csv or a NanoBench log; the columns show which. A log that is read already stays as it is.

    For ``drop_unmeasured`` see :func:`read_flight`.
    """
    if isinstance(path, FlightLog):
        return path
    path = Path(path)
    names = header(path, "a flight.csv or a NanoBench log")
    read = read_nanobench if is_nanobench(names) else read_flight
    return read(path, drop_unmeasured=drop_unmeasured)
