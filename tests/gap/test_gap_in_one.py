"""Two causes as one: a pattern and the biases beside it, a noise and another one."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.fit import in_one as module
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.candidates import candidates, setting_of
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.free import Free
from depthsim.gap.depth.fit.in_one import (
    bias_in_other_form,
    biases_in_one,
    holes_anywhere,
    law_in_place,
    noises_in_one,
    smoothed_in_one,
)
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.validate import Validator
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import effect_class, load_profile
from depthsim.trajectory import load_trajectory

WHOLE = Candidate("fixed_pattern", (), {}, ((),), in_place=True)


@pytest.mark.parametrize(
    ("named", "alone", "worse", "becomes"),
    [
        (["fixed_pattern", "disparity_offset", "lateral_noise"], 0.105, False, ["lateral_noise", "fixed_pattern"]),
        (["fixed_pattern", "disparity_offset"], 0.105, False, ["fixed_pattern"]),
        (["fixed_pattern", "disparity_offset"], 0.2, False, None),  # what the mount turns is not at the same pixels
        (["fixed_pattern", "disparity_offset"], 0.105, True, None),
        (["fixed_pattern", "disparity_offset"], 0.101, True, ["fixed_pattern"]),  # surely, but next to nothing
        (["fixed_pattern", "lateral_noise"], 0.0, False, None),  # nothing to be in it
        (["disparity_offset", "extrinsic_rotation"], 0.0, False, None),
        (["ambient_light", "disparity_offset", "extrinsic_rotation"], 0.0, False, None),  # its other form is for light
    ],
)
def test_a_pattern_has_what_lies_at_the_same_pixels(
    monkeypatch: pytest.MonkeyPatch, named: list[str], alone: float, worse: bool, becomes: list[str] | None
) -> None:
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(module, "surely_worse", lambda *_: worse)
    smooth = replace(WHOLE, in_place=False)
    search = SimpleNamespace(
        config=DepthConfig(),
        whole=1.0,
        floor=0.02,
        base=(),
        validator=None,
        bank=[smooth, WHOLE, replace(WHOLE, effect="ambient_light")],
        begin=lambda one, base: Model((one,), np.empty(0)),
        fit=lambda of, rounds: of,
        validated=lambda of: Trial(of, alone),
        say=lambda text: None,
    )
    model = Model(
        tuple(smooth if one == "fixed_pattern" else replace(smooth, effect=one) for one in named), np.empty(0)
    )
    found = biases_in_one(cast("Search", search), Trial(model, 0.1)).model
    if becomes is None:
        assert found is model
    else:
        assert [part.effect for part in found.parts] == becomes and found.parts[-1] is WHOLE


@pytest.mark.parametrize("in_proportion", [True, False])
def test_noise_in_another_form_needs_no_other_beside_it(in_proportion: bool, tmp_path: Path) -> None:
    """To the corners it grows in proportion to that of each material, which it leaves as one that is added.

    If it does not act where the gap lies, the two that leave more than it does not, either.
    """
    scene, camera, paper = load_scene("office"), preset("d435", 160, 90), load_profile("paper")
    noise, corners = effect_class("material_noise"), effect_class("vignetting_noise")
    added = [noise(gain={"cement": 0.5}), corners(corner=0.3)]
    base = [one for one in paper.effects if in_proportion or one.id != noise.id]
    sensor = paper.model_copy(update={"effects": (*base, *([corners(gain=2.0, corner=0)] if in_proportion else added))})
    generate(scene, load_trajectory("tour", scene, 10.0, 12), camera, sensor, tmp_path / "run", seed=3, threads=1)
    evidence, _ = load_evidence(tmp_path / "run", scene, "paper", threads=1)
    bank = [c for c in candidates(evidence.base, setting_of(evidence)) if c.effect in (noise.id, corners.id)]
    search = Search(evidence, Validator(evidence, evidence.held_out), bank, evidence.base, lambda _: None)
    found = Model((), np.empty(0))
    for one, fixed in ((noise, "m"), (corners, "gain")):
        form = next(c for c in bank if c.effect == one.id and fixed in c.fixed)
        found = search.fit(found.plus(search.begin(form, found.build(evidence.base))), 4)
    both = search.validated(found)
    refused: dict[str, str] = {}
    other = noises_in_one(search, both, lambda effect, closed, why: refused.update({effect: why}))
    assert not refused
    if in_proportion:
        assert [part.effect for part in other.model.parts] == [corners.id] and other.gap < both.gap
        assert other.model.parameters(0)["gain"] == pytest.approx(2.0, abs=0.2)
        search.disagreement = lambda *_, **__: "acts elsewhere"  # type: ignore[method-assign]
        neither = noises_in_one(search, both, lambda effect, closed, why: refused.update({effect: why}))
        assert not neither.model.parts and neither.gap == search.before
        assert refused == {
            corners.id: "leaves more beside material_noise than vignetting_noise alone, which is none",
            noise.id: "leaves more beside vignetting_noise than vignetting_noise alone, which is none",
        }
    else:
        assert other is both


@pytest.mark.parametrize("decentred", [True, False])
def test_a_lens_that_is_decentred_needs_no_mount_that_is_off_beside_it(decentred: bool, tmp_path: Path) -> None:
    """Which is for what a centred lens leaves; where the mount is off itself, both stay."""
    scene, camera, clean = load_scene("office"), preset("d435", 160, 90), load_profile("clean")
    lens, mount = effect_class("lens_distortion"), effect_class("extrinsic_translation")
    bent = [lens(k1=0.015, p1=0.002, p2=-0.002)] if decentred else [lens(k1=0.015), mount(x=0.02, y=-0.01)]
    sensor = clean.model_copy(update={"effects": (*clean.effects, *bent, effect_class("disparity_noise")(sigma=0.05))})
    path = load_trajectory("tour", scene, 10.0, 12)
    generate(scene, path, camera, sensor, tmp_path / "run", seed=3, threads=1)
    evidence, _ = load_evidence(tmp_path / "run", scene, sensor.effects[-1:], threads=1)
    bank = [one for one in candidates(evidence.base, setting_of(evidence)) if one.effect in (lens.id, mount.id)]
    search = Search(evidence, Validator(evidence, evidence.held_out), bank, evidence.base, lambda _: None)
    found = Model((), np.empty(0))
    centred = next(one for one in bank if one.effect == lens.id and one.fixed.get("p1") == 0)
    for form in (centred, next(one for one in bank if one.effect == mount.id)):
        found = search.fit(found.plus(search.begin(form, found.build(evidence.base))), 4)
    both = search.validated(found)
    other = bias_in_other_form(search, both)
    if decentred:
        assert [part.effect for part in other.model.parts] == [lens.id] and other.gap < both.gap
        assert other.model.parameters(0)["p1"] == pytest.approx(0.002, abs=0.0005)
    else:
        assert other is both


@pytest.mark.parametrize("replaced", [True, False])
def test_a_law_that_was_added_to_the_simulators_takes_its_place(replaced: bool, tmp_path: Path) -> None:
    """Where it does, and not where both are there."""
    scene, camera, paper = load_scene("office"), preset("d435", 160, 90), load_profile("paper")
    law = effect_class("disparity_noise")(sigma=0.06)
    effects = (*(one for one in paper.effects if not (replaced and one.law)), law)
    sensor = paper.model_copy(update={"effects": effects})
    generate(scene, load_trajectory("tour", scene, 10.0, 12), camera, sensor, tmp_path / "run", seed=3, threads=1)
    evidence, _ = load_evidence(tmp_path / "run", scene, "paper", threads=1)
    bank = [one for one in candidates(evidence.base, setting_of(evidence)) if one.effect == law.id]
    search = Search(evidence, Validator(evidence, evidence.held_out), bank, evidence.base, lambda _: None)
    found = {}
    for way in bank:
        found[bool(way.replaces)] = search.validated(search.fit(search.begin(way, evidence.base), 4))
    for begun in found.values():
        assert bool(law_in_place(search, begun).newest.replaces) == replaced
    sigma = law_in_place(search, found[not replaced]).model.parameters(0)["sigma"]
    assert sigma == pytest.approx(0.06, rel=0.1)


@pytest.mark.parametrize("smoothed", [True, False])
def test_a_filter_takes_the_place_of_little_noise_that_goes_together(smoothed: bool, tmp_path: Path) -> None:
    """Where there is one, and not where a law of little noise is the sensor's own and goes together."""
    scene, camera, paper = load_scene("office"), preset("d435", 160, 90), load_profile("paper")
    law, pairs, smooth = map(effect_class, ("disparity_noise", "spatial_correlation", "spatial_filter"))
    others = [one for one in paper.effects if not one.law]
    effects = (*paper.effects, smooth(iterations=1)) if smoothed else (*others, law(sigma=0.05), pairs(x=0.8, y=0.8))
    sensor = paper.model_copy(update={"effects": tuple(effects)})
    generate(scene, load_trajectory("tour", scene, 10.0, 18), camera, sensor, tmp_path / "run", seed=3, threads=1)
    evidence, _ = load_evidence(tmp_path / "run", scene, "paper", threads=1)
    ids = (law.id, pairs.id, smooth.id)
    bank = [one for one in candidates(evidence.base, setting_of(evidence)) if one.effect in ids]
    search = Search(evidence, Validator(evidence, evidence.held_out), bank, evidence.base, lambda _: None)
    found = Model((), np.empty(0))
    for way in (next(one for one in bank if one.replaces), next(one for one in bank if one.effect == pairs.id)):
        found = search.fit(found.plus(search.begin(way, found.build(evidence.base))), 4)
    both = search.validated(found)
    other = smoothed_in_one(search, both)
    assert (other is both) != smoothed
    if smoothed:
        assert [part.effect for part in other.model.parts] == [smooth.id] and other.gap < both.gap


