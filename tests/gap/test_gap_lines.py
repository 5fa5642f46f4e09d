"""Holes and outliers that come in rows or columns, told from those that are drawn one by one."""

import numpy as np
import pytest

from depthsim.gap.depth.data.lines import far_off, in_lines

SHAPE = (120, 160)


def lines(rate: object, frames: int = 6) -> float:
    rng = np.random.default_rng(0)
    return in_lines((rng.random(SHAPE) < rate, np.ones(SHAPE, np.bool_)) for _ in range(frames))


@pytest.mark.parametrize("rate", [0.003, 0.03, 0.3])
def test_holes_one_by_one_vary_from_line_to_line_by_chance(rate: float) -> None:
    assert lines(rate) == pytest.approx(1, abs=0.25)


def test_a_share_that_changes_over_the_picture_makes_no_lines() -> None:
    assert lines(np.linspace(0, 0.2, SHAPE[1])) < 1.25


@pytest.mark.parametrize("down", [True, False])
def test_every_sixth_line_that_loses_pixels_is_seen(down: bool) -> None:
    v, u = np.indices(SHAPE)
    assert lines(np.where((v if down else u) % 6 == 3, 0.12, 0.01)) > 5


def test_without_a_hole_or_a_surface_there_are_no_lines() -> None:
    nowhere = np.zeros(SHAPE, np.bool_)
    assert lines(0.0) == 0
    assert in_lines([(nowhere, nowhere), (nowhere[:2], ~nowhere[:2])]) == 0


@pytest.mark.parametrize("step", [1, 2])
def test_outliers_of_every_other_column_come_in_lines(step: int) -> None:
    """Told from noise that grows with the range; without a pixel that has depth there is none."""
    rng = np.random.default_rng(1)
    clean = np.tile(np.linspace(1.0, 4.0, SHAPE[0])[:, None], (1, SHAPE[1]))
    off = (rng.random(SHAPE) < 0.1) & (np.arange(SHAPE[1]) % step == 0)
    depth = 1 / (1 / clean + rng.normal(0, 0.003, SHAPE)) + np.where(off, 0.25 * clean, 0)
    seen = rng.random(SHAPE) < 0.95
    found = far_off(depth, clean, seen)
    assert np.array_equal(found, off & seen)
    assert (in_lines([(found, seen)]) > 5) == (step == 2)
    assert not far_off(depth, clean, np.zeros(SHAPE, np.bool_)).any()
