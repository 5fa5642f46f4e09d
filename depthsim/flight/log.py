"""The log of a flight, and its file flight.csv (docs/formats.md).

World: z up, metres. Body: x forward, y left, z up; thrust pushes along +z of the body. Quaternions are x y z w, body to
world. The specific force is what an accelerometer measures: Rᵀ(a + g e3), all forces but gravity over the mass.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.flight.table import Floats, Table, read_table, write_table
from depthsim.trajectory.rotation import rotation_matrices

_POSITION, _VELOCITY, _QUATERNION = ("px", "py", "pz"), ("vx", "vy", "vz"), ("qx", "qy", "qz", "qw")
_RATES, _FORCE = ("wx", "wy", "wz"), ("ax", "ay", "az")
_GROUPS = (_POSITION, _VELOCITY, _QUATERNION, _RATES, _FORCE)
_ROTOR = re.compile(r"T[1-9]\d?")
_EXTRA = re.compile(r"(pwm|omega)[1-9]\d?|battery")
LEAST_ROWS = 3


@dataclass(frozen=True)
class FlightLog:
    """Samples of one flight.

    t: (N,) stamps [s], rising. velocity: (N, 3) in the world [m/s]. quaternion: (N, 4) of unit length. rates: (N, 3) in
    the body [rad/s]. position: (N, 3) in the world [m]. thrust: (N,) of all rotors [N]. rotor_thrusts: (N, K) [N].
    specific_force: (N, 3) in the body [m/s²]. What was not recorded is None.
    extras: (N,) each: ``pwm1``.. (motor commands 0 to 65535), ``omega1``.. (rotor speeds [rad/s]), ``battery`` [V].
    kind: the format it was read from. left_out: columns of the file that mean nothing here. derived: what was not in
    the file but follows from the rest.
    """

    t: Floats
    velocity: Floats
    quaternion: Floats
    rates: Floats
    position: Floats | None = None
    thrust: Floats | None = None
    rotor_thrusts: Floats | None = None
    specific_force: Floats | None = None
    extras: Mapping[str, Floats] = field(default_factory=dict)
    source: str = "a flight"
    kind: str = "flight.csv"
    left_out: tuple[str, ...] = ()
    derived: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.t)
        shapes = {"velocity": 3, "quaternion": 4, "rates": 3, "position": 3, "specific_force": 3}
        for name, width in shapes.items():
            value = getattr(self, name)
            if value is not None and value.shape != (n, width):
                raise ValueError(f"{name} has shape {value.shape}, not {(n, width)}")
        for name, column in {"thrust": self.thrust, **self.extras}.items():
            if column is not None and column.shape != (n,):
                raise ValueError(f"{name} has shape {column.shape}, not {(n,)}")
        if self.rotor_thrusts is not None and (self.rotor_thrusts.ndim != 2 or len(self.rotor_thrusts) != n):
            raise ValueError(f"rotor_thrusts has shape {self.rotor_thrusts.shape}, not ({n}, K)")

    def __len__(self) -> int:
        return len(self.t)

    @property
    def duration(self) -> float:
        """From the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def rotations(self) -> Floats:
        """(N, 3, 3) rotation matrices, body to world."""
        return rotation_matrices(self.quaternion)

    @property
    def total_thrust(self) -> Floats | None:
        """(N,) thrust of all rotors [N], or None where the log has none."""
        if self.thrust is not None or self.rotor_thrusts is None:
            return self.thrust
        return np.asarray(self.rotor_thrusts.sum(axis=1))

    def rotor_columns(self, kind: str) -> Floats | None:
        """(N, K) of the extras ``kind``1 to ``kind``K, kind being ``pwm`` or ``omega``; None without them."""
        names = _numbered(kind, self.extras)
        return np.stack([self.extras[name] for name in names], axis=1) if names else None

    def select(self, rows: NDArray[np.bool_] | NDArray[np.int_] | slice) -> "FlightLog":
        """The same log with some rows only."""
        names = ("t", "velocity", "quaternion", "rates", "position", "thrust", "rotor_thrusts", "specific_force")
        cut = {name: value[rows] for name in names if (value := getattr(self, name)) is not None}
        return replace(self, **cut, extras={name: column[rows] for name, column in self.extras.items()})


def read_flight(path: str | Path, *, drop_unmeasured: bool = False) -> FlightLog:
    """Read a flight.csv. Stamps and attitude must be there, and velocities or positions; the rest is optional.

    Velocities that are not in the file are differentiated from the positions, rates from the attitude; ``derived`` says
    so. Quaternions within 1 % of unit length are normalised. Raises :class:`InputError` with line and column; with
    ``drop_unmeasured`` rows with empty cells or NaN are left out instead, and ``derived`` says how many.
    """
    path = Path(path)
    table = read_table(path, "a flight.csv", _known, drop_unmeasured=drop_unmeasured)
    return log_from_table(table)


