"""How noise is correlated between pixels and frames, whichever effect adds it."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import MATERIALS, Array, as_scene, camera, wall

from depthsim.draws import Draws
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.effects.correlation import SpatialCorrelation, TemporalCorrelation
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.effects.noise import DisparityNoise, IncidenceNoise, MotionNoise, VignettingNoise
from depthsim.sensor.noise_field import Correlation, frame_weights, noise_field, smoothing_weights

SHAPE = (180, 240)
CAMERA = camera(240, 180, 200)
WALL = Caster(as_scene(wall(1.0)))


def fields(correlation: Correlation, frames: int = 30, shape: tuple[int, int] = SHAPE, every: int = 1000) -> Array:
    """(frames, H, W) noise of frames that are far apart, or ``every`` few."""
    made = [noise_field(Draws(1, "test", every * n, 1), shape, correlation, 1) for n in range(frames)]
    return np.stack(made).astype(np.float64)


@pytest.mark.parametrize(("x", "y"), [(8.0, 5.0), (2.0, 0.0), (0.0, 3.0), (1.0, 1.0), (0.7, 0.7), (12.5, 20.0)])
def test_the_correlation_falls_to_a_half_at_the_length(x: float, y: float) -> None:
    noise = fields(Correlation(x=x, y=y))
    for dy, dx in [(0, 1), (1, 0), (0, 4), (3, 0), (2, 2), (0, 8), (5, 0), (0, 16), (15, 15)]:
        found = (noise[:, dy:, dx:] * noise[:, : SHAPE[0] - dy, : SHAPE[1] - dx]).mean(axis=(1, 2))
        law = 2.0 ** -((dx / x) ** 2 if x else 1e3 * dx) * 2.0 ** -((dy / y) ** 2 if y else 1e3 * dy)
        # The weights end at three of their standard deviations.
        assert abs(found.mean() - law) < 4 * found.std() / np.sqrt(len(found)) + 0.003


@pytest.mark.parametrize("half", [0.0, 1e-300, 0.3, 1.0, 8.0, 32.0])
def test_smoothing_keeps_the_variance(half: float) -> None:
    weights = smoothing_weights(half).astype(np.float64)
    assert weights.size % 2 == 1 and np.array_equal(weights, weights[::-1])
    assert abs((weights**2).sum() - 1) < 1e-6


def test_every_pixel_has_unit_variance_the_border_too() -> None:
    noise = fields(Correlation(x=4, y=3, frames=0.5), frames=400, shape=(20, 30))
    variance = (noise**2).mean(axis=0)
    assert abs(noise.mean()) < 0.01
    assert np.abs(variance - 1).max() < 5 * np.sqrt(2 / 400)
    border = np.concatenate([variance[0], variance[-1], variance[:, 0], variance[:, -1]])
    assert abs(border.mean() - variance[5:-5, 5:-5].mean()) < 0.05
    kurtosis = (noise**4).mean() / (noise**2).mean() ** 2
    assert abs(kurtosis - 3) < 0.1


@settings(max_examples=30)
@given(st.floats(0, 0.99), st.integers(0, 2**31))
def test_frames_are_correlated_as_an_ar1_process(correlation: float, start: int) -> None:
    """Exactly, from the weights: the covariance of two frames is the product of what they have in common."""
    count = 40
    made = [dict(zip(*frame_weights(start + n, correlation), strict=True)) for n in range(count)]
    for a in range(count):
        for b in range(a, count):
            found = sum(float(w) * float(made[b].get(k, 0)) for k, w in made[a].items())
            assert abs(found - correlation ** (b - a)) < (1e-6 if a == b else 0.0101)


@pytest.mark.parametrize(("correlation", "most"), [(0.0, 1), (0.2, 4), (0.7, 6), (0.95, 9), (0.99, 11)])
def test_few_pictures_are_drawn_for_a_frame(correlation: float, most: int) -> None:
    assert max(len(frame_weights(n, correlation)[0]) for n in range(600)) == most


def test_the_last_frame_that_a_counter_can_number() -> None:
    numbers, weights = frame_weights(2**32 - 1, 0.9)
    assert numbers.dtype == np.uint32 and abs((weights.astype(float) ** 2).sum() - 1) < 1e-6


@pytest.mark.parametrize("correlation", [0.2, 0.8])
def test_the_noise_of_frames_is_correlated(correlation: float) -> None:
    noise = fields(Correlation(frames=correlation), frames=12, shape=(60, 80), every=1)
    for lag in (1, 2, 5):
        found = (noise[lag:] * noise[:-lag]).mean()
        assert abs(found - correlation**lag) < 0.025
    # Not between pixels.
    assert abs((noise[:, :, 1:] * noise[:, :, :-1]).mean()) < 0.025


def test_without_correlation_the_noise_is_that_of_the_draws() -> None:
    plain = Draws(1, "test", 3).normal(SHAPE)
    assert noise_field(Draws(1, "test", 3), SHAPE, Correlation(), 1).tobytes() == plain.tobytes()


def measure(*effects: Effect, **keys: Any) -> Array:
    return Sensor(WALL, CAMERA, effects, MATERIALS).measure(np.eye(4), **keys).depth.astype(np.float64)


@pytest.mark.parametrize(
    "correlations", [[SpatialCorrelation()], [TemporalCorrelation()], [TemporalCorrelation(), SpatialCorrelation()]]
)
def test_neither_threads_nor_earlier_frames_make_a_difference(correlations: list[Effect]) -> None:
    sensor = Sensor(WALL, camera(123, 77, 90), [DisparityNoise(), *correlations], MATERIALS)
    one = sensor.measure(np.eye(4), index=5, threads=1)
    for index in (9, 4, 6):
        sensor.measure(np.eye(4), index=index)
    for threads in (1, 2, 3, 64):
        assert sensor.measure(np.eye(4), index=5, threads=threads).depth.tobytes() == one.depth.tobytes()


NOISES = [MaterialNoise(), DisparityNoise(), IncidenceNoise(sigma=0.5), VignettingNoise()]


@pytest.mark.parametrize("noise", NOISES, ids=[noise.id for noise in NOISES])
def test_every_noise_is_correlated_and_keeps_its_spread(noise: Effect) -> None:
    clean = measure()
    plain, smooth = (
        np.stack([measure(noise, *more, index=1000 * n) - clean for n in range(20)])
        for more in ([], [SpatialCorrelation(x=6, y=4)])
    )
    assert abs(smooth.std() / plain.std() - 1) < 0.06
    for picture, law in ((plain, 0.0), (smooth, 0.5)):
        for a, b in ((picture[:, :, 6:], picture[:, :, :-6]), (picture[:, 4:], picture[:, :-4])):
            assert abs((a * b).mean() / np.sqrt((a**2).mean() * (b**2).mean()) - law) < 0.05


@pytest.mark.parametrize("noise", NOISES, ids=[noise.id for noise in NOISES])
def test_every_noise_is_correlated_between_frames(noise: Effect) -> None:
    clean = measure()
    pictures = [measure(noise, TemporalCorrelation(correlation=0.7), index=n) - clean for n in range(12)]
    for lag in (1, 3):
        found = [np.mean(a * b) / (a.std() * b.std()) for a, b in zip(pictures, pictures[lag:], strict=False)]
        assert abs(np.mean(found) - 0.7**lag) < 0.03


def test_the_law_of_the_material_holds_for_correlated_noise_too() -> None:
    z = np.stack([measure(MaterialNoise(), SpatialCorrelation(x=3, y=3), index=1000 * n) - 1 for n in range(20)]) / (
        0.005 * np.exp(0.35)
    )
    assert abs(z.std() - 1) < 0.02 and abs((z**4).mean() / z.var() ** 2 - 3) < 0.15


def test_correlated_noises_of_material_and_disparity_are_independent() -> None:
    clean, smooth = measure(), SpatialCorrelation(x=2, y=2)
    noises = MaterialNoise(), DisparityNoise()
    pairs = [[measure(noise, smooth, index=1000 * n) - clean for noise in noises] for n in range(30)]
    found = [np.mean(a * b) / (a.std() * b.std()) for a, b in pairs]
    assert abs(np.mean(found)) < 4 * np.std(found) / np.sqrt(len(found))


def test_correlation_alone_changes_nothing() -> None:
    assert np.array_equal(measure(SpatialCorrelation(), TemporalCorrelation(), MotionNoise()), measure())
