"""What a pixel's error may depend on: the axes along which the gap is looked for, from clean geometry and motion."""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.kernels import kernel
from depthsim.moving import objects_seen
from depthsim.raycast import Geometry
from depthsim.scene import Scene
from depthsim.sensor.motion import Motion, velocity_of
from depthsim.sensor.posed import beside

_f = np.float32
EDGE_REACH = 12
"""[px] How far from a depth edge a pixel may lie to count as near it."""
_JUMP = 0.04
"""Least step of a depth edge as a share of the nearer depth, beyond what the surfaces' slopes explain."""


@dataclass
class Covariates:
    """Per pixel of what a camera sees of a frame, each (height, width); what nothing was hit by has depth 0.

    rays (2, …): x and y at z = 1; rows (height,): of the whole picture; corner: the largest length of (x, y) in that.
    depth [m], tag and face as cast; cosine of the incidence; normal (3, …) in the world; height over the world's
    ground [m]; slope_x, slope_y: change of depth [m] per unit of the ray's x and y; drift: change of depth with time
    at a fixed pixel [m/s]; flow: speed of the picture [rad/s]; edge: 0 far from depth edges, else 1 + a code of side,
    direction and distance; across: depth beyond that edge [m]; hidden: the right imager does not see it;
    toward: the normal points to the camera's side; instance: number of the object, 0 for none. On objects that move,
    drift and flow are those of the motion between camera and object.
    """

    rays: NDArray[np.float32]
    rows: NDArray[np.intp]
    corner: np.float32
    depth: NDArray[np.float32]
    tag: NDArray[np.uint8]
    face: NDArray[np.int32]
    cosine: NDArray[np.float32]
    normal: NDArray[np.float32]
    height: NDArray[np.float32]
    slope_x: NDArray[np.float32]
    slope_y: NDArray[np.float32]
    drift: NDArray[np.float32]
    flow: NDArray[np.float32]
    edge: NDArray[np.uint8]
    across: NDArray[np.float32]
    hidden: NDArray[np.bool_]
    toward: NDArray[np.bool_]
    instance: NDArray[np.uint16]

    def of_rows(self, rows: NDArray[np.intp]) -> "Covariates":
        """Some of the rows, counted from the first that is there."""
        pictures = (one.name for one in fields(self) if one.name not in ("rows", "corner"))
        return replace(self, rows=self.rows[rows], **{name: getattr(self, name)[..., rows, :] for name in pictures})


EDGE_DISTANCES = (1, 2, 4, 7, EDGE_REACH)
EDGE_CODES = 1 + len(EDGE_DISTANCES) * 4 * 2


def covariates(
    geometry: Geometry, pose: NDArray[np.float64], camera: Camera, scene: Scene, motion: Motion, stamp: float
) -> Covariates:
    """The axes of one frame. pose: (4, 4) camera to world; motion and stamp [s] give the camera's velocity."""
    z = geometry.depth
    x, y = camera.rays
    rotation = pose[:3, :3].astype(np.float32)
    world = np.moveaxis(geometry.normals(scene, stamp), -1, 0)
    n = np.einsum("ij,jhw->ihw", rotation.T, world)
    along = n[0] * x + n[1] * y + n[2]
    toward = along < 0
    along = np.where(np.abs(along) > 0.02, along, np.copysign(_f(0.02), along))
    hit = geometry.hit
    slope_x = np.where(hit, -z * n[0] / along, 0)
    slope_y = np.where(hit, -z * n[1] / along, 0)
    linear, turning = _velocities(geometry, scene, pose, motion, stamp)
    turned = np.stack(
        [
            turning[1] * n[2] - turning[2] * n[1],
            turning[2] * n[0] - turning[0] * n[2],
            turning[0] * n[1] - turning[1] * n[0],
        ]
    )
    ahead = np.tensordot(linear, n, 1) if linear.ndim == 1 else (linear * n).sum(axis=0)
    drift = (z * (turned[0] * x + turned[1] * y + turned[2]) - ahead) / along
    near = 1 / np.maximum(z, _f(0.05))
    flow_x = (x * linear[2] - linear[0]) * near + x * y * turning[0] - (1 + x * x) * turning[1] + y * turning[2]
    flow_y = (y * linear[2] - linear[1]) * near + (1 + y * y) * turning[0] - x * y * turning[1] - x * turning[2]
    up = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2]
    edge, across = np.zeros(z.shape, np.uint8), np.zeros(z.shape, np.float32)
    _edges(z, np.abs(slope_x) / _f(camera.fx), np.abs(slope_y) / _f(camera.fy), edge, across)
    hidden = np.zeros(z.shape, np.bool_) if geometry.right_sees is None else geometry.right_sees == 0
    return Covariates(
        rays=camera.rays,
        rows=camera.rows,
        corner=np.hypot(*camera.whole.rays).max(),
        depth=z,
        tag=geometry.tag,
        face=geometry.face,
        cosine=geometry.cosine,
        normal=world,
        height=(z * up + _f(pose[2, 3])).astype(np.float32),
        slope_x=slope_x.astype(np.float32),
        slope_y=slope_y.astype(np.float32),
        drift=np.where(hit, drift, 0).astype(np.float32),
        flow=np.hypot(flow_x, flow_y).astype(np.float32),
        edge=edge,
        across=across,
        hidden=hidden & hit,
        toward=toward,
        instance=scene.instance_of_face[geometry.face + 1],
    )


def _velocities(
    geometry: Geometry, scene: Scene, pose: NDArray[np.float64], motion: Motion, stamp: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(3,) linear [m/s] and angular [rad/s] velocity of the camera, in its own axes, as seen from the scene.

    Where objects move they are (3, height, width), as seen from what a pixel shows.
    """
    linear, turning = (one.astype(_f) for one in motion.velocity(stamp))
    if not scene.movers:
        return linear, turning
    face = geometry.face.reshape(-1)
    shape = (3, *geometry.face.shape)
    linear, turning = (np.broadcast_to(one[:, None, None], shape).copy() for one in (linear, turning))
    for number, pixels, _ in objects_seen(scene.movers, face, pose, stamp):
        own = velocity_of(beside(scene.movers, number, motion), stamp)
        for field, velocity in zip((linear, turning), own, strict=True):
            field.reshape(3, -1)[:, pixels] = velocity[:, None]
    return linear, turning


@kernel
def _edges(z, step_x, step_y, edge, across):
    """The nearest depth edge of each pixel, in its row and its column."""
    height, width = z.shape
    for v in range(height):
        for u in range(width):
            best, found_side, found_direction = EDGE_REACH + 1, 0, 0
            for direction in range(4):
                du = -1 if direction == 0 else (1 if direction == 1 else 0)
                dv = -1 if direction == 2 else (1 if direction == 3 else 0)
                for k in range(1, best):
                    y, x = v + dv * k, u + du * k
                    if y < 0 or x < 0 or y >= height or x >= width:
                        break
                    y0, x0 = y - dv, x - du
                    a, b = z[y0, x0], z[y, x]
                    slope = step_x[y0, x0] + step_x[y, x] if du != 0 else step_y[y0, x0] + step_y[y, x]
                    if abs(a - b) > _f(_JUMP) * min(a, b) + _f(0.75) * slope:
                        best, found_direction = k, direction
                        found_side = 0 if (a > b > 0) or a == 0 else 1
                        across[v, u] = b
                        break
            if best <= EDGE_REACH:
                far = 0 if best == 1 else (1 if best == 2 else (2 if best <= 4 else (3 if best <= 7 else 4)))
                edge[v, u] = 1 + far + 5 * (found_direction + 4 * found_side)
