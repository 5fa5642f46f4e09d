"""Holes that a driver fills, beside holes that it does not."""

from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.histograms import BINS, ERROR, ERROR_HOLE
from depthsim.gap.depth.fit import changes
from depthsim.gap.depth.fit.changes import too_many_left
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import GONE, Search
from depthsim.gap.depth.fit.traits import fills_besides, is_filling
from depthsim.sensor.effect import effect_class, effect_ids

if TYPE_CHECKING:
    from depthsim.gap.depth.fit.validate import Validator

CELLS, PIXELS = 6, 10_000


def counts(*holes: float) -> NDArray[np.int64]:
    """(1, cells * bins) of one block: of each cell the share of holes, all else in one bin."""
    cells = np.zeros((CELLS, BINS[ERROR]), np.int64)
    cells[:, ERROR_HOLE] = np.round(PIXELS * np.array(holes))
    cells[:, 5] = PIXELS - cells[:, ERROR_HOLE]
    return cells.reshape(1, -1)


def left(monkeypatch: pytest.MonkeyPatch, real: tuple[float, ...], runs: dict[str, list[tuple[float, ...]]]) -> object:
    """Of what a simulator has too many of; runs: of it, and of it with an effect that fills holes."""
    evidence = SimpleNamespace(
        config=DepthConfig(), cells=lambda axis, of: of.reshape(CELLS, -1), axes=[SimpleNamespace(kind=ERROR)]
    )
    validator = SimpleNamespace(evidence=evidence, real=counts(*real), once=lambda work, effects: None)
    monkeypatch.setattr(changes, "first_axis", lambda *of: 0)
    monkeypatch.setattr(changes, "_runs", lambda of, effects: [counts(*run) for run in runs[effects]])
    return too_many_left(
        cast("Validator", validator), cast("changes.Effects", "before"), cast("changes.Effects", "after")
    )


BEFORE = [(0.1,) * CELLS, (0.101,) * CELLS]


@given(st.floats(0, 0.1), st.lists(st.floats(0.2, 1), min_size=2, max_size=2))
def test_holes_that_another_cause_makes_are_not_held_against_what_fills(still: float, more: list[float]) -> None:
    """Where the recording has more holes than the simulator nothing is asked; elsewhere how many are still there."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        runs = {"before": BEFORE, "after": [(still,) * CELLS]}
        found = left(monkeypatch, (0, 0, 0, 0, *more), runs)
    assert found == pytest.approx((still / 0.1) ** 2, abs=0.01)


def test_a_simulator_without_too_many_holes_is_asked_for_none(monkeypatch: pytest.MonkeyPatch) -> None:
    assert left(monkeypatch, (0.1, 0.1, 0.1, 0.1, 0.4, 0.9), {"before": BEFORE, "after": BEFORE}) is None


def test_what_fills_holes() -> None:
    assert [effect for effect in effect_ids() if is_filling(effect)] == ["hole_filling"]
    assert {effect for effect in effect_ids() if fills_besides(effect)} == {"decimation", "temporal_filter"}


@pytest.mark.parametrize(("rate", "gone"), [(0.05, False), (0.049, False), (1e-3, False), (1e-6, True)])
def test_holes_that_are_all_gone(rate: float, gone: bool) -> None:
    from depthsim.gap.depth.fit.candidate import Candidate
    from depthsim.gap.depth.fit.free import Free

    candidate = Candidate("fill_rate", (Free("rate", 1e-9, 1, True, 1.0),), {}, ((0.05,),))
    trial = Trial(Model((candidate,), candidate.encode((rate,))), 0.1)
    search = cast("Search", SimpleNamespace(base=(effect_class("fill_rate")(rate=0.05),)))
    assert Search.is_less(search, trial, GONE) == gone
    assert Search.is_less(search, trial) == (rate < 0.05)
    assert not Search.is_less(cast("Search", SimpleNamespace(base=())), trial)


def test_holes_that_are_all_gone_have_more_parameters_than_what_fills_them() -> None:
    """So no holes at all are neither named first, nor in the place of what fills them."""

    def trial(effect: str, parameters: int, gone: bool = False) -> Trial:
        newest = SimpleNamespace(effect=effect, free=[None] * parameters, is_gone=gone)
        return cast("Trial", SimpleNamespace(newest=newest))

    search = cast("Search", SimpleNamespace(is_less=lambda one, by: by == GONE and one.newest.is_gone))
    filled, gone, less = trial("hole_filling", 2), trial("fill_rate", 1, gone=True), trial("fill_rate", 1)
    assert Search.parameters_of(search, gone, [filled, gone]) == 3
    assert Search.parameters_of(search, less, [filled, less]) == 1
    assert Search.parameters_of(search, gone, [less, gone]) == 1
    assert Search.parameters_of(search, filled, [filled, gone]) == 2
