"""What is empty at the border of every frame, and what is only too far or too near there."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthsim.gap import diagnose
from depthsim.gap.depth.data.border import find_border
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.diagnosis import Cause
from depthsim.gap.report import words
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import effect_class, effect_ids
from depthsim.trajectory import load_trajectory

HEIGHT, WIDTH = 60, 80
Looked = list[tuple[NDArray, NDArray[np.uint16], NDArray]]


def frames(border: tuple[int, int, int, int], depth: NDArray | float, rows: NDArray | None = None) -> Looked:
    """Three frames with 1 % of holes that are empty at the border. border: left, right, top, bottom."""
    rng, left, right, top, bottom = np.random.default_rng(1), *border
    clean = np.broadcast_to(np.asarray(depth, float), (HEIGHT, WIDTH))
    found = []
    for _ in range(3):
        units = np.where(rng.random((HEIGHT, WIDTH)) < 0.01, 0, 1000).astype(np.uint16)
        units[:top], units[HEIGHT - bottom :], units[:, :left], units[:, WIDTH - right :] = 0, 0, 0, 0
        at = np.arange(HEIGHT) if rows is None else rows
        found.append((at, units[at], clean[at]))
    return found


@given(st.tuples(*[st.integers(2, 8)] * 4))
def test_what_is_empty_in_every_frame_is_counted(border: tuple[int, int, int, int]) -> None:
    assert find_border(frames(border, 2.0), HEIGHT) == border


def test_rows_that_are_not_looked_at_are_as_those_about_them() -> None:
    rows = np.concatenate([np.arange(5), np.arange(12, 60)])
    assert find_border(frames((2, 9, 8, 3), 2.0, rows), HEIGHT) == (2, 9, 5, 3)


@pytest.mark.parametrize(
    ("border", "depth"),
    [
        ((0, 0, 0, 0), 2.0),
        ((9, 0, 0, 0), 2.0),  # as wide as the disparity, and seven pixels
        ((0, 1, 1, 1), 2.0),  # a filter's
        ((0, 9, 0, 0), np.where(np.arange(WIDTH) >= WIDTH - 9, 9.0, 2.0)),  # nothing else is as far away
        ((0, 60, 0, 0), 2.0),
        ((80, 0, 0, 0), 2.0),
    ],
)
def test_no_border_is_made_up(border: tuple[int, int, int, int], depth: NDArray | float) -> None:
    assert find_border(frames(border, depth), HEIGHT) is None


def test_no_frames_have_no_border() -> None:
    assert find_border([], HEIGHT) is None
    nothing_there = [(rows, units, np.zeros_like(depth)) for rows, units, depth in frames((2, 9, 8, 3), 2.0)]
    assert find_border(nothing_there, HEIGHT) is None


def test_a_registered_picture_is_told_from_holes_by_range(tmp_path: Path) -> None:
    scene, camera, paper = load_scene("office"), preset("d435", 106, 60), load_profile("paper")
    border = effect_class("empty_border")(left=0, right=9, top=5, bottom=0)
    generate(
        scene, load_trajectory("tour", scene, camera.rate, 18), camera,
        paper.model_copy(update={"effects": (*paper.effects, border)}),
        tmp_path / "run", streams=("depth",), seed=3, threads=1,
    )  # fmt: skip
    bank = ("empty_border", "max_range", "fill_rate", "invalid_band")
    without = [name for name in effect_ids() if name not in bank]
    found = diagnose(tmp_path / "run", sensor="paper", without=without, threads=1, tasks=False)
    assert [cause.effect for cause in found.causes] == ["empty_border"] and found.verdict == "explained"
    assert {"right": 9, "top": 5}.items() <= found.causes[0].parameters.items()


def test_a_sensor_that_resamples_its_pictures_has_a_border_of_its_own(tmp_path: Path) -> None:
    camera, border = preset("d435", 106, 60), effect_class("empty_border")(left=0, right=9, top=5, bottom=0)
    generate("office", None, camera, (border,), tmp_path / "run", frames=6, streams=("depth",), threads=1)
    assert load_evidence(tmp_path / "run", None, ())[0].border == (0, 9, 5, 0)
    decimated = (effect_class("decimation")(factor=2),)
    generate(
        "office", None, preset("d435", 212, 120), (border, *decimated), tmp_path / "half", frames=6,
        streams=("depth",), threads=1,
    )  # fmt: skip
    assert load_evidence(tmp_path / "half", None, ())[0].border is not None
    assert load_evidence(tmp_path / "half", None, decimated)[0].border is None


@pytest.mark.parametrize(
    ("effect", "told"),
    [("empty_border", ["share", "left", "right", "top", "bottom"]), ("invalid_band", ["margin"])],
)
def test_what_was_counted_is_told_though_it_is_as_usual(effect: str, told: list[str]) -> None:
    """What no fit looked for is not: a band's slope."""
    usual = effect_class(effect)().model_dump()
    cause = Cause(
        effect=effect, parameters=usual, ci95={told[0]: [0.9, 1.0]}, closed_fraction=0.5, ci95_closed=(0.4, 0.6)
    )
    assert [one.name for one in words.parameters(cause)] == told
    if told[0] == "share":
        assert words.parameters(cause)[0].text == "share 100 % (95 %: 90 to 100)"
