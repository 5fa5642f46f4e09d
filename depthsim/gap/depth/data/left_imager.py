"""The left imager of aligned pictures whose camera does not say what it was, by the rows that were doubled."""

from dataclasses import replace

import numpy as np

from depthsim.gap.config import DepthData
from depthsim.gap.depth.data.doubling import SMALLEST, find_doubling
from depthsim.runs.folder import Run

_FRAMES = 16
_MOST = 3
"""The largest zoom that an alignment has."""
_SURE = 0.7
"""[px] Over the picture's size: how well doubled rows show the zoom."""


def with_left_imager(run: Run, limit: DepthData = DepthData()) -> Run:  # noqa: B008 - frozen
    """The run with the focal length of the left imager that its doubled rows show, where its camera does not say it.

    The driver's camera_info of aligned pictures has the colour camera's intrinsics alone. A preset's are off by some
    per cent, and other rows are doubled then.
    """
    camera = run.camera
    if not camera.aligned or camera.depth is not None or min(camera.shape) <= SMALLEST:
        return run
    frames = np.unique(np.linspace(0, len(run) - 1, _FRAMES).round().astype(int))
    doubled = find_doubling((run.depth_raw(int(i)) for i in frames), limit)
    usual = camera.left
    sure = _SURE / np.sqrt(camera.width * camera.height)
    if doubled is None or doubled[0] > _MOST or abs(doubled[0] * usual.fy / camera.fy - 1) < sure:
        return run
    focal = float(camera.fy / doubled[0])
    own = {name: getattr(usual, name) for name in ("width", "height", "cx", "cy")} | {"fx": focal, "fy": focal}
    return replace(run, camera=camera.model_copy(update={"depth": own}), left_by_rows=True)
