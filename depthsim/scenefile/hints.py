"""Guesses at what may be wrong with a scene, for people to judge."""

import numpy as np
from numpy.typing import NDArray

WIDE, NARROW = 300.0, 0.25
"""Widths [m] beyond which a scene for a depth camera is likely in other units."""

FAR = 8192.0
"""Distance from the origin [m] from which on float32, in which rays are cast, steps by a millimetre."""


def size_hint(bounds: NDArray[np.float64]) -> str | None:
    """What the width of the scene says of its units."""
    width = float(np.ptp(bounds, axis=0).max())
    if width > WIDE:
        units = [unit for unit, metres in (("mm", 1e-3), ("cm", 1e-2)) if 0.5 <= width * metres <= WIDE]
        tries = " or ".join(f"`units` {unit}" for unit in units or ["mm"])
        return f"{width:,.0f} m wide: is the file in other units? {tries}"
    if width < NARROW:
        return f"{width:.2g} m wide: is the file in other units? `scale:` in a scene file makes it larger"
    return None


def origin_hint(bounds: NDArray[np.float64]) -> str | None:
    """Whether the scene lies so far out that single precision hurts."""
    farthest = float(np.abs(bounds).max())
    if farthest < FAR:
        return None
    step = float(np.spacing(np.float32(farthest))) * 1000
    return f"{farthest:,.0f} m from the origin, where depth comes in steps of {step:.2g} mm: `translate:` it nearer"


def up_hint(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> str | None:
    """Whether the ground seems to lie across the y axis rather than the z axis."""
    across_y, across_z = (_ground(vertices, faces, axis) for axis in (1, 2))
    if across_y > 0.5 and across_z < min(0.75, 0.8 * across_y):
        return "its largest level surface lies across y: is y up in the file? `up` y"
    return None


def _ground(vertices: NDArray[np.float64], faces: NDArray[np.int64], axis: int) -> float:
    """The area that is level along an axis and near the lower end of it, as a share of the footprint."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    cross = np.cross(b - a, c - a)
    area = np.linalg.norm(cross, axis=1) / 2
    low, high = vertices[:, axis].min(), vertices[:, axis].max()
    near = (a[:, axis] + b[:, axis] + c[:, axis]) / 3 < low + 0.1 * (high - low)
    level = np.abs(cross[:, axis]) > 0.95 * 2 * area
    footprint = np.prod(np.delete(np.ptp(vertices, axis=0), axis))
    return float(area[near & level].sum() / footprint) if footprint > 0 else 0.0
