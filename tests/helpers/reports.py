"""A small recording whose simulator lacks one effect, and its diagnosis with a bank of three, for tests of reports."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from depthsim.gap import Findings, investigate
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import effect_ids
from depthsim.trajectory import load_trajectory

BANK = ("incidence_noise", "disparity_noise", "vignetting_noise")
OTHERS = tuple(name for name in effect_ids() if name not in BANK)
"""What is left out of the bank, so that a diagnosis takes a second."""
LACKED = "effects: [material_noise, fill_rate, {incidence_noise: {sigma: 0.05}}]"
PAPER = "effects: [material_noise, fill_rate]"

_KEPT: list[TemporaryDirectory[str]] = []
"""The folders of the runs, which go when the tests end."""


@cache
def recorded(effects: str, seed: int = 1, rate: float = 1.0, width: int = 106) -> Path:
    """The folder of a run of 8 frames."""
    kept = TemporaryDirectory(prefix="depthsim_report_")
    _KEPT.append(kept)
    folder = Path(kept.name)
    (folder / "truth.yaml").write_text(effects)
    scene, camera = load_scene("office"), preset("d435", width, 60 * width // 106).model_copy(update={"rate": rate})
    path = load_trajectory("tour", scene, rate, 8)
    profile = load_profile(folder / "truth.yaml")
    generate(scene, path, camera, profile, folder / "run", streams=("depth",), seed=seed, threads=1)
    return folder / "run"


@cache
def found(effects: str = LACKED, without: tuple[str, ...] = OTHERS) -> Findings:
    """What was found in such a run, against the paper's sensor."""
    return investigate(recorded(effects), sensor="paper", without=without, threads=1)
