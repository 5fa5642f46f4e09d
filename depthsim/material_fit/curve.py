"""What is measured: std of depth against distance, for one material."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Point:
    """The spread of depth at one distance.

    distance: [m]. pixels: measured depths that stand behind it. holes: share of the pixels without a depth, or
    saturated. outliers: share of the depths beyond six robust deviations, which std and bias do not count.
    std: standard deviation over the image [m], about a plane or about the means of patches.
    robust_std: 1.4826 · MAD of all depths [m]. bias: mean error [m].
    incidence: mean angle between ray and surface normal [deg], not a number for a wall.
    temporal_std: standard deviation of a pixel over the frames [m], not a number where frames cannot be compared.
    count, temporal_count: how many independent Gaussian numbers would give the two as exactly.
    """

    distance: float
    std: float
    robust_std: float
    bias: float
    count: float
    pixels: int
    holes: float
    outliers: float
    incidence: float = float("nan")
    temporal_std: float = float("nan")
    temporal_count: float = float("nan")


@dataclass(frozen=True)
class Curve:
    """std of depth against distance for one material.

    points: in order of distance. source: what it was measured from, as errors and materials.yaml name it.
    left_out: distances that could not be measured, with the reason.
    focal_baseline: f·b of the camera [px m], None where the camera is not known.
    """

    tag: str
    source: str
    points: tuple[Point, ...]
    left_out: tuple[str, ...] = ()
    focal_baseline: float | None = None

    def column(self, name: str) -> NDArray[np.float64]:
        """One figure of all points, (K,)."""
        return np.array([getattr(point, name) for point in self.points], dtype=np.float64)
