"""Which cells of an axis hold most of what lies along it, against every row and every rectangle."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from depthsim.gap.depth.data.axes import edge_names
from depthsim.gap.depth.data.covariates import EDGE_CODES
from depthsim.gap.depth.where.part import shortest_row, smallest_rectangle

SHARES = st.tuples(st.integers(1, 5), st.integers(1, 6)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.floats(0.001, 1))
)


@given(SHARES, st.floats(0.1, 0.95))
def test_no_smaller_rectangle_holds_as_much(shares: NDArray[np.float64], enough: float) -> None:
    shares = shares / shares.sum()
    rows, columns = shares.shape
    found = smallest_rectangle(shares, enough)
    assert shares.ravel()[found].sum() >= enough - 1e-9
    at = np.unravel_index(found, shares.shape)
    assert len(found) == (np.ptp(at[0]) + 1) * (np.ptp(at[1]) + 1)
    for top, bottom in combinations(range(rows + 1), 2):
        for left, right in combinations(range(columns + 1), 2):
            if (bottom - top) * (right - left) < len(found):
                assert shares[top:bottom, left:right].sum() < enough


@given(SHARES, st.floats(0.1, 0.95))
def test_a_row_is_a_rectangle_of_one_row(shares: NDArray[np.float64], enough: float) -> None:
    row = shares.ravel() / shares.sum()
    assert np.array_equal(shortest_row(row, enough), smallest_rectangle(row[None], enough))


@pytest.mark.parametrize(
    ("cells", "words"),
    [
        ([0], "hidden from the right imager"),
        ([1], "1 px behind an edge left"),
        ([3, 2, 8], "2 to 4 px behind an edge left or right"),
        ([5, 10, 15, 20], "8 to 12 px behind an edge"),
        ([21, 25, EDGE_CODES + 3], "3 to 4 px behind an edge left, hidden; 1 to 12 px before an edge left"),
    ],
)
def test_edges_in_words(cells: list[int], words: str) -> None:
    assert edge_names(np.array(cells)) == words
