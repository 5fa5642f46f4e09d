"""Waves of errors, and seams between blocks of them, are told from noise of any kind."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import fft, ndimage

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.waves import strongest_seam, strongest_wave
from depthsim.gap.depth.fit import marks
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import effect_class

Array = NDArray[np.float64]
RNG = np.random.default_rng(0)
V, U = np.mgrid[:90, :160]


def waves_of(make: Callable[[int], Array]) -> tuple[float, float]:
    """Of eight frames of errors, with a tenth of holes."""
    frames = (np.sign(make(frame)) * (RNG.random(V.shape) < 0.9) for frame in range(8))
    return strongest_wave(frame.astype(np.int8) for frame in frames)


def noise() -> Array:
    return RNG.standard_normal(V.shape)


NOISES = pytest.mark.parametrize(
    "make",
    [
        lambda _: noise(),
        lambda _: noise() + 0.5,
        lambda _: ndimage.gaussian_filter(noise(), (2, 4)),
        lambda _: ndimage.gaussian_filter(noise(), (2, 4)) + 0.1 * noise(),
        lambda _: ndimage.uniform_filter(noise(), 5) + 0.1 * noise(),
        lambda _: noise() * RNG.exponential(size=(1, 160)) ** 2,
        lambda _: noise() + 0.01 * (U - 80) + 0.5 * (V > 40),
    ],
    ids=["independent", "biased", "smooth", "smooth and rough", "of a window", "tails", "on a slope with a step"],
)


@NOISES
def test_noise_is_no_wave(make: Callable[[int], Array]) -> None:
    assert waves_of(make)[0] < 4


@pytest.mark.parametrize("length", [2, 7.3, 16, 23])
@pytest.mark.parametrize("down", [False, True])
def test_waves_are_found_that_move(length: float, down: bool) -> None:
    """Larger than the noise, at another place in each frame."""
    rise, found = waves_of(lambda k: noise() + 2 * np.cos(2 * np.pi * ((V if down else U) / length + 0.37 * k)))
    assert rise > 10 and found == pytest.approx(length, rel=0.15)


def test_nothing_known_is_no_wave() -> None:
    assert strongest_wave(np.zeros((3, 10, 12), np.int8))[0] == 1
    assert strongest_wave(np.ones((1, 1, 1), np.int8))[0] == 1


@pytest.mark.parametrize(
    ("effect", "rise", "refused"),
    [
        ("motion_noise", 20.0, True), ("spatial_correlation", 20.0, True), ("motion_noise", 5.0, False),
        ("fill_rate", 20.0, False),
    ],
)  # fmt: skip
def test_noise_is_none_for_waves(monkeypatch: pytest.MonkeyPatch, effect: str, rise: float, refused: bool) -> None:
    monkeypatch.setattr(marks, "_held_recorded", lambda validator: marks._Held((rise, 16.0), (0, 4), 0, 0, 0))
    monkeypatch.setattr(marks, "_held_simulated", lambda validator, effects: marks._Held((1.1, 2.0), (0, 4), 0, 0, 0))
    for doubled, aligned in ((None, False), ((2.7, 0.0), False), (None, True)):
        evidence = SimpleNamespace(camera=SimpleNamespace(aligned=aligned), doubled=doubled, config=DepthConfig())
        validator = SimpleNamespace(evidence=evidence, once=lambda work, *sensors: work(None, *sensors))
        said = marks.comes_in_waves(cast("Validator", validator), effect_class(effect), ())
        assert (said is not None) == (refused and doubled is None and not aligned)


def of_a_codec(depth: Array, side: int) -> Array:
    """Blocks of a cosine transform, of which high frequencies are rounded more than low ones."""
    rows, columns = (size // side for size in depth.shape)
    blocks = depth[: rows * side, : columns * side].reshape(rows, side, columns, side).swapaxes(1, 2)
    step = 1 + 8 / side * np.add.outer(np.arange(side), np.arange(side))
    back = (
        fft.idctn(step * np.round(fft.dctn(blocks, axes=(2, 3), norm="ortho") / step), axes=(2, 3), norm="ortho")
        .swapaxes(1, 2)
        .reshape(rows * side, columns * side)
    )
    out = depth.copy()
    out[: rows * side, : columns * side] = back
    return out


def seams_of(make: Callable[[int], Array]) -> tuple[float, int]:
    """As :func:`waves_of`."""
    frames = (np.sign(make(frame)) * (RNG.random(V.shape) < 0.9) for frame in range(8))
    return strongest_seam(frame.astype(np.int8) for frame in frames)


@NOISES
def test_noise_has_no_seams(make: Callable[[int], Array]) -> None:
    assert seams_of(make)[0] < 0.05


@pytest.mark.parametrize("side", [4, 8, 16])
def test_seams_of_a_codec_are_found(side: int) -> None:
    seam, found = seams_of(lambda _: of_a_codec(noise(), side))
    assert seam > 0.2 and found == side


def test_nothing_known_has_no_seams() -> None:
    assert strongest_seam([])[0] == 0
    assert strongest_seam(np.zeros((3, 10, 40), np.int8))[0] == 0
    assert strongest_seam(np.ones((1, 1, 1), np.int8))[0] == 0


@pytest.mark.parametrize(
    ("effect", "seam", "refused"),
    [
        ("material_noise", 0.3, True),
        ("spatial_filter", 0.3, True),
        ("spatial_filter", 0.12, False),
        ("fill_rate", 0.3, False),
    ],
)
def test_a_filter_is_none_for_blocks(monkeypatch: pytest.MonkeyPatch, effect: str, seam: float, refused: bool) -> None:
    monkeypatch.setattr(marks, "_held_recorded", lambda validator: marks._Held((1, 2), (seam, 8), 0, 0, 0))
    monkeypatch.setattr(marks, "_held_simulated", lambda validator, effects: marks._Held((1, 2), (0.05, 5), 0, 0, 0))
    evidence = SimpleNamespace(camera=SimpleNamespace(aligned=False), doubled=None, config=DepthConfig())
    validator = SimpleNamespace(evidence=evidence, once=lambda work, *sensors: work(None, *sensors))
    said = marks.breaks_at_seams(cast("Validator", validator), effect_class(effect), ())
    assert (said == "makes no seams, and the recording's errors break every 8 columns") == refused
    assert (said is None) != refused
