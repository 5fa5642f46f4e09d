"""Errors that go together with those some way off, and with none between."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from changed import SIGMA, Array, diagnosed, noise, noisy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from depthsim.gap import Diagnosis
from depthsim.gap.config import DepthData
from depthsim.gap.depth.data.frames import pair_frames, select_frames
from depthsim.gap.depth.data.lags import BEFORE, Lags, find_lags
from depthsim.sensor.effects.noise import DisparityNoise


def echo(lag: int, axis: int, white: Array) -> Array:
    """Each with a share of the one so far before it, which has one, too; all of variance 1."""
    out = np.moveaxis(white.copy(), axis, 0)
    for k in range(lag, len(out)):
        out[k] = 0.8 * out[k - lag] + 0.6 * out[k]
    return np.moveaxis(out, 0, axis)


def lags_of(errors: Array, are_whole: bool = True) -> Lags:
    signs = np.sign(errors) * (np.random.default_rng(9).random(errors.shape) < 0.9)
    pictures = list(signs.astype(np.int8))
    in_a_row = [pictures[k - BEFORE : k + 1][::-1] for k in range(BEFORE, len(pictures), 2)]
    return find_lags([pictures[:1], *in_a_row], are_whole, DepthData())


@settings(max_examples=15)
@given(st.integers(2, 12), st.integers(5, 12), st.integers(2, 4), st.integers(0, 2**32 - 1))
def test_an_echo_is_found(left: int, up: int, frames: int, seed: int) -> None:
    usual = Lags()
    assert lags_of(echo(left, 2, noise(seed))) == usual._replace(left=left)
    assert lags_of(echo(up, 1, noise(seed))) == usual._replace(up=up)
    assert lags_of(echo(up, 1, noise(seed)), are_whole=False) == usual
    assert lags_of(echo(frames, 0, noise(seed))) == usual._replace(frames=frames)
    assert lags_of(0.7 * echo(left, 2, noise(seed)) + 3 * np.linspace(-1, 1, 60)[:, None]).left in (left, usual.left)


@pytest.mark.parametrize(
    "errors",
    [
        noise(),
        noise() + 0.5,
        ndimage.gaussian_filter(noise(), (0, 2, 4)),
        ndimage.uniform_filter(noise(), (0, 5, 5)),
        ndimage.gaussian_filter1d(noise(), 2, axis=0),
        echo(1, 0, noise()),
        -noise() * np.cos(np.pi * np.arange(12))[:, None, None] + 0.5 * noise(1)[:1],
        noise() + 0.01 * (np.arange(106) - 53) + 0.5 * (np.arange(60) > 30)[:, None],
        noise() + 2 * np.cos(2 * np.pi * np.arange(106) / 7),
    ],
    ids=["white", "biased", "smooth", "window", "slow", "next", "alternating", "sloped", "waves"],
)
def test_what_goes_together_with_the_next_ones_is_no_echo(errors: Array) -> None:
    assert lags_of(errors) == Lags()


@given(st.integers(2, 200), st.integers(2, 4))
def test_frames_in_pairs(count: int, lag: int) -> None:
    blocks = pair_frames(count, lag)
    assert sorted(np.concatenate(blocks)) == list(range(count))
    assert all(len(block) == 1 or block[1] - block[0] == lag for block in blocks)
    assert sum(len(block) == 1 for block in blocks) < 2 * lag


@given(st.integers(2, 2000), st.integers(1, 4), st.sampled_from([106, 424, 1280]))
def test_blocks_share_no_frame(count: int, lag: int, width: int) -> None:
    blocks = select_frames(count, width, DepthData(), lag)
    frames = np.concatenate(blocks)
    assert len({*frames}) == len(frames) and min(frames) >= 0 and max(frames) < count
    if count > 60:
        assert all(block[1] - block[0] == lag for block in blocks) and len(frames) >= 15
    if count > 300:
        assert max(frames) == count - 1


def test_the_usual_lags_need_no_remark() -> None:
    assert Lags().remark == ""
    assert "3 columns to the left and 2 frames before" in Lags(left=3, frames=2).remark


def found_in(run: Path) -> Diagnosis:
    return diagnosed(run, [DisparityNoise(sigma=SIGMA)], "temporal_correlation", "spatial_correlation", "lateral_noise")


@pytest.mark.parametrize(
    ("make", "axis", "said"),
    [
        (lambda: echo(3, 2, noise()), "pixel_neighbours", "pixels 3 columns apart"),
        (lambda: echo(2, 0, noise()), "frame_neighbours", "frames 2 apart"),
        (lambda: noise(frames=3)[np.arange(60) % 3], "frame_neighbours", "frames 3 apart"),
    ],
    ids=["read-out line", "buffers by turns", "patterns by turns"],
)
def test_an_echo_is_located_and_nothing_named(tmp_path: Path, make: Callable[[], Array], axis: str, said: str) -> None:
    found = found_in(noisy(tmp_path / "run", make()))
    assert (found.verdict, found.causes) == ("unexplained", ())
    assert found.where[0].axis == axis and found.where[0].what == "correlation" and said in found.where[0].text


def test_noise_by_itself_is_no_gap(tmp_path: Path) -> None:
    assert found_in(noisy(tmp_path / "run", noise())).verdict == "no_gap"
