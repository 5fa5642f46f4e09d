"""Two causes that hide each other: the filter by another formula than the effect's."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.fit.candidates import candidates, setting_of
from depthsim.gap.depth.fit.chain import Chain
from depthsim.gap.depth.fit.hiding import beneath_a_filter
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.validate import Validator
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.png import encode_png
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import effect_class
from depthsim.trajectory import load_trajectory

FRAMES = 12


def smoothed(picture: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Each pixel the mean of those beside it that are no farther from it than 20 %, twice."""
    z = np.where(picture > 0, picture.astype(float), np.nan)
    for _ in range(2):
        around = np.stack([np.roll(z, (dv, du), (0, 1)) for dv in (-1, 0, 1) for du in (-1, 0, 1)])
        near = np.abs(around - z) < 0.2 * z
        z = np.where(np.isnan(z), np.nan, np.where(near, around, 0).sum(axis=0) / np.maximum(near.sum(axis=0), 1))
    return np.asarray(np.nan_to_num(np.round(z)).astype(np.uint16))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("office")


@pytest.mark.parametrize(("filtered", "scaled"), [(True, False), (False, False), (True, True)])
def test_a_noise_is_found_beneath_a_filter(filtered: bool, scaled: bool, scene: Scene, tmp_path: Path) -> None:
    """More noise to the corners, where a filter takes away as much in the middle; also beside a scale that is known."""
    camera, paper = preset("d435", 106, 60), load_profile("paper")
    corners = effect_class("vignetting_noise")(gain=2.0)
    biases = (effect_class("baseline_scale")(scale=1.008),) if scaled else ()
    sensor = paper.model_copy(update={"effects": (*paper.effects, *biases, corners)})
    path = load_trajectory("tour", scene, camera.rate, FRAMES)
    generate(scene, path, camera, sensor, tmp_path / "run", streams=("depth",), seed=3, threads=1)
    run = Run.open(tmp_path / "run")
    for index, file in enumerate(run.files if filtered else ()):
        file.write_bytes(encode_png(smoothed(run.depth_raw(index))))
    evidence, _ = load_evidence(run, scene, "paper", threads=1)
    validator = Validator(evidence, evidence.held_out)
    asked = {"spatial_filter", "temporal_filter", "vignetting_noise", "incidence_noise", "fill_rate",
             "baseline_scale"}  # fmt: skip
    bank = [one for one in candidates(evidence.base, setting_of(evidence)) if one.effect in asked]
    search = Search(evidence, validator, bank, evidence.base, lambda _: None)
    chain = Chain(search.config.select, validator.score(evidence.base), search.before)
    if scaled:
        assert beneath_a_filter(search, chain) is None  # biases make neighbours go together
        scale = next(one for one in bank if one.effect == "baseline_scale")
        chain.model = search.fit(search.begin(scale, evidence.base), 4)
        chain.score = validator.score(chain.model.build(evidence.base))
        chain.gap = search.validated(chain.model).gap
    found = beneath_a_filter(search, chain)
    if not filtered:  # nothing goes together that a filter would have to be there for
        assert found is None
        return
    assert found is not None
    assert [part.effect for part in found.model.parts][-2:] == ["spatial_filter", "vignetting_noise"]
    assert chain.gap - found.gap > 0.7 * chain.score.above
