"""Errors that go together, from pixel to pixel and from frame to frame, and frames that are unlike by turns."""

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from changed import FRAMES, Change, diagnosed, recorded
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data import histograms
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit import marks, neighbours
from depthsim.gap.depth.fit.validate import Validator
from depthsim.materials import load_materials
from depthsim.runs import Run
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import effect_class


@given(st.floats(-0.3, 0.9), st.floats(0.3, 3.0), st.integers(0, 2**32 - 1))
def test_correlations_are_measured_whatever_the_spread(correlation: float, spread: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, other = rng.multivariate_normal([0, 0], [[1, correlation], [correlation, 1]], 20_000).T * spread
    errors = np.histogram(one, [-np.inf, *-histograms.MAGNITUDES[::-1], 0, *histograms.MAGNITUDES, np.inf])[0]
    apart = (one - other) / np.sqrt(2)
    differences = np.histogram(apart, [-np.inf, *-histograms.APART[::-1], 0, *histograms.APART, np.inf])[0]
    found = neighbours._of_differences(np.append(differences, np.zeros(4)), errors.astype(float))
    assert found == pytest.approx(correlation, abs=0.15)
    if spread == 1:
        coarse = [np.searchsorted([-1, -0.3, 0.3, 1], x) for x in (one, other)]
        table = np.bincount(coarse[0] * 5 + coarse[1], minlength=28).astype(float)
        assert neighbours._of_table(table) == pytest.approx(correlation, abs=0.1)


def test_frames_that_are_noisier_by_turns_are_told(tmp_path: Path) -> None:
    """As where the projector is on in every other frame."""
    rng = np.random.default_rng(0)

    def change(pictures: list[NDArray[np.uint16]]) -> list[NDArray[np.uint16]]:
        spread = [0.008 * (index % 2) * picture for index, picture in enumerate(pictures)]
        return [
            np.where(picture > 0, np.maximum(rng.normal(picture, noise), 1), 0).astype(np.uint16)
            for picture, noise in zip(pictures, spread, strict=True)
        ]

    found = diagnosed(recorded(tmp_path / "run", change), "paper", "disparity_noise", "motion_noise")
    assert found.verdict == "unexplained", found.causes
    assert ("time", "every other frame: frames 1, 3, 5, ...") in [(cut.axis, cut.label) for cut in found.where]


def test_the_mean_of_three_frames_is_no_filter_of_the_picture(tmp_path: Path) -> None:
    """It takes away as much of the noise, and neighbouring pixels stay independent."""

    def change(pictures: list[NDArray[np.uint16]]) -> list[NDArray[np.uint16]]:
        recent = [pictures[max(index - 2, 0) : index + 1] for index in range(len(pictures))]
        return [np.where(some[-1] > 0, np.mean(some, axis=0), 0).astype(np.uint16) for some in recent]

    run = recorded(tmp_path / "run", change, "d415", still=True)
    found = diagnosed(run, "d415", "spatial_filter")
    assert "spatial_filter" not in [cause.effect for cause in found.causes]


def test_even_and_odd_columns_are_told_from_noise(tmp_path: Path) -> None:
    """They are off to opposite sides, as errors that go together or are each by itself are not."""

    def change(pictures: list[NDArray[np.uint16]]) -> list[NDArray[np.uint16]]:
        side = np.where(np.arange(106) % 2, 20, -20)
        return [np.where(picture > 0, picture + side, 0).astype(np.uint16) for picture in pictures]

    def with_tails(pictures: list[NDArray[np.uint16]]) -> list[NDArray[np.uint16]]:
        rng = np.random.default_rng(0)
        off = [rng.laplace(size=picture.shape) * 40 * (rng.random((1, 106)) < 0.5) for picture in pictures]
        return [
            np.where(one > 0, np.maximum(one + more, 1), 0).astype(np.uint16)
            for one, more in zip(pictures, off, strict=True)
        ]

    def length(name: str, how: Change) -> float | None:
        profile = load_profile("paper").effects
        run = Run.open(recorded(tmp_path / name, how))
        evidence = Evidence(run, load_scene("office"), load_materials(), profile, 1)
        return marks.waves_beside(Validator(evidence, evidence.test), profile)

    assert length("columns", change) == pytest.approx(2, abs=0.1)
    assert length("noise", lambda pictures: pictures) is None and length("tails", with_tails) is None


def test_what_two_ray_casters_differ_by_is_no_gap(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)

    def change(pictures: list[NDArray[np.uint16]]) -> list[NDArray[np.uint16]]:
        return [picture + (rng.random(picture.shape) < 2e-4).astype(np.uint16) for picture in pictures]

    found = diagnosed(recorded(tmp_path / "run", change, "clean"), "clean", "heavy_tails")
    assert found.verdict == "no_gap", found.gap


@pytest.mark.parametrize(
    ("effect", "brought", "apart", "why"),
    [
        ("spatial_filter", -0.1, 1.0, None),
        ("spatial_filter", 0.0, 1.0, "no better"),  # such as one that hardly filters, for what a noise leaves
        ("spatial_filter", -0.001, 1.0, "no better"),
        ("spatial_filter", -0.001, 0.01, None),  # of noise of which neighbours go together by 0.99
        ("spatial_filter", 0.1, 1.0, "where the recording's do not"),
        ("spatial_correlation", 0.0, 1.0, None),  # of errors in steps nobody sees how they go together
        ("spatial_correlation", 0.1, 1.0, "where the recording's do not"),
        ("motion_noise", 0.1, 1.0, None),
    ],
)
def test_a_filter_brings_neighbours_nearer(
    monkeypatch: pytest.MonkeyPatch, effect: str, brought: float, apart: float, why: str | None
) -> None:
    monkeypatch.setattr(neighbours, "brought", lambda *_: brought)
    monkeypatch.setattr(neighbours, "apart", lambda *_: apart)
    validator = cast("Validator", SimpleNamespace(evidence=SimpleNamespace(config=DepthConfig())))
    said = marks.brings_together(validator, effect_class(effect), (), ())
    assert said is None if why is None else why in str(said)


def test_stripes_that_move_are_no_noise(tmp_path: Path) -> None:
    """Such as a second projector's: as large as a noise of the disparity, and of any sign in any pixel over time."""

    def change(pictures: list[NDArray[np.uint16]]) -> list[NDArray[np.uint16]]:
        phase = [2 * np.pi * (np.arange(106) / 11 + 0.37 * index) for index in range(len(pictures))]
        off = (
            0.2 * np.sin(at) * picture.astype(float) ** 2 / 3300 for at, picture in zip(phase, pictures, strict=True)
        )
        return [
            np.where(one > 0, np.maximum(one + more, 1), 0).astype(np.uint16)
            for one, more in zip(pictures, off, strict=True)
        ]

    found = diagnosed(recorded(tmp_path / "run", change), "paper", "disparity_noise", "spatial_correlation")
    assert found.verdict == "unexplained" and not found.causes
    assert any("waves of" in note for note in found.notes), found.notes


def test_a_strong_drift_by_another_law_is_found(tmp_path: Path) -> None:
    """Far from where its fit begins, beside effects that begin nearer."""

    def change(pictures: list[NDArray[np.uint16]]) -> list[NDArray[np.uint16]]:
        drift = -0.05 * np.linspace(0, 1, FRAMES) ** 0.8
        return [(picture * (1 + off)).astype(np.uint16) for picture, off in zip(pictures, drift, strict=True)]

    run = recorded(tmp_path / "run", change)
    found = diagnosed(run, "paper", "thermal_drift", "lens_distortion", "disparity_noise")
    assert [cause.effect for cause in found.causes] == ["thermal_drift"]
