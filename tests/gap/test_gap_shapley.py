"""How what several causes close together is shared among them."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import stdtrit

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.shapley import credit, credit_and_error
from depthsim.gap.depth.fit.validate import Validator


def shares(gaps: dict[str, float]) -> tuple[float, ...]:
    """Of the causes "a", "b" ..., by the gap that is left with each set of them, such as "" and "ab"."""
    validator = SimpleNamespace(
        evidence=SimpleNamespace(config=DepthConfig(), base=()),
        quick=lambda effects, *_: gaps["".join(sorted(effects))],
    )
    parts = [
        SimpleNamespace(free=(), build=lambda effects, _, name=name: (*effects, name)) for name in max(gaps, key=len)
    ]
    model = SimpleNamespace(parts=parts, x=np.empty(0), split=lambda _: [None] * len(parts))
    return credit(cast("Validator", validator), (), cast("Model", model))


def test_a_cause_that_another_hides_has_what_it_closes_once_that_is_there() -> None:
    """Errors that go together are seen only where coarse steps are modelled: by themselves they make it worse."""
    assert shares({"": 1.0, "a": 0.03, "b": 1.04, "ab": 0.01}) == pytest.approx((0.97, 0.02))


def test_two_that_cancel_share_what_they_close() -> None:
    """A scale and an offset that a calibration at one range leaves: either alone makes it far worse."""
    assert shares({"": 1.0, "a": 24.0, "b": 25.0, "ab": 0.1}) == pytest.approx((0.45, 0.45))


def test_what_closes_nothing_has_nothing() -> None:
    assert shares({"": 1.0, "a": 0.03, "b": 1.01, "ab": 0.04})[1] < 0


@given(st.lists(st.floats(0, 1), min_size=8, max_size=8))
def test_the_shares_are_what_all_close_together(gaps: list[float]) -> None:
    sets = ["", "a", "b", "c", "ab", "ac", "bc", "abc"]
    assert sum(shares(dict(zip(sets, gaps, strict=True)))) == pytest.approx(gaps[0] - gaps[-1], abs=1e-9)


def test_shares_have_intervals_by_the_frames_that_show_them() -> None:
    """Of two that cancel, one of which acts in some blocks alone: what both close is the same in all."""
    blocks = 9
    there = np.arange(blocks) < 4
    left = {"": 1.0 + 0 * there, "a": 1.0 - 0.8 * there, "b": 0.3 + 0.6 * there, "ab": 0.1 + 0 * there}
    validator = SimpleNamespace(
        evidence=SimpleNamespace(config=DepthConfig(), base=()),
        config=DepthConfig().significance,
        blocks=list(range(blocks)),
        quick=lambda effects, _, some=slice(None): float(left["".join(sorted(effects))][some].mean()),
        between=lambda effects, *_: 0.1,
    )
    parts = [SimpleNamespace(free=(), build=lambda effects, _, name=name: (*effects, name)) for name in "ab"]
    model = SimpleNamespace(parts=parts, x=np.empty(0), split=lambda _: [None] * len(parts))
    shares, halves = credit_and_error(cast("Validator", validator), (), cast("Model", model))
    assert sum(shares) == pytest.approx(0.9)
    of_b = np.where(there, 0.1, 0.8) / 0.9  # in each block alone
    error = of_b.std(ddof=1) / np.sqrt(blocks) * stdtrit(blocks - 1, 0.975)
    assert halves == pytest.approx([np.hypot(error, DepthConfig().significance.least_error)] * 2)
