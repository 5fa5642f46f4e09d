"""Odd logs, and effects by formulas that the bank does not have: named all the same, or refused in one line."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import gap_of, log_of

from benchmarks import withheld_flight_inverse as inverse
from benchmarks.withheld_flight import the_vehicle
from benchmarks.withheld_flight_data import Truth
from depthsim.errors import InputError
from depthsim.flight.log import FlightLog
from depthsim.flight.measurement import Measurement
from depthsim.gap.flight import diagnose_flight, investigate
from depthsim.gap.flight.data.columns import measured_columns


@pytest.fixture(scope="module")
def log() -> FlightLog:
    return log_of(Truth({"quad_all": 0.03}))


def hover(log: FlightLog, mass: float) -> FlightLog:
    rng, n = np.random.default_rng(0), len(log)
    return replace(
        log,
        velocity=0.01 * rng.normal(size=(n, 3)),
        quaternion=np.tile([0.0, 0, 0, 1], (n, 1)),
        rates=0.005 * rng.normal(size=(n, 3)),
        position=np.array([0, 0, 2.0]) + 0.003 * rng.normal(size=(n, 3)),
        rotor_thrusts=mass * 9.80665 / 4 * (1 + 0.005 * rng.normal(size=(n, 4))),
        specific_force=np.array([0, 0, 9.80665]) + 0.1 * rng.normal(size=(n, 3)),
    )


def test_in_a_hover_mass_is_indistinguishable_from_thrust_and_nothing_else_is_tied(log: FlightLog) -> None:
    diagnosis = diagnose_flight(hover(log, 1.3), the_vehicle(True))
    cause = diagnosis.causes[0]
    assert {cause.effect, *cause.indistinguishable_from} == {"mass", "thrust_scale"}
    assert {cut.axis for cut in diagnosis.where} <= {"axis", "thrust", "time"}, "nothing else varies"
    assert diagnose_flight(hover(log, 1.2), the_vehicle(True)).verdict == "no_gap"


@pytest.mark.parametrize(
    ("column", "said"),
    [
        ("velocity", "taken from positions"),
        ("position", "positions that never change"),
        ("rates", "taken from the attitude"),
        ("specific_force", "an accelerometer that never changes"),
        ("rotor_thrusts", "a thrust that never changes"),
    ],
)
def test_columns_that_never_change_were_not_measured(column: str, said: str, log: FlightLog) -> None:
    values = getattr(log, column)
    stuck = replace(log, **{column: np.tile(values[:1], (len(log), 1))})
    measured, notes = measured_columns(stuck)
    assert len(notes) == 1 and said in notes[0]
    now = getattr(measured, column)
    assert now is None or np.ptp(now, axis=0).min() > 0
    assert measured_columns(log) == (log, [])


@pytest.mark.parametrize(
    ("column", "change", "problem"),
    [
        ("quaternion", lambda v: np.tile(v[:1], (len(v), 1)), "the attitude is the same in every row"),
        ("specific_force", lambda v: v * [1, -1, -1], "thrust pushes upwards"),
        ("specific_force", lambda v: v / 9.8, "is 1"),
        ("rotor_thrusts", lambda v: v / 12, "of the weight of withheld"),
        ("velocity", lambda v: np.where(np.arange(len(v))[:, None] == 70, 1e300, v), "no multirotor has"),
        ("rotor_thrusts", lambda v: v * 1e6, "no multirotor has"),
    ],
)
def test_what_cannot_be_is_one_line(column: str, change, problem: str, log: FlightLog) -> None:
    with pytest.raises(InputError, match=problem) as raised:
        diagnose_flight(replace(log, **{column: change(getattr(log, column))}), the_vehicle(True))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("rows", [slice(None, 900), slice(None, None, 4)], ids=["9 s", "25 Hz"])
def test_short_and_slow_logs_are_diagnosed(rows: slice, log: FlightLog) -> None:
    diagnosis = diagnose_flight(log.select(rows), the_vehicle(True))
    assert diagnosis.causes[0].effect == "body_drag_quadratic"


def test_logs_of_two_rates_are_diagnosed_together(log: FlightLog) -> None:
    diagnosis = diagnose_flight([log, log.select(slice(None, None, 3))], the_vehicle(True))
    assert [cause.effect for cause in diagnosis.causes] == ["body_drag_quadratic"]


def foreign(effect: str, variant: int) -> tuple[FlightLog, dict]:
    """A flight of the effect by one of its formulas, and the drag of its vehicle file."""
    drag, force = inverse.BASES[0] if effect != "rotor_drag" else ({"law": "none"}, lambda v, _: 0.0 * v)
    for seed in range(100):
        rng = np.random.default_rng(seed)
        world = inverse.EFFECTS[effect](rng, 1.5)
        if world.variant == variant:
            return inverse.fly(rng, "lemniscate", force, world)[0], drag
    raise AssertionError("no seed has this formula")


@pytest.mark.parametrize(
    ("effect", "variant"),
    [
        ("rotor_drag", 2),  # in proportion to the thrust
        ("body_drag_quadratic", 2),  # with the power 1.8
        ("constant_wind", 1),  # sheared
        ("gusting_wind", 1),  # single gusts
        ("thrust_scale", 1),  # some newtons
        ("thrust_scale", 3),  # fading
        ("imu_bias", 1),  # a ramp
        ("imu_bias", 2),  # a random walk
        ("rotor_thrust_difference", 1),  # two rotors
    ],
)
def test_other_formulas_for_an_effect_have_its_name(effect: str, variant: int) -> None:
    log, drag = foreign(effect, variant)
    log = log.select(slice(None, 3000))
    found = investigate([log], inverse.vehicle(drag))
    diagnosis = found.diagnosis
    cause = diagnosis.causes[0]
    assert effect in (cause.effect, *cause.indistinguishable_from)
    assert len(cause.indistinguishable_from) <= 1
    assert diagnosis.gap.closed_fraction > 0.7
    if effect != "gusting_wind":  # whose file has their statistics, not this flight's gusts
        assert gap_of(log, found.vehicle) < 0.5 * diagnosis.gap.before


def test_a_recorder_that_drifts_and_fades() -> None:
    t = np.arange(3000) * 0.01
    thrusts = 2 + np.sin(t)[:, None] * np.ones((1, 4))
    recorder = Measurement.model_validate({"thrust_offset": 0.3, "thrust_fade": 2e-3, "imu_drift": [0.01, 0, -0.02]})
    logged = recorder.of_thrusts(thrusts, 0.0, 0.01)
    np.testing.assert_allclose(logged * (1 - 2e-3 * t[:, None]) + 0.3, thrusts)
    force = np.zeros((3000, 3))
    np.testing.assert_allclose(recorder.of_force(force, 0.01)[-1], t[-1] * np.array([0.01, 0, -0.02]))
