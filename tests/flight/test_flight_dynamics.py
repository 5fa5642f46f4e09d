"""The integrator: closed forms, conservation, order, symmetry, and many vehicles at once."""

import numpy as np
import pytest
from flights import drift, random_quaternion, state, vehicle
from scipy.spatial.transform import Rotation

from depthsim.flight.constants import GRAVITY
from depthsim.flight.dynamics import simulate
from depthsim.flight.fleet import make_fleet
from depthsim.flight.ground_effect import ground_factor
from depthsim.flight.paths import Circle, Hover, Lemniscate
from depthsim.flight.reference import make_reference
from depthsim.flight.wind import ConstantWind, Gusts, make_air

NONE = {"law": "none"}
LAWS = [
    NONE,
    {"law": "linear", "D": [0.3, 0.2, 0.1]},
    {"law": "airsim_quadratic", "area": [0.05, 0.06, 0.2]},
    {"law": "rotor_sqrt", "c_d1": 0.05},
    {"law": "rotor_linear_each", "c_d1": 0.05},
    {"law": "rotor_linear_difference", "c_d1": 0.05},
    {"law": "rotor_linear", "c_d1": 0.05},
]
laws = pytest.mark.parametrize("law", LAWS, ids=lambda law: law["law"])


def test_free_fall() -> None:
    motion = drift(vehicle(drag=NONE), state(v=[1, 2, 3]), 0, 5)
    t = motion.t[:, None]
    expected = np.array([1, 2, 3]) * t + [0, 0, -GRAVITY / 2] * t**2
    np.testing.assert_allclose(motion.states[0, :, :3], expected, rtol=1e-10, atol=1e-10)
    assert np.abs(motion.specific_force).max() == 0


def test_terminal_velocity_of_linear_and_quadratic_drag() -> None:
    linear = vehicle(drag={"law": "linear", "D": [0, 0, 2.0]})
    quadratic = vehicle(drag={"law": "airsim_quadratic", "area": [0, 0, 0.5], "coefficient": 1.1})
    fall = [drift(craft, state(), 0, 40, every=40000).states[0, -1, 5] for craft in (linear, quadratic)]
    assert fall[0] == pytest.approx(-linear.weight / 2.0, rel=1e-9)
    assert fall[1] == pytest.approx(-np.sqrt(quadratic.weight / (0.5 * 1.225 * 1.1 * 0.5)), rel=1e-9)


def test_fall_through_linear_drag_follows_the_exponential() -> None:
    craft = vehicle(drag={"law": "linear", "D": [0.5, 0.5, 0.5]})
    motion = drift(craft, state(v=[4, 0, 0]), 0, 3)
    rate = 0.5 / craft.mass
    np.testing.assert_allclose(motion.states[0, :, 3], 4 * np.exp(-rate * motion.t), rtol=1e-9)
    np.testing.assert_allclose(motion.states[0, :, 5], GRAVITY / rate * np.expm1(-rate * motion.t), rtol=1e-9)


@laws
def test_hover_takes_the_weight_and_stays(law: dict) -> None:
    craft = vehicle(drag=law)
    motion = drift(craft, state(thrust=craft.weight / 4), craft.weight / 4, 10)
    assert np.abs(motion.states[0, :, :6]).max() < 1e-9
    np.testing.assert_allclose(motion.specific_force[0], np.tile([0, 0, GRAVITY], (10001, 1)), rtol=1e-10, atol=1e-10)


def test_controlled_hover_settles_to_the_weight() -> None:
    craft = vehicle()
    reference = make_reference(Hover(time=12), craft)
    start = reference.start.copy()
    start[:3] += [0.5, -0.3, 0.2]
    start[6:10] = Rotation.from_euler("xyz", [0.3, -0.2, 0.5]).as_quat()
    motion = simulate(
        make_fleet([craft]), make_air(None), start[None], step=1e-3, steps=12000, references=reference.rows[None]
    )
    assert motion.states[0, -1, 13:].sum() == pytest.approx(craft.weight, rel=1e-6)
    assert np.abs(motion.states[0, -1, :6] - reference.rows[-1, :6]).max() < 1e-6


def test_constant_rate_turn_about_each_principal_axis() -> None:
    for axis in range(3):
        rates = np.zeros(3)
        rates[axis] = 2.5
        motion = drift(vehicle(drag=NONE), state(w=rates), 0, 10)
        turned = Rotation.from_quat(motion.states[0, -1, 6:10])
        off = (turned * Rotation.from_rotvec(rates * 10).inv()).magnitude()
        assert off < 1e-9
        np.testing.assert_allclose(motion.states[0, -1, 10:13], rates, atol=1e-12)


