"""Trajectories in the TUM RGB-D format: "timestamp tx ty tz qx qy qz qw" a line, camera to world."""

import math
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.trajectory.poses import Trajectory
from depthsim.yamlfile import read_text

_COLUMNS = "timestamp tx ty tz qx qy qz qw"


def read_tum(path: Path) -> Trajectory:
    """Read a TUM trajectory. Columns are separated by white space; lines that start with # are comments.

    A quaternion within 1 % of unit length is normalised. Raises :class:`InputError`, with the line.
    """
    rows: list[list[float]] = []
    stamp = -math.inf
    for number, line in enumerate(read_text(path, "a TUM trajectory").splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        row = _row(line, path, f"line {number}")
        if row[0] <= stamp:
            problem = "comes twice" if row[0] == stamp else f"is before the one above, {stamp:.6f}"
            raise InputError(path, f"line {number}", f"stamp {row[0]:.6f} {problem}", "sort the lines, each stamp once")
        stamp = row[0]
        rows.append(row)
    if not rows:
        raise InputError(path, "", "holds no pose", f"write lines of `{_COLUMNS}`")
    poses = np.array(rows)
    return Trajectory(poses[:, 0], poses[:, 1:4], poses[:, 4:], str(path))


def _row(line: str, path: Path, place: str) -> list[float]:
    words = line.split()
    if len(words) != 8:
        fix = "separate the columns by spaces, not commas" if "," in line else f"write `{_COLUMNS}`"
        raise InputError(path, place, f"has {len(words)} columns, not 8", fix)
    row = []
    for name, word in zip(_COLUMNS.split(), words, strict=True):
        try:
            row.append(float(word.replace("_", "?")))  # float() itself takes 1_000
        except ValueError:
            raise InputError(path, place, f"{name} is {word[:40]!r}, not a number", "write a number") from None
        if not math.isfinite(row[-1]):
            raise InputError(path, place, f"{name} is {word[:40]}", "write a finite number, or drop the line")
    length = math.hypot(*row[4:])
    if abs(length - 1) > 1e-2:
        raise InputError(path, place, f"the quaternion has length {length:.4g}", "write a unit quaternion, qx qy qz qw")
    return row


def tum_text(trajectory: Trajectory) -> str:
    """The text of a TUM file: the shortest decimals that read back as the same numbers, six or more in a stamp."""
    lines = [f"# {_COLUMNS}"]
    poses = np.hstack([trajectory.positions, trajectory.quaternions]).tolist()
    for stamp, pose in zip(trajectory.stamps, poses, strict=True):
        words = [np.format_float_positional(stamp, min_digits=6), *map(repr, pose)]
        lines.append(" ".join(words))
    return "\n".join(lines) + "\n"


def write_tum(trajectory: Trajectory, path: Path) -> None:
    """Write a TUM file."""
    path.write_text(tum_text(trajectory), encoding="utf-8")
