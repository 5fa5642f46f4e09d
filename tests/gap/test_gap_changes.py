"""How two sensors differ, kind by kind."""

import numpy as np
import pytest

from depthsim.gap.depth.data.histograms import BINS, ERROR
from depthsim.gap.depth.fit.changes import KINDS, _scaled


def far_off(share: float) -> np.ndarray:
    """(1, bins) of a cell in which a share of the pixels is far off to each side, and the others are near 0."""
    counts = np.zeros((1, int(BINS[ERROR])))
    counts[0, 14:18] = 10_000 * (1 - 2 * share) / 4
    counts[0, [1, 30]] = 10_000 * share
    return counts


@pytest.mark.parametrize("more", [0.005, 0.01])
def test_a_spread_differs_by_no_more_than_its_distribution(more: float) -> None:
    """Quantiles of 16 % jump where about a sixth of the pixels is far off."""
    one, other = far_off(0.16 + more), far_off(0.16 - more)
    found = _scaled(one, other)[:, 0]
    whole = np.square(found[4:]).sum() / (2 * np.log(2))
    assert 0 < found[KINDS.index("spread")] ** 2 <= 3.0 * whole * (1 + 1e-9)
    assert whole < 0.01


def test_spreads_of_normal_errors_differ_as_they_are() -> None:
    edges = np.arange(-16.0, 16.0)

    def normal(spread: float) -> np.ndarray:
        counts = np.zeros((1, int(BINS[ERROR])))
        counts[0, :32] = 10_000 * np.exp(-0.5 * ((edges + 0.5) / spread) ** 2)
        return counts

    found = _scaled(normal(3.0), normal(2.0))[:, 0]
    whole = np.square(found[4:]).sum() / (2 * np.log(2))
    assert found[KINDS.index("spread")] ** 2 < 3.0 * whole
