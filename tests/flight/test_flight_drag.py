"""The drag laws: their formulas, their common limit, and what √T ≈ kT + b is worth."""

import math

import numpy as np
import pytest
from flights import vehicle
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from depthsim.flight.constants import GRAVITY
from depthsim.flight.drag import LAWS, hover_tangent
from depthsim.flight.vehicle import Vehicle, load_vehicle, vehicle_names

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)
quick = settings(max_examples=40)
C = 0.05


def law(name: str, **keys: object) -> Vehicle:
    areas = {"area": [0.05, 0.06, 0.2]}
    defaults = {"linear": {"D": [0.3, 0.2, 0.1]}, "airsim_quadratic": areas, "body_quadratic": areas, "none": {}}
    defaults["thrust_difference"] = {"c": 0.01}
    return vehicle(drag={"law": name, **defaults.get(name, {"c_d1": C}), **keys})


def force(craft: Vehicle, v: np.ndarray, w: np.ndarray, thrusts: np.ndarray) -> np.ndarray:
    return craft.drag.force(craft, np.atleast_2d(v), np.atleast_2d(w), np.atleast_2d(thrusts))


def draw(rng: np.random.Generator, rows: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return 5 * rng.normal(size=(rows, 3)), 2 * rng.normal(size=(rows, 3)), rng.uniform(1, 8, (rows, 4))


def test_every_law_of_the_issue_is_there() -> None:
    numbers = {name: law.equation for name, law in LAWS.items()}
    assert [numbers[name] for name in ("linear", "rotor_sqrt", "rotor_linear")] == ["5", "6", "13"]
    assert [numbers[name] for name in ("rotor_linear_each", "rotor_linear_difference")] == ["8 to 11", "12"]
    assert set(numbers) >= {"none", "airsim_quadratic"}


@given(seeds)
@quick
def test_laws_are_their_formulas(rng: np.random.Generator) -> None:
    v, w, t = draw(rng)
    total = t.sum(axis=1, keepdims=True)
    flat = np.array([1, 1, 0])
    places = vehicle().rotor_positions
    each = v[:, None] + np.cross(w[:, None], places)
    k, b = hover_tangent(1.4, 4)
    expected = {
        "none": 0 * v,
        "linear": -v * [0.3, 0.2, 0.1],
        "airsim_quadratic": -0.5 * 1.225 * 0.325 * np.abs(v) * v * [0.05, 0.06, 0.2],
        "body_quadratic": -0.5 * 1.225 * np.linalg.norm(v, axis=1, keepdims=True) * v * [0.05, 0.06, 0.2],
        "thrust_difference": -0.01 * np.cross(w, t @ vehicle().rotor_positions) * [1, 1, 0],
        "rotor_sqrt": -C * flat * np.sum(np.sqrt(t)[..., None] * each, axis=1),
        "rotor_linear_each": -C * flat * np.sum((k * t + b / 4)[..., None] * each, axis=1),
        "rotor_linear_difference": -C * flat * ((k * total + b) * v + k * np.cross(w, t @ places)),
        "rotor_linear": -C * flat * (k * total + b) * v,
    }
    for name, wanted in expected.items():
        np.testing.assert_allclose(force(law(name), v, w, t), wanted, rtol=1e-12, atol=1e-12, err_msg=name)


@given(seeds)
@quick
def test_the_sum_of_eq_8_to_11_is_eq_12(rng: np.random.Generator) -> None:
    v, w, t = draw(rng)
    sums = [force(law(name), v, w, t) for name in ("rotor_linear_each", "rotor_linear_difference")]
    np.testing.assert_allclose(*sums, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("name", ["rotor_linear_each", "rotor_linear_difference", "rotor_linear"])
def test_the_rotor_laws_meet_at_hover(name: str) -> None:
    """At hover thrust they are equal, and about it they part with the square of the difference."""
    v, w, hover = np.array([4.0, -3, 2]), np.zeros(3), np.full(4, 1.4 * GRAVITY / 4)

    def gap(share: float) -> float:
        t = hover * (1 + share * np.array([1, 0.4, -0.2, 0.7]))
        return float(np.linalg.norm(force(law(name), v, w, t) - force(law("rotor_sqrt"), v, w, t)))

    assert gap(0) < 1e-14
    assert gap(0.02) / gap(0.01) == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("rotors", [4, 6, 8])
def test_tangent_touches_the_root_at_hover(rotors: int) -> None:
    mass = 1.4
    k, b = hover_tangent(mass, rotors)
    one = mass * GRAVITY / rotors
    assert k * one + b / rotors == pytest.approx(math.sqrt(one), rel=1e-14)
    assert k == pytest.approx(1 / (2 * math.sqrt(one)), rel=1e-14)
    if rotors == 4:
        assert (k, b) == pytest.approx((1 / math.sqrt(mass * GRAVITY), math.sqrt(mass * GRAVITY)))


@given(seeds)
@quick
def test_drag_is_against_the_airspeed_and_turns_with_the_vehicle(rng: np.random.Generator) -> None:
    v, _, t = draw(rng)
    t[:] = t[:, :1]
    quarter = Rotation.from_euler("z", 90, degrees=True)
    for name in LAWS:
        f = force(law(name), v, 0 * v, t)
        assert (np.sum(f * v, axis=1) <= 0).all()
        if name.startswith("rotor"):
            turned = force(law(name), quarter.apply(v), 0 * v, t)
            np.testing.assert_allclose(turned, quarter.apply(f), atol=1e-12)


def test_given_k_and_b_are_taken() -> None:
    craft = law("rotor_linear", k=0.2, b=3.0)
    f = force(craft, np.array([2.0, 0, 0]), np.zeros(3), np.full(4, 5.0))
    assert f[0, 0] == pytest.approx(-(0.2 * 20 + 3) * C * 2)


def test_presets_are_consistent_and_say_their_sources() -> None:
    assert set(vehicle_names()) == {"f450", "hummingbird", "racer250", "crazyflie"}
    for name in vehicle_names():
        craft = load_vehicle(name)
        rotors = craft.rotors
        reported = ", ".join(craft.sources)
        for key in ("mass", "inertia", "arm", "radius", "motor_time_constant", "max_thrust", "torque_ratio", "drag"):
            assert key in reported, (name, key)
        np.testing.assert_allclose(craft.allocation @ craft.mixer, np.eye(4), atol=1e-12)
        if rotors.thrust_coefficient:
            speed = math.sqrt(craft.weight / 4 / rotors.thrust_coefficient)
            assert 30 < speed * rotors.radius < 200  # the tip's [m/s] at hover
        assert 1.5 < 4 * craft.max_thrust / craft.weight < 6


def test_f450_is_the_papers() -> None:
    craft = load_vehicle("f450")
    assert craft.rotors.radius * 2 / 0.0254 == pytest.approx(11, rel=1e-3)
    assert 1.4 <= craft.mass <= 1.5 and craft.rotors.arm == 0.225 and craft.rotors.motor_time_constant == 0.02
    assert craft.rotors.thrust_coefficient == pytest.approx(1.1e-5, rel=0.01)
    assert craft.rotors.thrust_coefficient * craft.rotors.torque_ratio == pytest.approx(1.8e-7, rel=0.02)
