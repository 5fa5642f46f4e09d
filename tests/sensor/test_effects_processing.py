"""The driver's spatial filter, and sunlight."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from sensing import CAMERA, LEFT, RIGHT, disparity, measure, z_score
from shapes import MATERIALS, Array, as_scene, look_at, quad, wall

from depthsim.raycast import Caster
from depthsim.sensor import Sensor
from depthsim.sensor.effects.ambient import AmbientLight
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.filter import SpatialFilter
from depthsim.sensor.effects.material_noise import MaterialNoise

NOISE = MaterialNoise(floor=0.003, m={"plastic": 0.0, "cement": 0.8})


def follow(line: Array, alpha: float, delta: float) -> Array:
    """One way along one line, reported step by step."""
    out = line.copy()
    for k in range(1, line.size):
        if line[k] > 0 and line[k - 1] > 0 and abs(line[k] - line[k - 1]) < delta:
            out[k] = alpha * line[k] + (1 - alpha) * out[k - 1]
    return out


def smooth(d: Array, effect: SpatialFilter) -> Array:
    d = d.copy()
    for _ in range(effect.iterations):
        for lines in (d, d.T):
            for line in lines:
                line[:] = follow(line, effect.alpha, effect.delta)
                line[:] = follow(line[::-1], effect.alpha, effect.delta)[::-1]
    return d


@pytest.mark.parametrize("effect", [SpatialFilter(), SpatialFilter(alpha=0.2, delta=0.1, iterations=1)])
def test_the_filter_is_the_recursion_of_the_driver(effect: SpatialFilter) -> None:
    plain = disparity(measure(NOISE, FillRate(rate=0.05)))
    filtered = disparity(measure(NOISE, FillRate(rate=0.05), effect))
    units = np.rint(CAMERA.focal_baseline / np.where(plain > 0, plain, np.inf) / CAMERA.depth_scale)
    stored = np.divide(CAMERA.focal_baseline / CAMERA.depth_scale, units, out=np.zeros_like(plain), where=units > 0)
    expected = smooth(stored, effect)
    # A difference that is delta but for float32's last bit may go either way, and then its neighbours.
    assert (np.abs(filtered - expected) < 1e-4).mean() > 0.999
    assert np.array_equal(filtered == 0, plain == 0)


def test_the_filter_smooths_noise_and_keeps_edges_and_planes() -> None:
    plain, filtered = disparity(measure(NOISE)), disparity(measure(NOISE, SpatialFilter()))
    inside = (slice(10, -10), slice(LEFT + 10, RIGHT - 10))
    assert filtered[inside].std() < 0.5 * plain[inside].std()
    assert abs(filtered[inside].mean() - 10) < 0.01
    assert (filtered[:, LEFT:RIGHT] > 9).all() and (filtered[:, :LEFT] < 5).all() and (filtered[:, RIGHT:] < 5).all()
    still = measure().depth
    assert np.abs(measure(SpatialFilter()).depth - still).max() <= 0.501 * CAMERA.depth_scale  # it begins with units


def test_a_smaller_alpha_smooths_more() -> None:
    spread = [disparity(measure(NOISE, SpatialFilter(alpha=a)))[:, LEFT + 5 : RIGHT - 5].std() for a in (0.9, 0.6, 0.3)]
    assert all(a > b for a, b in itertools.pairwise(spread))


def sunlit(effect: AmbientLight, flip: bool = False, **keys: int) -> tuple[Array, NDArray[np.bool_], Array]:
    """Disparity error, holes and clean disparity of a floor seen from above."""
    floor = quad((-20, -20, 0), (40, 0, 0), (0, 40, 0)) if not flip else quad((-20, -20, 0), (0, 40, 0), (40, 0, 0))
    sensor = Sensor(Caster(as_scene(floor)), CAMERA, [effect], MATERIALS)
    measured = sensor.measure(look_at((0, 0, 1), (0.1, 0, 0)), **keys)
    clean = CAMERA.focal_baseline / measured.clean.depth.astype(float)
    return disparity(measured) - clean, measured.depth == 0, clean


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("elevation", [90.0, 30.0, 5.0])
def test_sun_on_a_floor(elevation: float, flip: bool) -> None:
    effect = AmbientLight(noise=0.3, holes=0.5, elevation=elevation)
    error, lost, _ = sunlit(effect, flip)
    light = np.sin(np.radians(elevation))
    assert abs(z_score(lost.sum(), np.full(lost.size, 0.5 * light))) < 4
    kept = error[~lost]
    assert abs(kept.std() / (0.3 * light) - 1) < 4 / np.sqrt(2 * kept.size) and abs(
        kept.mean()
    ) < 4 * kept.std() / np.sqrt(kept.size)


@pytest.mark.parametrize("elevation", [-5.0, -90.0])
def test_what_turns_away_from_the_sun_keeps_every_bit(elevation: float) -> None:
    error, lost, _ = sunlit(AmbientLight(noise=2, holes=1, elevation=elevation))
    assert not lost.any() and np.abs(error).max() < 1e-4


def test_the_azimuth_tells_which_wall_is_lit() -> None:
    room = as_scene(quad((3, -5, -5), (0, 10, 0), (0, 0, 10)), quad((-3, -5, -5), (0, 10, 0), (0, 0, 10)), wall(9))
    for azimuth, lit in ((180.0, 3), (0.0, -3)):
        sensor = Sensor(Caster(room), CAMERA, [AmbientLight(azimuth=azimuth, elevation=0, holes=1)], MATERIALS)
        for x in (3, -3):
            lost = (sensor.measure(look_at((0, 0, 0), (x, 0, 0))).depth == 0).mean()
            assert lost == (1 if x == lit else 0)


def test_sun_alone_with_noise_or_with_holes() -> None:
    assert AmbientLight(noise=0, holes=0).is_neutral and not AmbientLight(noise=0).is_neutral
    error, lost, _ = sunlit(AmbientLight(noise=0))
    assert lost.any() and np.abs(error[~lost]).max() < 1e-4
    error, lost, _ = sunlit(AmbientLight(holes=0))
    assert not lost.any() and error.std() > 0.05
