"""Causes that are withdrawn: they act elsewhere than the gap lies first, or are what registered frames leave."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth import diagnose
from depthsim.gap.depth.compared import Compared
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.fit import withdraw
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.free import Free
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.validate import Score, Validator
from depthsim.gap.diagnosis import Cut
from depthsim.materials import load_materials
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor.effect import effect_class
from depthsim.sensor.effects.calibration import BaselineScale
from depthsim.sensor.effects.material_noise import MaterialNoise

SCORE = cast("Score", SimpleNamespace(above=1.0))
VALIDATOR = cast("Validator", SimpleNamespace(evidence=SimpleNamespace(config=DepthConfig(), base=(), supposed=None)))

BY_CHANCE = {"turn_by_chance": 0.1, "shift_by_chance": 0.1, "late_by_chance": 0.1}


def selection(*effects: str) -> Selection:
    """Causes without parameters."""
    return Selection(Model(tuple(Candidate(one, (), {}, ((),)) for one in effects), np.empty(0)), {}, (), ())


def cut(axis: str, what: Any, share: float = 0.5) -> Cut:
    """A place where half of the gap lies, or another share."""
    return Cut(axis=axis, label=axis, unit="", share_of_gap=share, what=what, text="")


@pytest.mark.parametrize(
    "pair", [("intrinsics", "extrinsic_rotation"), ("disparity_noise", "motion_noise")], ids=["biases", "noises"]
)
@pytest.mark.parametrize(
    ("alone", "left", "stays"),
    [
        ((3.0, 2.0), 0.5, False),
        ((3.0, 2.0), 0.05, True),  # calibrated together
        ((0.8, 2.0), 0.5, True),  # the first comes nearer by itself
    ],
)
def test_two_of_a_kind_that_only_cancel_leave_next_to_nothing(
    monkeypatch: pytest.MonkeyPatch, pair: tuple[str, str], alone: tuple[float, float], left: float, stays: bool
) -> None:
    """As noise by motion in the place of the simulator's own does not."""
    gaps = {(): 1.0, pair[:1]: alone[0], pair[1:]: alone[1]}

    def gap(effects: Any) -> float:
        named = tuple(effect.id for effect in effects if effect.id != "fill_rate")
        return gaps.get(named, 0.6)

    validator = cast("Validator", SimpleNamespace(evidence=VALIDATOR.evidence, quick=gap, once=lambda work, x: work(x)))
    wrong = {1: 1.0, 3: left}
    monkeypatch.setattr(withdraw, "against", lambda effects: SimpleNamespace(whole=[wrong[len(effects)]] * 2))
    found = withdraw.cancelling(validator, selection(pair[0], "fill_rate", pair[1]))
    kept = [pair[0], "fill_rate", pair[1]] if stays else ["fill_rate"]
    assert [part.effect for part in found.model.parts] == kept
    assert [round(near.closed_fraction, 6) for near in found.nearest] == ([] if stays else [0.2, 0.2])


@pytest.mark.parametrize("fills", [True, False])
def test_fewer_holes_are_no_cause_beside_what_fills_them(fills: bool) -> None:
    """The simulator loses 16 columns more; holes: those that a sensor makes before they are filled."""

    def looked(work: Any, sensor: Any) -> float:
        return sum(one.margin for one in sensor if one.id == "invalid_band") / 100

    band = effect_class("invalid_band")(margin=16.0)
    evidence = SimpleNamespace(config=DepthConfig(), base=(band,), supposed=None, camera=preset("d435", 106, 60))
    validator: Any = SimpleNamespace(evidence=evidence, once=looked, quick=lambda effects: 1.0 / (1 + len(effects)))
    less = Candidate("invalid_band", (), {"margin": 0.0}, ((),))
    other = selection("hole_filling" if fills else "baseline_scale").model.parts[0]
    found = withdraw.filled(validator, replace(selection(), model=Model((less, other), np.empty(0))))
    assert [part.effect for part in found.model.parts] == ([other.effect] if fills else ["invalid_band", other.effect])
    assert [near.why_not for near in found.nearest] == (["takes away holes, which hole_filling fills"] if fills else [])


