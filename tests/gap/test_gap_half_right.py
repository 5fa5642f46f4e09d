"""Profiles that are half right: one value or one effect is otherwise in the recording."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.half_right import cases
from depthsim.gap import diagnose
from depthsim.gap.depth.data.load import load_evidence
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.sensor import load_profile
from depthsim.sensor.effect import effect_ids
from depthsim.sensor.effects.calibration import BaselineScale
from depthsim.sensor.effects.noise import DisparityNoise


@pytest.mark.parametrize("profile", ["paper", "d435"])
def test_every_case_has_one_effect_otherwise(profile: str) -> None:
    names = []
    for case in cases(profile, []):
        here, there = ({one.id: one for one in effects} for effects in (case.base, case.recorded))
        assert {key for key in here | there if here.get(key) != there.get(key)} == {case.effect}, case
        names.append((case.effect, case.what))
    assert len(set(names)) == len(names)
    assert {effect for effect, _ in names} >= {effect.id for effect in load_profile(profile).effects}


@pytest.mark.parametrize(
    ("effect", "what"), [("matching_window", "radius"), ("invalid_band", "left out"), ("disparity_noise", "sigma")]
)
def test_an_effect_that_is_otherwise_is_found(effect: str, what: str, tmp_path: Path) -> None:
    """A whole number that no slope leads to, a band that goes on by what fits hold, and noise like that of motion."""
    (case,) = (case for case in cases("d435", [effect]) if case.what.startswith(what))
    camera = preset("d435", 212, 120).model_copy(update={"rate": 10.0})
    generate("office", None, camera, case.recorded, tmp_path / "run", frames=24, streams=("depth",), seed=11)
    diagnosis = diagnose(tmp_path / "run", sensor=case.base, tasks=False)
    assert [cause.effect for cause in diagnosis.causes] == [effect]
    assert diagnosis.causes[0].closed_fraction > 0.95


def test_against_a_simulator_without_noise_errors_are_told_in_the_recordings(tmp_path: Path) -> None:
    """In the simulator's own all of them lie in the last bins, where a scale is like an offset of the disparity."""
    camera = preset("d435", 212, 120).model_copy(update={"rate": 10.0})
    recorded = [BaselineScale(scale=1.03), DisparityNoise(sigma=0.08)]
    generate("office", None, camera, recorded, tmp_path / "run", frames=24, streams=("depth",), seed=11)
    bank = ("baseline_scale", "disparity_offset", "disparity_noise", "incidence_noise", "intrinsics")
    without = [name for name in effect_ids() if name not in bank]
    found = diagnose(tmp_path / "run", sensor="clean", without=without, tasks=False)
    assert sorted(cause.effect for cause in found.causes) == ["baseline_scale", "disparity_noise"]
    assert found.verdict == "explained" and found.gap.closed_fraction > 0.98
    evidence, _ = load_evidence(tmp_path / "run", None, "clean")
    usual, _ = load_evidence(tmp_path / "run", None, recorded)
    ratio = evidence.cuts.spread / usual.cuts.spread
    assert np.median(ratio) == pytest.approx(1, abs=0.2)
