"""Effects that come near a gap, and do not act where it lies."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthsim.gap import diagnose
from depthsim.gap.depth.fit.changes import KINDS, Changes, less_others
from depthsim.gap.depth.fit.search import worth_a_look
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import effect_class, effect_ids
from depthsim.sensor.effects.calibration import BaselineScale
from depthsim.trajectory import load_trajectory


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


def test_a_scale_that_is_wrong_all_the_time_is_no_drift(scaled: Path) -> None:
    bank = ("thermal_drift", "fill_rate", "lateral_noise")
    found = diagnose(
        scaled, sensor="paper", without=[name for name in effect_ids() if name not in bank], threads=1, tasks=False
    )
    assert found.verdict == "unexplained", found.causes
    assert found.unexplained is not None
    near = {near.effect: near.why_not for near in found.unexplained.nearest}
    assert "along time" in near["thermal_drift"]


@pytest.mark.parametrize(
    ("effect", "left"),
    [("max_range", [0.0, 0.0, 0.02]), ("baseline_scale", [0.05, 0.01, 0.0]), ("ambient_light", [0.05, 0.01, 0.02])],
)
def test_holes_and_errors_of_what_has_depth_are_answered_for_apart(effect: str, left: list[float]) -> None:
    """Squared differences of roots are 2 ln 2 for a bit, where they are small."""
    kinds = np.array([0.05, 0.01, 0.02])
    varies = np.append(kinds, 2 * np.log(2) * kinds.sum())[:, None]
    none = np.zeros_like(varies)
    seen = less_others(Changes(none, varies, none, np.zeros(1), 0.0), effect_class(effect))
    assert seen.varies[KINDS.index("all"), 0] == pytest.approx(2 * np.log(2) * sum(left))
    assert seen.varies[:3, 0] == pytest.approx(kinds)


@given(st.lists(st.one_of(st.floats(0, 1e3), st.just(np.inf)), max_size=30), st.integers(1, 20))
def test_what_begins_with_nothing_takes_no_other_ones_place(gains: list[float], most: int) -> None:
    looked = worth_a_look(dict(enumerate(gains)), most)
    known = sorted((gain for gain in gains if np.isfinite(gain)), reverse=True)
    assert looked == sorted(looked)
    assert sorted((gains[k] for k in looked if np.isfinite(gains[k])), reverse=True) == known[:most]
    assert sum(not np.isfinite(gains[k]) for k in looked) == gains.count(np.inf)