@pytest.mark.parametrize(
    ("gap", "rival", "marked", "stays"),
    [
        (0.83, 0.4, False, False),  # a name that happens to be near, when what it was found beside is gone
        (0.6, 0.4, False, True),
        (0.9, 0.98, False, True),  # little, and nothing else comes near
        (0.83, 0.4, True, True),  # steps are made by nothing else
    ],
)
def test_what_is_left_alone_is_asked_as_a_first_cause(
    monkeypatch: pytest.MonkeyPatch, gap: float, rival: float, marked: bool, stays: bool
) -> None:
    monkeypatch.setattr(withdraw, "only_its_own", lambda *change: marked)
    validator: Any = SimpleNamespace(
        evidence=VALIDATOR.evidence, quick=lambda effects: gap if effects else 1.0,
        score=lambda effects: SimpleNamespace(floor=0.0),
    )  # fmt: skip
    looked = ((Trial(selection("disparity_noise").model, rival), Trial(selection("material_dropout").model, 0.0)),)
    given = replace(selection("material_dropout"), looked_at=looked)
    found = withdraw.little(validator, given)
    assert [part.effect for part in found.model.parts] == (["material_dropout"] if stays else [])
    assert [near.why_not for near in found.nearest] == ([] if stays else ["closes too little by itself"])
    both = selection("material_dropout", "fill_rate")
    assert withdraw.little(validator, both) is both


@pytest.mark.parametrize(
    ("effects", "where", "closed", "left", "stays"),
    [
        (["fill_rate"], [("time", "missing")], 0.97, 1.0, False),  # it closes nearly all, and none of what comes first
        (["fill_rate"], [("time", "missing")], 0.97, 0.05, True),
        (["fill_rate"], [("time", "missing")], 0.92, 0.05, True),  # it has no axis to act along
        (["fill_rate"], [("time", "missing")], 0.88, 0.05, False),
        (["max_range"], [("time", "missing")], 0.92, 0.05, False),
        (["intrinsics"], [("motion", "bias")], 0.9, 0.05, True),  # it has no other formula
        (["intrinsics"], [("motion", "bias")], 0.9, 1.0, False),
        (["intrinsics"], [("motion", "bias")], 0.7, 0.05, False),
        (["lens_distortion"], [("motion", "bias")], 0.9, 0.05, False),
        (["fill_rate", "motion_noise"], [("time", "missing")], 0.9, 1.0, True),
        (["fill_rate", "max_range", "motion_noise"], [("time", "missing")], 0.9, 1.0, False),  # noise makes no holes
        (["ambient_light"], [("surface", "spread"), ("image_column", "spread")], 0.9, 1.0, True),  # known by surfaces
        (["motion_noise"], [("surface", "spread"), ("image_column", "spread")], 0.9, 1.0, False),
        (["motion_noise"], [("surface", "spread"), ("motion", "spread")], 0.9, 1.0, True),
        # Columns behind a place in the picture are that place, also beside holes that are known by columns.
        (
            ["disparity_noise", "invalid_band"],
            [("image_position", "spread"), ("image_column", "spread"), ("range", "spread")],
            0.9,
            1.0,
            True,
        ),
        (
            ["disparity_noise"],
            [("image_column", "spread"), ("image_position", "spread"), ("range", "spread")],
            0.9,
            1.0,
            False,
        ),
        (["ambient_light"], [("incidence", "spread"), ("height", "spread")], 0.9, 1.0, False),
        (["ambient_light"], [("incidence", "spread"), ("height", "spread")], 0.97, 1.0, True),  # as much lies there
        (["ambient_light"], [("incidence", "spread"), ("height", "bias")], 0.97, 1.0, False),
        # None of what comes first is left, and as much lies along an own axis.
        (["ambient_light"], [("incidence", "spread"), ("height", "spread")], 0.85, 0.05, True),
        (["ambient_light"], [("incidence", "spread"), ("height", "spread")], 0.75, 0.05, False),
        (["ambient_light"], [("incidence", "spread", 0.4), ("height", "spread", 0.3)], 0.85, 0.05, False),
        # More lies along an own axis: the other is first by its fewer cells.
        (["temporal_filter"], [("time x range", "bias", 0.23), ("motion", "bias", 0.34)], 0.79, 1.0, True),
        (["temporal_filter"], [("time x range", "bias", 0.34), ("motion", "bias", 0.23)], 0.79, 1.0, False),
        # Of holes where these are is asked, and not how errors go together.
        (["empty_border"], [("pixel_neighbours", "correlation"), ("image_column", "missing")], 0.4, 1.0, True),
        (["empty_border"], [("pixel_neighbours", "correlation"), ("range", "missing")], 0.4, 1.0, False),
        (["empty_border"], [("pixel_neighbours", "correlation")], 0.4, 1.0, False),
        (["edge_fattening"], [("residual_tail", "tail")], 0.9, 1.0, True),
        (["baseline_scale"], [("residual_tail", "tail")], 0.9, 1.0, False),
        (["stereo_shadow"], [("frame_neighbours", "missing"), ("edge_distance", "missing")], 0.9, 1.0, True),
    ],
)
def test_causes_act_where_the_gap_lies_first(
    monkeypatch: pytest.MonkeyPatch,
    effects: list[str],
    where: list[tuple[Any, ...]],
    closed: float,
    left: float,
    stays: bool,
) -> None:
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(withdraw, "left_of_change", lambda *_: left)
    monkeypatch.setattr(withdraw, "is_uniform", lambda *_: False)
    monkeypatch.setattr(withdraw, "credit", lambda *_: np.full(len(effects), closed / len(effects)))
    monkeypatch.setattr(withdraw, "_shows_for_sure", lambda *_: False)
    given = selection(*effects)
    found = withdraw.acting_elsewhere(VALIDATOR, given, SCORE, closed, [cut(*place) for place in where])
    assert (found is given) == stays
    if not stays:
        assert not found.model.parts
        assert {near.effect for near in found.nearest} == set(effects)