@pytest.mark.parametrize(
    ("rates", "acts", "becomes"),
    [
        ([0.03, 0.03, 0.03], True, ["fill_rate"]),
        ([0.03, 0.03, 0.5], True, ["material_dropout", "fill_rate"]),
        ([0.03, 0.03, 0.5], False, None),
        ([0.0, 0.0, 0.5], True, None),  # of one material alone: nothing is anywhere
    ],
)
def test_holes_that_all_materials_have_alike_are_anywhere(
    monkeypatch: pytest.MonkeyPatch, rates: list[float], acts: bool, becomes: list[str] | None
) -> None:
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    free = tuple(Free(("rates", tag), 0.0, 1.0, False, 0.1) for tag in ("brick", "metal", "wood"))
    each = Candidate("material_dropout", free, {}, ((0.1, 0.2, 0.3), (0.4, 0.5, 0.3)))
    anywhere = Candidate("fill_rate", (), {}, ((),))
    few = max(rates) > 0.1

    def validated(model: Model) -> Trial:
        own = [f.key[1] for part in model.parts for f in part.free]
        return Trial(model, 0.1 if own == (["wood"] if few else []) else 0.3)

    search = SimpleNamespace(
        config=DepthConfig(),
        floor=0.02,
        base=(),
        bank=[each, anywhere],
        begin=lambda one, base: Model((one,), np.empty(0)),
        fit=lambda of, rounds: of,
        validated=validated,
        disagreement=lambda *_, **__: None if acts else "acts elsewhere",
        say=lambda text: None,
    )
    model = Model((each,), np.array([one.encode(rate) for one, rate in zip(free, rates, strict=True)]))
    found = holes_anywhere(cast("Search", search), Trial(model, 0.1)).model
    if becomes is None:
        assert found is model
    else:
        assert [part.effect for part in found.parts] == becomes
        starts = [part.starts for part in found.parts if part.free]
        assert starts == ([((0.3,),)] if few else [])  # where causes are looked for once more, it begins there
