"""Depth that is wrong by a law: a scale, a scale that drifts, an offset of the disparity."""

from typing import ClassVar

import numpy as np

from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_f = np.float32


@kernel
def _scale(start, stop, factor, disparity):
    d = disparity[start:stop]
    for i in range(d.size):
        d[i] *= factor


@kernel
def _shift(start, stop, width, offset, border, cx, fx, disparity):
    """Rows ``start`` to ``stop``, in pixels; what is shifted to 0 or beyond has no depth."""
    for at in range(start, stop, width):
        d = disparity[at : at + width]
        for u in range(width):
            x = (_f(u) - cx) / fx
            shifted = max(d[u] + offset * (_f(1) + border * x * x), _f(0))
            d[u] = shifted if d[u] > _f(0) else _f(0)


def _scale_depth(frame: Frame, scale: float) -> None:
    """Depth times ``scale``, as a wrong f·b does it: the imagers see another disparity than the chip reckons with."""
    frame.run(_scale, _f(1 / scale), frame.disparity.reshape(-1))


class BaselineScale(Effect):
    """Depth times ``scale``: the product of focal length and baseline is miscalibrated by this factor."""

    id: ClassVar[str] = "baseline_scale"
    stage: ClassVar[Stage] = Stage.DISPARITY
    source: ClassVar[str] = "Z = f·b / d"
    axes = ("range",)
    kinds = ("bias",)
    recording = "one flat target at several known ranges, from near to far"
    exact = True
    shown: ClassVar = {"scale": 0.98}

    scale: float = parameter(
        0.98,
        low=0.8,
        high=1.25,
        unit="1",
        neutral=1,
        about="measured depth over true depth",
        source="M. Calvert 2018, 'Improving the depth map accuracy of RealSense cameras': 980.7 mm at 1 m, D435",
        starts=(1.0, 0.95, 1.05),
    )

    def apply(self, frame: Frame) -> None:
        """Scale every depth."""
        _scale_depth(frame, self.scale)


class ThermalDrift(Effect):
    """Depth times 1 + drift · (1 - exp(-t / time_constant)), t since the first frame: the camera warms up."""

    id: ClassVar[str] = "thermal_drift"
    stage: ClassVar[Stage] = Stage.DISPARITY
    source: ClassVar[str] = "librealsense issues 8434 (D455, D415) and 684 (SR300); the exponential is assumed"
    axes = ("time", "range")
    kinds = ("bias",)
    recording = "one unchanged view from a cold start until the depth no longer moves"

    drift: float = parameter(
        -0.007,
        low=-0.1,
        high=0.1,
        unit="1",
        neutral=0,
        about="relative change of depth when the camera is warm",
        source="librealsense issue 8434: 1688 mm in place of 1700 mm on a D455 at 35 °C",
        starts=(-0.01, 0.01, -0.04, 0.04),
    )
    time_constant: float = parameter(
        600,
        low=0.1,
        high=1e5,
        unit="s",
        about="time after which 63 % of the drift is there",
        source="assumed; an SR300 drifted for about 30 minutes (librealsense issue 684)",
        starts=lambda seen: (0.3 * seen.span, 3.0 * seen.span),
    )

    def apply(self, frame: Frame) -> None:
        """Scale every depth by the drift at the frame's stamp."""
        elapsed = max(frame.stamp - frame.motion.start, 0.0)
        _scale_depth(frame, 1 - self.drift * float(np.expm1(-elapsed / self.time_constant)))


class DisparityOffset(Effect):
    """A constant is added to every disparity: one imager's picture is shifted, or the imager turned about y.

    By a turn, to the first order, ``offset`` · (1 + x²) at x times the focal length beside the middle.
    """

    id: ClassVar[str] = "disparity_offset"
    stage: ClassVar[Stage] = Stage.DISPARITY
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "Z = f·b / (d + offset); f·tan(atan(x) + turn) - f·x = f·turn·(1 + x²)"
    axes = ("range",)
    kinds = ("bias",)
    recording = "one flat target at several known ranges, from near to far"
    exact = True
    forms = ({"border": 0.0}, {"border": 1.0})

    offset: float = parameter(
        0.1,
        low=-5,
        high=5,
        unit="px",
        neutral=0,
        about="measured disparity minus true disparity",
        source="assumed; what on-chip calibration finds moves with temperature (librealsense issue 13787)",
        starts=(0.0, -0.3, 0.3),
    )
    border: float = parameter(
        0.0,
        low=0,
        high=1,
        unit="1",
        about="how the offset grows towards the sides: 0 of a picture that is shifted, 1 of an imager that is turned",
        source="geometry",
    )

    def apply(self, frame: Frame) -> None:
        """Shift every disparity."""
        camera = frame.camera
        frame.run(
            _shift, camera.width, _f(self.offset), _f(self.border), _f(camera.cx), _f(camera.fx),
            frame.disparity.reshape(-1), multiple=camera.width,
        )  # fmt: skip