def test_what_shows_for_sure_stays_where_the_others_act_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tiles of one value each are those of decimation, wherever the gap lies first."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(withdraw, "left_of_change", lambda *_: 1.0)
    monkeypatch.setattr(withdraw, "credit", lambda *_: (0.7, 0.2))
    monkeypatch.setattr(withdraw, "only_its_own", lambda _, effect, *sensors: effect.id == "decimation")
    given = selection("decimation", "disparity_noise")
    found = withdraw.acting_elsewhere(VALIDATOR, given, SCORE, 0.9, [cut("pixel_neighbours", "correlation")])
    assert [part.effect for part in found.model.parts] == ["decimation"]
    assert [near.effect for near in found.nearest] == ["disparity_noise"]


@pytest.mark.parametrize(
    ("angle", "closes", "by_poses", "gap", "stays"),
    [
        (0.02, 0.2, 0.0, 1.0, False),
        (0.5, 0.2, 0.0, 1.0, True),
        (0.5, 0.01, 0.0, 1.0, False),
        (0.5, 0.01, 0.0, 0.0, True),
        (0.5, 0.08, 0.05, 1.0, False),
        (0.5, 0.08, 0.02, 1.0, True),
        (0.5, 0.2, 0.2, 1.0, True),
    ],
)
@pytest.mark.parametrize("effect", ["extrinsic_rotation", "extrinsic_translation", "time_offset"])
def test_what_registered_frames_leave_is_no_cause(
    monkeypatch: pytest.MonkeyPatch, effect: str, angle: float, closes: float, by_poses: float, gap: float, stays: bool
) -> None:
    """A mount that is hardly turned, stamps that are hardly late, what closes next to nothing beside poses, and what
    poses close as well that are off by what registering leaves."""
    monkeypatch.setattr(Model, "build", lambda model, base: tuple(part.effect for part in model.parts))
    monkeypatch.setattr(Model, "parameters", lambda model, number: {"x": angle, "y": 0.0, "z": 0.0})
    monkeypatch.setattr(withdraw, "only_its_own", lambda *_: False)
    errors = cast("PoseErrors", SimpleNamespace(**BY_CHANCE, left="{:.0f} errors".format))
    takes_off = {effect: closes, "1 errors": by_poses, "2 errors": 0.0}
    selecting = SimpleNamespace(
        evidence=VALIDATOR.evidence, quick=lambda effects: 1.0 - sum(takes_off[one] for one in effects)
    )
    given = selection(effect)
    found = withdraw.left_by_poses(errors, cast("Validator", selecting), given, gap)
    assert (found is given) == stays
    if not stays:
        assert found.nearest[0].effect == effect
        assert found.nearest[0].closed_fraction == pytest.approx(closes)


