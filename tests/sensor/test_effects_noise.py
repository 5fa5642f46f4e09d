"""Effects that add noise: its spread, its shape, and that every effect draws for itself."""

from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation
from shapes import MATERIALS, Array, as_scene, camera, quad, wall

from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.effects.heavy_tails import HeavyTails
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.effects.noise import DisparityNoise, IncidenceNoise, MotionNoise, VignettingNoise
from depthsim.sensor.motion import Motion
from depthsim.sensor.sensor import Measurement
from depthsim.trajectory import Trajectory

CAMERA = camera(240, 180, 200)
FB = CAMERA.focal_baseline  # 10 px m
CASTERS = {distance: Caster(as_scene(wall(distance))) for distance in (0.5, 1.0, 2.0, 3.0)}


def measure(*effects: Effect, caster: Caster = CASTERS[1.0], **keys: Any) -> Measurement:
    return Sensor(caster, CAMERA, effects, MATERIALS).measure(np.eye(4), **keys)


def errors(*effects: Effect, **keys: Any) -> Array:
    """(H, W) error of the disparity [px]."""
    measured = measure(*effects, **keys)
    assert (measured.depth > 0).all()
    return FB / measured.depth.astype(np.float64) - FB / measured.clean.depth.astype(np.float64)


def assert_unit_normal(z: Array) -> None:
    z = z.ravel()
    assert abs(z.mean()) < 4 / np.sqrt(z.size)
    assert abs(z.std() - 1) < 4 / np.sqrt(2 * z.size)
    assert stats.kstest(z, "norm").pvalue > 1e-4


@pytest.mark.parametrize("distance", CASTERS)
@pytest.mark.parametrize("sigma", [0.05, 0.3])
def test_disparity_noise_is_constant_in_disparity(distance: float, sigma: float) -> None:
    measured = measure(DisparityNoise(sigma=sigma), caster=CASTERS[distance])
    assert_unit_normal(errors(DisparityNoise(sigma=sigma), caster=CASTERS[distance]) / sigma)
    if sigma * distance / FB < 0.01:  # far from where the disparity ends, so that depth is nearly linear in it
        assert abs(measured.depth.std() / (sigma * distance**2 / FB) - 1) < 0.02


def test_noise_beyond_infinity_is_a_hole() -> None:
    far = Caster(as_scene(wall(100.0, half=500)))  # 0.1 px
    measured = measure(DisparityNoise(sigma=0.1), caster=far)
    share = stats.norm.cdf(-1)
    assert abs((measured.depth == 0).mean() - share) < 4 * np.sqrt(share / measured.depth.size)


@pytest.mark.parametrize(("degrees", "power"), [(0, 1), (30, 1), (45, 1), (60, 1), (70, 1), (45, 2), (70, 2), (60, 3)])
def test_incidence_noise_grows_with_the_tangent(degrees: float, power: int) -> None:
    tilt = np.tan(np.radians(degrees))
    caster = Caster(as_scene(quad((-20, -60, 1 - 60 * tilt), (0, 120, 120 * tilt), (40, 0, 0))))
    cam = camera(200, 200, 4000, baseline=0.05)  # a narrow view, so that the angle is nearly one
    measured = Sensor(caster, cam, [IncidenceNoise(sigma=0.1, power=power)], MATERIALS).measure(np.eye(4))
    error = cam.focal_baseline / measured.depth.astype(np.float64) - cam.focal_baseline / measured.clean.depth
    cosine = measured.clean.cosine.astype(np.float64)
    std = 0.1 * (np.sqrt(1 - cosine**2) / cosine) ** power
    assert abs(std.mean() - 0.1 * tilt**power) < 0.004 + 0.02 * tilt**power
    if degrees:
        # The smallest errors are as large as float32's steps at 200 px of disparity.
        z = (error / std).ravel()
        assert abs(z.std() - 1) < 4 / np.sqrt(2 * z.size) + 1e-3
        assert stats.kstest(z, "norm").pvalue > 1e-4
    else:
        assert np.abs(error).max() < 0.1 * 0.036 * 5 + 1e-4


