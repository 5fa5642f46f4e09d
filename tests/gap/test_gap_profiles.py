"""Recordings of every shipped profile diagnosed against every shipped profile, and what holds of any two."""

from functools import cache
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from depthsim.errors import InputError
from depthsim.gap import Diagnosis, diagnose
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import effect_ids
from depthsim.sensor.profile import profile_names
from depthsim.trajectory import load_trajectory

STEREO = tuple(name for name in profile_names() if load_profile(name).stereo is not None)
EFFECTS = tuple(name for name in profile_names() if name not in STEREO)
STEPS = "effects: [disparity_quantization, invalid_band]"
"""Nothing of it is random, and it is not clean."""
BANK = ("material_noise", "disparity_noise", "fill_rate")
OTHERS = tuple(name for name in effect_ids() if name not in BANK)
ALIKE = {"d415", "d435", "d455"}
"""The same chip: in so few pixels they are indistinguishable."""
OFFICE = load_scene("office")

_KEPT = TemporaryDirectory(prefix="depthsim_profiles_")


@cache
def recorded(name: str) -> Run:
    """Four small frames in the office, with the seed that fits once had as their own."""
    camera, folder = preset("d435", 80, 46).model_copy(update={"rate": 1.0}), Path(_KEPT.name) / name
    path = load_trajectory("tour", OFFICE, camera.rate, 4)
    generate(OFFICE, path, camera, load_profile(name), folder, streams=("depth",), seed=1, threads=1)
    return Run.open(folder)


@pytest.fixture(scope="module")
def steps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("profile") / "steps.yaml"
    file.write_text(STEPS)
    return file


def holds(found: Diagnosis) -> None:
    """What is reported adds up."""
    gap = found.gap
    closed = [cause.closed_fraction for cause in found.causes]
    assert sum(closed) == pytest.approx(gap.closed_fraction, abs=1e-9)
    assert gap.before >= 0 and gap.floor >= 0 and gap.closed_fraction <= 1.05
    if found.causes:
        assert gap.closed_fraction == pytest.approx((gap.before - gap.after) / (gap.before - gap.floor), abs=1e-9)
    for cause in found.causes:
        assert cause.ci95_closed[0] < cause.closed_fraction < cause.ci95_closed[1]


@pytest.mark.parametrize(("real", "sensor"), list(product(profile_names(), EFFECTS)))
def test_every_profile_against_every_profile(real: str, sensor: str) -> None:
    found = diagnose(recorded(real), scene=OFFICE, sensor=sensor, without=OTHERS, threads=1)
    holds(found)
    if real == sensor:
        assert found.verdict == "no_gap"
    elif not {real, sensor} <= ALIKE:
        assert found.verdict != "no_gap" and found.gap.before > found.gap.floor


@pytest.mark.parametrize("real", profile_names())
def test_every_profile_against_a_sensor_without_chance(real: str, steps: Path) -> None:
    found = diagnose(recorded(real), scene=OFFICE, sensor=steps, without=OTHERS, threads=1)
    holds(found)
    assert found.verdict != "no_gap" and found.gap.before > 0


@pytest.mark.parametrize("sensor", STEREO)
def test_active_stereo_has_no_effects_to_fit(sensor: str) -> None:
    with pytest.raises(InputError, match="active stereo, which has no effects to fit"):
        diagnose(recorded("paper"), sensor=sensor)