def test_a_cause_with_a_value_for_each_material_stays_beside_poses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Model, "build", lambda model, base: tuple(part.effect for part in model.parts))
    monkeypatch.setattr(Model, "parameters", lambda model, number: {"m": {"wood": 0.5, "glass": 0.8}, "floor": 0.005})
    errors = cast("PoseErrors", SimpleNamespace(**BY_CHANCE))
    selecting = SimpleNamespace(evidence=VALIDATOR.evidence, quick=lambda effects: 1.0 - 0.4 * len(effects))
    given = selection("material_noise")
    assert withdraw.left_by_poses(errors, cast("Validator", selecting), given, 1.0) is given


def test_beside_errors_of_the_poses_a_cause_closes_something(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Model, "build", lambda model, base: tuple(part.effect for part in model.parts))
    parts = {"lateral_noise": -0.2, "disparity_noise": 0.4}

    def credit(validator: Any, base: Any, model: Model, given: Any) -> tuple[float, ...]:
        return (*(parts[part.effect] for part in model.parts), 0.5)

    monkeypatch.setattr(withdraw, "credit", credit)
    selecting = cast("Validator", SimpleNamespace(evidence=VALIDATOR.evidence, quick=lambda effects: 1.0))
    found = withdraw.adding_nothing(VALIDATOR, selecting, selection(*parts), VALIDATOR)
    assert [part.effect for part in found.model.parts] == ["disparity_noise"]
    assert [near.effect for near in found.nearest] == ["lateral_noise"]


@pytest.mark.parametrize(
    ("left", "stays"), [([0.5, 0.1, 0.9], True), ([0.1, 0.1, 0.95], True), ([0.1, 0.1, 1.4], False)]
)
def test_where_the_frames_do_not_agree_nothing_is_named(
    monkeypatch: pytest.MonkeyPatch, left: list[float], stays: bool
) -> None:
    """left: of a gap of 1 in each of three blocks."""
    monkeypatch.setattr(withdraw, "credit", lambda *_: (0.4,))
    monkeypatch.setattr(withdraw, "_by_block", lambda _, effects: np.array(left if effects else [1.0] * 3))
    monkeypatch.setattr(Model, "build", lambda model, base: (1,))
    monkeypatch.setattr(withdraw, "_shows_for_sure", lambda *_: False)
    found = withdraw.unsure(VALIDATOR, given := selection("fixed_pattern"), SCORE)
    assert (found is given) == stays
    if not stays:
        assert not found.model.parts and found.nearest[0].closed_fraction == 0.4


@pytest.mark.parametrize(
    ("beside", "closes", "along", "stays"),
    [
        ("lens_distortion", 0.05, None, False),
        ("lens_distortion", 0.05, 0.3, False),
        ("lens_distortion", 0.05, 0.02, True),
        ("lens_distortion", 0.2, None, True),
        ("temporal_correlation", 0.05, None, True),
    ],
)
@pytest.mark.parametrize("noise", ["disparity_noise", "material_noise"])
def test_a_little_noise_everywhere_beside_a_bias_is_what_its_formula_leaves(
    monkeypatch: pytest.MonkeyPatch, noise: str, beside: str, closes: float, along: float | None, stays: bool
) -> None:
    """But one that leaves next to nothing of how spreads change along its own axes is there."""
    monkeypatch.setattr(withdraw, "left_along", lambda *_: along)
    monkeypatch.setattr(withdraw, "_is_noise_there", lambda *_: False)
    monkeypatch.setattr(Model, "build", lambda model, base: tuple(part.effect for part in model.parts))
    left = {noise: closes, "incidence_noise": 0.01, beside: 0.5}
    selecting = SimpleNamespace(
        evidence=VALIDATOR.evidence,
        score=lambda base: SCORE,
        quick=lambda effects: 1 - sum(left[one] for one in effects),
    )
    given = selection(*left)
    found = withdraw.left_by_biases(cast("Validator", selecting), given)
    assert (found is given) == stays
    assert stays or [part.effect for part in found.model.parts] == ["incidence_noise", beside]


