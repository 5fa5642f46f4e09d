"""Errors that stay at their pixels are told from noise."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.locked import locked_share
from depthsim.gap.depth.fit import marks
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import effect_class

RNG = np.random.default_rng(0)
SIZE = 90, 160


def signs(pattern: NDArray[np.float64] | float, count: int = 4, holes: float = 0.1) -> list[NDArray[np.int8]]:
    """Of frames of noise beside a pattern, with some holes."""
    return [
        (np.sign(RNG.standard_normal(SIZE) + pattern) * (RNG.random(SIZE) >= holes)).astype(np.int8)
        for _ in range(count)
    ]


@pytest.mark.parametrize("pattern", [0.0, 0.5, -3.0])
def test_noise_stays_nowhere(pattern: float) -> None:
    """Nor where all of it is off to one side."""
    assert abs(locked_share(signs(pattern))) < 0.02


@pytest.mark.parametrize("size", [0.3, 1.0, 3.0])
def test_a_pattern_stays_as_much_as_it_has_of_the_variance(size: float) -> None:
    """Signs of normal errors that are correlated by r agree by 2/pi asin r (Grothendieck)."""
    found = locked_share(signs(size * RNG.standard_normal(SIZE)))
    assert found == pytest.approx(2 / np.pi * np.arcsin(size**2 / (1 + size**2)), abs=0.03)


def test_nothing_is_said_of_one_frame_or_of_holes() -> None:
    assert locked_share(signs(0.0, count=1)) == 0 == locked_share(signs(0.0, holes=1.0))


@pytest.mark.parametrize(
    ("effect", "recorded", "simulated", "refused"),
    [
        ("disparity_noise", 0.4, 0.02, True),
        ("spatial_correlation", 0.4, 0.02, True),
        ("disparity_noise", 0.4, 0.3, False),  # beside a fixed pattern that is named, too
        ("disparity_noise", 0.1, 0.0, False),
        ("temporal_correlation", 0.4, 0.0, False),  # it may last longer than by the formula
        ("fixed_pattern", 0.4, 0.0, False),
        ("fill_rate", 0.4, 0.0, False),
    ],
)
def test_noise_is_no_cause_of_errors_that_stay(effect: str, recorded: float, simulated: float, refused: bool) -> None:
    known = {marks._locked_recorded: recorded, marks._locked_simulated: simulated}
    validator = SimpleNamespace(evidence=SimpleNamespace(config=DepthConfig()), once=lambda work, *_: known[work])
    why = marks.stays_at_pixels(cast(Validator, validator), effect_class(effect), ())
    assert (why is not None) == refused
