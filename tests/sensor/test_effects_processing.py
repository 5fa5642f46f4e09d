"""The driver's spatial filter, and sunlight."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from sensing import CAMERA, LEFT, RIGHT, disparity, measure, z_score
from shapes import MATERIALS, Array, as_scene, look_at, quad, wall

from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.effects.ambient import AmbientLight
from depthsim.sensor.effects.extrinsics import ExtrinsicRotation
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.filter import SpatialFilter
from depthsim.sensor.effects.lens import LensDistortion
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.effects.rolling_shutter import RollingShutter
from depthsim.sensor.motion import Motion
from depthsim.trajectory import Trajectory

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


@pytest.mark.parametrize("falloff", [0.0, 0.5, 1.0])
def test_the_sun_drowns_a_pattern_the_more_the_farther_and_the_more_at_a_slant_it_is(falloff: float) -> None:
    """Walls square to the camera at 1, 2 and 4 m, and one at 60 degrees; the sun is behind the camera."""
    for pose, square in ((look_at((0, 0, 0), (1, 0, 0)), 1.0), (look_at((0, 0, 0), (0.5, np.sqrt(0.75), 0)), 0.5)):
        for z in (1.0, 2.0, 4.0):
            caster = Caster(as_scene(quad((z * square, -90, -90), (0, 180, 0), (0, 0, 180))))
            effect = AmbientLight(noise=0, holes=0.15, azimuth=180, elevation=0, falloff=falloff)
            measured = Sensor(caster, CAMERA, [effect], MATERIALS).measure(pose)
            seen = measured.clean.depth > 0
            cosine, depth = (x[seen].astype(float) for x in (measured.clean.cosine, measured.clean.depth))
            chance = np.minimum(0.15 * ((depth / 2) ** 2 / np.maximum(cosine, 0.2)) ** falloff, 1)
            assert abs(z_score((measured.depth[seen] == 0).sum(), chance)) < 4
            assert measured.clean.cosine.max() > square - 0.01


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


def test_a_surface_keeps_the_sun_from_what_lies_behind_it() -> None:
    """A plate over a floor, the sun 45 degrees high: its shadow lies as far beside it as it is high."""
    floor, plate = quad((-20, -20, 0), (40, 0, 0), (0, 40, 0)), quad((-0.2, -0.2, 0.5), (0.4, 0, 0), (0, 0.4, 0))
    caster, pose = Caster(as_scene(floor, plate, tags=["formboard"] * 2)), look_at((0.2, 0, 2), (0, 0, 0))
    light = {"noise": 0, "holes": 1, "azimuth": 180.0, "elevation": 45.0}
    shade, half = {}, np.sqrt(0.5)
    for shadows in (0.0, 0.6, 1.0):
        measured = Sensor(caster, CAMERA, [AmbientLight(**light, shadows=shadows)], MATERIALS).measure(pose)
        x, y = CAMERA.rays
        points = np.stack([x, y, np.ones_like(x)], -1) * measured.clean.depth[..., None] @ pose[:3, :3].T + pose[:3, 3]
        dark = (abs(points[..., 0] - 0.5) < 0.19) & (abs(points[..., 1]) < 0.19) & (abs(points[..., 2]) < 0.01)
        lit = (points[..., 0] > 0.72) | (abs(points[..., 1]) > 0.22)
        assert dark.sum() > 200
        assert abs(z_score((measured.depth[lit] == 0).sum(), np.full(lit.sum(), half))) < 4
        shade[shadows] = (measured.depth[dark] == 0).sum()
        assert abs(z_score(shade[shadows], np.full(dark.sum(), half * (1 - shadows)))) < 4 or not shade[shadows]
    assert shade[1.0] == 0 < shade[0.6]


@pytest.mark.parametrize(
    "others", [[LensDistortion(k1=-0.2)], [ExtrinsicRotation(x=2, y=-3)], [RollingShutter(readout=0.1)]]
)
def test_no_surface_is_in_its_own_shadow(others: list[Effect]) -> None:
    """However the rays are bent: points are where these rays met the mesh."""
    light = AmbientLight(noise=0, holes=1, shadows=1, elevation=60)
    floor = quad((-20, -20, 0), (40, 0, 0), (0, 40, 0))
    poses = np.stack([look_at((0.1 * k, 0, 1), (0.1 + 0.3 * k, 0.2 * k, 0)) for k in range(4)])
    turns = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    motion = Motion.along(Trajectory(np.arange(4) / 10, poses[:, :3, 3], turns))
    sensor = Sensor(Caster(as_scene(floor)), CAMERA, [*others, light], MATERIALS)
    measured = sensor.measure(motion.at(0.1)[0], motion=motion, stamp=0.1)
    hit = measured.clean.depth > 0
    assert abs(z_score((measured.depth[hit] == 0).sum(), np.full(hit.sum(), np.sin(np.radians(60))))) < 4


def test_depth_from_elsewhere_has_no_shadows() -> None:
    depth, keys = np.full(CAMERA.shape, 2.0), {"camera": CAMERA, "materials": MATERIALS}
    effects = [AmbientLight(holes=0.5, azimuth=180, elevation=20, shadows=shadows) for shadows in (1.0, 0.0)]
    dark, light = (Sensor(profile=[effect], **keys).apply(depth).depth for effect in effects)
    assert (dark == 0).any() and np.array_equal(dark, light)


def test_sun_alone_with_noise_or_with_holes() -> None:
    assert AmbientLight(noise=0, holes=0).is_neutral and not AmbientLight(noise=0).is_neutral
    error, lost, _ = sunlit(AmbientLight(noise=0))
    assert lost.any() and np.abs(error[~lost]).max() < 1e-4
    error, lost, _ = sunlit(AmbientLight(holes=0))
    assert not lost.any() and error.std() > 0.05
