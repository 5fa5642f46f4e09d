"""Errors whose distribution has another shape than the simulator's are told apart from biased and from wider ones."""

from pathlib import Path

import numpy as np
import pytest
from changed import SIGMA, diagnosed, noise, noisy
from numpy.typing import NDArray

from depthsim.gap.depth.data.histograms import BINS, ERROR, MAGNITUDES
from depthsim.gap.depth.where.differences import _one, _shape
from depthsim.sensor.effects.noise import DisparityNoise

RNG = np.random.default_rng(0)
WHITE = RNG.standard_normal(400_000)
STEPS = np.arange(1, 21)[:, None] / 20
STEPPED = (np.round(WHITE.reshape(20, -1) / STEPS) * STEPS).ravel()
"""As of one step of the disparity at many ranges."""


def counted(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    found = np.zeros(int(BINS[ERROR]))
    edges = [-np.inf, *-MAGNITUDES[::-1], 0, *MAGNITUDES, np.inf]
    found[: len(edges) - 1] = np.histogram(errors, edges)[0]
    return found


@pytest.mark.parametrize(
    ("errors", "has_another"),
    [
        (RNG.standard_normal(400_000), False),
        (WHITE + 0.7, False),
        (1.6 * WHITE, False),
        (0.6 * WHITE - 1, False),
        (STEPPED, False),
        ((WHITE**2 - 1) / np.sqrt(2), True),
        (1 - RNG.exponential(size=400_000), True),
        (np.sqrt(12) * (RNG.random(400_000) - 0.5), True),
    ],
    ids=["the same", "biased", "wider", "both", "in steps", "leaning", "leaning back", "flat"],
)
def test_another_shape_is_told(errors: NDArray[np.float64], has_another: bool) -> None:
    a, b = counted(errors), counted(WHITE)
    size = _shape(a, b).size
    assert bool(size > 0.005 and size > max(_one(a, b)[0].values())) is has_another


@pytest.mark.parametrize(("sign", "side"), [(1, "farther"), (-1, "nearer")])
def test_the_side_is_said(sign: int, side: str) -> None:
    assert f"times as wide on the {side} side" in _shape(counted(sign * (WHITE**2 - 1)), counted(WHITE)).words


def test_noise_that_leans_is_located_in_its_tail(tmp_path: Path) -> None:
    leaning = (noise() ** 2 - 1) / np.sqrt(2)
    found = diagnosed(noisy(tmp_path / "run", leaning), [DisparityNoise(sigma=SIGMA)], "vignetting_noise")
    assert (found.verdict, found.causes) == ("unexplained", ())
    first = found.where[0]
    assert (first.axis, first.what) == ("residual_tail", "tail") and "another shape" in first.text
    assert "pixel_neighbours" not in [cut.axis for cut in found.where[:2]]
