"""Figures of real frames: what they are of noise that is known, and a short slice of the page on real frames."""

import sys
from pathlib import Path

import numpy as np
import pytest
from shapes import Array

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks import real_figures as figures
from benchmarks.real_noise import floor_of
from depthsim.draws import Draws
from depthsim.runs import Run
from depthsim.sensor import load_profile
from depthsim.sensor.noise_field import Correlation, noise_field

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
SHAPE = (200, 300)


def surfaces(errors: Array) -> list[figures.Surface]:
    """Frames over a plane at 1 m whose disparities are 20 px and ``errors``, in units of 0.1 mm."""
    clean, whole = np.ones(SHAPE), np.ones(SHAPE, np.bool_)
    units = np.round(1e4 * 20 / (20 + errors)).astype(np.uint16)
    return [figures.Surface(u, e, 20 + e, whole, clean, np.zeros(SHAPE)) for u, e in zip(units, errors, strict=True)]


def correlated(sigma: float, x: float, y: float, frames: int = 6) -> Array:
    fields = [noise_field(Draws(0, "test", k), SHAPE, Correlation(x=x, y=y), 1) for k in range(frames)]
    return sigma * np.stack(fields).astype(np.float64)


def test_noise_that_repeats_and_noise_that_does_not_come_apart() -> None:
    v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
    pattern = 0.1 * np.sqrt(2) * np.sin(u / 7 + v / 11)
    found = figures.noise_figures(surfaces(correlated(0.05, 0, 0, 10) + pattern))
    by_name = {name.split(":")[0]: value for name, value in found.items()}
    # The median of the root of chi² with 9 degrees of freedom, over 9.
    assert by_name["temporal noise"] == pytest.approx(0.05 * np.sqrt(8.343 / 9), rel=0.01)
    assert by_name["fixed pattern"] == pytest.approx(0.1, rel=0.02)
    assert figures.noise_figures(surfaces(correlated(0.05, 0, 0)))["fixed pattern: std of what repeats [px]"] < 0.005


def test_the_correlation_is_that_of_the_noise() -> None:
    frames = surfaces(correlated(0.05, 2, 1))
    for axis, half in ((1, 2.0), (0, 1.0)):
        for lag in (1, 2, 4):
            # The window's mean takes its variance, 1/625 of the sum of the correlation, off at every lag.
            lost = np.pi / np.log(2) * 2 * 1 / 625
            expected = (2.0 ** -((lag / half) ** 2) - lost) / (1 - lost)
            assert figures.correlation(frames, lag, axis) == pytest.approx(expected, abs=0.02)


def test_equal_neighbours_are_counted_among_the_measured() -> None:
    errors = np.zeros((1, *SHAPE))
    errors[0, :, ::2] = 0.5  # every column is unlike the next, and every row like it
    errors[0, :50] = np.nan
    frames = surfaces(np.nan_to_num(errors))
    frames = [figures.Surface(f.units, errors[0], f.disparity, f.mask, f.depth, f.angle) for f in frames]
    assert figures.equal(frames, 1) == 0 and figures.equal(frames, 0) == 100


def real(name: str) -> Run:
    if not (DATA / name).is_dir():
        pytest.skip(f"shared/data/{name} is not beside the repository")
    return Run.open(DATA / name)


def test_d435_is_like_the_real_one_over_a_floor() -> None:
    run, indices = real("d435_floor"), [k for first in range(0, 120, 13) for k in (first, first + 1)]
    frames = figures.surface_frames(run, None, indices)
    made = figures.surface_frames(run, load_profile("d435"), indices)
    noise, other, floor = figures.noise_figures(frames), figures.noise_figures(made), floor_of(frames)
    near = [name for name in noise if abs(other[name] - noise[name]) < 2 * floor[name]]
    assert len(near) >= 10, {name: (noise[name], other[name], floor[name]) for name in set(noise) - set(near)}
    stds = [figures.by_bins(some, (1.0, 1.6, 2.5, 3.2), lambda f: f.depth) for some in (frames, made)]
    assert stds[1] == pytest.approx(stds[0], rel=0.2)


def test_edges_of_d435_are_those_of_the_real_one() -> None:
    pictures = [frame.disparity for frame in figures.surface_frames(real("d435_floor"), None, range(0, 120, 8))]
    recording, made = (figures.edge_figures(some) for some in (pictures, figures.office(load_profile("d435"), 10)))
    for name, most in (("nearer", 0.8), ("farther", 4.0)):
        key = f"jumps to something {name} without a hole [%]"
        assert recording[key] < most and made[key] < most


def test_a_table_by_hand_is_nearer_than_the_law_of_the_paper() -> None:
    run, indices = real("aligned_table"), range(6)
    frames = figures.noise_figures(figures.surface_frames(run, None, indices))
    by_hand = str(ROOT / "benchmarks/aligned_table.yaml")
    made, paper = (
        figures.noise_figures(figures.surface_frames(run, load_profile(p), indices)) for p in (by_hand, "paper")
    )
    off, far = ({n: abs(some[n] - frames[n]) for n in frames} for some in (made, paper))
    assert all(off[name] < 0.5 * far[name] or far[name] < 0.2 for name in frames), (frames, made)
    temporal, *_, pattern = frames
    assert made[temporal] == pytest.approx(frames[temporal], rel=0.15)
    assert made[pattern] == pytest.approx(frames[pattern], rel=0.2)
