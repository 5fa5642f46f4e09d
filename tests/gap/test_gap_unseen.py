"""What a recording cannot show."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.fit.unseen import in_words, unseen
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few small frames on a tour of the office, by the paper's sensor."""
    folder = tmp_path_factory.mktemp("unseen") / "run"
    scene, camera = load_scene("office"), preset("d435", 106, 60).model_copy(update={"rate": 2.0})
    path = load_trajectory("tour", scene, camera.rate, 6)
    generate(scene, path, camera, load_profile("paper"), folder, streams=("depth",), seed=3, threads=1)
    return folder


def test_holes_of_one_material_are_seen_where_there_are_several(run: Path) -> None:
    """By default the effect is for dark materials, and nothing in the office is dark."""
    evidence, _ = load_evidence(run, None, "paper", None, 1, DepthConfig(), (), ())
    assert evidence.cuts.shown_tags.max() > 0
    names = unseen(evidence)
    assert "min_range" in names  # nothing is nearer than 0.28 m
    assert not {"material_dropout", "disparity_noise", "baseline_scale", "heavy_tails"} & set(names)
    one = np.where(np.arange(len(evidence.cuts.shown_tags)) == 0, 0, -1)
    evidence.cuts = replace(evidence.cuts, shown_tags=one)
    assert set(unseen(evidence)) == {*names, "material_dropout"}
    assert "min_range" not in unseen(evidence, without=("min_range",))


def test_what_is_to_be_recorded_is_said_once() -> None:
    said = in_words(("min_range", "max_range", "material_dropout"))
    assert said.startswith("this recording cannot show, at a typical strength: min_range (record ")
    assert said.count("record the same range and angle on several materials") == 1
