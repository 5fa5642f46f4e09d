"""Errors that stay at their pixels, or at their places in the scene, are told from noise."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.frames import CleanFrame
from depthsim.gap.depth.data.locked import carried_share, locked_share, seen_again
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


CAMERA = Camera(width=SIZE[1], height=SIZE[0], fx=100, fy=100, cx=79.5, cy=44.5, baseline=0.05)


def before_a_wall(camera: Camera, *steps: int) -> list[CleanFrame]:
    """Frames of a camera that moves sideways before a wall at 2 m, by whole pixels."""
    frames = []
    for step in steps:
        pose = np.eye(4)
        pose[0, 3] = step * 2 / CAMERA.fx
        geometry = SimpleNamespace(depth=np.full(camera.shape, 2, np.float32))
        frames.append(cast(CleanFrame, SimpleNamespace(camera=camera, pose=pose, geometry=geometry)))
    return frames


@pytest.mark.parametrize("rows", [None, range(0, 90, 2), range(20, 50)])
@pytest.mark.parametrize("size", [0.0, 0.7, 2.0])
def test_a_texture_goes_over_the_picture_with_the_wall(size: float, rows: range | None) -> None:
    """Its errors agree at its own places, and are not locked to the pixel."""
    camera = CAMERA if rows is None else CAMERA.window(np.array(rows))
    texture, steps = size * RNG.standard_normal((90, 240)), (0, 10, 25, 60)
    shown = [
        np.sign(texture[camera.rows, step : step + 160] + RNG.standard_normal(camera.shape)).astype(np.int8)
        for step in steps
    ]
    found = carried_share(shown, seen_again(before_a_wall(camera, *steps)))
    assert found == pytest.approx(2 / np.pi * np.arcsin(size**2 / (1 + size**2)), abs=0.03)
    assert abs(locked_share(shown)) < 0.03


def test_what_stays_at_its_pixel_is_not_carried() -> None:
    """Nor is anything said of a camera that stands still, or of a place behind another surface."""
    shown, steps = signs(3 * RNG.standard_normal(SIZE)), (0, 10, 25, 60)
    frames = before_a_wall(CAMERA, *steps)
    assert abs(carried_share(shown, seen_again(frames))) < 0.03
    assert carried_share(shown, seen_again(before_a_wall(CAMERA, 0, 0, 0, 0))) == 0
    frames[1].geometry.depth[:] = 1.5
    assert all(len(pair.here) == 0 for pair in seen_again(frames) if 1 in (pair.one, pair.other))
    assert sum(len(pair.here) for pair in seen_again(frames)) > 1000


def held(how: str, recorded: float, simulated: float) -> Validator:
    """By which the recording's errors are held in one way so much, and the simulator's."""
    none = marks._Held((0, 0), (0, 4), 0, 0, 0)
    known: dict[Any, marks._Held] = {
        marks._held_recorded: none._replace(**{how: recorded}),
        marks._held_simulated: none._replace(**{how: simulated}),
    }
    evidence = SimpleNamespace(config=DepthConfig())
    return cast(Validator, SimpleNamespace(evidence=evidence, once=lambda work, *_: known[work]))


@pytest.mark.parametrize(
    ("effect", "recorded", "simulated", "refused"),
    [
        ("disparity_noise", 0.4, 0.02, True),
        ("temporal_correlation", 0.4, 0.02, True),
        ("disparity_noise", 0.4, 0.3, False),  # beside a mount that is turned, say
        ("disparity_noise", 0.1, 0.0, False),  # a filter in time lags by as much
        ("extrinsic_rotation", 0.4, 0.0, False),
        ("fill_rate", 0.4, 0.0, False),
    ],
)
def test_noise_is_no_cause_of_errors_of_the_scene(
    effect: str, recorded: float, simulated: float, refused: bool
) -> None:
    assert (marks.stays_in_scene(held("carried", recorded, simulated), effect_class(effect), ()) is not None) == refused


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
    assert (marks.stays_at_pixels(held("locked", recorded, simulated), effect_class(effect), ()) is not None) == refused


@pytest.mark.parametrize(
    ("effect", "recorded", "simulated", "refused"),
    [
        ("motion_noise", 0.9, 0.03, True),
        ("spatial_correlation", 0.9, 0.03, True),
        ("motion_noise", 0.9, 0.8, False),  # beside stamps that are late
        ("motion_noise", 0.1, 0.0, False),
        ("time_offset", 0.9, 0.0, False),
    ],
)
def test_noise_is_no_cause_of_frames_that_are_off_as_a_whole(
    effect: str, recorded: float, simulated: float, refused: bool
) -> None:
    assert (
        marks.shifts_by_frame(held("shifted", recorded, simulated), effect_class(effect), ()) is not None
    ) == refused
