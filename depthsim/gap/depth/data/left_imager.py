"""The left imager of aligned pictures whose camera does not say what it was, by the rows that were doubled."""

from dataclasses import replace

from depthsim.gap.config import DepthData
from depthsim.gap.depth.data.doubling import SMALLEST, find_doubling
from depthsim.runs.folder import Run
from depthsim.sensor.effect import parameters_of
from depthsim.sensor.effects.align import AlignToColor, zoom_accuracy

_FRAMES = 16


def with_left_imager(run: Run, limit: DepthData = DepthData()) -> Run:  # noqa: B008 - frozen
    """The run with the focal length of the left imager that its doubled rows show, where its camera does not say it.

    The driver's camera_info of aligned pictures has the colour camera's intrinsics alone. A preset's are off by some
    per cent, and other rows are doubled then.
    """
    camera = run.camera
    if not camera.aligned or camera.depth is not None or min(camera.shape) <= SMALLEST:
        return run
    doubled = find_doubling(map(run.depth_raw, run.spread(_FRAMES)), limit)
    usual, most = camera.left, parameters_of(AlignToColor)["zoom"].high
    sure = zoom_accuracy(camera.width, camera.height)
    if doubled is None or doubled[0] > most or abs(doubled[0] * usual.fy / camera.fy - 1) < sure:
        return run
    focal = float(camera.fy / doubled[0])
    own = {name: getattr(usual, name) for name in ("width", "height", "cx", "cy")} | {"fx": focal, "fy": focal}
    return replace(run, camera=camera.model_copy(update={"depth": own}), left_by_rows=True)
