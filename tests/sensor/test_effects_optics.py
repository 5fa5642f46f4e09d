"""Effects that bend rays: a distortion that is left, and jitter."""

from typing import Any

import numpy as np
import pytest
from scipy import stats
from shapes import MATERIALS, Array, as_scene, camera, quad, wall

from depthsim.camera import distort
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.effects.lens import Intrinsics, LateralNoise, LensDistortion
from depthsim.sensor.sensor import Measurement

CAMERA = camera(200, 150, 120)
SLOPE = (0.4, 0.3)
TILTED = Caster(as_scene(quad((-40, -40, 2 - 40 * 0.7), (0, 80, 80 * SLOPE[1]), (80, 0, 80 * SLOPE[0]))))
"""The plane z = 2 + 0.4 x + 0.3 y: its depth along a ray is 2 / (1 - 0.4 x - 0.3 y)."""
SQUARE = Caster(as_scene(wall(3.0)))


def measure(*effects: Effect, caster: Caster = TILTED, **keys: Any) -> Measurement:
    return Sensor(caster, CAMERA, effects, MATERIALS).measure(np.eye(4), **keys)


def plane_depth(x: Array, y: Array) -> Array:
    return 2 / (1 - SLOPE[0] * x - SLOPE[1] * y)


@pytest.mark.parametrize(("k1", "k2"), [(0.002, 0), (-0.1, 0.02), (0.2, -0.05), (0, 0.01), (-0.05, 0)])
def test_rays_are_bent_with_the_radius(k1: float, k2: float) -> None:
    x, y = distort(*CAMERA.rays.astype(np.float64), (k1, k2, 0, 0, 0))
    measured = measure(LensDistortion(k1=k1, k2=k2))
    assert np.abs(measured.depth / plane_depth(x, y) - 1).max() < 1e-5
    # Depth is along the axis: on a wall square to it bent rays make no difference.
    assert np.abs(measure(LensDistortion(k1=k1, k2=k2), caster=SQUARE).depth - 3).max() < 1e-5


@pytest.mark.parametrize(("p1", "p2"), [(0.01, 0), (0, -0.02), (-0.05, 0.05)])
def test_a_decentred_lens_bends_rays_as_opencv_has_it(p1: float, p2: float) -> None:
    x, y = distort(*CAMERA.rays.astype(np.float64), (0.05, -0.01, p1, p2, 0))
    measured = measure(LensDistortion(k1=0.05, k2=-0.01, p1=p1, p2=p2))
    assert np.abs(measured.depth / plane_depth(x, y) - 1).max() < 1e-5
    assert not LensDistortion(k1=0, p1=p1, p2=p2).is_neutral


@pytest.mark.parametrize("off", [{"fx": 1.1}, {"fy": 0.9}, {"cx": 4.0}, {"cy": -7.5}, {}])
def test_rays_go_where_other_intrinsics_put_them(off: dict[str, float]) -> None:
    neutral = {"fx": 1.0, "fy": 1.0, "cx": 0.0, "cy": 0.0}
    effect = Intrinsics(**(neutral | off if off else {}))
    other = CAMERA.model_copy(
        update={
            "fx": CAMERA.fx * effect.fx, "fy": CAMERA.fy * effect.fy,
            "cx": CAMERA.cx + effect.cx, "cy": CAMERA.cy + effect.cy,
        }
    )  # fmt: skip
    measured, there = measure(effect), Sensor(TILTED, other, [], MATERIALS).measure(np.eye(4))
    assert np.abs(measured.depth / there.depth - 1).max() < 1e-5
    assert np.abs(measure(effect, caster=SQUARE).depth - 3).max() < 1e-5


def test_distortion_is_the_same_in_every_frame_and_nothing_in_the_middle() -> None:
    first, second = (measure(LensDistortion(k1=0.1), index=i).depth for i in (0, 9))
    assert first.tobytes() == second.tobytes()
    error = np.abs(first - measure().depth)
    assert error[74:76, 99:101].max() < 1e-5
    assert error[-1, -1] > 0.05


