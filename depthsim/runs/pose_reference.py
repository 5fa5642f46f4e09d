"""Which camera the poses of aligned pictures are those of: the colour camera, or the left imager still."""

import numpy as np
from numpy.typing import NDArray

from depthsim.raycast import Caster
from depthsim.runs.folder import Run
from depthsim.scene import Scene
from depthsim.units import SATURATED

_FRAMES = 8
_STRIDE = 3
_CAP = 0.1
"""[m] Larger errors count as this: they are at edges, or of what the scene has not."""
_BETTER = 0.01
"""Of the mean error, by which it must be less with the left imager's poses, besides in nearly all frames."""


def with_poses_of_pictures(run: Run, scene: Scene) -> Run:
    """The run with the poses of the camera that its pictures are seen from, where those given are the left imager's.

    Pictures that are aligned to colour are the colour camera's, and its place beside the left imager is known: with the
    wrong poses they fit the scene less well, in every frame.
    """
    if not run.camera.aligned or np.abs(run.camera.left_pose - np.eye(4)).max() < 1e-3:
        return run
    other, caster = run.posed_by_left(), Caster(scene)
    frames = run.spread(_FRAMES)
    as_given, by_left = (np.array([_error(one, caster, i) for i in frames]) for one in (run, other))
    less = as_given - by_left
    sure = less.mean() > 3 * less.std() / np.sqrt(len(frames)) and less.mean() > _BETTER * as_given.mean()
    return other if sure else run


def _error(run: Run, caster: Caster, index: int) -> float:
    """The mean error of a frame [m]."""
    seen: NDArray[np.float32] = caster.cast(run.camera, run.poses[index], stamps=float(run.stamps[index])).depth
    units, mask = run.depth_raw(index), run.mask(index)
    known = (units > 0) & (units < SATURATED) & (seen > 0)
    known &= True if mask is None else mask
    off = np.abs(units * np.float32(run.camera.depth_scale) - seen)[known][::_STRIDE]
    return float(np.minimum(off, _CAP).mean()) if off.size else 0.0