def log_from_table(table: Table) -> FlightLog:
    """The log in a table with the column names of flight.csv; see :func:`read_flight`."""
    path, columns = table.path, table.columns
    _check_columns(table)
    t = columns["t"]
    quaternion = _unit_quaternions(table)
    position = table.stack(_POSITION) if "px" in columns else None
    derived = []
    if "vx" in columns:
        velocity = table.stack(_VELOCITY)
    else:
        assert position is not None
        velocity, derived = np.gradient(position, t, axis=0), ["velocities from positions"]
    if "wx" in columns:
        rates = table.stack(_RATES)
    else:
        rates = rates_from_attitude(t, quaternion)
        derived.append("angular rates from attitude")
    if table.dropped:
        derived.append(f"{table.dropped} rows left out that were not measured whole")
    rotors = [name for name in columns if _ROTOR.fullmatch(name)]
    return FlightLog(
        t=t,
        velocity=velocity,
        quaternion=quaternion,
        rates=rates,
        position=position,
        thrust=columns.get("thrust"),
        rotor_thrusts=table.stack(_numbered("T", columns)) if rotors else None,
        specific_force=table.stack(_FORCE) if "ax" in columns else None,
        extras={name: column for name, column in columns.items() if _EXTRA.fullmatch(name)},
        source=str(path),
        left_out=table.left_out,
        derived=tuple(derived),
    )


def write_flight(log: FlightLog, path: str | Path) -> None:
    """Write a flight.csv that reads back as the same numbers; whole or not at all."""
    columns = {"t": log.t}
    groups = zip(_GROUPS, (log.position, log.velocity, log.quaternion, log.rates, log.specific_force), strict=True)
    for names, values in groups:
        if values is not None:
            columns.update(zip(names, values.T, strict=True))
    if log.thrust is not None:
        columns["thrust"] = log.thrust
    if log.rotor_thrusts is not None:
        columns.update({f"T{number}": column for number, column in enumerate(log.rotor_thrusts.T, start=1)})
    write_table({**columns, **log.extras}, Path(path))


def rates_from_attitude(t: Floats, quaternion: Floats) -> Floats:
    """(N, 3) angular rates in the body [rad/s]: 2 q* ⊗ dq/dt, with dq/dt by central differences."""
    turned = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0
    q = quaternion.copy()
    q[1:] *= np.where(np.cumsum(turned) % 2 == 1, -1.0, 1.0)[:, None]
    x, y, z, w = q.T
    dx, dy, dz, dw = np.gradient(q, t, axis=0).T
    return 2 * np.stack(
        [
            w * dx - x * dw - y * dz + z * dy,
            w * dy + x * dz - y * dw - z * dx,
            w * dz - x * dy + y * dx - z * dw,
        ],
        axis=1,
    )


def _known(name: str) -> bool:
    fixed = name in ("t", "thrust") or any(name in group for group in _GROUPS)
    return fixed or bool(_ROTOR.fullmatch(name) or _EXTRA.fullmatch(name))


def _numbered(stem: str, names: Mapping[str, Floats]) -> list[str]:
    """stem1, stem2, ... as far as they go."""
    found: list[str] = []
    while f"{stem}{len(found) + 1}" in names:
        found.append(f"{stem}{len(found) + 1}")
    return found


def _check_columns(table: Table) -> None:
    path, names = table.path, table.columns
    if "t" not in names:
        raise InputError(path, "header", "has no column t", "name the column of stamps [s] t")
    for group in _GROUPS:
        missing = [name for name in group if name not in names]
        if missing and len(missing) < len(group):
            there = " ".join(name for name in group if name in names)
            raise InputError(path, "header", f"has {there} without {' '.join(missing)}", f"write {' '.join(group)}")
    if "qx" not in names:
        raise InputError(path, "header", "has no attitude", "write the columns qx qy qz qw, body to world")
    if "vx" not in names and "px" not in names:
        raise InputError(path, "header", "has neither velocities nor positions", "write vx vy vz, or px py pz")
    for stem in ("T", "pwm", "omega"):
        given = [name for name in names if re.fullmatch(rf"{stem}[1-9]\d?", name)]
        if len(_numbered(stem, names)) != len(given):
            raise InputError(path, "header", f"has {' '.join(given)}", f"number the rotors {stem}1, {stem}2 and so on")
    if len(table) < LEAST_ROWS:
        raise InputError(path, "", f"holds {len(table)} rows", f"give a log of {LEAST_ROWS} samples or more")
    _check_stamps(table)


def _check_stamps(table: Table) -> None:
    t = table.columns["t"]
    step = np.diff(t)
    if (step <= 0).any():
        row = int(np.argmax(step <= 0)) + 1
        problem = f"t {t[row]:.6f} comes twice" if step[row - 1] == 0 else f"t {t[row]:.6f} is before the row above"
        raise table.fault(row, problem, "sort the rows, each stamp once")
    if np.median(step) > 1:
        fix = "write t in seconds, with at least one sample a second"
        raise InputError(table.path, "t", f"goes in steps of {np.median(step):.3g} s", fix)


def _unit_quaternions(table: Table) -> Floats:
    quaternion = table.stack(_QUATERNION)
    length = np.linalg.norm(quaternion, axis=1)
    wrong = np.abs(length - 1) > 1e-2
    if wrong.any():
        row = int(np.argmax(wrong))
        raise table.fault(row, f"the quaternion has length {length[row]:.4g}", "write a unit quaternion, qx qy qz qw")
    length[np.abs(length - 1) < 1e-12] = 1.0  # what was written by write_flight comes back to the last bit
    return quaternion / length[:, None]
