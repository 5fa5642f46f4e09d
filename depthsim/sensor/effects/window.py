"""The matcher's averaging over a window."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

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
    z, d = clean[start:stop], out[start:stop]
    for i in range(d.size):
        d[i] = focal_baseline / z[i] if z[i] > _ZERO else _f(-1)


@kernel
def _move_by(start, stop, focal_baseline, clean, mean, disparity):
    """Add what the mean differs by from the true disparity; holes stay, and nothing is beyond infinity."""
    z, m, d = clean[start:stop], mean[start:stop], disparity[start:stop]
    for i in range(d.size):
        own, there, by = d[i], z[i], m[i]
        moved = own + by - focal_baseline / there
        moved = moved if moved > _ZERO else _ZERO  # one choice a line, see kernel
        moved = moved if there > _ZERO else own
        d[i] = moved if own > _ZERO else own


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
        high=8,
        unit="px",
        about="the mean is of what differs by less",
        source="librealsense, src/ds/advanced_mode/presets.cpp: rsm.diffThresh of the default preset",
        starts=(4.0,),
    )

    def apply(self, frame: Frame) -> None:
        """Move every disparity by what averaging does to the scene there."""
        focal_baseline = frame.camera.focal_baseline
        of = self.radius, self.step, focal_baseline
        mean = frame.geometry.once(self.id, of, lambda: self._mean(frame)).reshape(-1)
        clean = frame.geometry.depth.reshape(-1)
        frame.run(_move_by, _f(focal_baseline), clean, mean, frame.disparity.reshape(-1))

    def _mean(self, frame: Frame) -> NDArray[np.float32]:
        """(height, width) the mean of the scene's disparities."""
        true, mean = frame.empty(), frame.empty()
        frame.run(_true_disparity, _f(frame.camera.focal_baseline), frame.geometry.depth.reshape(-1), true.reshape(-1))
        split(
            smooth_rows, frame.camera.height, frame.threads, true, self.radius, self.radius, _f(self.step), _FINE, mean
        )
        return mean
