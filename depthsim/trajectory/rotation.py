"""Rotations of the optical frame as unit quaternions x y z w, camera to world."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_VERTICAL = 1e-12
"""A direction whose horizontal part is below this (of its length) looks straight up or down."""

OPTICAL_IN_BODY = np.array([-0.5, 0.5, -0.5, 0.5])
"""The optical frame (x right, y down, z forward) in a body frame (x forward, y left, z up)."""


def rotation_matrices(quaternions: Floats) -> Floats:
    """(N, 4) unit quaternions to (N, 3, 3) rotation matrices."""
    x, y, z, w = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def turned(vector: Floats) -> Floats:
    """(3, 3) the rotation about ``vector`` by its length [rad]."""
    angle = float(np.linalg.norm(vector))
    # NumPy's sinc is sin(πx) / πx, so this is sin(angle / 2) / angle, without a division by 0.
    axis = vector * np.sinc(angle / (2 * np.pi)) / 2
    turn: Floats = rotation_matrices(np.array([[*axis, np.cos(angle / 2)]]))[0]
    return turn


def multiply(a: Floats, b: Floats) -> Floats:
    """The Hamilton product of quaternions (..., 4): first ``b``, then ``a``."""
    ax, ay, az, aw = np.moveaxis(a, -1, 0)
    bx, by, bz, bw = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )


def slerp(a: Floats, b: Floats, share: Floats) -> Floats:
    """Spherical linear interpolation (Shoemake 1985) the shorter way round: ``a`` at share 0, ``±b`` at share 1.

    a, b: (N, 4) unit quaternions. share: (N,) in 0 to 1.
    """
    b = np.where(np.sum(a * b, axis=1, keepdims=True) < 0, -b, b)
    # The angle from the arctangent stays exact for rotations of any size; the arccosine of the dot product does not.
    angle = 2 * np.arctan2(np.linalg.norm(b - a, axis=1), np.linalg.norm(b + a, axis=1))
    small = angle < 1e-8
    safe = np.where(small, 1.0, np.sin(angle))
    first = np.where(small, 1 - share, np.sin((1 - share) * angle) / safe)
    second = np.where(small, share, np.sin(share * angle) / safe)
    mixed = first[:, None] * a + second[:, None] * b
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)


def view_rotations(directions: Floats, pitch: float = 0.0) -> Floats:
    """Quaternions of cameras that look along ``directions`` (N, 3), level: the x axis is horizontal, y points down.

    ``pitch`` [rad] raises the view above the direction, up to the vertical. Where a direction itself is vertical, the
    upper edge of the image is turned to +y of the world. Signs are chosen such that neighbours are close.
    """
    horizontal = np.hypot(directions[:, 0], directions[:, 1])
    vertical = horizontal <= _VERTICAL * np.linalg.norm(directions, axis=1)
    azimuth = np.where(vertical, np.pi / 2, np.arctan2(directions[:, 1], directions[:, 0]))
    elevation = np.clip(np.arctan2(directions[:, 2], horizontal) + pitch, -np.pi / 2, np.pi / 2)
    zero = np.zeros_like(azimuth)
    yaw = np.stack([zero, zero, np.sin(azimuth / 2), np.cos(azimuth / 2)], axis=1)
    raised = np.stack([zero, -np.sin(elevation / 2), zero, np.cos(elevation / 2)], axis=1)
    quaternions = multiply(multiply(yaw, raised), OPTICAL_IN_BODY)
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    turned = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0
    quaternions[1:] *= np.where(np.cumsum(turned) % 2 == 1, -1.0, 1.0)[:, None]
    return quaternions