def jitter(sigma: float, index: int = 0, **keys: float) -> tuple[Array, Array]:
    """How far rays were moved along the plane's slope, in pixels and divided by sigma; and the picture of it."""
    z = measure(LateralNoise(sigma=sigma, **keys), index=index).depth.astype(np.float64)
    x, y = CAMERA.rays.astype(np.float64)
    # 2 / z = 1 - a (x + dx / f) - b (y + dy / f): one number per pixel of std sigma · |(a, b)| / f.
    moved = (1 - SLOPE[0] * x - SLOPE[1] * y - 2 / z) * CAMERA.fx / np.hypot(*SLOPE)
    return moved.ravel() / sigma, moved


@pytest.mark.parametrize("sigma", [0.2, 0.8, 5.0])
def test_rays_jitter_sideways(sigma: float) -> None:
    z, _ = jitter(sigma)
    assert stats.kstest(z, "norm").pvalue > 1e-4
    assert abs(z.std() - 1) < 4 / np.sqrt(2 * z.size)


def test_the_jitter_is_drawn_for_every_pixel_and_frame() -> None:
    (a, picture), (b, _) = jitter(0.8), jitter(0.8, index=1)
    assert abs((a * b).mean()) < 4 / np.sqrt(a.size)
    for shifted in (picture[:, 1:] * picture[:, :-1], picture[1:] * picture[:-1]):
        assert abs(shifted.mean()) < 4 * 0.64 / np.sqrt(shifted.size)


@pytest.mark.parametrize("correlation", [0, 4])
def test_x_and_y_jitter_apart(correlation: float) -> None:
    across = Caster(as_scene(quad((-40, -40, 2 - 40 * 0.5), (0, 80, 0), (80, 0, 40))))
    down = Caster(as_scene(quad((-40, -40, 2 - 40 * 0.5), (0, 80, 40), (80, 0, 0))))
    errors = []
    for caster in (across, down):
        errors.append(2 / measure(LateralNoise(correlation=correlation), caster=caster).depth.astype(np.float64))
        errors[-1] -= 2 / measure(caster=caster).depth.astype(np.float64)
    a, b = (e.ravel() / e.std() for e in errors)
    independent = a.size / max(1, 2 * correlation) ** 2
    assert abs((a * b).mean()) < 4 / np.sqrt(independent)
    assert abs(errors[0].std() / errors[1].std() - 1) < 4 / np.sqrt(independent)


@pytest.mark.parametrize("lag", [2, 5])
def test_outlines_wander_smoothly(lag: int) -> None:
    pictures = np.stack([jitter(1.5, index, correlation=lag)[1] / 1.5 for index in range(40)])
    independent = pictures.size / (2 * lag) ** 2
    assert abs(pictures.std() - 1) < 4 / np.sqrt(2 * independent)
    for shifted in (pictures[:, :, lag:] * pictures[:, :, :-lag], pictures[:, lag:] * pictures[:, :-lag]):
        assert abs(shifted.mean() - 0.5) < 4 / np.sqrt(independent)
    assert abs((pictures[1:] * pictures[:-1]).mean()) < 4 / np.sqrt(independent)


def test_jitter_leaves_a_square_wall_as_it_is_and_comes_on_top_of_the_bend() -> None:
    assert np.abs(measure(LateralNoise(sigma=2), caster=SQUARE).depth - 3).max() < 1e-5
    bend, shake = LensDistortion(k1=0.05), LateralNoise(sigma=0.8)
    both, bent = measure(shake, bend), measure(bend)
    moved = (2 / bent.depth.astype(np.float64) - 2 / both.depth) * CAMERA.fx / np.hypot(*SLOPE)
    assert np.abs(moved - jitter(0.8)[1]).max() < 2e-3
