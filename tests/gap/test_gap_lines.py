"""Holes and outliers that come in rows or columns, told from those that are drawn one by one."""

import numpy as np
import pytest
from numpy.typing import NDArray

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


@pytest.mark.parametrize("shape", ["bands", "clumps", "single"])
def test_bands_of_a_few_rows_are_lines_and_clumps_are_none(shape: str) -> None:
    """A beam that sweeps the picture disturbs three rows at once; single rows of that are like their neighbours."""
    rng, (v, _) = np.random.default_rng(2), np.indices(SHAPE)
    rates = np.where(v % 9 < 3, 0.06, 0.0)

    def marked() -> NDArray[np.bool_]:
        if shape == "clumps":
            return np.kron(rng.random((40, 54)) < 0.02, np.ones((3, 3), np.bool_))[:, : SHAPE[1]]
        return rng.random(SHAPE) < (rates if shape == "bands" else rates.mean())

    pictures = [(marked(), np.ones(SHAPE, np.bool_)) for _ in range(6)]
    assert (in_lines(pictures, 3) > 5) == (shape == "bands")
    assert in_lines(pictures) < 5
