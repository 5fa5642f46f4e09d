"""Effects that come near a gap, and do not act where it lies."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from depthsim.gap import diagnose
from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.histograms import ERROR, ERROR_HOLE
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.fit import agreement, along, itself, marks, pairs, rules, validate
from depthsim.gap.depth.fit.asked import Asked
from depthsim.gap.depth.fit.changes import KINDS, Changes, _scaled, less_others
from depthsim.gap.depth.fit.screening import worth_a_look
from depthsim.gap.depth.fit.validate import Validator
from depthsim.gap.depth.where.differences import errors_together, holes_together, moments, tails, together_more
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.sensor.effects.calibration import BaselineScale
from depthsim.sensor.effects.dropout import RangeDropout
from depthsim.sensor.effects.heavy_tails import HeavyTails
from depthsim.sensor.effects.hole_filling import HoleFilling
from depthsim.sensor.effects.limits import MaxRange
from depthsim.sensor.effects.noise import DisparityNoise
from depthsim.sensor.effects.shadow import InvalidBand
from depthsim.trajectory import load_trajectory

AXES = [
    SimpleNamespace(name=name, names=set(name.split(" x ")), kind=0, size=8, single=" x " not in name)
    for name in ("range", "material", "range x material")
]
BIAS, SPREAD, HOLES, TAIL, ALL = map(KINDS.index, ("bias", "spread", "missing", "tail", "all"))


@pytest.fixture(scope="module")
def scaled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All depths too large by the same share."""
    folder = tmp_path_factory.mktemp("scaled") / "run"
    scene, camera = load_scene("office"), preset("d435", 106, 60).model_copy(update={"rate": 3.0})
    paper = load_profile("paper")
    sensor = paper.model_copy(update={"effects": (*paper.effects, BaselineScale(scale=1.03))})
    path = load_trajectory("tour", scene, camera.rate, 18)
    generate(scene, path, camera, sensor, folder, streams=("depth",), seed=3, threads=1)
    return folder