def test_level_turn_has_the_bank_and_thrust_of_the_closed_form() -> None:
    craft = vehicle(drag=NONE)
    path = Circle(radius=8, speed=6, laps=4)
    reference = make_reference(path, craft)
    motion = simulate(
        make_fleet([craft]), make_air(None), reference.start[None], step=1e-3, steps=len(reference.rows) - 1,
        references=reference.rows[None],
    )  # fmt: skip
    middle = len(reference.rows) // 2
    y = motion.states[0, middle]
    centripetal = np.sum(y[3:5] ** 2) / np.hypot(*y[:2])
    assert y[13:].sum() == pytest.approx(craft.mass * np.hypot(GRAVITY, centripetal), rel=1e-6)
    bank = np.arccos(Rotation.from_quat(y[6:10]).as_matrix()[2, 2])
    assert bank == pytest.approx(np.arctan2(centripetal, GRAVITY), rel=1e-6)


def test_motor_lag_is_first_order() -> None:
    motion = drift(vehicle(drag=NONE), state(thrust=1.0), [5, 4, 3, 2], 0.1)
    expected = np.array([5, 4, 3, 2]) + (1 - np.array([5, 4, 3, 2])) * np.exp(-motion.t[:, None] / 0.02)
    np.testing.assert_allclose(motion.states[0, :, 13:], expected, rtol=1e-7)


@laws
def test_order_is_four(law: dict) -> None:
    # No axis changes its direction against the air: |v| v has a kink in its second derivative, where the order falls.
    start = state(v=[9, 8, 12], w=[0.5, -0.6, 0.4], thrust=3.4)

    def end(step: float) -> np.ndarray:
        return drift(vehicle(drag=law), start, [4, 3.6, 3.5, 3.7], 0.4, step, every=round(0.4 / step)).states[0, -1]

    exact = end(1 / 3200)
    errors = [np.abs(end(step) - exact).max() for step in (1 / 50, 1 / 100, 1 / 200)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders.min() > 3.95


@pytest.mark.parametrize("seed", range(3))
def test_angular_momentum_and_energy_are_kept_without_drag(seed: int) -> None:
    rng = np.random.default_rng(seed)
    craft = vehicle(drag=NONE)
    start = state(v=rng.normal(size=3), q=random_quaternion(rng), w=3 * rng.normal(size=3))
    y = drift(craft, start, 0, 5).states[0]
    inertia = np.array(craft.inertia)
    momentum = Rotation.from_quat(y[:, 6:10]).apply(y[:, 10:13] * inertia)
    np.testing.assert_allclose(momentum, np.tile(momentum[0], (len(y), 1)), atol=1e-9)
    energy = (
        0.5 * craft.mass * np.sum(y[:, 3:6] ** 2, axis=1)
        + craft.weight * y[:, 2]
        + 0.5 * np.sum(inertia * y[:, 10:13] ** 2, axis=1)
    )
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9, atol=1e-9)


@laws
def test_drag_only_takes_energy(law: dict) -> None:
    craft = vehicle(drag=law)
    level = craft.weight / 4
    # Weightless in the mean: the thrust stays level with a vehicle that does not turn, so only drag changes the speed.
    y = drift(craft, state(v=[6, -3, 0], thrust=level), level, 5).states[0]
    energy = np.sum(y[:, 3:6] ** 2, axis=1)
    assert (np.diff(energy) <= 1e-12).all()
    assert law is NONE or energy[-1] < 0.9 * energy[0]


def test_quaternion_stays_unit() -> None:
    y = drift(vehicle(), state(w=[8, -6, 5], v=[10, 5, 3]), [4, 3, 5, 2], 3).states[0]
    assert np.abs(np.linalg.norm(y[:, 6:10], axis=1) - 1).max() < 1e-15


