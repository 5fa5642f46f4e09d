"""The way of a frame through the sensor: disparity, effects, 16 bits; threads, buffers and keys."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import MATERIALS, as_scene, camera, look_at, random_poses, soup, sphere, strips, wall

from depthsim.errors import InputError
from depthsim.materials import Materials
from depthsim.raycast import Caster
from depthsim.sensor import Sensor, Stage, effect_class, effect_ids
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.sensor import Measurement
from depthsim.units import SATURATED, to_depth_raw

PAPER = [MaterialNoise(), FillRate()]


class AsksForTheRight(FillRate):
    """A stand-in for the effects that need to know what the right imager sees."""

    needs_right = True


@pytest.fixture(scope="module")
def caster() -> Caster:
    meshes = [soup(np.random.default_rng(1), 2000), sphere(3), wall(-20)]
    return Caster(as_scene(*meshes, tags=["plastic", "cement", "formboard"]))


POSE = look_at((2.5, 0.5, 1.0), (0, 0, 0))


def assert_same_bytes(a: Measurement, b: Measurement) -> None:
    assert a.depth_raw.tobytes() == b.depth_raw.tobytes()
    assert a.depth.tobytes() == b.depth.tobytes()
    assert a.clean.depth.tobytes() == b.clean.depth.tobytes()


def test_without_effects_depth_is_the_clean_depth(caster: Caster) -> None:
    measured = Sensor(caster, camera(), [], MATERIALS).measure(POSE)
    clean = measured.clean.depth
    assert (clean > 0).mean() > 0.1
    # It once went through disparity and back, and came out a unit off in some pixels of 100,000.
    assert measured.depth.tobytes() == clean.tobytes()
    assert np.array_equal(measured.depth_raw, to_depth_raw(clean, camera()))


@pytest.mark.parametrize("effects", [PAPER, [*PAPER, AsksForTheRight(rate=0.1)], []])
@pytest.mark.parametrize("size", [(203, 149), (5, 3), (1, 1)])
def test_the_number_of_threads_makes_no_difference(caster: Caster, effects: list, size: tuple[int, int]) -> None:
    sensor = Sensor(caster, camera(*size, 150), effects, MATERIALS)
    one = sensor.measure(POSE, threads=1, seed=3, index=4)
    for threads in (2, 3, 4, 64):
        assert_same_bytes(one, sensor.measure(POSE, threads=threads, seed=3, index=4))


def test_written_over_is_as_good_as_new(caster: Caster) -> None:
    sensor = Sensor(caster, camera(61, 47), PAPER, MATERIALS)
    used = sensor.measure(POSE)
    for index, pose in enumerate(random_poses(np.random.default_rng(2), 5, 2)):
        fresh = sensor.measure(pose, index=index)
        used = sensor.measure(pose, index=index, out=used)
        assert_same_bytes(fresh, used)
    with pytest.raises(ValueError, match=r"out has pictures of \(47, 61\), the camera of \(48, 64\)"):
        Sensor(caster, camera(), PAPER, MATERIALS).measure(POSE, out=used)


def test_a_frame_depends_on_its_seed_and_its_number_and_on_nothing_before_it(caster: Caster) -> None:
    sensor = Sensor(caster, camera(), PAPER, MATERIALS)
    first = sensor.measure(POSE, index=7, seed=1)
    for other in ({"index": 8, "seed": 1}, {"index": 7, "seed": 2}):
        assert not np.array_equal(sensor.measure(POSE, **other).depth, first.depth)
    assert_same_bytes(sensor.measure(POSE, index=7, seed=1), first)
    assert_same_bytes(sensor.measure(POSE, index=7, seed=1, stamp=12.5), first)


def test_the_right_imager_is_asked_only_where_an_effect_needs_it(caster: Caster) -> None:
    assert Sensor(caster, camera(), PAPER, MATERIALS).measure(POSE).clean.right_sees is None
    seen = Sensor(caster, camera(), [AsksForTheRight()], MATERIALS).measure(POSE).clean.right_sees
    assert seen is not None and 0 < seen.mean() < 1


def test_effects_act_in_the_order_of_their_stages(caster: Caster) -> None:
    effects = [FillRate(rate=0.1), MaterialNoise(), FillRate(rate=0), FillRate(rate=0.2)]
    assert Sensor(caster, camera(), effects, MATERIALS).effects == [effects[1], effects[0], effects[3]]
    ids = effect_ids()
    stages = [effect_class(effect_id).stage for effect_id in ids]
    assert stages == sorted(stages)
    assert ids.index("material_noise") < ids.index("fill_rate")
    assert Stage.DISPARITY < Stage.NOISE < Stage.HOLES < Stage.PROCESSING
    assert Stage["MISSING"] is Stage.HOLES, "effects of other people's have the former name"
    with pytest.raises(KeyError):
        effect_class("gremlins")


def test_a_tag_that_is_no_material_is_reported() -> None:
    caster = Caster(strips(2.0, camera()))
    few = Materials.model_validate({"cement": {"m": 0.3}, "plastic": {"m": 0.3}})
    with pytest.raises(InputError, match="test: there is no material 'formboard'; the tags are cement, plastic"):
        Sensor(caster, camera(), [], few)
    misspelt = MaterialNoise(m={"cemnt": 0.5})
    with pytest.raises(InputError, match="sensor profile: material_noise: there is no material 'cemnt'; the tags are"):
        Sensor(caster, camera(), [misspelt], MATERIALS)


def units(depth: list[float], scale: float = 0.001) -> list[int]:
    return to_depth_raw(np.array(depth, np.float32), camera(depth_scale=scale)).tolist()


def test_halves_are_rounded_up() -> None:
    # Powers of two, so that the halves are exact.
    assert units([0.0, 0.125, 0.375, 0.625, 1.125, 1.124, 1.126, 16383.375], 0.25) == [0, 1, 2, 3, 5, 4, 5, 65534]
    assert units([0.0004, 0.0006, 1.0004, 1.0006]) == [0, 1, 1000, 1001]


@pytest.mark.parametrize("scale", [0.001, 0.0001, 0.00025, 1e-6, 1.0])
def test_depths_that_do_not_fit_are_saturated_or_holes(scale: float) -> None:
    whole = np.array([1, 2, 1000, 65533, 65534]) * scale
    assert units(list(whole), scale) == [1, 2, 1000, 65533, 65534]
    assert units([65535 * scale, 65536 * scale, 1e6, 1e30, 3e38, np.inf], scale) == [SATURATED] * 6
    assert units([0, -0.0, -1e-9, -scale, -70000 * scale, -1e30, -np.inf, np.nan], scale) == [0] * 8


@settings(max_examples=50)
@given(st.lists(st.floats(0, 70, width=32), min_size=1, max_size=300), st.integers(1, 5))
def test_sixteen_bits_hold_the_depth_to_half_a_unit(depth: list[float], threads: int) -> None:
    exact = np.array(depth, np.float32)
    stored = to_depth_raw(exact, camera(), threads)
    assert np.array_equal(stored == SATURATED, np.floor(exact * np.float32(1000) + np.float32(0.5)) >= SATURATED)
    inside = stored < SATURATED
    assert (np.abs(stored[inside] * 0.001 - exact[inside].astype(np.float64)) <= 0.0005 + 4e-6).all()


def test_a_wall_too_far_for_the_unit_is_saturated_and_no_hole() -> None:
    cam = camera(depth_scale=0.0001)
    measured = Sensor(Caster(as_scene(wall(7.0))), cam, PAPER, MATERIALS).measure(np.eye(4))
    assert set(np.unique(measured.depth_raw)) == {0, SATURATED}
    assert abs((measured.depth_raw == 0).mean() - 0.01) < 0.01


def test_the_geometry_as_it_is_can_be_asked_for_later_and_frames_share_no_memory_with_it(caster: Caster) -> None:
    """With effects that bend rays the nominal geometry is cast when it is asked for, from the pose of that time."""
    effects = [effect_class(name)() for name in ("lateral_noise", "disparity_noise", "edge_fattening")]
    eye, pose = camera(101, 75, 80.0), POSE.copy()
    sensor = Sensor(caster, eye, effects, MATERIALS)
    made = sensor.measure(pose)
    kept = made.depth_raw.copy()
    pose[2, 3] += 0.5
    other = sensor.measure(pose)
    assert made.cast_already is None
    np.testing.assert_array_equal(made.clean.depth, caster.cast(eye, POSE).depth)
    np.testing.assert_array_equal(made.depth_raw, kept)
    assert (other.depth_raw != kept).any()
    again = sensor.measure(POSE, out=made)
    np.testing.assert_array_equal(again.depth_raw, kept)
