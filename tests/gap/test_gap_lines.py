"""Holes that come in rows or columns, told from those that are drawn one by one."""

import numpy as np
import pytest

from depthsim.gap.depth.data.lines import holes_in_lines

SHAPE = (120, 160)


def lines(rate: object, frames: int = 6) -> float:
    rng = np.random.default_rng(0)
    pictures = (np.where(rng.random(SHAPE) < rate, 0, 1000).astype(np.uint16) for _ in range(frames))
    return holes_in_lines((one, np.ones(SHAPE, np.bool_)) for one in pictures)


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
    some, nowhere = np.ones(SHAPE, np.uint16), np.zeros(SHAPE, np.bool_)
    assert lines(0.0) == 0
    assert holes_in_lines([(some, nowhere), (some[:2], ~nowhere[:2])]) == 0
