"""Effects on the disparity that are not random: scale, drift, offset, sub-pixel bias and steps."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import MATERIALS, Array, as_scene, camera, quad, wall

from depthsim.raycast import Caster
from depthsim.sensor import Effect, Frame, Sensor
from depthsim.sensor.effects.calibration import BaselineScale, DisparityOffset, ThermalDrift
from depthsim.sensor.effects.noise import DisparityNoise
from depthsim.sensor.effects.subpixel import DisparityQuantization, SubpixelBias
from depthsim.sensor.motion import Motion
from depthsim.sensor.sensor import Measurement
from depthsim.trajectory import Trajectory

CAMERA = camera(300, 100, 200)
FB = CAMERA.focal_baseline  # 10 px m
FLOOR = Caster(as_scene(quad((-60, -60, 3 - 60 * 0.9), (0, 120, 0), (120, 0, 120 * 0.9))))
"""The plane z = 3 + 0.9 x: disparities from about 1 to 6 px."""


def measure(*effects: Effect, caster: Caster = FLOOR, **keys: Any) -> Measurement:
    return Sensor(caster, CAMERA, effects, MATERIALS).measure(np.eye(4), **keys)


def disparities(*effects: Effect, **keys: Any) -> tuple[Array, Array]:
    """True and measured disparity [px]."""
    measured = measure(*effects, **keys)
    assert (measured.depth > 0).all()
    return FB / measured.clean.depth.astype(np.float64), FB / measured.depth.astype(np.float64)


@pytest.mark.parametrize("scale", [0.8, 0.98, 1.02, 1.25])
def test_depth_is_scaled(scale: float) -> None:
    measured = measure(BaselineScale(scale=scale))
    assert np.abs(measured.depth / measured.clean.depth / scale - 1).max() < 1e-6


@pytest.mark.parametrize("offset", [-0.5, 0.1, 3.0])
def test_disparity_is_shifted(offset: float) -> None:
    true, measured = disparities(DisparityOffset(offset=offset))
    assert np.abs(measured - true - offset).max() < 1e-5


def test_an_imager_that_is_turned_shifts_the_sides_more() -> None:
    """Against rays of a camera that is turned about y, whose disparity is reckoned as if it were not."""
    turn = np.radians(0.02)
    true, measured = disparities(DisparityOffset(offset=CAMERA.fx * turn, border=1.0))
    x = (np.arange(CAMERA.width) - CAMERA.cx) / CAMERA.fx
    moved = CAMERA.fx * (np.tan(np.arctan(x) + turn) - x)
    assert np.ptp(moved) > 0.2 * moved.min()
    assert np.abs(measured - true - moved).max() < 1e-3 * moved.max()


def test_what_is_shifted_beyond_infinity_has_no_depth() -> None:
    measured = measure(DisparityOffset(offset=-2.0))
    true = FB / measured.clean.depth.astype(np.float64)
    assert 0.1 < (true < 2).mean() < 0.9
    sure = np.abs(true - 2) > 1e-5
    assert np.array_equal((measured.depth_raw == 0)[sure], (true < 2)[sure])


RUN = Motion.along(Trajectory(np.array([1e9, 1e9 + 300]), np.zeros((2, 3)), np.tile([0.0, 0, 0, 1], (2, 1))))


@pytest.mark.parametrize("drift", [-0.1, -0.007, 0.05])
@pytest.mark.parametrize("time_constant", [0.5, 60.0, 600.0])
def test_depth_drifts_while_the_camera_warms_up(drift: float, time_constant: float) -> None:
    effect, before = ThermalDrift(drift=drift, time_constant=time_constant), 0.0
    for elapsed in (0.0, 1.0, 20.0, 60.0, 300.0):
        measured = measure(effect, stamp=1e9 + elapsed, motion=RUN)
        scale = float((measured.depth / measured.clean.depth.astype(np.float64)).mean())
        assert abs(scale - 1 - drift * (1 - np.exp(-elapsed / time_constant))) < 2e-6
        assert abs(scale - 1) >= before - 1e-6
        before = abs(scale - 1)


def test_a_run_of_one_frame_has_not_drifted() -> None:
    alone = Motion.along(Trajectory(np.array([1e9]), np.zeros((1, 3)), np.array([[0.0, 0, 0, 1]])))
    measured = measure(ThermalDrift(drift=0.1, time_constant=1), stamp=1e9, motion=alone)
    assert np.abs(measured.depth / measured.clean.depth - 1).max() < 1e-6


@pytest.mark.parametrize(("amplitude", "phase"), [(0.01, 0), (0.05, -0.16), (0.1, 0.5), (0.5, 0.25)])
def test_the_bias_is_periodic_in_the_fraction(amplitude: float, phase: float) -> None:
    true, measured = disparities(SubpixelBias(amplitude=amplitude, phase=phase))
    assert np.ptp(true) > 3
    assert np.abs(measured - true + amplitude * np.sin(2 * np.pi * (true - phase))).max() < 2e-5


@pytest.mark.parametrize(("second", "third"), [(-0.13, 0.06), (0.0, 0.17), (0.34, 0.0)])
def test_the_bias_has_harmonics(second: float, third: float) -> None:
    true, measured = disparities(SubpixelBias(amplitude=0.05, phase=0.1, second=second, third=third))
    turns = 2 * np.pi * (true - 0.1)
    bias = 0.05 * (np.sin(turns) + second * np.sin(2 * turns) + third * np.sin(3 * turns))
    assert np.abs(measured - true + bias).max() < 2e-5


def test_a_parabola_through_absolute_differences_is_three_sines() -> None:
    """It finds p / (2(1 - |p|)) for p; one sine alone is off by an eighth of the largest bias."""
    p = np.linspace(-0.5, 0.5, 1001)
    off = np.sign(p) * np.abs(p) / (2 * (1 - np.abs(p))) - p
    x = 2 * np.pi * p
    sines = np.sin(x) - 0.1275 * np.sin(2 * x) + 0.0556 * np.sin(3 * x)
    assert np.abs(off + 0.08736 * sines).max() < 0.05 * np.abs(off).max()


def test_the_bias_draws_disparities_to_its_phase() -> None:
    _, measured = disparities(SubpixelBias(amplitude=0.1, phase=0.2))
    near = np.abs((measured - 0.2 + 0.5) % 1 - 0.5)
    assert (near < 0.1).mean() > 1.5 * (near > 0.4).mean()


@pytest.mark.parametrize("step", [1 / 32, 0.1, 1.0])
def test_disparity_comes_in_steps(step: float) -> None:
    true, measured = disparities(DisparityQuantization(step=step))
    whole = measured / step
    assert np.abs(whole - np.round(whole)).max() < 1e-4
    assert np.abs(measured - true).max() <= step / 2 + 1e-5
    assert len(np.unique(np.round(whole))) == np.ptp(np.round(true / step)) + 1  # and no step is left out


@pytest.mark.parametrize(("origin", "down"), [(0.3, 0.0), (-0.45, 0.0), (0.0, 1.0), (0.25, -1.0), (0.1, 0.5)])
def test_steps_may_begin_elsewhere_and_be_cut_off(origin: float, down: float) -> None:
    step = 0.1
    true, measured = disparities(DisparityQuantization(step=step, origin=origin, down=down))
    whole = measured / step - origin
    assert np.abs(whole - np.round(whole)).max() < 1e-4
    error = (measured - true) / step
    assert -(1 + down) / 2 - 1e-4 <= error.min() < error.max() <= (1 - down) / 2 + 1e-4


def test_what_has_no_depth_gets_none_by_the_steps() -> None:
    half = Caster(as_scene(quad((-60, -60, 4), (0, 120, 0), (60, 0, 0))))
    measured = measure(DisparityQuantization(step=0.5, origin=0.4), caster=half)
    assert np.array_equal(measured.depth_raw > 0, measured.clean.depth > 0)


def test_what_is_nearer_to_no_disparity_than_to_one_step_has_no_depth() -> None:
    far = Caster(as_scene(wall(50.0)))  # 0.2 px
    assert not measure(DisparityQuantization(step=0.5), caster=far).depth_raw.any()
    assert measure(DisparityQuantization(step=0.3), caster=far).depth_raw.all()


def test_steps_are_those_of_the_chip_whatever_else_is_wrong() -> None:
    """Noise, offset and scale come first: what the chip gives is f·b over whole steps, with the f·b it believes in."""
    others = (DisparityNoise(), DisparityOffset(), BaselineScale(), SubpixelBias())
    for effects in ((DisparityQuantization(), *others), (*others, DisparityQuantization())):
        _, measured = disparities(*effects)
        assert np.abs(measured * 32 - np.round(measured * 32)).max() < 1e-3


def test_two_systematic_errors_compose_in_the_physical_order() -> None:
    true, measured = disparities(SubpixelBias(amplitude=0.1), DisparityOffset(offset=0.3), BaselineScale(scale=0.9))
    seen = true / 0.9 + 0.3
    assert np.abs(measured - seen + 0.1 * np.sin(2 * np.pi * seen)).max() < 2e-5


def frame(depth: Array) -> Frame:
    """A frame that has measured ``depth`` of a scene that does not matter."""
    cam = camera(depth.shape[1], depth.shape[0], 200)
    scene = FLOOR.scene
    clean = FLOOR.cast(cam, np.eye(4))
    return Frame(depth.astype(np.float32), clean, cam, scene, MATERIALS, Motion.still(np.eye(4)))


@settings(max_examples=50)
@given(st.lists(st.one_of(st.just(0.0), st.floats(0.0625, 100, width=32)), min_size=1, max_size=50))
def test_disparity_and_depth_are_one_measurement(depth: list[float]) -> None:
    exact = np.array([depth], np.float32)
    made = frame(exact)
    assert made.depth is made.depth
    assert np.allclose(made.disparity[exact > 0], FB / exact[exact > 0], rtol=1e-6)
    assert np.array_equal(made.disparity > 0, exact > 0)
    assert np.allclose(made.depth, exact, rtol=2e-7)
    # A change made in one is seen in the other, and none is lost.
    made.disparity[:] *= 2
    made.depth[:] *= 3
    made.disparity[exact > 5] = 0
    assert np.allclose(made.depth, np.where(exact > 5, 0, 1.5 * exact), rtol=1e-6)
