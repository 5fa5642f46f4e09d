"""By how much the axes of a recording ask for different values of a parameter."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from depthsim.gap.depth.fit.intervals import _disagreement


@given(st.floats(0.01, 10), st.lists(st.floats(0.05, 1), min_size=2, max_size=6))
def test_what_axes_ask_for_beyond_chance_is_its_standard_deviation(apart: float, sizes: list[float]) -> None:
    shares = np.array(sizes)[:, None] / np.sum(sizes)
    asked = apart * np.where(np.arange(len(sizes)) % 2, 1.0, -1.0)[:, None]
    certain = np.repeat((asked * shares)[None], 8, axis=0)
    found = _disagreement(asked * shares, certain, shares)
    np.testing.assert_allclose(found, apart, rtol=1e-9)


def test_chance_alone_is_no_disagreement() -> None:
    rng = np.random.default_rng(5)
    blocks, axes, runs = 16, 20, 400
    shares = np.full((axes, 1), 1 / axes)
    found = []
    for _ in range(runs):
        of_block = rng.normal(size=(blocks, axes, 1)) * shares
        total = of_block.sum(axis=0)
        left_out = (total - of_block) / (blocks - 1)
        found.append(float(_disagreement(total / blocks, left_out, shares)[0] ** 2))
    # Cut off at 0, what is left of the variance 1 / 16 of each is the scatter of its own estimate.
    assert np.mean(found) < 0.3 / blocks


def test_an_axis_that_says_nothing_has_no_say() -> None:
    shares = np.array([[0.5], [0.5], [1e-4]])
    moves = np.array([[0.1], [-0.1], [3.0]])
    found = _disagreement(moves, np.repeat(moves[None], 4, axis=0), shares)
    np.testing.assert_allclose(found, 0.2)
