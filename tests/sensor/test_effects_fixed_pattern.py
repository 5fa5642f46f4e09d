"""A bias of the disparity that is locked to the pixel: random, or of a grid that was learned."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from shapes import MATERIALS, Array, as_scene, camera, wall

from depthsim.errors import InputError
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Profile, Sensor, load_profile
from depthsim.sensor.effects.fixed_pattern import FixedPattern, picture

CAMERA = camera(160, 120, 200)
WALLS = {depth: Caster(as_scene(wall(depth))) for depth in (1.0, 2.5)}
GRID = ((0.1, -0.2, 0.3), (0.0, 0.4, -0.1), (-0.3, 0.2, 0.1), (0.2, 0.0, -0.4))


def bias(*effects: Effect, depth: float = 1.0, **keys: Any) -> Array:
    """(H, W) measured minus true disparity [px] of a wall."""
    measured = Sensor(WALLS[depth], CAMERA, effects, MATERIALS).measure(np.eye(4), **keys)
    return np.asarray(CAMERA.focal_baseline * (1 / measured.depth.astype(float) - 1 / depth))


def test_it_is_the_same_in_every_frame_and_at_every_range_and_another_for_another_seed() -> None:
    first = bias(FixedPattern(), index=0)
    assert np.array_equal(bias(FixedPattern(), index=77), first)
    assert np.abs(bias(FixedPattern(), depth=2.5, index=3) - first).max() < 1e-4
    other = bias(FixedPattern(), seed=1)
    assert abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 0.9 and np.abs(first - other).max() > 0.05


@pytest.mark.parametrize("size", [3.0, 16.0, 17.0, 30.0])
def test_a_random_shape_has_the_amplitude_and_falls_to_half_its_correlation_at_the_size(size: float) -> None:
    made = np.stack([bias(FixedPattern(amplitude=0.3, size=size), seed=n) for n in range(150)]) / 0.3
    lag = round(size)
    for found, wanted in (
        ((made**2).mean(axis=(1, 2)), 1.0),
        ((made[:, lag:] * made[:, :-lag]).mean(axis=(1, 2)), 0.5),
        ((made[:, :, lag:] * made[:, :, :-lag]).mean(axis=(1, 2)), 0.5),
    ):
        assert abs(found.mean() - wanted) < 4 * found.std() / np.sqrt(len(found)) + 0.005
    # Not less at the border.
    assert abs((made[:, 0] ** 2).mean() - 1) < 0.2


def test_a_camera_keeps_its_shape_from_run_to_run() -> None:
    first, same, other = (bias(FixedPattern(shape=n), seed=seed) for n, seed in ((1, 0), (1, 5), (2, 0)))
    assert np.array_equal(first, same)
    assert abs(np.corrcoef(first.ravel(), other.ravel())[0, 1]) < 0.5 and first.std() > 0.05


def test_a_grid_is_the_shape_and_the_amplitude_its_root_mean_square() -> None:
    found = bias(FixedPattern(amplitude=0.2, grid=GRID))
    assert np.sqrt((found**2).mean()) == pytest.approx(0.2, rel=1e-3)
    shape = picture(np.array(GRID), CAMERA.shape)
    assert np.abs(found - 0.2 * shape / np.sqrt((shape**2).mean())).max() < 1e-4
    assert np.array_equal(bias(FixedPattern(amplitude=0.2, grid=GRID), seed=5, index=9), found)
    # Through the knots, the corners of the grid at those of the picture.
    knots = shape[[0, -1]][:, [0, -1]]
    assert np.allclose(knots, np.array(GRID)[[0, -1]][:, [0, -1]])


@pytest.mark.parametrize("grid", [((0.1,),), ((0.1, 0.3),), ((0.1,), (0.2,))])
def test_the_smallest_grids(grid: tuple[tuple[float, ...], ...]) -> None:
    found = bias(FixedPattern(amplitude=0.1, grid=grid))
    assert np.sqrt((found**2).mean()) == pytest.approx(0.1, rel=1e-3)
    assert np.ptp(found[:, 0]) < 1e-4 or len(grid) > 1


def test_what_is_not_returned_stays_so_and_nothing_goes_beyond_infinity() -> None:
    strong = FixedPattern(amplitude=10, grid=((-1.0,),))
    assert not Sensor(WALLS[2.5], CAMERA, [strong], MATERIALS).measure(np.eye(4)).depth.any()


def test_a_profile_keeps_the_grid_a_line_a_row(tmp_path: Path) -> None:
    profile = Profile(name="own", effects=(FixedPattern(grid=GRID), FixedPattern(amplitude=0.05)))
    text = profile.to_yaml()
    assert text.count("grid") == 1 and "- [0.1, -0.2, 0.3]" in text
    (tmp_path / "own.yaml").write_text(text, encoding="utf-8")
    assert load_profile(tmp_path / "own.yaml") == profile


@pytest.mark.parametrize(
    ("grid", "problem"),
    [
        ("[[0.1, 0.2], [0.3]]", "rows have different lengths"),
        ("[[0, 0], [0, 0]]", "0 everywhere"),
        ("[]", "at least 1 item"),
        ("[[]]", "at least 1 item"),
        ("[[.nan]]", "finite number"),
        ("0.3", "valid tuple"),
    ],
)
def test_a_grid_that_is_none_is_reported_in_one_line(grid: str, problem: str, tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(f"effects: [fixed_pattern: {{grid: {grid}}}]", encoding="utf-8")
    with pytest.raises(InputError, match=problem) as raised:
        load_profile(file)
    assert "effects[0].fixed_pattern.grid" in str(raised.value) and "\n" not in str(raised.value)


def test_a_grid_has_bounds() -> None:
    with pytest.raises(ValidationError):
        FixedPattern(grid=((0.1,) * 1025,))