def test_incidence_noise_ends_where_surfaces_are_seen_edge_on() -> None:
    caster = Caster(as_scene(quad((-200, 0.02, 0.1), (0, 0, 300), (400, 0, 0))))
    measured = measure(IncidenceNoise(sigma=0.05), caster=caster)
    cosine = measured.clean.cosine
    edge_on = (cosine > 0) & (cosine < 0.09) & (measured.depth > 0)
    assert edge_on.sum() > 1000
    error = FB / measured.depth[edge_on].astype(np.float64) - FB / measured.clean.depth[edge_on]
    assert abs(error.std() / (0.05 * np.sqrt(1 / 0.17**2 - 1)) - 1) < 0.05


def test_vignetting_noise_grows_with_the_square_of_the_radius() -> None:
    z = errors(VignettingNoise(corner=0.2))
    x, y = CAMERA.rays.astype(np.float64)
    std = 0.2 * (x**2 + y**2) / (x[0, 0] ** 2 + y[0, 0] ** 2)
    assert np.abs(z[89:91, 119:121]).max() < 1e-4
    assert_unit_normal((z / std)[std > 1e-3])
    rim = np.concatenate([z[:8, :8].ravel(), z[-8:, -8:].ravel(), z[:8, -8:].ravel(), z[-8:, :8].ravel()])
    assert abs(rim.std() / 0.2 - 0.92) < 0.12


def motion(speed: float, turning: float) -> Motion:
    stamps = np.arange(21) / 20
    turn = Rotation.from_rotvec(np.outer(turning * (stamps - 0.5), [0, 1, 0])).as_quat()
    return Motion.along(Trajectory(stamps, np.outer(speed * (stamps - 0.5), [1.0, 0, 0]), turn))


def image_speed(motion: Motion, distance: float, step: float = 1e-3) -> Array:
    """(height, width) [1/s]: by where the points of a wall are seen a moment before and after."""
    x, y = CAMERA.rays.astype(np.float64)
    before, now, after = motion.at([0.5 - step, 0.5, 0.5 + step])
    world = now @ np.stack([distance * x, distance * y, np.full_like(x, distance), np.ones_like(x)]).reshape(4, -1)
    first, last = ((np.linalg.inv(pose) @ world)[:3] for pose in (before, after))
    return np.hypot(*(last[:2] / last[2] - first[:2] / first[2])).reshape(x.shape) / (2 * step)


@pytest.mark.parametrize(("speed", "turning"), [(1.0, 0.0), (0.0, 1.0), (2.0, 0.5)])
@pytest.mark.parametrize("distance", [1.0, 2.0])
def test_motion_noise_grows_with_the_speed_of_the_image(speed: float, turning: float, distance: float) -> None:
    moving = {"caster": CASTERS[distance], "stamp": 0.5, "motion": motion(speed, turning)}
    assert_unit_normal(errors(MotionNoise(sigma=0.1), **moving) / (0.1 * image_speed(moving["motion"], distance)))


def test_motion_noise_all_over_the_picture_grows_with_the_speed_of_the_camera() -> None:
    moving = {"caster": CASTERS[2.0], "stamp": 0.5, "motion": motion(3.0, 0.5)}
    assert_unit_normal(errors(MotionNoise(sigma=0.1, local=0), **moving) / (0.1 * (0.5 + 3.0 / 2)))


def test_a_camera_that_stands_has_no_motion_noise() -> None:
    assert np.abs(errors(MotionNoise(sigma=5))).max() < 1e-5


NOISES = [DisparityNoise(sigma=0.1), IncidenceNoise(sigma=0.3), VignettingNoise(corner=0.2), MotionNoise(sigma=0.1)]


MOVING: dict[str, Any] = {"stamp": 0.5, "motion": motion(1.0, 0.3)}


