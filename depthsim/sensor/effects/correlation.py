"""How noise is correlated: between neighbouring pixels and between frames, for all effects that add noise."""

from dataclasses import replace
from typing import ClassVar

from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_MEASURED = "the D435 frames of aims-slam, detrended over 25 px"


class SpatialCorrelation(Effect):
    """The noise of two pixels is correlated by 2^-((dx/x)² + (dy/y)²); every pixel keeps its variance."""

    id: ClassVar[str] = "spatial_correlation"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = -1  # before what draws noise
    source: ClassVar[str] = "bell-shaped as measured on real D435 frames: 0.95, 0.79, 0.46, 0.19 at 1, 4, 8, 12 px in x"
    axes = ("pixel_neighbours",)
    kinds = ("correlation",)
    recording = "a flat frontal wall, without filters in the camera"
    seen_on = ("disparity_noise",)

    x: float = parameter(
        8,
        low=0,
        high=32,
        unit="px",
        neutral=0,
        about="lag along a row with correlation 1/2",
        source=_MEASURED,
        starts=(0.7, 2, 6),
    )
    y: float = parameter(
        5,
        low=0,
        high=32,
        unit="px",
        neutral=0,
        about="lag along a column with correlation 1/2",
        source=_MEASURED,
        starts=(0.7, 2, 6),
    )

    @property
    def is_neutral(self) -> bool:
        """Whether there is no correlation either way."""
        return self.x == self.y == 0

    def apply(self, frame: Frame) -> None:
        """Have the noise drawn so."""
        frame.correlation = replace(frame.correlation, x=self.x, y=self.y)


class TemporalCorrelation(Effect):
    """The noise of a pixel is correlated by correlation^|n| with that n frames away; the variance stays."""

    id: ClassVar[str] = "temporal_correlation"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = -1
    source: ClassVar[str] = "an AR(1) process by frames"
    axes = ("frame_neighbours",)
    kinds = ("correlation",)
    recording = "a camera that stands still, at the full frame rate"
    shown: ClassVar = {"correlation": 0.9}
    seen_on = ("disparity_noise",)

    correlation: float = parameter(
        0.2,
        low=0,
        high=0.99,
        unit="1",
        neutral=0,
        about="correlation with the frame before",
        source="0.1 to 0.5, median 0.2, in the D435 frames of aims-slam: 10 Hz, moving, detrended over 25 px",
        starts=(0.2, 0.6),
    )

    def apply(self, frame: Frame) -> None:
        """Have the noise drawn so."""
        frame.correlation = replace(frame.correlation, frames=self.correlation)
