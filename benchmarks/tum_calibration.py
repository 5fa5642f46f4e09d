"""Which calibration fits the depth of a TUM RGB-D sequence: `./run python benchmarks/tum_calibration.py FOLDER`.

FOLDER is freiburg1_xyz, or part of it. Pixels of one frame are taken into another by the motion capture's poses, and
their distance from the surface there, along its normal, is what a calibration leaves: it fits where many views agree.
Noise, quantisation and errors of the poses are the same for all candidates. Each is judged by the poses as they are,
after its own best time offset, and after its own best hand-eye motion as well, as a wrong principal point is much like
a turned camera.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter, uniform_filter
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from depthsim.camera import Camera, distort
from depthsim.importing.tum import FREIBURG, KINECT_BASELINE, UNITS
from depthsim.runs import layout
from depthsim.runs.folder import read_list
from depthsim.runs.png import decode_png
from depthsim.trajectory import Trajectory, read_tum

Floats = NDArray[np.float64]
RGB, RGB_BENT = FREIBURG["1"]
INFRARED, INFRARED_BENT = (591.1, 590.1, 331.0, 234.0), (-0.0410, 0.3286, 0.0087, 0.0051, -0.5643)
STRAIGHT = (0.0,) * 5
CANDIDATES = {
    "525, 525, 319.5, 239.5 (the driver's default)": ((525.0, 525.0, 319.5, 239.5), STRAIGHT),
    "infrared": (INFRARED, STRAIGHT),
    "infrared with its distortion": (INFRARED, INFRARED_BENT),
    "RGB": (RGB, STRAIGHT),
    "RGB's centre, focal length 525": ((525.0, 525.0, 318.6, 255.3), STRAIGHT),
    "nearest pinhole to RGB with its distortion": ((530.2, 529.1, 319.2, 254.3), STRAIGHT),
    "RGB with its distortion": (RGB, RGB_BENT),
}
"""fx fy cx cy and k1 k2 p1 p2 k3 of the data set's page."""
FAR, OUTLIER = 2.5, 0.06
"""[m] Pixels beyond, and matches farther apart than this, do not count."""
SIDE = 4
"""[px] Normals are of differences over this to either side, where depth has no jump."""


class Sequence:
    """Depth [m] of smooth surfaces (0 elsewhere) and the poses, stamps from the first pose on."""

    def __init__(self, folder: Path) -> None:
        stamps, files, _ = read_list(folder / layout.list_name(layout.DEPTH))
        truth = read_tum(folder / layout.GROUND_TRUTH)
        start = truth.stamps[0]
        self.stamps = np.array([float(stamp) for stamp in stamps]) - start
        self.truth = Trajectory(truth.stamps - start, truth.positions, truth.quaternions)
        self.depth = np.array([self._smooth(decode_png(file).astype(np.float32) / np.float32(UNITS)) for file in files])

    @staticmethod
    def _smooth(depth: NDArray[np.float32]) -> NDArray[np.float32]:
        low, high = minimum_filter(depth, 2 * SIDE + 1), maximum_filter(depth, 2 * SIDE + 1)
        return np.where((low > 0) & (high - low < 0.06 * depth) & (depth < FAR), uniform_filter(depth, 3), 0)

    def poses(self, mounting: Floats) -> Floats:
        """Camera to world after a time offset [s] and a hand-eye motion (rotation vector, translation [m])."""
        motion = np.eye(4)
        motion[:3, :3], motion[:3, 3] = Rotation.from_rotvec(mounting[1:4]).as_matrix(), mounting[4:]
        stamps = np.clip(self.stamps + mounting[0], 0, self.truth.stamps[-1])
        return np.asarray(self.truth.at(stamps).matrices() @ motion)


