"""Against a simulator without noise causes are looked for beside a law of it, which the recording's pixels show."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from changed import diagnosed
from numpy.typing import NDArray

from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.data.noise_scale import nearby
from depthsim.gap.depth.fit.basic_noise import basic_noise
from depthsim.materials import load_materials
from depthsim.presets import preset
from depthsim.raycast import Geometry
from depthsim.runs.generate import generate
from depthsim.sensor.effect import Effect
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.lens import LensDistortion
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.effects.noise import DisparityNoise, IncidenceNoise, VignettingNoise
from depthsim.sensor.effects.shadow import InvalidBand
from depthsim.sensor.effects.subpixel import DisparityQuantization

M = {"cement": 0.45, "formboard": 0.6, "plastic": 0.95}
RECORDED: dict[str, list[Effect]] = {
    "of the disparity": [DisparityNoise(sigma=0.08)],
    "by materials, and a lens": [MaterialNoise(m=M), LensDistortion(k1=0.01)],
    "biases and holes": [LensDistortion(k1=0.01), FillRate(rate=0.05)],
    "by materials, and a band": [MaterialNoise(m=M), InvalidBand(margin=3)],
    "in steps": [DisparityNoise(sigma=0.024), DisparityQuantization(step=1 / 14), FillRate(rate=0.04)],
    "to the corners": [VignettingNoise(corner=0.15), FillRate(rate=0.05)],
    "by incidence": [IncidenceNoise(sigma=0.1)],
}
_KEPT: list[TemporaryDirectory[str]] = []


@cache
def recording(name: str) -> Path:
    """A run of the office by a sensor with those effects."""
    kept = TemporaryDirectory(prefix="depthsim_law_")
    _KEPT.append(kept)
    camera, folder = preset("d435", 160, 90).model_copy(update={"rate": 7.0}), Path(kept.name) / "run"
    generate("office", None, camera, RECORDED[name], folder, frames=16, streams=("depth",), seed=11)
    return folder


def law(run: Path, sensor: str | Sequence[Effect] = "clean", *without: str) -> Effect | None:
    given, _ = load_evidence(run, None, sensor)
    found = basic_noise(given, without)
    return None if found is None else found.build(given.base)[-1]


def test_the_law_of_the_disparity_is_told_from_that_of_materials() -> None:
    """And each takes the other's place, if that is not to be a cause."""
    found = law(recording("of the disparity"))
    assert isinstance(found, DisparityNoise) and found.sigma == pytest.approx(0.08, rel=0.1)
    by_material = recording("by materials, and a lens")
    found = law(by_material)
    assert isinstance(found, MaterialNoise) and found.floor == MaterialNoise().floor and not found.gain
    truth = {tag: M.get(tag, load_materials()[tag].m) for tag in found.m}
    assert found.m == pytest.approx(truth, abs=0.06) and len({*truth.values()}) > 2
    assert isinstance(law(by_material, "clean", MaterialNoise.id), DisparityNoise)
    assert law(by_material, "clean", MaterialNoise.id, DisparityNoise.id) is None


def test_there_is_none_where_the_simulator_has_one_or_the_recording_has_no_noise() -> None:
    assert law(recording("of the disparity"), "paper") is None
    assert law(recording("biases and holes")) is None, "biases are no noise"


def test_biases_that_change_slowly_are_no_part_of_how_errors_differ_nearby() -> None:
    shape = (40, 60)
    rows, columns = np.indices(shape)
    depth = np.full(shape, 2.0, np.float32)
    met = Geometry.empty(shape, right=False)
    met.depth[:], met.tag[:] = depth, (columns >= 30).astype(np.uint8)

    def spread(noise: float, bias: NDArray[np.float64]) -> float:
        drawn = np.random.default_rng(2).normal(0, noise, shape)
        units = np.rint(1000 * (depth + drawn + bias)).astype(np.uint16)
        pairs = nearby([(units, met)], 0.001)
        assert {*pairs.tag.tolist()} == {0, 1} and pairs.differ.shape == pairs.depth.shape == pairs.tag.shape
        assert pairs.differ.size == 40 * 2 * (30 - 4), "pairs of one material"
        return float(pairs.differ.std())

    assert spread(0.02, np.zeros(shape)) == pytest.approx(0.02, rel=0.05)
    assert spread(0.02, 1e-3 * columns + 2e-3 * rows) == pytest.approx(0.02, rel=0.05)


@pytest.mark.parametrize("name", ["by materials, and a band", "in steps", "to the corners", "by incidence"])
def test_causes_are_found_beside_the_law_and_it_is_one_only_where_it_is(name: str) -> None:
    """In units of no noise, noise of one kind was as good as that of another, and much the same on all materials."""
    bank = (
        "ambient_light", "disparity_noise", "disparity_quantization", "fill_rate", "incidence_noise", "invalid_band",
        "lateral_noise", "material_noise", "motion_noise", "vignetting_noise",
    )  # fmt: skip
    found = diagnosed(recording(name), "clean", *bank)
    assert sorted(cause.effect for cause in found.causes) == sorted(one.id for one in RECORDED[name])
    assert found.gap.closed_fraction > 0.95
