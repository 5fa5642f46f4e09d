"""What is wrong with the disparity in the same way in every frame: the rest that a calibration leaves."""

from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, FiniteFloat, field_validator

from depthsim.draws import Draws, Seed
from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame
from depthsim.sensor.noise_field import Correlation, noise_field
from depthsim.sensor.parameter import learned

_f = np.float32
_PLAIN = 16
"""[px] A random shape of this size or smaller is drawn pixel by pixel, a larger one at knots."""
_KNOTS = 4
"""Knots within the lag at which the correlation is a half: with so many a spline gives what is between exactly."""
_MARGIN = 4
"""Knots beyond the picture, because a spline is less exact at its ends."""
Row = Annotated[tuple[FiniteFloat, ...], Field(min_length=1, max_length=1024)]
Grid = Annotated[tuple[Row, ...], Field(min_length=1, max_length=1024)]


@kernel
def _add(start, stop, amplitude, pattern, disparity):
    """What is shifted to 0 or beyond has no depth."""
    d, p = disparity[start:stop], pattern[start:stop]
    for i in range(d.size):
        shifted = max(d[i] + p[i] * amplitude, _f(0))
        d[i] = shifted if d[i] > _f(0) else _f(0)


class FixedPattern(Effect):
    """A smooth bias is added to the disparity, locked to the pixel: the same in every frame of a run.

    Its shape is a random one, normal with the correlation 2^-(lag / size)², or that of ``grid``. The random one is of
    the run's seed, or with ``shape`` of a camera that keeps it from run to run.
    """

    id: ClassVar[str] = "fixed_pattern"
    stage: ClassVar[Stage] = Stage.DISPARITY
    rank: ClassVar[int] = 2
    source: ClassVar[str] = (
        "what repeats in every frame of a RealSense over a table: 0.15 px in 0.6 m, four times the noise of a frame"
    )
    axes = ("image_position", "image_row", "image_column", "image_radius")
    kinds = ("bias", "spread")
    recording = "a flat wall that fills the picture, from several ranges"

    amplitude: float = parameter(
        0.15,
        low=0,
        high=10,
        unit="px",
        neutral=0,
        about="standard deviation of the bias of the disparity; of a grid its root mean square over the picture",
        source="RealSense frames of RobotCalibration, aligned to colour: 1.94 mm at 0.46 to 0.78 m",
        starts=(0.05, 0.2),
    )
    size: float = parameter(
        40,
        low=1,
        high=1000,
        unit="px",
        about="lag at which the bias is correlated by 1/2; a grid has its own",
        source="between the 14 px of these frames and the 47 px of the D435 frames of aims-slam",
        frozen=True,
    )
    shape: int = parameter(
        0,
        low=0,
        high=1_000_000,
        unit="1",
        about="number of a camera, whose random shape is the same in all runs; 0: each seed has a shape of its own",
        source="none: any number",
        frozen=True,
    )
    grid: Grid | None = learned(
        about="rows of values that span the picture from its first row and column to its last, cubic in between: "
        "the shape of the bias, which is scaled to `amplitude`; without it the shape is random"
    )

    @field_validator("grid")
    @classmethod
    def _is_a_grid(cls, grid: Grid | None) -> Grid | None:
        if grid is not None and len({len(row) for row in grid}) > 1:
            raise ValueError("rows have different lengths")
        if grid is not None and not any(value for row in grid for value in row):
            raise ValueError("is 0 everywhere, which has no shape")
        return grid

    def apply(self, frame: Frame) -> None:
        """Add the pattern."""
        shape = frame.camera.whole.shape
        if self.grid is None:
            draws = Draws(Seed("camera", self.shape), self.id, 0) if self.shape else frame.draws(self.id).of_frame(0)
            pattern = _random(draws.key.tobytes(), shape, self.size)
        else:
            pattern = _shaped(self.grid, shape)
        if frame.camera.height < frame.camera.whole.height:
            pattern = pattern[frame.camera.rows]
        frame.run(_add, _f(self.amplitude), pattern.reshape(-1), frame.disparity.reshape(-1))


@lru_cache(maxsize=16)
def spline(knots: int, pixels: int) -> NDArray[np.float64]:
    """(pixels, knots): what each of ``knots`` values, evenly from the first pixel to the last, gives to each pixel."""
    return _spline(knots, np.linspace(0, knots - 1, pixels))


def _spline(knots: int, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """(places, knots): the natural cubic spline through each knot's unit value; one knot is a constant."""
    from scipy.interpolate import CubicSpline  # takes as long to load as half of all else that a command needs

    if knots == 1:
        return np.ones((len(at), 1))
    return np.asarray(CubicSpline(np.arange(knots), np.eye(knots), bc_type="natural")(at))


def _spread(grid: NDArray[np.float64], down: NDArray[np.float64], across: NDArray[np.float64]) -> NDArray[np.float64]:
    # Not by BLAS, whose sums depend on the number of its threads.
    return np.asarray(np.einsum("vj,uj->vu", np.einsum("vi,ij->vj", down, grid), across))


def picture(grid: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
    """(height, width): a grid spread over a picture."""
    return _spread(grid, spline(grid.shape[0], shape[0]), spline(grid.shape[1], shape[1]))


@lru_cache(maxsize=4)
def _shaped(grid: Grid, shape: tuple[int, int]) -> NDArray[np.float32]:
    """A grid's picture with a root mean square of 1."""
    whole = picture(np.array(grid), shape)
    return (whole / np.sqrt((whole**2).mean())).astype(np.float32)


@lru_cache(maxsize=4)
def _random(key: bytes, shape: tuple[int, int], size: float) -> NDArray[np.float32]:
    """A random picture, at every pixel of variance 1. key: of the draws."""
    draws = Draws(0, "", 0)
    draws.key = np.frombuffer(key, np.uint32)
    if size <= _PLAIN:
        return noise_field(draws, shape, Correlation(x=size, y=size), 1)
    step = size / _KNOTS
    height, width = (int(np.ceil((n - 1) / step)) + 1 + 2 * _MARGIN for n in shape)
    field = noise_field(draws, (height, width), Correlation(x=_KNOTS, y=_KNOTS), 1).astype(np.float64)
    at = [_MARGIN + np.arange(n) / step for n in shape]
    return _spread(field, _spline(height, at[0]), _spline(width, at[1])).astype(np.float32)
