"""What odometry and mapping make of runs, as figures: a process of its own, on one core.

Open3D adds up in the order in which its threads finish, and a track that is nearly lost then goes one way or another;
on one core it gives the same figures again. It also may end the process that it runs in.
"""

import json
import os
import sys
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.odometry import Estimate, estimate, score
from depthsim.odometry.open3d_images import quiet_open3d
from depthsim.reconstruction.reconstruct import fuse
from depthsim.runs.folder import Run
from depthsim.trajectory import Trajectory

SCENE, MASKS = "scene.npz", "masks.npy"
"""Beside the runs: vertices and faces of the scene, where its surface is to be compared; where it may be trusted."""
SYSTEMS = {"open3d": "open3d-odometry", "kiss_icp": "kiss-icp"}
"""The name of each system in those of the figures."""
VOXEL, DEPTH_MAX, VIEWS, BLOCKS = 0.04, 4.0, 5, 1000
"""Of the map: [m], twice that of `reconstruct`, which takes 2.4 times as long; [m]; how many frames must have seen a
surface; and the room to begin with."""


def figures_of(folder: Path, systems: Sequence[str]) -> dict[str, float]:
    """The figures of a run, by name; what cannot be measured is left out. systems: of :data:`SYSTEMS`."""
    run: Run = _Kept.open(folder)
    found: dict[str, float] = {}
    for name in systems:
        scored = score(run.trajectory, kept_to_the_end(estimate(run, SYSTEMS[name]), run))
        found |= {f"drift_{name}": 100 * scored.drift, f"ate_{name}": 1000 * scored.ate}
    if (folder.parent / SCENE).is_file():
        found["surface_error"] = 1000 * surface_error(run, folder.parent)
    return {name: value for name, value in found.items() if np.isfinite(value)}


def kept_to_the_end(found: Estimate, run: Run) -> Trajectory:
    """The estimate; where the track was lost, the last pose stays."""
    way = found.trajectory
    if len(way) == found.frames:
        return way
    rest = run.stamps[run.stamps > way.stamps[-1]]
    last = np.repeat(-1, len(rest))
    stamps = np.concatenate([way.stamps, rest])
    return Trajectory(
        stamps,
        np.concatenate([way.positions, way.positions[last]]),
        np.concatenate([way.quaternions, way.quaternions[last]]),
        way.name,
    )


class _Kept(Run):
    """A run whose pictures are read once: odometry asks for each twice, and a map three times."""

    @cached_property
    def _pictures(self) -> dict[int, NDArray[np.uint16]]:
        return {}

    def depth_raw(self, index: int) -> NDArray[np.uint16]:
        if index not in self._pictures:
            self._pictures[index] = super().depth_raw(index)
        return self._pictures[index]


class _Trusted(_Kept):
    """The same, with holes where the scene may not be trusted."""

    def depth_raw(self, index: int) -> NDArray[np.uint16]:
        masks = np.load(self.path.parent / MASKS, mmap_mode="r", allow_pickle=False)
        return np.where(masks[index], super().depth_raw(index), np.uint16(0))


def surface_error(run: Run, beside: Path) -> float:
    """How far the map of a run at its own poses lies from the scene, on average over its vertices [m]; or NaN."""
    if (beside / MASKS).is_file():
        run = _Trusted.open(run.path)
    try:
        mesh = fuse(run, run.poses, VOXEL, DEPTH_MAX, VIEWS, "cement", blocks=BLOCKS)
    except InputError:  # nothing was seen often enough
        return float("nan")
    scene: dict[str, Any] = dict(np.load(beside / SCENE, allow_pickle=False))
    o3d = quiet_open3d()
    near = o3d.t.geometry.RaycastingScene()
    near.add_triangles(*(o3d.core.Tensor(scene[name]) for name in ("vertices", "faces")))
    return float(near.compute_distance(o3d.core.Tensor(mesh.vertices.astype(np.float32))).numpy().mean())


def main() -> None:
    """The figures of systems, with commas between, on the runs whose folders come in, a line of JSON for each line.

    After the systems comes which core it is for.
    """
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[int(sys.argv[2]) % len(cores)]})
    os.nice(19)  # what begins it is waited for
    sys.modules["dash"] = MagicMock()  # Open3D takes four fifths of its time to load for what shows it in a browser
    systems, parent = sys.argv[1].split(","), os.getppid()
    for line in sys.stdin:
        if os.getppid() != parent:  # it was killed, and nobody waits for what it had asked for
            break
        print(json.dumps(figures_of(Path(line.rstrip("\n")), systems)), flush=True)


if __name__ == "__main__":
    main()