@laws
def test_turning_the_world_turns_the_flight(law: dict) -> None:
    """About the vertical all laws, their wind too, know no direction of the world."""
    rng = np.random.default_rng(4)
    turn = Rotation.from_euler("z", 1.1)
    q = random_quaternion(rng)
    start = state(p=[1, 2, 3], v=[4, -2, 1], q=q, w=[0.5, 1, -0.4], thrust=3)
    turned = start.copy()
    turned[:3], turned[3:6] = turn.apply(start[:3]), turn.apply(start[3:6])
    turned[6:10] = (turn * Rotation.from_quat(q)).as_quat()
    wind = np.array([2.0, -1.0, 0.5])
    craft = vehicle(drag=law)
    ends = [
        drift(craft, y, [4, 3.5, 3.6, 3.4], 1, air=make_air(ConstantWind(velocity=tuple(blow)))).states[0, -1]
        for y, blow in ((start, wind), (turned, turn.apply(wind)))
    ]
    np.testing.assert_allclose(ends[1][:3], turn.apply(ends[0][:3]), atol=1e-11)
    np.testing.assert_allclose(ends[1][3:6], turn.apply(ends[0][3:6]), atol=1e-11)
    np.testing.assert_allclose(ends[1][10:], ends[0][10:], atol=1e-11)


@laws
def test_wind_is_only_a_change_of_frame(law: dict) -> None:
    craft, wind = vehicle(drag=law), np.array([3.0, -2.0, 1.0])
    start = state(v=[1, 2, 0], w=[0.2, 0, 1], thrust=3.5)
    blown = start.copy()
    blown[3:6] += wind
    still = drift(craft, start, 3.4, 2).states[0, -1]
    moved = drift(craft, blown, 3.4, 2, air=make_air(ConstantWind(velocity=tuple(wind)))).states[0, -1]
    np.testing.assert_allclose(moved[:3] - 2 * wind, still[:3], atol=1e-10)
    np.testing.assert_allclose(moved[6:], still[6:], atol=1e-10)


def test_ground_effect_lifts_by_the_formula_and_is_bounded() -> None:
    assert ground_factor(1e9, 0.14) == pytest.approx(1)
    assert ground_factor(0.28, 0.14) == pytest.approx(1 / (1 - 1 / 64))
    assert ground_factor(0.07, 0.14) == ground_factor(0.0, 0.14) == ground_factor(-1.0, 0.14) == pytest.approx(4 / 3)
    craft = vehicle(drag=NONE)
    air = make_air(None, ground=1.0)
    motion = drift(craft, state(p=[0, 0, 1.2], thrust=2), 2, 1e-3, air=air)
    expected = 8 / craft.mass * ground_factor(0.2, craft.rotors.radius)
    assert motion.specific_force[0, 0, 2] == pytest.approx(expected, rel=1e-12)


def _batch() -> tuple:
    crafts = [vehicle(), vehicle(mass=1.5), vehicle(drag=LAWS[1]), vehicle(drag=LAWS[2]), vehicle(mass=1.3)]
    path = Lemniscate(size=(10, 6), speed=4)
    reference = make_reference(path, crafts[0])
    starts = np.tile(reference.start, (5, 1))
    starts[:, 1] += 0.1 * np.arange(5)
    wind = Gusts(velocity=(4, 1, 0))
    return crafts, reference, starts, wind


def test_batch_is_its_singles_to_the_bit_on_any_number_of_threads() -> None:
    crafts, reference, starts, wind = _batch()
    keys = {"step": 1e-3, "steps": 3000, "every": 10, "references": reference.rows[None]}
    air = make_air(wind, range(5), duration=3)
    whole = [simulate(make_fleet(crafts), air, starts, threads=threads, **keys) for threads in (1, 2, 4)]
    for other in whole[1:]:
        assert other.states.tobytes() == whole[0].states.tobytes()
        assert other.specific_force.tobytes() == whole[0].specific_force.tobytes()
    for i, craft in enumerate(crafts):
        alone = simulate(make_fleet([craft]), make_air(wind, [i], duration=3), starts[i : i + 1], **keys)
        assert alone.states[0].tobytes() == whole[0].states[i].tobytes()


def test_each_vehicle_follows_its_own_reference() -> None:
    craft = vehicle()
    paths = [Circle(radius=2, speed=1, laps=0.5), Hover(time=4.0, position=(0, 0, 2))]
    references = [make_reference(path, craft) for path in paths]
    rows = np.stack([reference.rows[:3000] for reference in references])
    starts = np.stack([references[1].start, references[0].start, references[1].start])
    motion = simulate(
        make_fleet([craft] * 3), make_air(None, [0] * 3), starts, step=1e-3, steps=2999,
        references=rows, which=np.array([1, 0, 1]),
    )  # fmt: skip
    assert np.abs(motion.states[0, :, :3] - [0, 0, 2]).max() < 1e-9
    assert np.abs(motion.states[1, :, :3] - rows[0, :, :3]).max() < 0.02
    assert motion.states[0].tobytes() == motion.states[2].tobytes()
