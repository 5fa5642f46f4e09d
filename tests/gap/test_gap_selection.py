"""The rules by which causes are selected, without a measure or a fit."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthsim.gap.config import DepthSelect, FlightSelect
from depthsim.gap.diagnosis import Unexplained
from depthsim.gap.selection import (
    Limits,
    Refused,
    closes_enough,
    is_tie,
    nearest_in_words,
    not_outdone,
    plainest,
    verdict_of,
)


def test_refused_effects_are_kept_where_they_closed_most_and_the_nearest_reported() -> None:
    refused, limit = Refused(), DepthSelect(nearest=0.1, most_nearest=2)
    for effect, closed in (("a", 0.3), ("b", 0.5), ("a", 0.2), ("c", 0.05), ("d", 0.9), ("e", 0.4)):
        refused.refuse(effect, closed, f"closes {closed}")
    near = refused.nearest(("d",), limit)
    assert [(one.effect, one.why_not) for one in near] == [("b", "closes 0.5"), ("e", "closes 0.4")]
    assert refused["a"].closed_fraction == 0.3
    assert nearest_in_words(near) == " Nearest is b, which closes 50%; it is no cause, as it closes 0.5."
    assert nearest_in_words(()) == ""


def test_the_verdict_is_from_what_is_left() -> None:
    left = Unexplained(fraction=0.1, where=(), description="")
    assert [verdict_of(named, rest) for named in (True, False) for rest in (None, left)] == [
        "explained", "partly_explained", "unexplained", "unexplained",
    ]  # fmt: skip


@pytest.mark.parametrize("limit", [DepthSelect(), FlightSelect()], ids=["depth", "flight"])
@given(whole=st.floats(1, 1e6), small=st.floats(1e-4, 1), share=st.floats(0.6, 1))
def test_a_small_cause_is_enough_beside_any_other(limit: Limits, whole: float, small: float, share: float) -> None:
    assert closes_enough(share * small, small, whole, 1e-5, limit)
    assert not closes_enough(share * small, small, whole, 2 * small, limit), "what is less than faint is no gap"
    assert not closes_enough(0.1 * small, small, 1e3 * whole, 1e-5, limit), "and most of what is left must go"


def test_ties_and_the_plainest() -> None:
    assert is_tie(0.5, 1.0, 9.0, lambda: True) and is_tie(2.0, 1.0, 9.0, lambda: False)
    assert not is_tie(2.0, 1.0, 9.0, lambda: True) and not is_tie(9.0, 1.0, 9.0, lambda: False)
    trials = [(1.0, 3), (1.2, 1), (1.4, 1), (2.0, 0)]
    assert plainest(trials, lambda one: one[0], lambda one: one[1], 0.5) == (1.2, 1)
    assert plainest([], lambda one: one[0], lambda one: one[1], 0.5) is None


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(1, 4), st.sampled_from("ab")), max_size=8))
def test_what_a_smaller_one_of_its_kind_does_as_well_is_outdone(trials: list[tuple[int, int, str]]) -> None:
    kept = not_outdone(trials, lambda one: one[0], lambda one: one[1], lambda one: one[2])
    for one in trials:
        smaller = [other for other in trials if other[1] < one[1] and other[2] == one[2] and other[0] <= one[0]]
        assert (one in kept) == (not smaller)
    assert bool(kept) == bool(trials)