@pytest.mark.parametrize(("more", "stays"), [(1.05, False), (1.2, True)])
def test_noise_by_the_depth_that_a_bias_makes_is_no_other_noise(tmp_path: Path, more: float, stays: bool) -> None:
    """A scale of 1.05, and noise whose m are larger by as much, is the same law at the depth that is measured."""
    scale, tags = 1.05, load_scene("office").tags
    m = {tag: load_materials()[tag].m for tag in tags}
    noise = MaterialNoise(m={tag: value * more for tag, value in m.items()})
    camera = preset("d435", 160, 120, rate=3.0)
    effects = (BaselineScale(scale=scale), noise)
    generate("office", None, camera, effects, tmp_path / "run", frames=12, seed=2, streams=("depth",), threads=1)
    evidence, _ = load_evidence(tmp_path / "run", None, (MaterialNoise(),))
    parts = [Candidate(one.id, (), one.model_dump(), ((),)) for one in effects]
    given = Selection(Model(tuple(parts), np.empty(0)), {}, (), ())
    found = withdraw.left_by_biases(Validator(evidence, evidence.held_out), given)
    assert [part.effect for part in found.model.parts] == ["baseline_scale", *(["material_noise"] if stays else [])]
    assert stays or "depth that the biases make" in found.nearest[0].why_not


@pytest.mark.parametrize(
    ("closes", "error", "by_block", "its_own", "stays"),
    [
        (0.2, 0.05, (0.2, 0.2), False, True),
        (0.2, 3.0, (-0.2, 0.6), False, False),  # how much it closes is not known
        (0.2, 3.0, (-0.05, 0.45), False, True),  # nor here, but it begins late, and then it closes much
        (-0.1, 0.05, (-0.1, -0.1), False, False),
        (1e-3, 1e-4, (1e-3, 1e-3), False, False),  # less than a tenth of the floor
        (1e-3, 1e-4, (1e-3, 1e-3), True, True),  # steps, or doubled rows, are there all the same
    ],
)
def test_frames_that_were_not_seen_support_a_cause(
    monkeypatch: pytest.MonkeyPatch,
    closes: float,
    error: float,
    by_block: tuple[float, ...],
    its_own: bool,
    stays: bool,
) -> None:
    monkeypatch.setattr(Model, "build", lambda model, base: tuple(part.effect for part in model.parts))
    monkeypatch.setattr(withdraw, "closed_error", lambda *_: error)
    gap = np.ones(len(by_block))
    monkeypatch.setattr(withdraw, "_by_block", lambda _, effects: gap - by_block if effects else gap)
    monkeypatch.setattr(withdraw, "only_its_own", lambda *_: its_own)
    validator = SimpleNamespace(
        config=DepthConfig().significance,
        evidence=VALIDATOR.evidence,
        score=lambda effects: SimpleNamespace(above=1.0, floor=0.1),
        quick=lambda effects: 0.5 if effects else 0.5 + closes,
    )
    found = withdraw.unsupported(*[cast("Validator", validator)] * 2, selection("motion_noise"))
    assert bool(found.model.parts) == stays


@pytest.mark.parametrize(
    ("effect", "intervals", "stays"),
    [
        ("baseline_scale", {"scale": [0.9999, 1.0007]}, False),
        ("baseline_scale", {"scale": [1.0001, 1.0007]}, True),
        ("extrinsic_rotation", {"x": [-0.1, 0.1], "y": [-0.1, 0.2], "z": [-0.3, 0.1]}, False),
        ("extrinsic_rotation", {"x": [-0.1, 0.1], "y": [0.1, 0.2], "z": [-0.3, 0.1]}, True),
        ("thermal_drift", {"drift": [-0.1, 0.1], "time_constant": [1.0, 2.0]}, False),
        ("disparity_noise", {}, True),  # nothing is known of its size
    ],
)
@pytest.mark.parametrize("in_base", [False, True])
def test_what_may_be_nothing_is_no_cause(
    monkeypatch: pytest.MonkeyPatch, effect: str, intervals: dict[str, list[float]], stays: bool, in_base: bool
) -> None:
    """But for what the simulator has: to do nothing is a finding then."""
    base = (effect_class(effect)(),) if in_base else ()
    evidence = SimpleNamespace(config=DepthConfig(), base=base)
    validator = cast("Validator", SimpleNamespace(evidence=evidence, ruler=None, quick=lambda _: 1.0))
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(withdraw, "parameter_intervals", lambda *_: [{"k1": [0.1, 0.2]}, intervals])
    monkeypatch.setattr(withdraw, "_shows_for_sure", lambda *_: False)
    found = withdraw.as_nothing(validator, validator, selection("lens_distortion", effect))
    kept = ["lens_distortion", effect] if stays or in_base else ["lens_distortion"]
    assert [part.effect for part in found.model.parts] == kept
    assert stays or in_base or "nothing" in found.nearest[0].why_not