def matches(seen: Sequence, camera: Camera, mounting: Floats, seed: int) -> tuple[NDArray[np.intp], Floats]:
    """(2, M) frames i and j; (3, M, 3) a point in i, the nearest point in j, and the normal there."""
    draw, poses, count = np.random.default_rng(seed), seen.poses(mounting), len(seen.depth)
    frames, points = [], []
    for i in range(count):
        j = int((i + draw.integers(1, count)) % count)
        v, u = (axis[draw.integers(0, len(axis), 800)] for axis in np.nonzero(seen.depth[i]))
        there = points_of(seen, camera, i, u, v)
        motion = np.linalg.inv(poses[j]) @ poses[i]
        moved = there @ motion[:3, :3].T + motion[:3, 3]
        there, moved = there[moved[:, 2] > 0.1], moved[moved[:, 2] > 0.1]
        x, y = distort(moved[:, 0] / moved[:, 2], moved[:, 1] / moved[:, 2], camera.distortion)
        u, v = np.rint(camera.fx * x + camera.cx).astype(int), np.rint(camera.fy * y + camera.cy).astype(int)
        inside = (u >= SIDE) & (u < camera.width - SIDE) & (v >= SIDE) & (v < camera.height - SIDE)
        there, moved, u, v = there[inside], moved[inside], u[inside], v[inside]
        near = points_of(seen, camera, j, u, v)
        across, down = (
            points_of(seen, camera, j, u + du, v + dv) - points_of(seen, camera, j, u - du, v - dv)
            for du, dv in ((SIDE, 0), (0, SIDE))
        )
        normal = np.cross(across, down)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        good = np.abs(((moved - near) * normal).sum(axis=1)) < OUTLIER
        for du, dv in ((0, 0), (SIDE, 0), (-SIDE, 0), (0, SIDE), (0, -SIDE)):
            good &= seen.depth[j, v + dv, u + du] > 0
        frames.append(np.tile([[i], [j]], good.sum()))
        points.append(np.stack([there[good], near[good], normal[good]]))
    return np.concatenate(frames, axis=1), np.concatenate(points, axis=1)


def points_of(seen: Sequence, camera: Camera, index: int, u: NDArray[np.intp], v: NDArray[np.intp]) -> Floats:
    """(N, 3) the points of pixels in the camera's frame [m]."""
    depth = seen.depth[index, v, u].astype(np.float64)
    return np.stack([camera.rays[0, v, u] * depth, camera.rays[1, v, u] * depth, depth], axis=1)


def distances(mounting: Floats, seen: Sequence, found: tuple[NDArray[np.intp], Floats]) -> Floats:
    """(M,) from each point to the surface that it was matched with, along its normal [m]."""
    (i, j), (there, near, normal) = found
    poses = seen.poses(mounting)
    motion = np.linalg.inv(poses)[j] @ poses[i]
    moved = np.einsum("nab,nb->na", motion[:, :3, :3], there) + motion[:, :3, 3]
    return np.asarray(((moved - near) * normal).sum(axis=1))


def refined(seen: Sequence, camera: Camera, free: int) -> Floats:
    """What this calibration fits best with: nothing, the time offset (1), or the hand-eye motion, too (7 ``free``)."""
    mounting = np.zeros(7)
    for turn in range(6 if free else 0):  # what is matched with what depends on the motion
        found = matches(seen, camera, mounting, turn)
        rest = mounting[free:]
        mounting[:free] = least_squares(
            lambda first, found=found, rest=rest: distances(np.concatenate([first, rest]), seen, found),
            mounting[:free], loss="soft_l1", f_scale=0.005, x_scale=0.01,
        ).x  # fmt: skip
    return mounting


def main() -> None:
    """A line a candidate: median of the distance and what 90 % stay below [mm], and what the refining moved."""
    seen = Sequence(Path(sys.argv[1]))
    print("| calibration | poses as they are | time offset | hand-eye motion, too | turned by x, y, z | offset |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, ((fx, fy, cx, cy), bent) in CANDIDATES.items():
        model = "brown_conrady" if any(bent) else "pinhole"
        camera = Camera(
            model=model, width=640, height=480, fx=fx, fy=fy, cx=cx, cy=cy, distortion=bent, baseline=KINECT_BASELINE
        )
        cells = []
        for free in (0, 1, 7):
            mounting = refined(seen, camera, free)
            size = 1000 * np.abs(distances(mounting, seen, matches(seen, camera, mounting, 99)))
            cells.append(f"{np.median(size):.2f}, {np.quantile(size, 0.9):.1f}")
        turn = ", ".join(f"{angle:+.1f}" for angle in np.degrees(mounting[1:4]))
        print(f"| {name} | {' | '.join(cells)} | {turn}° | {1000 * mounting[0]:+.0f} ms |", flush=True)


if __name__ == "__main__":
    main()
