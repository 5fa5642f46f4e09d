"""Depths that are the lengths of their rays are told from depth along the axis, and no effect is named for them."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from depthsim.camera import Camera
from depthsim.gap import diagnose
from depthsim.gap.depth.data.ray_length import are_ray_lengths
from depthsim.gap.report.words import STUB, Origin, next_steps
from depthsim.presets import preset
from depthsim.runs.folder import open_run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory

CAMERA = Camera(width=160, height=90, fx=100, fy=100, cx=79.5, cy=44.5, baseline=0.05)
RNG = np.random.default_rng(0)


@pytest.mark.parametrize(
    ("power", "scale", "fx", "lengths"),
    [
        (1.0, 1.0, 100, True),
        (1.0, 1.03, 100, True),  # beside a scale that is wrong
        (0.0, 1.0, 100, False),
        (0.5, 1.0, 100, False),
        (2.0, 1.0, 100, False),
        (-1.0, 1.0, 100, False),
        (1.0, 1.0, 1000, False),  # so narrow that nothing is seen of it
    ],
)
def test_depth_that_grows_as_rays_do(power: float, scale: float, fx: float, lengths: bool) -> None:
    camera = CAMERA.model_copy(update={"fx": fx, "fy": fx})
    x, y = camera.rays
    looked = []
    for _ in range(3):
        clean = RNG.uniform(1, 4, camera.shape).astype(np.float32)
        shown = scale * clean * np.sqrt(1 + x * x + y * y) ** power * (1 + 0.02 * RNG.standard_normal(camera.shape))
        looked.append((np.where(RNG.random(camera.shape) < 0.1, 0, shown).astype(np.float32), clean, camera.rays))
    assert are_ray_lengths(looked) == lengths


def test_nothing_is_said_of_no_depth() -> None:
    none = np.zeros(CAMERA.shape, np.float32)
    assert not are_ray_lengths([(none, none, CAMERA.rays)]) and not are_ray_lengths([])


def test_a_recording_of_lengths_is_said_to_be_one_and_has_no_cause(tmp_path: Path) -> None:
    scene, camera = load_scene("office"), preset("d435", 106, 60)
    run = tmp_path / "run"
    generate(
        scene, load_trajectory("tour", scene, camera.rate, 18), camera, load_profile("paper"), run,
        streams=("depth",), seed=3, threads=1,
    )  # fmt: skip
    assert not diagnose(run, sensor="paper", threads=1, tasks=False).causes
    x, y = open_run(run).camera.rays
    for path in sorted((run / "depth").glob("*.png")):
        units = np.asarray(Image.open(path)).astype(np.float64)
        Image.fromarray(np.rint(units * np.sqrt(1 + x * x + y * y)).astype(np.uint16)).save(path)
    found = diagnose(run, sensor="paper", threads=1, tasks=False, out=tmp_path / "report")
    assert found.verdict == "unexplained" and not found.causes
    assert any("lengths of their rays" in note for note in found.notes)
    # What is to be done is to convert them, and not to write an effect.
    steps = [step.text for step in next_steps(found, Origin("run", "report", "paper"))]
    assert any("in place of the lengths of rays" in text for text in steps)
    assert not any("not in the bank" in text for text in steps)
    assert not (tmp_path / "report" / STUB).exists()