def test_what_is_withdrawn_leaves_the_slopes_of_the_others() -> None:
    free = Free("scale", 0.8, 1.25, False, 0.005)
    parts = tuple(Candidate(one, (free,) * k, {}, ((1.0,) * k,)) for one, k in (("a", 1), ("b", 2), ("c", 1)))
    model = Model(parts, np.arange(4.0), jacobian=np.arange(12.0).reshape(3, 4))
    less = model.less(1)
    assert [part.effect for part in less.parts] == ["a", "c"] and less.x.tolist() == [0, 3]
    assert less.jacobian is not None and less.jacobian.tolist() == [[0, 3], [4, 7], [8, 11]]
    assert model.less(0).less(0).less(0).parts == () and replace(model, jacobian=None).less(0).jacobian is None


@pytest.mark.parametrize(
    ("leader", "first", "another"),
    [
        ("thermal_drift", cut("time x range", "bias"), True),
        ("thermal_drift", cut("time x range", "spread"), False),
        ("thermal_drift", cut("range", "bias"), False),  # it acts along that, and is not known by it
        ("temporal_filter", cut("time x range", "bias"), False),  # it is what acts elsewhere
    ],
)
@pytest.mark.parametrize(("next_one", "given"), [("", False), ("lens_distortion", False), ("lens_distortion", True)])
def test_causes_are_looked_for_once_more_without_what_acts_elsewhere(
    monkeypatch: pytest.MonkeyPatch, leader: str, first: Cut, another: bool, next_one: str, given: bool
) -> None:
    """If another effect is known by the axis on which the gap lies first; what is named then stays.

    given: whether the causes do as well on frames as they are, and the registered ones are gone.
    """
    another = another and not given
    registered, as_they_are = SimpleNamespace(poses="off"), SimpleNamespace(poses=None)
    steps = (tuple(Trial(selection(one).model, 0.1) for one in ("temporal_filter", leader)),)
    looks: list[tuple[str, ...]] = []

    def explain(compared: Any, without: tuple[str, ...], say: Any) -> tuple[Any, Selection, bool]:
        looks.append(without)
        names = [next_one] if "temporal_filter" in without and next_one else ["temporal_filter"] * (not looks[1:])
        return as_they_are if given else compared, replace(selection(*names), looked_at=steps), False

    def acting(found: tuple[Any, Selection, bool], where: Any) -> tuple[Any, Selection, bool]:
        kept = [part.effect for part in found[1].model.parts if part.effect != "temporal_filter"]
        return found[0], selection(*kept), found[2]

    monkeypatch.setattr(diagnose, "explain", explain)
    monkeypatch.setattr(diagnose, "_acting", acting)
    found = diagnose._explained(cast("Compared", registered), [first], ("fill_rate",), lambda _: None)[1]
    assert looks == [("fill_rate",), ("fill_rate", "temporal_filter")][: 1 + another]
    assert [part.effect for part in found.model.parts] == [next_one] * bool(another and next_one)


def test_causes_are_not_looked_for_once_more_where_none_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same search would find the same: nothing, in twice the time."""
    looks: list[tuple[str, ...]] = []

    def explain(compared: Any, without: tuple[str, ...], say: Any) -> tuple[Any, Selection, bool]:
        looks.append(without)
        return compared, replace(selection(), looked_at=((Trial(selection("thermal_drift").model, 0.1),),)), False

    monkeypatch.setattr(diagnose, "explain", explain)
    first = cut("time x range", "bias")
    found = diagnose._explained(cast("Compared", SimpleNamespace(poses=None)), [first], (), lambda _: None)[1]
    assert looks == [()] and not found.model.parts