def test_simulated_recordings_that_were_packed_are_not_made_again(
    scaled: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    evidence, _ = load_evidence(scaled, None, (DisparityNoise(sigma=0.05),))
    validator = Validator(evidence, evidence.held_out)
    one, other = evidence.base, (*evidence.base, HeavyTails(share=0.1))
    first = [run.copy() for run in validator.runs(one, 2)]
    monkeypatch.setattr(validate, "_KEPT", sum(run.nbytes for run in first))
    validator.runs(other, 2)
    monkeypatch.setattr(evidence, "simulate_runs", lambda effects, blocks, seeds: [pytest.fail("again") for _ in seeds])
    np.testing.assert_array_equal(validator.runs(one, 2), first)


def test_a_scale_that_is_wrong_all_the_time_is_no_drift(scaled: Path) -> None:
    bank = ("thermal_drift", "fill_rate", "lateral_noise")
    found = diagnose(
        scaled, sensor="paper", without=[name for name in effect_ids() if name not in bank], threads=1, tasks=False
    )
    assert found.verdict == "unexplained", found.causes
    assert found.unexplained is not None
    near = {near.effect: near.why_not for near in found.unexplained.nearest}
    assert "along time" in near["thermal_drift"]


def test_what_a_large_bias_hides_is_found_behind_it(tmp_path: Path) -> None:
    """Depths that are off by ten times their spread lie in the last bins, however they go together."""
    scene, camera = load_scene("office"), preset("d435", 106, 60)
    paper = load_profile("paper")
    effects = (*paper.effects, BaselineScale(scale=1.15), effect_class("temporal_correlation")(correlation=0.6))
    generate(
        scene, load_trajectory("tour", scene, camera.rate, 18), camera, paper.model_copy(update={"effects": effects}),
        tmp_path / "run", streams=("depth",), seed=3, threads=1,
    )  # fmt: skip
    bank = ("baseline_scale", "temporal_correlation", "spatial_correlation", "lateral_noise")
    without = [name for name in effect_ids() if name not in bank]
    found = diagnose(tmp_path / "run", sensor="paper", without=without, threads=1, tasks=False)
    assert [cause.effect for cause in found.causes] == ["baseline_scale", "temporal_correlation"], found.unexplained
    assert found.causes[1].parameters["correlation"] == pytest.approx(0.6, abs=0.1)


@pytest.mark.parametrize(
    ("others", "left"), [(("bias", "spread"), 0.02), (("missing",), 0.06), ((), 0.08), (("spread", "missing"), 0.05)]
)
def test_kinds_of_errors_are_answered_for_apart(others: tuple[str, ...], left: float) -> None:
    """Squared differences of roots are 2 ln 2 for a bit, where they are small."""
    kinds = np.array([0.05, 0.01, 0.02, 0.0])
    varies = np.append(kinds, 2 * np.log(2) * kinds.sum())[:, None]
    none = np.zeros_like(varies)
    seen = less_others(Changes(none, varies, none, np.zeros(1), 0.0, 0.0), [KINDS.index(kind) for kind in others])
    assert seen.varies[ALL, 0] == pytest.approx(2 * np.log(2) * left)
    assert seen.varies[:ALL, 0] == pytest.approx(kinds)


@given(st.lists(st.one_of(st.floats(0, 1e3), st.just(np.inf)), max_size=30), st.integers(1, 20))
def test_what_begins_with_nothing_takes_no_other_ones_place(gains: list[float], most: int) -> None:
    looked = worth_a_look(dict(enumerate(gains)), most)
    known = sorted((gain for gain in gains if np.isfinite(gain)), reverse=True)
    assert looked == sorted(looked)
    assert sorted((gains[k] for k in looked if np.isfinite(gains[k])), reverse=True) == known[:most]
    assert sum(not np.isfinite(gains[k]) for k in looked) == gains.count(np.inf)


def changes(k: int, mean: float, varies: list[float]) -> Changes:
    """Of one kind, and of all errors as much as that makes."""
    means, varied, none = np.zeros((3, len(KINDS), len(varies)))
    means[k], varied[k] = mean, varies
    means[ALL], varied[ALL] = 2 * np.log(2) * means[k], 2 * np.log(2) * varied[k]
    return Changes(means, varied, none, np.zeros(len(varies)), 0.0, 0.0)


CAMERA = preset("d435", 106, 60)


def asked(effect: str, gap: Changes, left: Changes, does: Changes, before: Sequence[Effect] = ()) -> Asked:
    """An effect that is asked when all others are there."""
    evidence = SimpleNamespace(axes=AXES, base=(), camera=CAMERA, config=DepthConfig())
    validator = cast("Validator", SimpleNamespace(evidence=evidence))
    return Asked(validator, effect_class(effect), before, gap, left, does, True, False, True)


def test_what_else_acts_along_an_axis_is_asked_of_a_kind() -> None:
    light, holes = effect_class("ambient_light")(), effect_class("material_dropout")()
    nothing = changes(BIAS, 0.0, [0, 0, 0])
    one = asked("material_noise", nothing, nothing, nothing, (light, holes))
    material = [axis.name for axis in AXES].index("material")
    assert one.others(material) == one.others(material, KINDS.index("missing")) == [light, holes]
    assert one.others(material, KINDS.index("spread")) == [light]
    assert one.others(material, BIAS) == []


@given(st.floats(0.01, 1), st.floats(0, 0.9))
def test_a_bias_of_another_shape_is_brought_where_the_recording_has_none(bias: float, part: float) -> None:
    gap = changes(BIAS, bias, [0, 0, 0])
    right = asked("disparity_offset", gap, changes(BIAS, 0.0, [0, 0, 0]), gap)
    assert rules.brings(right, BIAS) is None
    does = changes(BIAS, bias, [bias * part, 0, bias * part])
    wrong = asked("disparity_offset", gap, changes(BIAS, 0.0, [bias * part, 0, bias * part]), does)
    said = rules.brings(wrong, BIAS)
    assert (said is not None) == (part > DepthConfig().agreement.brought * (1 + part))
    assert said is None or "along range" in said


@pytest.mark.parametrize(("before", "brought", "refused"), [(0.0, 0.05, True), (0.0, 0.01, False), (0.05, 0.05, False)])
def test_a_noise_that_is_more_all_the_time_goes_not_with_the_range(
    before: float, brought: float, refused: bool
) -> None:
    gap, left = changes(SPREAD, 1.0, [before, 0, before]), changes(SPREAD, 0.0, [brought, 0, brought])
    one = asked("disparity_noise", gap, left, changes(SPREAD, 1.0, [brought, 0, brought]))
    assert (rules.brings(one, SPREAD) is not None) == refused


@given(st.floats(0, 1), st.floats(0, 1))
def test_what_is_made_one_by_one_does_not_go_together(errors: float, holes: float) -> None:
    """Of holes nothing is said by the errors between them, such as a rolling shutter's."""
    limit = DepthConfig().agreement
    for name, kind, together, bound in (
        ("range_dropout", HOLES, holes, limit.together),
        ("lateral_noise", SPREAD, errors, limit.together),
        ("heavy_tails", KINDS.index("tail"), errors, limit.outliers_together),
    ):
        does = changes(kind, 1.0, [0, 0, 0])
        left = replace(changes(kind, 0.0, [0, 0, 0]), together=errors, lost_together=holes)
        refused = pairs.goes_together(asked(name, does, left, does)) is not None
        most = bound * does.whole[kind if name == "heavy_tails" else ALL]
        assert refused == (together > most)
        if kind == HOLES:  # what is too near has holes that go together by themselves
            near = replace(does, lost_together=1.1 * most)
            assert pairs.goes_together(asked("min_range", does, left, near)) is None


@given(st.floats(0, 1), st.floats(0, 0.6))
def test_noise_everywhere_is_not_that_of_a_few_far_things(change: float, left: float) -> None:
    """It makes the mean of what changes with the range, and leaves the change."""
    limit = DepthConfig().agreement
    gap = changes(SPREAD, 1 - change, [change, 0, 0])
    one = asked("disparity_noise", gap, changes(SPREAD, 0.0, [left * change, 0, 0]), gap)
    refused = change > limit.all_along * (1 + 1e-9) and left > limit.left_of_noise * (1 + 1e-9)
    if min(abs(change - limit.all_along), abs(left - limit.left_of_noise)) > 1e-6:
        assert (rules.leaves_own(one, SPREAD) is not None) == refused
    assert rules.leaves_own(replace(one, nearly_all=True), SPREAD) is None or left > limit.left_along


@given(st.floats(0.01, 1), st.floats(0, 1.2))
def test_what_crossed_axes_leave_is_the_shape_that_is_wrong(bias: float, left: float) -> None:
    change = 0.3 * bias
    gap = changes(BIAS, bias, [0.5 * bias, 0, change])
    one = asked("disparity_offset", gap, changes(BIAS, 0.0, [0, 0, left * change]), gap)
    assert (rules.leaves_crossed(one, BIAS) is not None) == (left > DepthConfig().agreement.left_along)
    other = asked("lens_distortion", gap, one.left, gap)
    assert rules.leaves_crossed(other, BIAS) is None  # no axis of its own


def test_tails_in_one_place_are_no_tails_everywhere() -> None:
    left = changes(TAIL, 0.0, [0, 0.01, 0])
    everywhere = asked("heavy_tails", changes(TAIL, 0.1, [0, 0.01, 0]), left, changes(TAIL, 0.1, [0, 0, 0]))
    assert along.leaves(everywhere, TAIL) is None
    in_one = asked("heavy_tails", changes(TAIL, 0.02, [0, 0.08, 0]), changes(TAIL, 0.0, [0, 0.08, 0]), everywhere.does)
    assert "along material" in str(along.leaves(in_one, TAIL))


@given(st.floats(0, 1))
def test_tails_that_are_left_are_of_something_else(left: float) -> None:
    """Of outliers by other formulas a seventh was left at most, of torn pictures and of reflections two fifths."""
    gap = changes(TAIL, 0.125, [0, 0, 0])
    one = asked("heavy_tails", gap, changes(TAIL, 0.125 * left, [0, 0, 0]), gap)
    assert (along.leaves(one, TAIL) is None) == (left <= DepthConfig().agreement.left_of_tails)


@given(st.floats(0, 1.5))
def test_pixels_in_between_leave_less_at_edges_of_all_kinds_together(left: float) -> None:
    bound = DepthConfig().agreement.untouched
    gap = changes(TAIL, 0.0625, [0.0625, 0, 0])
    one = asked("flying_pixels", gap, changes(TAIL, 0.0, [0, 0, 0]), gap)
    one.left.varies[ALL, 0] = left * gap.varies[ALL, 0]  # a bias that the recording has not, say
    assert (rules.not_itself(at_edges(one)) is None) == (left <= bound)


def at_edges(one: Asked) -> Asked:
    """The same, where the first axis is the distance from an edge."""
    edge = SimpleNamespace(name="edge_distance", names={"edge_distance"}, kind=0, size=8, single=True)
    evidence = SimpleNamespace(axes=[edge, *AXES[1:]], base=(), camera=CAMERA, config=DepthConfig())
    return replace(one, validator=cast("Validator", SimpleNamespace(evidence=evidence)))


@given(st.floats(0, 1))
def test_where_all_at_edges_is_closed_the_tails_there_are_for_the_formula(left: float) -> None:
    """The mean of a footprint is no tail where most pixels have it: pixels in between bring some."""
    gap, tails_left = changes(TAIL, 0.0625, [0.0, 0, 0]), changes(TAIL, 0.0, [0.04, 0, 0])
    gap.varies[ALL, 0] = 1.0
    one = asked("flying_pixels", gap, tails_left, changes(TAIL, 0.0625, [0.0625, 0, 0]))
    one.left.varies[ALL, 0] = left
    closed = left <= DepthConfig().agreement.left_along
    assert (rules.not_itself(at_edges(one)) is None) == closed
    tails_left.mean[TAIL] = 0.4 * 0.0625 - 0.04
    why = along.leaves(at_edges(asked("flying_pixels", gap, tails_left, one.does)), TAIL)
    assert (why is None) == closed, why


@given(st.floats(0, 1), st.sampled_from(["intrinsics", "fixed_pattern"]))
def test_rays_that_are_bent_by_another_formula_leave_some_at_edges(left: float, effect: str) -> None:
    """Other than what has as many parameters and moves no ray."""
    gap, limit = changes(BIAS, 0.1, [0.2, 0, 0]), DepthConfig().agreement
    one = at_edges(asked(effect, gap, changes(BIAS, 0.1 * left, [0.2 * left, 0, 0]), gap))
    most = limit.left_along * (1.0 if effect == "intrinsics" else limit.left_by_flexible)
    assert (along.leaves(replace(one, flexible=True), ALL) is None) == (left <= most)


@given(st.floats(0, 1.2), st.floats(0.02, 0.3), st.sampled_from(["fixed_pattern", "intrinsics"]))
def test_what_stays_at_its_pixels_leaves_nothing_that_changes_otherwise(left: float, much: float, effect: str) -> None:
    """Nine tenths of the biases change over the picture, and are gone; others change along the material."""
    limit = DepthConfig().agreement
    gap = changes(BIAS, 0.0, [0.0, much, 0])
    gap.mean[BIAS] = 0.9
    one = asked(effect, gap, changes(BIAS, 0.0, [0.0, left * much, 0]), changes(BIAS, 0.9, [0, 0, 0]))
    too_much = left >= limit.untouched and left * much >= limit.beside_pattern * gap.whole[BIAS]
    assert (rules.leaves_beside_pattern(one, BIAS) is not None) == (effect == "fixed_pattern" and too_much)
    beside = replace(one, before=(effect_class("material_noise")(),))
    assert rules.leaves_beside_pattern(beside, BIAS) is None


@given(st.floats(0, 1), st.sampled_from(["lateral_noise", "flying_pixels"]), st.booleans())
def test_noise_makes_no_outliers_where_the_recording_has_none(share: float, effect: str, is_alone: bool) -> None:
    """Beside far more spread, which another cause's formula leaves. Pixels in between are not asked: outliers are what
    they are."""
    limit = DepthConfig().agreement
    gap, does = changes(TAIL, 0.0, [0.01 * share, 0, 0]), changes(TAIL, 0.0, [0.01, 0, 0])
    left = changes(TAIL, 0.0, [0.01 * (1 - share), 0, 0])
    one = at_edges(replace(asked(effect, gap, left, does), alone=is_alone))
    refused = rules.makes_besides(one)
    assert (refused is not None) == (is_alone and effect == "lateral_noise" and share <= limit.near_floor)
    assert refused in (None, "makes tails change along edge distance, where the recording's do not")


@given(st.floats(0, 0.2), st.floats(0, 1))
def test_pixels_in_between_that_are_seen_as_spread_go_together_as_noise_does(together: float, still: float) -> None:
    """Where most pixels near an edge are off, hardly any of them is an outlier by the spread that they have there."""
    limit, does = DepthConfig().agreement, changes(TAIL, 0.01, [0.01, 0, 0])
    gap, left = changes(SPREAD, 0.25, [0.25, 0, 0]), changes(SPREAD, 0.25 * still, [0.25 * still, 0, 0])
    does.mean[ALL] = 0.25
    one = at_edges(asked("flying_pixels", gap, replace(left, together=together), does))
    lies_there = still <= limit.left_along
    most = limit.together * does.whole[ALL] if lies_there else limit.outliers_together * does.whole[TAIL]
    assert (pairs.goes_together(one) is None) == (together <= most)


@given(st.floats(0, 0.02), st.floats(0, 0.2), st.floats(0, 1))
def test_medians_that_hardly_move_at_edges_say_nothing_of_their_shape(there: float, left: float, still: float) -> None:
    """Less than half of what is near an edge is foreground: only the spread shows it, unless fits move the medians."""
    bound = DepthConfig().agreement
    one = at_edges(asked("edge_fattening", *(changes(BIAS, 0.0, [b, 0, 0]) for b in (there, left, 0.0625))))
    for part, spread in ((one.gap, 0.25), (one.left, 0.25 * still), (one.does, 0.25)):
        part.varies[SPREAD, 0] = part.varies[ALL, 0] = spread
    hardly, closes = max(there, left) <= bound.known_by * 0.25, still <= bound.left_along
    assert rules.is_little(one, BIAS) == (hardly and closes)
    if hardly and closes:
        assert agreement._of_gap(replace(one, alone=False)) is None
    elif left > bound.known_by:
        assert agreement._of_gap(replace(one, alone=False)) is not None


@given(st.floats(0, 0.2), st.floats(0, 1))
def test_outliers_anywhere_lie_away_from_the_edges_too(anywhere: float, left: float) -> None:
    """False matches beside pixels in between, of which another formula leaves some along the edges."""
    bound = DepthConfig().agreement
    gap = changes(TAIL, anywhere, [0.125, 0, 0])
    still = changes(TAIL, anywhere * left, [0.0625, 0, 0])
    one = asked("heavy_tails", gap, still, gap, before=(effect_class("flying_pixels")(),))
    why = rules.is_of(at_edges(replace(one, closes_well=False)), TAIL)
    lie_anywhere = anywhere >= bound.beside * 0.125 and anywhere * left <= bound.near_floor * anywhere
    assert (why is None) == lie_anywhere, why


def test_what_another_cause_leaves_along_its_axis_is_not_asked_of_the_next() -> None:
    gap, left = changes(BIAS, 0.1, [0.02, 0.03, 0]), changes(BIAS, 0.0, [0, 0.03, 0])
    alone = asked("disparity_offset", gap, left, changes(BIAS, 0.1, [0.02, 0, 0]))
    assert "along material" in str(rules.leaves_elsewhere(alone, BIAS))
    beside = asked("disparity_offset", gap, left, alone.does, before=(effect_class("material_noise")(),))
    assert rules.leaves_elsewhere(beside, BIAS) is None


def test_what_the_effects_own_axis_leaves_is_not_held_against_what_is_crossed_with_it() -> None:
    gap = changes(BIAS, 0.1, [0.05, 0, 0.06])
    smooth_for_sharp = asked("disparity_offset", gap, changes(BIAS, 0.0, [0.03, 0, 0.04]), gap)
    assert rules.leaves_crossed(smooth_for_sharp, BIAS) is None
    elsewhere = asked("disparity_offset", gap, changes(BIAS, 0.0, [0.001, 0, 0.04]), gap)
    assert "along range x material" in str(rules.leaves_crossed(elsewhere, BIAS))


@pytest.mark.parametrize(("cause", "refused"), [("thermal_drift", False), ("motion_noise", True)])
def test_what_a_drift_leaves_from_range_to_range_is_not_held_against_an_offset(cause: str, refused: bool) -> None:
    gap, left = changes(BIAS, 0.1, [0.05, 0, 0.06]), changes(BIAS, 0.0, [0.001, 0, 0.04])
    one = asked("disparity_offset", gap, left, gap, before=(effect_class(cause)(),))
    one.validator.evidence.axes = [
        SimpleNamespace(name=name, names=set(name.split(" x ")), kind=0, size=8)
        for name in ("range", "time", "time x range")
    ]
    assert ("along time x range" in str(rules.leaves_crossed(one, BIAS))) == refused


@given(st.floats(0.1, 1), st.floats(0, 1))
def test_what_a_cause_leaves_along_its_axis_does_not_hide_the_next_one(beside: float, left: float) -> None:
    """Holes by material, beside more of them that the formula of holes by range has left along the range."""
    bound = DepthConfig().agreement
    gap, does = changes(HOLES, 0.0, [0.03125, 0.03125 * beside, 0]), changes(HOLES, 0.0, [0, 0.03125 * beside, 0])
    one = asked(
        "material_dropout", gap, changes(HOLES, 0.0, [0.03125, 0.03125 * beside * left, 0]), does,
        before=(effect_class("range_dropout")(),),
    )  # fmt: skip
    assert rules.is_of(one, HOLES) is None  # it closes most of what is left
    one = replace(one, closes_well=False)
    own = beside >= bound.beside
    assert (rules.is_of(one, HOLES) is None) == own
    assert (one.beside(HOLES) == 1) == (beside > 0)
    if own:
        assert (along.leaves(one, HOLES) is None) == (left <= bound.left_along)
    alone = asked("material_dropout", gap, one.left, does)
    assert "along range" in str(along.leaves(alone, HOLES))


@given(st.floats(0, 1))
def test_what_is_crossed_with_another_causes_axis_gives_way_to_the_effects_own(left: float) -> None:
    """Holes of one material, where the formula of holes by range leaves the most along both together."""
    gap, does = changes(HOLES, 0.0, [0.03125, 0.03125, 0.125]), changes(HOLES, 0.0, [0, 0.03125, 0])
    rest = changes(HOLES, 0.0, [0.03125, 0.03125 * left, 0.125])
    beside = asked("material_dropout", gap, rest, does, before=(effect_class("range_dropout")(),))
    limit = DepthConfig().agreement
    assert (along.leaves(replace(beside, alone=False, closes_well=False), HOLES) is None) == (left <= limit.left_along)
    assert "along range x material" in str(along.leaves(replace(beside, before=()), HOLES))


@pytest.mark.parametrize(("left", "refused"), [(0.01, False), (0.2, True)])
def test_what_acted_before_steps_leaves_next_to_nothing_along_their_axis(left: float, refused: bool) -> None:
    """An offset of coarse steps makes biases that change with the phase most, as what another origin leaves does."""
    gap = changes(BIAS, 0.01, [0.01, 0.1, 0])
    steps = (effect_class("material_noise")(),)  # in the place of the steps: the axes here have no phase
    one = asked("disparity_offset", gap, changes(BIAS, 0.0, [0, 0.1 * left, 0]), gap, before=steps)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(effect_class("material_noise"), "kinds", ("spread", "bias"))
        assert (rules.is_of(one, BIAS) is not None) == refused


@given(st.floats(0, 1), st.sampled_from(["baseline_scale", "disparity_offset"]))
def test_a_law_of_the_range_leaves_next_to_nothing_along_it(left: float, effect: str) -> None:
    """Where most of the change is along something else than the range, by which other laws come near, too."""
    gap, limit = changes(BIAS, 0.125, [0.03125, 0.0625, 0.03125]), DepthConfig().agreement
    one = asked(effect, gap, changes(BIAS, 0.0, [0.03125 * left, 0, 0]), gap)
    assert (rules.leaves_geometry(one, BIAS) is None) == (left <= limit.near_floor)
    crossed = asked(effect, gap, changes(BIAS, 0.0, [0, 0, 0.03125 * left]), gap)
    assert (rules.leaves_geometry(crossed, BIAS) is None) == (left <= limit.near_floor)
    faint = changes(BIAS, 0.125, [0.001, 0.0625, 0.001])
    assert rules.leaves_geometry(asked(effect, faint, changes(BIAS, 0.0, [0.001, 0, 0.001]), gap), BIAS) is None
    other = asked("thermal_drift", gap, one.left, gap)  # has other formulas
    assert rules.leaves_geometry(other, BIAS) is None
    drift = effect_class("thermal_drift")()  # that of another cause leaves some along its own axis
    one = asked(effect, gap, changes(BIAS, 0.0, [0, 0, 0.03125]), gap, before=[drift])
    one.validator.evidence.axes = [*AXES[:2], SimpleNamespace(**{**vars(AXES[2]), "names": {"time", "range"}})]  # type: ignore[list-item]
    assert rules.leaves_geometry(one, BIAS) is None


def test_what_moves_pixels_by_another_formula_has_other_medians_at_edges() -> None:
    edges = SimpleNamespace(name="edge_distance", names={"edge_distance"}, kind=0, size=8, single=True)
    gap, left = changes(BIAS, 0.1, [0, 0, 0]), changes(BIAS, 0.0, [0.1, 0, 0])
    for effect, brings in (("rolling_shutter", False), ("edge_fattening", True)):
        one = asked(effect, gap, left, gap)
        one.validator.evidence.axes = [edges, *AXES[1:]]  # type: ignore[list-item]
        assert (rules.brings(one, BIAS) is not None) == brings


@given(st.floats(0, 1))
def test_a_sensor_with_too_many_holes_everywhere_is_asked_for_their_number(left: float) -> None:
    """Of the few that the recording has it is not the one to say how they change."""
    gap, rest = changes(HOLES, 0.0625, [0.03125, 0, 0]), changes(HOLES, 0.0625 * left, [0.03125, 0, 0])
    one = asked("fill_rate", gap, rest, gap)
    assert "along range" in str(agreement._of_kind(one, HOLES))
    fewer = agreement._of_kind(replace(one, takes_away=True), HOLES)
    assert (fewer is None) == (left <= DepthConfig().agreement.left_of_uniform)


@pytest.mark.parametrize(
    ("effect", "said"),
    [("disparity_noise", True), ("fill_rate", True), ("time_offset", False), ("empty_border", False)],
)
def test_whatis_alike_for_neighbours_is_not_made_one_by_one(effect: str, said: bool) -> None:
    gap = changes(SPREAD, 0.1, [0.05, 0, 0])
    left = replace(gap, together=0.05, lost_together=0.05)
    one = asked(effect, replace(gap, together=0.1, lost_together=0.1), left, gap)
    assert (pairs.goes_together(one) is not None) == said


@pytest.mark.parametrize(("place", "said"), [("image_column", False), ("incidence", True)])
def test_a_filter_is_not_asked_for_where_edges_lie_in_the_picture(place: str, said: bool) -> None:
    """A camera that hardly moves has them in some columns; that noise changes with incidence is another matter."""
    gap, left = changes(SPREAD, 0.1, [0, 0.05, 0]), changes(SPREAD, 0.05, [0, 0.045, 0])
    one = asked("spatial_filter", gap, left, gap)
    axis = SimpleNamespace(name=place, names={place}, kind=0, size=8, single=True)
    one.validator.evidence.axes = [AXES[0], axis, AXES[2]]  # type: ignore[list-item]
    assert (pairs.smooths_elsewhere(one) is not None) == said


def test_a_learned_pattern_is_asked_for_no_spread_that_another_cause_makes() -> None:
    gap = changes(SPREAD, 0.1, [0.05, 0, 0])
    noise, scale = effect_class("disparity_noise")(), BaselineScale(scale=1.1)
    assert agreement._answers(asked("fixed_pattern", gap, gap, gap), SPREAD)
    assert agreement._answers(asked("fixed_pattern", gap, gap, gap, before=[scale]), SPREAD)
    assert not agreement._answers(asked("fixed_pattern", gap, gap, gap, before=[noise]), SPREAD)
    assert agreement._answers(asked("vignetting_noise", gap, gap, gap, before=[noise]), SPREAD)


@given(st.floats(0, 1), st.floats(0, 1))
def test_what_chance_leaves_is_held_against_no_effect(left: float, chance: float) -> None:
    gap = changes(HOLES, 0.0, [0.0625, 0, 0])
    rest = changes(HOLES, 0.0, [0.0625 * left, 0, 0])
    one = asked("max_range", gap, replace(rest, chance=rest.chance + 0.0625 * chance), gap)
    bound = DepthConfig().agreement
    assert one.surely_left(HOLES, 0) == pytest.approx(max(left - bound.sure * chance, 0))
    assert (along.leaves(one, HOLES) is None) == (one.surely_left(HOLES, 0) <= bound.shape)


def test_what_is_left_at_edges_gives_way_to_noise_along_an_axis_of_its_own() -> None:
    """Noise by range, beside what the formula of another cause leaves at edges, where that is to make no noise."""
    edges = SimpleNamespace(name="edge_distance", names={"edge_distance"}, kind=0, size=8, single=True)
    gap, left = (changes(SPREAD, 0.0, [by_range, 0.0625, 0]) for by_range in (0.05, 0.005))
    does = changes(SPREAD, 0.0, [0.045, 0, 0])
    for before in ([effect_class("edge_fattening")()], []):
        one = replace(asked("disparity_noise", gap, left, does, before), alone=False)
        one.validator.evidence.axes = [AXES[0], edges, AXES[1]]  # type: ignore[list-item]
        said = along.leaves(one, SPREAD)
        assert said is None if before else "along edge distance" in str(said)


@given(st.floats(0, 1))
def test_what_an_effect_makes_besides_is_asked_where_it_acts(left: float) -> None:
    """Light makes noise, and holes on materials: those along the range are another effect's."""
    gap = changes(HOLES, 0.0, [0.25, 0.0625, 0])
    one = asked("ambient_light", gap, changes(HOLES, 0.0, [0.25, 0.0625 * left, 0]), gap)
    assert (along.leaves(one, HOLES) is None) == (left <= DepthConfig().agreement.left_along)
    holes_alone = asked("material_dropout", gap, one.left, gap)
    assert "along range" in str(along.leaves(holes_alone, HOLES))
    elsewhere = changes(HOLES, 0.0, [0.25, 0, 0])
    assert "along range" in str(along.leaves(asked("ambient_light", elsewhere, elsewhere, gap), HOLES))


@given(st.floats(0, 1))
def test_holes_along_the_range_are_told_apart_by_their_shape(left: float) -> None:
    gap = changes(HOLES, 0.0, [0.0625, 0, 0])  # a power of two, by which a share stays what it is
    one = asked("max_range", gap, changes(HOLES, 0.0, [0.0625 * left, 0, 0]), gap)
    assert (along.leaves(one, HOLES) is None) == (left <= DepthConfig().agreement.shape)
    known_by_more = asked("incidence_dropout", gap, one.left, gap)
    assert (along.leaves(known_by_more, HOLES) is None) == (left <= DepthConfig().agreement.left_along)


@given(st.floats(0, 0.99), st.floats(0, 1))
def test_many_parameters_do_not_follow_a_change_along_another_axis(own: float, left: float) -> None:
    """Noise that grows along the range, on materials that lie at different ranges: they are known by the material."""
    limit = DepthConfig().agreement
    gap = changes(SPREAD, 0.0625, [0.0625, 0.0625 * own, 0])
    one = asked("material_noise", gap, changes(SPREAD, 0.0, [0.0625 * left, 0, 0]), gap)
    assert rules.is_for_another_axis(one, SPREAD) is None  # with few it is one of the range, too
    said = rules.is_for_another_axis(replace(one, flexible=True), SPREAD)
    if min(abs(own - limit.as_much), abs(left - limit.near_floor)) > 1e-9:
        assert (said is not None) == (own < limit.as_much and left > limit.near_floor)
    beside = replace(one, flexible=True, before=(effect_class("disparity_noise")(),))
    assert rules.is_for_another_axis(beside, SPREAD) is None


@given(st.floats(0.0, 1))
def test_what_is_much_the_same_all_over_is_not_for_another_axis(change: float) -> None:
    """Such as noise against a simulator without any: that frames have a few per cent more or less is hardly any."""
    gap = changes(HOLES, 1 - change, [change, 0, 0])
    one = asked("material_dropout", gap, changes(HOLES, 0.0, [change, 0, 0]), gap)
    said = rules.is_for_another_axis(one, HOLES)
    if change < DepthConfig().agreement.uniform:
        assert said is None
    elif change > 0.3:  # in between how many cells the axis has decides
        assert said is not None


@pytest.mark.parametrize(("beside", "refused"), [("lens_distortion", False), ("incidence_noise", True)])
def test_what_rays_that_another_cause_bends_see_past_edges_is_for_its_formula(beside: str, refused: bool) -> None:
    gap = changes(HOLES, 0.0625, [0.0625, 0.0125, 0])
    left = replace(changes(HOLES, 0.0, [0.03, 0, 0]), lost_together=0.1)
    one = at_edges(asked("material_dropout", gap, left, gap, before=(effect_class(beside)(),)))
    assert (rules.is_for_another_axis(replace(one, flexible=True), HOLES) is not None) == refused
    assert (pairs.goes_together(one) is not None) == refused


@pytest.mark.parametrize(
    ("effect", "left", "refused"),
    [
        ("material_dropout", 0.0, False),
        ("material_dropout", 0.01, True),  # which leaves some along the material
        ("range_dropout", 0.0, True),  # is known by another axis, along which nothing changes
        ("ambient_light", 0.0, True),  # the same, and makes mainly holes
        ("fill_rate", 0.0, True),
    ],
)
def test_holes_in_patches_that_lie_by_a_material_are_its_own(effect: str, left: float, refused: bool) -> None:
    gap = changes(HOLES, 0.0625, [0, 0.0625, 0])
    rest = replace(changes(HOLES, 0.0, [0, left, 0]), lost_together=0.1)
    assert (pairs.goes_together(asked(effect, gap, rest, gap)) is not None) == refused


@given(st.floats(0, 0.99), st.floats(0, 1))
def test_few_parameters_leave_much_of_a_change_along_another_axis(own: float, left: float) -> None:
    """Holes that come with the range, on a material that lies far away; what lies anywhere is asked for the level."""
    limit = DepthConfig().agreement
    gap = changes(HOLES, 0.0625, [0.0625, 0.0625 * own, 0])
    one = asked("material_dropout", gap, changes(HOLES, 0.0, [0.0625 * left, 0, 0]), gap)
    said = rules.is_for_another_axis(one, HOLES)
    if min(abs(own - limit.beside), abs(left - limit.left_of_noise)) > 1e-9:
        assert (said is not None) == (own < limit.beside and left > limit.left_of_noise)
    assert rules.is_for_another_axis(replace(one, effect=effect_class("fill_rate")), HOLES) is None


@given(st.floats(0, 1), st.floats(0, 1))
def test_many_parameters_leave_little_along_the_axis_that_an_effect_is_known_by(there: float, left: float) -> None:
    limit = DepthConfig().agreement
    gap = changes(SPREAD, 0.0625, [0, 0.0625 * there, 0])
    one = asked("material_noise", gap, changes(SPREAD, 0.0, [0, 0.0625 * there * left, 0]), gap)
    if left < limit.left_of_noise or there < limit.all_along:  # with few parameters more may be left
        assert rules.leaves_own(one, SPREAD) is None
    said = rules.leaves_own(replace(one, flexible=True), SPREAD)
    if min(abs(left - limit.left_of_own), abs(there - limit.uniform * (1 + there))) > 1e-9:
        assert (said is not None) == (left > limit.left_of_own and there > limit.uniform * (1 + there))
    if left < limit.left_along:
        assert rules.leaves_own(replace(one, flexible=True, nearly_all=True), SPREAD) is None


@pytest.mark.parametrize(("surface", "is_right"), [(0.99, True), (0.9, False)])
def test_light_on_surfaces_is_asked_of_surfaces_and_not_of_where_they_are_seen(surface: float, is_right: bool) -> None:
    axes = [
        SimpleNamespace(name=name, names={name}, kind=0, size=8, single=True) for name in ("image_position", "surface")
    ]
    evidence = SimpleNamespace(axes=[*axes, AXES[0]], base=(), camera=CAMERA, config=DepthConfig())
    gap, left = (changes(SPREAD, 0.0, [0.0625 * n, 0.0625 * surface * m, 0]) for n, m in ((1, 1), (0.35, 0.35)))
    one = asked("ambient_light", gap, left, gap)
    one = replace(one, flexible=True, validator=cast("Validator", SimpleNamespace(evidence=evidence)))
    assert (along.leaves(one, SPREAD) is None) == is_right


@given(st.floats(0, 1))
def test_a_filter_smooths_on_every_material(left: float) -> None:
    gap = changes(SPREAD, 0.03125, [0, 0.0625, 0])
    one = asked("spatial_filter", gap, changes(SPREAD, 0.0, [0, 0.0625 * left, 0]), gap)
    assert (pairs.smooths_elsewhere(one) is None) == (left <= DepthConfig().agreement.left_along)
    for other in ("material_noise", "temporal_filter"):  # beside another filter it is by either's formula
        assert pairs.smooths_elsewhere(replace(one, before=(effect_class(other)(),))) is None
    assert pairs.smooths_elsewhere(replace(one, effect=effect_class("spatial_correlation"))) is None


@pytest.mark.parametrize(("slant", "is_left"), [(0.06, True), (0.04, False)])
@pytest.mark.parametrize(("other", "is_beside"), [("lateral_noise", True), ("heavy_tails", False)])
def test_noise_of_a_material_is_not_for_what_another_noise_leaves_on_a_slant(
    monkeypatch: pytest.MonkeyPatch, slant: float, is_left: bool, other: str, is_beside: bool
) -> None:
    gap = changes(SPREAD, 0.05, [0.0, 0.05, slant])
    one = asked("material_noise", gap, gap, gap, (effect_class(other)(),))
    across = SimpleNamespace(name="incidence", names={"incidence"}, kind=0, size=8, single=True)
    one.validator.evidence.axes = [AXES[0], AXES[1], across]  # type: ignore[list-item]
    monkeypatch.setattr(agreement, "_asked", lambda *_: one)
    assert agreement.is_theirs(one.validator, one.effect, (), ()) == (is_left and is_beside)


@given(st.floats(0, 1))
def test_what_is_left_of_noise_is_counted_wherever_it_lies(left: float) -> None:
    gap, still = changes(SPREAD, 0.25, [0.0, 0.25, 0.0]), changes(SPREAD, 0.25 * left, [0.25 * left, 0.0, 0.0])
    one = asked("material_noise", gap, still, gap)
    known = {"without": gap, "with": still}
    validator = SimpleNamespace(once=lambda work, effects: known[effects])
    assert agreement.left_in_all(cast("Validator", validator), one.effect, "without", "with") == pytest.approx(left)


@pytest.mark.parametrize(
    ("effect", "other", "left", "is_own"),
    [
        ("subpixel_bias", "rolling_shutter", 0.02, True), ("subpixel_bias", "rolling_shutter", 0.2, False),
        ("subpixel_bias", "subpixel_bias", 0.02, False), ("lens_distortion", "rolling_shutter", 0.02, False),
    ],
)  # fmt: skip
def test_a_bias_by_its_own_axis_is_not_for_what_another_bias_leaves(
    monkeypatch: pytest.MonkeyPatch, effect: str, other: str, left: float, is_own: bool
) -> None:
    gap, after = changes(BIAS, 0.0, [0, 0.005, 0.002]), changes(BIAS, 0.0, [0, 0.005 * left, 0.002])
    one = asked(effect, gap, after, gap, (effect_class(other)(),))
    phase = SimpleNamespace(name="disparity_phase", names={"disparity_phase"}, kind=0, size=8, single=True)
    one.validator.evidence.axes = [AXES[0], phase, AXES[2]]  # type: ignore[list-item]
    monkeypatch.setattr(agreement, "_asked", lambda *_: one)
    assert agreement.is_its_own(one.validator, one.effect, (), ()) == is_own


@pytest.mark.parametrize(("effect", "is_own"), [("fill_rate", False), ("min_range", True)])
def test_what_loses_pixels_anywhere_has_no_axis_of_its_own(
    monkeypatch: pytest.MonkeyPatch, effect: str, is_own: bool
) -> None:
    gap, after = changes(HOLES, 0.0, [0.005, 0, 0]), changes(HOLES, 0.0, [0, 0, 0])
    one = asked(effect, gap, after, gap, (effect_class("incidence_dropout")(),))
    monkeypatch.setattr(agreement, "_asked", lambda *_: one)
    assert agreement.is_its_own(one.validator, one.effect, (), ()) == is_own


@pytest.mark.parametrize(("other", "is_answered"), [("lateral_noise", False), ("rolling_shutter", True)])
def test_a_bias_does_not_answer_for_noise_by_the_formula_of_another_cause(other: str, is_answered: bool) -> None:
    """Pixels at edges make geometry answer for spreads, too."""
    noise, bias = changes(SPREAD, 0.0, [0, 0.05, 0]), changes(BIAS, 0.02, [0, 0, 0])
    gap = replace(noise, mean=noise.mean + bias.mean)
    one = asked("intrinsics", gap, noise, bias, (effect_class(other)(),))
    assert (agreement._of_all(replace(one, closes_well=False)) is not None) == is_answered


@pytest.mark.parametrize(("does", "answers"), [(0.001, False), (0.04, True)])
def test_a_pattern_does_not_answer_for_noise_that_it_hardly_changes(does: float, answers: bool) -> None:
    """What it changes in the mean over all pixels is the spread of the pattern itself."""
    gap = changes(SPREAD, 0.05, [0, 0.1, 0])
    one = asked("fixed_pattern", gap, gap, changes(SPREAD, 0.1, [0, does, 0]))
    assert agreement._answers(one, SPREAD) == answers


def test_holes_beside_errors_that_another_cause_makes_go_together() -> None:
    none = changes(HOLES, 0.1, [0, 0, 0])
    together = replace(none, together=0.1, lost_together=0.1)
    assert "independent" in str(pairs.goes_together(asked("fill_rate", none, together, none)))
    beside = asked("fill_rate", none, together, none, before=(effect_class("spatial_correlation")(),))
    assert pairs.goes_together(beside) is None
    assert pairs.goes_together(asked("fixed_pattern", none, together, none)) is None


@pytest.mark.parametrize(("well", "left", "refused"), [(True, 0.0, False), (True, 0.09, True), (False, 0.0, True)])
def test_what_closes_most_of_all_is_asked_along_its_own_axis_beside_what_another_formula_leaves(
    well: bool, left: float, refused: bool
) -> None:
    """Noise of one material beside edges that are fattened in another way, near which most of the spread is."""
    edge, place = (
        SimpleNamespace(name=name, names={name}, kind=ERROR, size=8, single=True)
        for name in ("edge_distance", "surface")
    )
    gap, still = changes(SPREAD, 1.0, [0, 0.1, 0, 0.9, 0.5]), changes(SPREAD, 0.8, [0, left, 0, 0.8, 0.3])
    one = asked("material_noise", gap, still, gap, before=(effect_class("edge_fattening")(),))
    one.validator.evidence.axes = [*AXES, edge, place]  # type: ignore[list-item]
    said = along.leaves(replace(one, closes_well=well), SPREAD)
    assert (said is not None) == refused


def test_errors_go_together_in_any_picture_that_is_resampled() -> None:
    """Pixels in between before an alignment, by another formula of that: each is doubled, and so is the noise."""
    none = changes(TAIL, 0.1, [0, 0, 0])
    one = asked("flying_pixels", none, replace(none, together=1.0), none)
    assert "independent" in str(pairs.goes_together(one))
    assert pairs.goes_together(replace(one, before=(effect_class("align_to_color")(),))) is None
    one.validator.evidence.camera = CAMERA.aligned_to_color()
    assert pairs.goes_together(one) is None


def test_an_aligned_camera_has_an_alignment_whatever_the_profile_says() -> None:
    """Another way to resample is seen everywhere, and hardly along edges, by which an alignment is known."""
    nothing = changes(HOLES, 0.1, [0, 0, 0, 0])
    edge = SimpleNamespace(name="edge_distance", names={"edge_distance"}, kind=ERROR, size=8, single=True)
    for aligned in (False, True):
        camera = CAMERA.aligned_to_color() if aligned else CAMERA
        evidence = SimpleNamespace(axes=[*AXES, edge], base=(), camera=camera, config=DepthConfig())
        validator = cast("Validator", SimpleNamespace(evidence=evidence, once=lambda what, *sensors: nothing))
        assert (itself.is_idle(validator, effect_class("align_to_color"), (), ()) is None) == aligned


@given(st.floats(0.2, 1), st.floats(0, 1))
def test_holes_beside_a_cause_whose_own_go_together(theirs: float, left: float) -> None:
    """By another formula than the recording's, a shadow leaves some of how holes go together."""
    shadow = effect_class("stereo_shadow")()
    does = changes(HOLES, 0.1, [0, 0, 0])
    one = asked("fill_rate", does, replace(does, lost_together=left), does, before=(shadow,))
    makes = replace(does, lost_together=theirs)
    evidence = one.validator.evidence
    validator = SimpleNamespace(evidence=evidence, once=lambda work, before, after: makes if shadow in after else None)
    refused = pairs.goes_together(replace(one, validator=cast("Validator", validator))) is not None
    assert refused == (left > max(one.limit.left_along * theirs, one.limit.together * does.whole[ALL]))


@given(arrays(np.float64, (3, 35), elements=st.floats(0, 1e4)))
def test_tails_are_shares_and_alike_of_whatis_alike(counts: NDArray[np.float64]) -> None:
    counts = np.round(counts)
    own = moments(counts)
    one, other = tails(counts, counts, own, own)
    assert one == pytest.approx(other)
    assert ((one >= 0) & (one <= 1)).all()


def test_steps_that_the_recording_does_not_show_are_no_steps(scaled: Path) -> None:
    bank = ("disparity_quantization", "disparity_offset")
    found = diagnose(
        scaled, sensor="paper", without=[name for name in effect_ids() if name not in bank], threads=1, tasks=False
    )
    assert not found.causes, found.causes


@pytest.mark.parametrize(("effect", "refused"), [("disparity_quantization", True), ("subpixel_bias", False)])
def test_only_what_rounds_is_asked_for_steps(effect: str, refused: bool) -> None:
    """A triangle of a pixel brings disparities near whole ones, as steps of a pixel do."""
    steps = {(): None, (1,): 0.997}
    evidence = SimpleNamespace(cuts=SimpleNamespace(own_steps=None))
    validator = SimpleNamespace(evidence=evidence, once=lambda work, effects: steps[effects])
    why = marks.unseen_step(cast("Validator", validator), effect_class(effect), (), cast("Any", (1,)))
    assert (why is not None) == refused


@given(st.floats(0.01, 0.5), st.lists(st.floats(0, 1), min_size=2, max_size=2))
def test_holes_that_go_together_are_told_from_more_of_them(share: float, together: list[float]) -> None:
    """Some pairs of pixels are lost together, the others each for itself."""
    alone = np.outer([1 - share, share], [1 - share, share])
    bits = []
    for part in (0.0, *sorted(together)):
        both = part * np.diag([1 - share, share]) + (1 - part) * alone
        pairs = np.append(np.full(25, both[0, 0] / 25), both.ravel()[1:])
        bits.append(float(holes_together(1e6 * pairs[None])[0]))
    assert bits[0] == pytest.approx(0, abs=1e-6)
    assert bits[1] >= bits[0] - 1e-6
    assert bits[2] >= bits[1] - 1e-6
    assert max(together) < 0.5 or bits[2] > 0.05 * share


@given(st.floats(0.2, 0.7), st.floats(0.005, 0.05), st.booleans())
def test_outliers_one_by_one_do_not_go_together_more_than_the_noise_about_them(
    correlation: float, share: float, in_patches: bool
) -> None:
    """Among noise of which neighbours go together; those of patches of outliers are far off on the same side."""
    alone = np.full((5, 5), 1 / 25)
    noise = (1 - correlation) * alone + correlation * np.eye(5) / 5
    far = np.diag([0.5, 0, 0, 0, 0.5]) if in_patches else np.outer([0.5, 0, 0, 0, 0.5], np.full(5, 0.2))
    with_outliers = (1 - 2 * share) * noise + share * (far + far.T)
    a, b = (np.append(1e7 * pairs, np.zeros(3))[None] for pairs in (with_outliers, noise))
    both = together_more(a, b)[0], together_more(b, a)[0]
    assert both[not in_patches] == max(both) == errors_together(a, b)[0]
    assert both[in_patches] == 0
    assert max(both) > 0 or correlation > 0.4 or not in_patches


def test_of_a_shadow_a_few_pixels_say_little() -> None:
    """The median of three among four hundred holes is far off, and that of none is 0; of a cell without holes it
    counts in full."""
    holes = np.zeros((1, 35))
    holes[0, ERROR_HOLE] = 400
    few = holes.copy()
    few[0, 3:6] = 1  # far nearer than they should be
    bias, spread, _, _ = _scaled(few, holes)[:4, 0]
    assert bias == spread == 0
    seen, off = np.zeros((2, 1, 35))
    seen[0, 15:17], off[0, 10:12] = 200, 200
    whole = _scaled(off, seen)[0, 0]
    part = _scaled(off + 3 * holes, seen + 3 * holes)[0, 0]  # three of four pixels have no depth
    assert part == pytest.approx(whole / 2) and abs(whole) > 0.5


@pytest.mark.parametrize(
    ("gain", "varies", "refused"), [({"wood": 1.0}, 0.05, True), ({"wood": 1.0}, 0.3, False), ({}, 0.05, False)]
)
def test_a_factor_that_is_alike_for_all_materials_is_none_of_theirs(
    gain: dict[str, float], varies: float, refused: bool
) -> None:
    """Such as the spread that a filter takes away; of an m, which grows with the range, this is not asked."""
    noise = effect_class("material_noise")
    does = changes(SPREAD, 1.0, [varies / 2, varies, 0])
    evidence = SimpleNamespace(axes=AXES, config=DepthConfig())
    validator = cast("Validator", SimpleNamespace(evidence=evidence, once=lambda work, before, after: does))
    why = itself.is_alike_for_all(validator, noise, (noise(),), (noise(m={"wood": 0.5}, gain=gain),))
    assert (why is not None) == refused
    assert itself.is_alike_for_all(validator, effect_class("fill_rate"), (), ()) is None


def of_both(spread: float, holes: float) -> Changes:
    """Spread and holes that change along the first axes."""
    one, other = changes(SPREAD, 0.0, [spread / 2, spread, 0]), changes(HOLES, 0.0, [holes, holes, 0])
    return replace(one, varies=one.varies + other.varies)


def seen_by(of: Changes, gap: Changes) -> Any:
    """A validator by which an effect does something, and the recording differs from the simulator."""
    evidence = SimpleNamespace(axes=AXES, config=DepthConfig(), base=(), camera=CAMERA)
    return SimpleNamespace(evidence=evidence, once=lambda work, *sensors: of if len(sensors) == 2 else gap)


@pytest.mark.parametrize("effect", ["ambient_light", "incidence_noise"])
@pytest.mark.parametrize("holes", [0.0, 0.1])
@pytest.mark.parametrize("later", [(), ("hole_filling",)])
def test_light_that_makes_noise_loses_pixels_too(effect: str, holes: float, later: tuple[str, ...]) -> None:
    """Also if they are filled later; and of what makes noise alone it is not asked."""
    none, both = of_both(0.5, 0.0), of_both(0.5, holes)
    kind, after = effect_class(effect), tuple(effect_class(name)() for name in (effect, *later))

    def once(work: Any, *sensors: Sequence[Effect]) -> Changes:
        is_filled = any(one.id in later for sensor in sensors for one in sensor)
        return none if is_filled else both

    validator = cast("Validator", seen_by(both, both))
    validator.once = once  # type: ignore[method-assign, assignment]
    why = itself.lacks_a_kind(validator, kind, after[1:], after)
    assert (why is not None) == (effect == "ambient_light" and not holes)
    validator.evidence.base = (kind(),)  # whose noise alone may be wrong
    assert itself.lacks_a_kind(validator, kind, after[1:], after) is None


@pytest.mark.parametrize(("made", "recorded", "none"), [(0.001, 0.001, True), (0.02, 0.001, False), (0.0, 0.02, False)])
def test_light_that_loses_pixels_makes_noise_too(made: float, recorded: float, none: bool) -> None:
    """If the recording has some: a material that loses pixels is lit from no side. Beside many it may be missed."""
    validator = cast("Validator", seen_by(of_both(made, 1.0), of_both(recorded, 1.0)))
    light = effect_class("ambient_light")
    why = itself.lacks_a_kind(validator, light, (), (light(),))
    assert why == ("makes none of the spreads that go with its holes" if none else None)


@pytest.mark.parametrize(("spread", "holes", "first"), [(0.5, 0.1, True), (0.1, 0.5, False)])
def test_marks_of_noise_are_for_what_makes_more_noise_than_holes(spread: float, holes: float, first: bool) -> None:
    """Sunlight is held against patterns that stay at their pixels only if it is noise that it makes."""
    both = of_both(spread, holes)
    asked = Asked(cast("Validator", seen_by(both, both)), effect_class("ambient_light"), (), both, both, both, True,
                  True, True)  # fmt: skip
    assert asked.makes_first == first
    assert replace(asked, effect=effect_class("spatial_correlation")).makes_first


@pytest.mark.parametrize(("inside", "made", "refused"), [(5.0, 0.01, True), (5.0, 0.03, False), (0.0, 0.01, False)])
def test_a_shadow_is_lost_of_the_background_mostly(inside: float, made: float, refused: bool) -> None:
    """Near things that are lost as a whole are no shadow, though they lie beside one."""
    shadow = effect_class("stereo_shadow")
    holes = {0.0: 0.01 + made, inside: 0.05}

    def once(work: Any, effects: Any) -> float:
        return holes[effects[-1].inside] if effects else 0.01

    validator: Any = SimpleNamespace(evidence=SimpleNamespace(config=DepthConfig(), base=(), camera=CAMERA), once=once)
    why = itself.is_mostly_besides(validator, shadow, (), (shadow(inside=inside),))
    assert why == ("loses 75% of its pixels by inside alone" if refused else None)
    assert itself.is_mostly_besides(validator, effect_class("fill_rate"), (), ()) is None
    validator.once = lambda work, effects: 0.01 if effects else 0.02  # fewer holes than without it, by chance
    assert itself.is_mostly_besides(validator, shadow, (), (shadow(inside=inside),)) is None


@pytest.mark.parametrize(
    ("was", "now", "stands_out", "effect", "refused"),
    [
        (0.11, 1e-4, True, "fill_rate", True),
        (0.11, 0.01, True, "fill_rate", False),
        (0.01, 0.0, True, "fill_rate", False),  # as little as that a good camera has not
        (0.11, 0.0, False, "fill_rate", False),  # and nothing is left that filling would explain
        (0.11, 0.0, True, "material_dropout", False),
    ],
)
def test_hardly_a_sensor_loses_no_pixel(was: float, now: float, stands_out: bool, effect: str, refused: bool) -> None:
    before, after = (effect_class("fill_rate")(rate=rate) for rate in (was, now))
    evidence = SimpleNamespace(config=DepthConfig(), base=(before,), camera=CAMERA)
    validator: Any = SimpleNamespace(
        evidence=evidence, config=DepthConfig().significance, once=lambda work, x: 0.02 + sum(one.rate for one in x),
        score=lambda effects: SimpleNamespace(stands_out=lambda limit: stands_out),
    )  # fmt: skip
    why = itself.takes_all(validator, effect_class(effect), (before,), (after,))
    assert why == ("loses no pixel where the simulator loses 11%, which is filling rather" if refused else None)


@pytest.mark.parametrize(
    ("was", "now", "beside", "refused"),
    [
        (16.0, 0.0, HoleFilling(), True),
        (16.0, 20.0, HoleFilling(), False),  # more of them than there are left when they are filled
        (16.0, 0.0, DisparityNoise(), False),
    ],
)
def test_what_fills_holes_takes_them_away_by_its_own_formula(
    was: float, now: float, beside: Effect, refused: bool
) -> None:
    band, less = (InvalidBand(margin=margin) for margin in (was, now))
    evidence = SimpleNamespace(config=DepthConfig(), base=(band,), camera=CAMERA)
    validator: Any = SimpleNamespace(
        evidence=evidence, once=lambda work, x: sum(one.margin for one in x if one.id == InvalidBand.id) / 100
    )
    why = itself.takes_what_is_filled(validator, InvalidBand, (band, beside), (less, beside))
    assert why == ("takes away holes, which hole_filling fills" if refused else None)
    filled = itself.takes_what_is_filled(validator, HoleFilling, (band,), (band, HoleFilling()))
    assert filled is None


@pytest.mark.parametrize(("varies", "same"), [(0.05, True), (0.2, False)])
def test_a_gap_that_is_the_same_all_over(varies: float, same: bool) -> None:
    gap = changes(HOLES, 1.0, [varies, 0, 0])
    evidence = SimpleNamespace(axes=AXES, config=DepthConfig())
    validator = cast("Validator", SimpleNamespace(evidence=evidence, once=lambda work, effects: gap))
    assert agreement.is_uniform(validator, "range", "missing", ()) == same
    assert agreement.is_uniform(validator, "material", "missing", ())


@pytest.mark.parametrize(
    ("effect", "is_theirs"),
    [(MaxRange(depth=25.0), True), (MaxRange(depth=4.0), False), (RangeDropout(start=3.0, rate=0.1), False)],
)
def test_holes_among_what_another_cause_makes_are_its_own_formulas(
    scaled: Path, effect: Effect, is_theirs: bool
) -> None:
    """A largest range of 25 m in an office is one of false matches alone, which lie anywhere."""
    evidence, _ = load_evidence(scaled, None, (DisparityNoise(sigma=0.05),))
    before = (*evidence.base, HeavyTails(share=0.1, search=8))
    validator = Validator(evidence, evidence.held_out)
    why = marks.acts_on_another(validator, type(effect), before, (*before, effect))
    assert (why is not None) == is_theirs, why
    assert marks.acts_on_another(validator, type(effect), evidence.base, (*evidence.base, effect)) is None


def test_what_a_filter_carries_on_is_not_made_of_what_another_cause_makes(scaled: Path) -> None:
    """Behind a filter in time an effect changes the pixels of the frames after its own, too."""
    evidence, _ = load_evidence(scaled, None, (DisparityNoise(sigma=0.05),))
    before = (*evidence.base, effect_class("temporal_filter")(alpha=0.1, delta=5.0))
    validator = Validator(evidence, evidence.held_out)
    effect = HeavyTails(share=0.02, search=8)
    assert marks.acts_on_another(validator, type(effect), before, (*before, effect)) is None


@given(st.floats(0, 0.0625), st.floats(0, 0.0625), st.floats(0, 0.0625))
def test_what_acts_on_one_material_shows_itself_on_that(along: float, material: float, both: float) -> None:
    """Holes near a mirror, on a material that lies alike at any angle: angles by themselves hardly show them."""
    does = changes(HOLES, 0.125, [along, material, both, 0.5])  # few pixels near edges, which are all lost
    axes = [
        SimpleNamespace(name=name, names=set(name.split(" x ")), kind=ERROR)
        for name in ("incidence", "material", "incidence x material", "edge_distance")
    ]
    evidence = SimpleNamespace(axes=axes, base=(), camera=CAMERA, config=DepthConfig())
    validator = cast("Validator", SimpleNamespace(evidence=evidence, once=lambda what, *sensors: does))
    least = DepthConfig().agreement.known_by * (does.mean + does.varies)[ALL]
    varies = does.varies[ALL]
    shows = bool(varies[0] >= least[0] or varies[2] - varies[1] >= least[2])
    assert itself.shows_itself(validator, effect_class("specular_dropout"), (), ()) == shows
    idle = itself.is_idle(validator, effect_class("specular_dropout"), (), ())
    assert (idle is None) == shows
    alone = itself.shows_itself(validator, effect_class("incidence_dropout"), (), ())  # acts on every material
    assert alone == bool(varies[0] >= least[0])


@pytest.mark.parametrize(
    ("softness", "base", "refused"), [(0.3, (), True), (0.29, (), False), (0.3, ("max_range",), False)]
)
def test_a_limit_that_is_soft_over_decimetres_is_none(softness: float, base: tuple[str, ...], refused: bool) -> None:
    evidence = SimpleNamespace(base=tuple(effect_class(name)() for name in base), camera=CAMERA)
    validator = cast("Validator", SimpleNamespace(evidence=evidence))
    said = itself.is_outgrown(validator, MaxRange, [RangeDropout(), MaxRange(depth=3.0, softness=softness)])
    assert (said is not None) == refused
    assert said is None or "softness" in said


@pytest.mark.parametrize(("rate", "refused"), [(2.0, True), (1.0, False)])
def test_holes_that_are_all_there_within_decimetres_are_a_limit(rate: float, refused: bool) -> None:
    validator = cast("Validator", SimpleNamespace(evidence=SimpleNamespace(base=(), camera=CAMERA)))
    assert (itself.is_outgrown(validator, RangeDropout, [RangeDropout(rate=rate)]) is not None) == refused


@pytest.mark.parametrize(("share", "refused"), [(1.0, True), (0.5, True), (0.4, False)])
def test_tails_of_all_pixels_are_noise(share: float, refused: bool) -> None:
    validator = cast("Validator", SimpleNamespace(evidence=SimpleNamespace(base=(), camera=CAMERA)))
    assert (itself.is_outgrown(validator, HeavyTails, [HeavyTails(share=share, spread=0.04)]) is not None) == refused