def test_noises_add_as_independent_ones_do() -> None:
    """The variance of all is the sum of the variances of each, at every pixel."""
    stds = []
    for noise in NOISES:  # the draws are common, so that the ratio of two errors is that of the deviations
        base, error = errors(DisparityNoise(sigma=0.1), **MOVING), errors(noise, **MOVING)
        stds.append(0.1 * error / np.where(np.abs(base) > 1e-2, base, np.nan))
    together = errors(*NOISES, **MOVING) / np.sqrt(sum(std**2 for std in stds))
    sure = np.isfinite(together)
    assert sure.mean() > 0.9
    assert np.abs(together / errors(DisparityNoise(sigma=0.1), **MOVING) * 0.1 - 1)[sure].max() < 2e-2
    assert_unit_normal(errors(DisparityNoise(sigma=0.3), DisparityNoise(sigma=0.4), **MOVING) / 0.5)


def test_the_material_has_a_noise_of_its_own() -> None:
    material, disparity = MaterialNoise(floor=0.001), DisparityNoise(sigma=0.01)
    a, b = errors(material), errors(disparity)
    assert abs(stats.spearmanr(a, b, axis=None).statistic) < 4 / np.sqrt(a.size)
    assert np.abs(errors(disparity, material) - a - b).max() < 2e-3


@pytest.mark.parametrize("gain", [-0.5, 0.7, 3.0])
def test_one_material_may_have_more_of_the_noise(gain: float) -> None:
    """The same draws, times a factor, in what is stored in units of a millimetre; of other materials as it was."""
    (tag,), material = CASTERS[2.0].scene.tags, MaterialNoise(floor=0.01)
    other = next(one for one in MATERIALS.tags if one != tag)
    plain, more, others = (
        measure(one, caster=CASTERS[2.0]).depth.astype(np.float64) - 2.0
        for one in (
            material,
            MaterialNoise(floor=0.01, gain={tag: gain}),
            MaterialNoise(floor=0.01, gain={other: 1.0}),
        )
    )
    assert np.abs(more - (1 + gain) * plain).max() < 1e-3 * (1 + gain / 2 + 0.6)
    assert np.array_equal(others, plain)


@pytest.mark.parametrize("share", [0.003, 0.2, 1.0])
def test_false_depths_are_a_share_and_lie_anywhere_in_the_search_range(share: float) -> None:
    measured = measure(HeavyTails(share=share, search=64))
    false = FB / measured.depth.astype(np.float64)
    is_false = np.abs(false - 10) > 1e-4
    expected = share * measured.depth.size
    assert abs(is_false.sum() - expected) < 4 * np.sqrt(expected * (1 - share)) + 2
    assert stats.kstest(false[is_false] / 64, "uniform").pvalue > 1e-4


def test_a_hole_stays_a_hole_and_the_rest_stays_true() -> None:
    small = Caster(as_scene(wall(1.0, half=0.2)))
    measured = measure(HeavyTails(share=0.5), DisparityNoise(), caster=small)
    assert not measured.depth[~measured.clean.hit].any()
    calm, noisy = measure(DisparityNoise(), caster=small), measured.clean.hit
    same = measured.depth == calm.depth
    assert abs(same[noisy].mean() - 0.5) < 4 * 0.5 / np.sqrt(noisy.sum())


def test_another_effect_leaves_the_draws_as_they_were() -> None:
    before, after = errors(DisparityNoise(sigma=0.1)), errors(DisparityNoise(sigma=0.1), VignettingNoise(corner=0.1))
    large = np.abs(before) > 1e-2
    ratio = (after / np.where(large, before, 1))[large]
    assert ratio.min() > 0.999 and 1.3 < ratio.max() < np.sqrt(2) + 1e-3
    false, both = errors(HeavyTails(share=0.2)), errors(HeavyTails(share=0.2), DisparityNoise(sigma=0.01))
    assert np.array_equal(false[np.abs(false) > 0.1], both[np.abs(false) > 0.1])
