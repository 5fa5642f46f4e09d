"""Holes anywhere beneath holes that grow along an axis."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.histograms import BINS, ERROR, ERROR_HOLE
from depthsim.gap.depth.fit import beneath, itself
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.changes import holes_lie_apart
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.optimize import Model
from depthsim.sensor.effect import effect_class

CELLS, PIXELS = 20, 100_000
RANGE = np.linspace(1, 4, CELLS)


def counts(holes: NDArray[np.float64]) -> NDArray[np.int64]:
    """(2, cells * bins) of two blocks of frames: of each cell the share of holes, all else in one bin."""
    cells = np.zeros((2, CELLS, BINS[ERROR]), np.int64)
    cells[:, :, ERROR_HOLE] = np.round(PIXELS * holes)
    cells[:, :, 5] = PIXELS - cells[:, :, ERROR_HOLE]
    return cells.reshape(2, -1)


def validator_of(axis: str, real: NDArray[np.float64], shares: Callable[[Any], NDArray[np.float64]]) -> Any:
    """shares: of holes along the axis, by the sensor's effects."""
    evidence = SimpleNamespace(
        config=DepthConfig(), axes=[SimpleNamespace(name=axis, kind=ERROR)], base=(),
        cells=lambda axis, of: of.reshape(*of.shape[:-1], CELLS, -1),
    )  # fmt: skip
    return SimpleNamespace(evidence=evidence, real=counts(real), runs=lambda effects, count: [counts(shares(effects))])


def said(real: NDArray[np.float64], base: float, fitted: NDArray[np.float64]) -> bool:
    shares = {"before": np.full(CELLS, base), "after": base + fitted}
    validator = validator_of("range", real, shares.__getitem__)
    return beneath.lies_beneath(validator, "range", cast("Any", "before"), cast("Any", "after"))


def ramp(start: float, rate: float) -> NDArray[np.float64]:
    return np.asarray(rate * np.maximum(RANGE - start, 0))


@given(st.floats(0.02, 0.1), st.floats(2.2, 2.8), st.floats(0.01, 0.03))
def test_a_level_beneath_holes_that_grow_is_seen(level: float, start: float, base: float) -> None:
    """What is fitted in place of both begins where the picture does, with too few holes."""
    grows = ramp(start, 0.03)
    assert said(base + level + grows, base, ramp(0.8, level / 3))
    # Holes that only grow have no level, wherever the fit begins; and none is left once the level is fitted.
    assert not said(base + grows, base, ramp(0.8, level / 3))
    assert not said(base + level + grows, base + level, grows)


@given(st.floats(0.01, 0.05), st.floats(0, 1), st.sampled_from(["fill_rate", "material_dropout"]))
def test_holes_anywhere_lie_where_others_begin_too(level: float, there: float, name: str) -> None:
    """Holes that grow by another formula begin earlier: more of them farther on are no holes anywhere."""
    growing, anywhere = effect_class("range_dropout")(), effect_class(name)()
    grown = ramp(2.5, 0.1)
    real = grown + level * np.where(RANGE < 1.5, there, 1.0)
    shares = [np.zeros(CELLS), grown, grown + level]  # by how many effects there are
    validator = validator_of("range", real, lambda effects: shares[len(effects)])
    least = validator.evidence.config.agreement.where_others_begin
    said = itself.lies_elsewhere(validator, type(anywhere), (growing,), (growing, anywhere))
    if abs(there - least) > 0.01:
        assert (said is not None) == (there < least)
    assert itself.lies_elsewhere(validator, type(growing), (growing,), (growing, anywhere)) is None


@given(st.floats(0.01, 0.05), st.floats(0, 1))
def test_holes_on_all_materials_are_there_on_those_that_another_cause_spares(level: float, there: float) -> None:
    """Holes of one material that grow along the range by another formula, which holes on all would be a part of."""
    of_one, anywhere = effect_class("material_dropout")(), effect_class("range_dropout")()
    its = np.arange(CELLS) < 5
    real = 0.05 * its + level * np.where(its, 1.0, there)
    shares = [np.zeros(CELLS), 0.05 * its, 0.05 * its + level]  # by how many effects there are
    validator = validator_of("material", real, lambda effects: shares[len(effects)])
    least = validator.evidence.config.agreement.where_others_begin
    said = itself.is_of_its_materials(validator, type(anywhere), (of_one,), (of_one, anywhere))
    if abs(there - least) > 0.01:
        assert (said is not None) == (there < least)
    assert itself.is_of_its_materials(validator, type(of_one), (of_one,), (of_one, anywhere)) is None


@given(st.floats(1.2, 2.0), st.floats(3.0, 3.7), st.floats(0.1, 1))
def test_the_nearest_and_the_farthest_lie_apart(near: float, far: float, share: float) -> None:
    """Holes of a least range and of a largest one are no two shapes of one; those of two largest ones are."""
    nearest, farthest = np.where(near > RANGE, share, 0.0), np.where(far < RANGE, 0.5, 0.0)
    shares = {"before": np.full(CELLS, 0.0), "near": nearest, "both": nearest + farthest}
    shares |= {"far": farthest, "farther": np.where((far + 4) / 2 < RANGE, 0.9, farthest)}
    validator = validator_of("range", shares["both"], shares.__getitem__)
    apart = lambda *effects: holes_lie_apart(validator, "range", *(cast("Any", one) for one in effects))  # noqa: E731
    assert apart("before", "near", "both")
    assert not apart("before", "far", "farther")


@given(st.floats(0.8, 4), st.floats(0.05, 0.3))
def test_a_power_of_the_range_is_no_level(power: float, most: float) -> None:
    """It is not flat where the range begins, however small it is there."""
    grows = most * (RANGE / 4) ** power
    assert not said(0.01 + grows, 0.01, ramp(1.2, most / 3))


def test_both_are_fitted_from_the_beginning(monkeypatch: Any) -> None:
    """The one that grows begins again on top of holes anywhere; both stay if they leave less, and no level."""
    monkeypatch.setattr(Model, "build", lambda model, base: tuple(part.effect for part in model.parts))
    levels = {("range_dropout",): True, ("fill_rate", "range_dropout"): False}
    monkeypatch.setattr(beneath, "lies_beneath", lambda validator, axis, before, after: levels[after])
    anywhere, grows = (Candidate(effect, (), {}, ((),)) for effect in ("fill_rate", "range_dropout"))
    alone = Model((grows,), np.empty(0))
    for gap, expected in ((0.1, ["fill_rate", "range_dropout"]), (0.3, ["range_dropout"])):
        search = SimpleNamespace(
            bank=[anywhere, grows], base=(), validator=None, begin=lambda part, base: Model((part,), np.empty(0)),
            fit=lambda model, rounds, elsewhere: model, validated=lambda model, gap=gap: Trial(model, gap),
            say=lambda text: None,
        )  # fmt: skip
        found = beneath.beneath(cast("Any", search), Trial(alone, 0.2)).model
        assert [part.effect for part in found.parts] == expected
