"""The matcher's averaging over a window."""

from typing import ClassVar

import numpy as np

from depthsim.kernels import kernel
from depthsim.parallel import split
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame
from depthsim.stereo.smoothing import smooth_rows

_f = np.float32
_ZERO = _f(0)
_FINE = 1 << 16
"""Steps of a pixel that are as good as none."""


@kernel
def _true_disparity(start, stop, focal_baseline, clean, out):
    """Below 0 where nothing is hit."""
    for i in range(start, stop):
        out[i] = focal_baseline / clean[i] if clean[i] > _ZERO else _f(-1)


@kernel
def _move_by(start, stop, true, mean, disparity):
    """Add what the mean differs by from the true disparity; holes stay, and nothing is beyond infinity."""
    for i in range(start, stop):
        moved = max(disparity[i] + mean[i] - true[i], _ZERO)
        disparity[i] = moved if (disparity[i] > _ZERO) & (true[i] > _ZERO) else disparity[i]


class MatchingWindow(Effect):
    """The disparity is the mean over a window of ``2·radius + 1`` pixels, across and down: small steps become ramps.

    What differs by ``step`` or more is left out, so that larger steps stay as they are. Where the picture ends so does
    the window, and slanted surfaces are bent. It is the scene that is averaged, with foreground that has grown; the
    noise is not, as its strength and correlation are those of the finished depth.
    """

    id: ClassVar[str] = "matching_window"
    stage: ClassVar[Stage] = Stage.MIXING
    rank: ClassVar[int] = 2
    source: ClassVar[str] = (
        "librealsense's advanced mode, STRsm, has a disparity difference threshold; form by 640x480 frames of a D435"
    )
    axes = ("edge_distance", "image_position")
    kinds = ("bias", "spread", "tail")
    recording = "a board a little before a wall, so that the disparity steps by 1 to 4 px"

    radius: int = parameter(
        4,
        low=0,
        high=12,
        unit="px",
        neutral=0,
        about="half the window, in rows and columns",
        source="640x480 frames of a D435: steps below 4 px are ramps over 9 pixels with tails, in x and y; the last "
        "rows of a slanted floor are bent as by 5 to 6 px",
        starts=(2, 4, 7),
    )
    step: float = parameter(
        4.0,
        low=0.1,
        high=64,
        unit="px",
        about="the mean is of what differs by less",
        source="librealsense, src/ds/advanced_mode/presets.cpp: rsm.diffThresh of the default preset",
        starts=(4.0,),
    )

    def apply(self, frame: Frame) -> None:
        """Move every disparity by what averaging does to the scene there."""
        true, mean, disparity = frame.empty(), frame.empty(), frame.disparity.reshape(-1)
        frame.run(_true_disparity, _f(frame.camera.focal_baseline), frame.geometry.depth.reshape(-1), true.reshape(-1))
        split(
            smooth_rows, frame.camera.height, frame.threads, true, self.radius, self.radius, _f(self.step), _FINE, mean
        )
        frame.run(_move_by, true.reshape(-1), mean.reshape(-1), disparity)
