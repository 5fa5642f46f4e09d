"""The diagnosis of flights, on logs from a simulator that shares nothing with it (benchmarks/withheld_flight_data)."""

import json

import numpy as np
import pytest
from diagnosed import EIGHT, log_of

from benchmarks.withheld_flight import FLIGHTS, the_vehicle
from benchmarks.withheld_flight_data import MASS, Truth
from benchmarks.withheld_flight_data import Path as Flown
from depthsim.errors import InputError
from depthsim.flight.nanobench import read_any
from depthsim.flight.vehicle import Vehicle, load_vehicle
from depthsim.gap.flight import diagnose_flight, investigate
from depthsim.gap.flight.fit.validate import lateral_errors

HOPS = Flown("hops", 3.0, 4.0, 0.15, 0.9, turning=False, phase=1.3)
LEVEL = Flown("lemniscate", 8.0, 18.0, 3.0, 0.0, turning=False, phase=0.7)


def gusts(size: float) -> np.ndarray:
    rng = np.random.default_rng(4)
    t = np.arange(4700) * 0.01
    wind = np.zeros((4700, 3))
    for axis in range(2):
        wind[:, axis] = sum(np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in rng.uniform(0.05, 0.5, 3))
    return size * wind


CAUSES = {
    "rotor_drag": (Truth({"drag_x": 0, "drag_y": 0, "drag_omega": 8e-5}), EIGHT),
    "body_drag_quadratic": (Truth({"quad_x": 0.02, "quad_y": 0.03, "quad_z": 0.05}), EIGHT),
    "constant_wind": (Truth(wind=np.array([[2.0, 1.5, 0.0]] * 2)), EIGHT),
    "gusting_wind": (Truth(wind=gusts(1.2)), EIGHT),
    "thrust_lag": (Truth({"lag": 0.08, "lag_order": 2}, logs_command=True), HOPS),
    "ground_effect": (Truth({"ground_exp": 0.15, "ground_height": 0.25}), HOPS),
    "vertical_damping": (Truth({"climb": 0.5}), EIGHT),
    "imu_bias": (Truth(bias=(0.2, -0.1, 0.1)), EIGHT),
    "imu_misalignment": (Truth(tilt=(0.03, 0.01, 0.02)), HOPS),
    "log_time_offset": (Truth(late={"imu": 0.03}), HOPS),
    "rotor_thrust_difference": (Truth(rotors=(0.9, 1.0, 1.0, 1.0)), EIGHT),
}


PARAMETERS = {
    "constant_wind": {"x": 2.0, "y": 1.5},
    "vertical_damping": {"D_z": 0.5},
    "ground_effect": {"strength": 0.15},
    "log_time_offset": {"seconds": 0.03},
    "rotor_thrust_difference": {"level": 0.973},
}
FIRST = {
    "rotor_drag": "speed",
    "ground_effect": "altitude",
    "gusting_wind": "time",
    "imu_bias": "axis",
    "thrust_lag": "thrust",
}
"""What is learned on it is among the two axes that close most."""
POSITIVE = {"D", "D_x", "D_y", "D_z", "A", "A_xy", "A_z", "c_d1", "strength", "time_constant"}


@pytest.mark.parametrize("name", CAUSES)
def test_a_withheld_effect_is_named_and_closes_the_gap(name: str) -> None:
    truth, path = CAUSES[name]
    diagnosis = diagnose_flight(log_of(truth, path), the_vehicle(name != "rotor_drag"))
    cause, gap = diagnosis.causes[0], diagnosis.gap
    assert cause.effect == name
    assert len(cause.indistinguishable_from) <= 1
    assert gap.closed_fraction > (0.8 if name == "gusting_wind" else 0.9)
    assert gap.ci95[0] <= gap.closed_fraction <= gap.ci95[1]
    assert gap.before > gap.after >= gap.floor > 0
    assert FIRST.get(name, diagnosis.where[0].axis) in {cut.axis for cut in diagnosis.where[:2]}
    for parameter, value in PARAMETERS.get(name, {}).items():
        assert cause.parameters[parameter] == pytest.approx(value, rel=0.1)
        assert cause.ci95[parameter][0] < cause.parameters[parameter] < cause.ci95[parameter][1]
    # Intervals stay within what is physical.
    for one in diagnosis.causes:
        for parameter in POSITIVE & set(one.ci95):
            low, high = one.ci95[parameter]
            assert 0 <= low <= one.parameters[parameter] <= high
        assert 0 <= one.ci95.get("dead_share", (0, 1))[0] <= one.ci95.get("dead_share", (0, 1))[1] <= 1
    if name in ("rotor_drag", "ground_effect", "vertical_damping"):
        assert POSITIVE & set(cause.ci95)


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_no_gap_where_there_is_none(seed: int) -> None:
    path = (EIGHT, HOPS, LEVEL)[seed % 3]
    diagnosis = diagnose_flight(log_of(Truth(), path, seed, accelerometer=0.2), the_vehicle(True))
    assert diagnosis.verdict == "no_gap"
    assert not diagnosis.causes and not diagnosis.where and diagnosis.unexplained is None
    assert diagnosis.gap.closed_fraction == 0
    assert diagnosis.gap.before == pytest.approx(diagnosis.gap.floor, rel=0.15)


@pytest.mark.parametrize(
    ("name", "without", "axes"),
    [
        ("rotor_drag", ["rotor_drag"], {"speed"}),
        ("ground_effect", ["ground_effect"], {"altitude"}),
        ("gusting_wind", ["gusting_wind"], {"time"}),
        ("imu_bias", ["imu_bias"], {"axis"}),
    ],
)
def test_what_the_bank_lacks_is_unexplained_and_not_the_nearest_name(
    name: str, without: list[str], axes: set[str]
) -> None:
    truth, path = CAUSES[name]
    diagnosis = diagnose_flight(log_of(truth, path), the_vehicle(name != "rotor_drag"), without=without)
    assert diagnosis.verdict == ("partly_explained" if name == "imu_bias" else "unexplained")
    assert diagnosis.unexplained is not None
    assert axes & {cut.axis for cut in diagnosis.unexplained.where[:2]}
    assert diagnosis.unexplained.learnable is not None
    assert diagnosis.unexplained.learnable > (0.1 if name == "imu_bias" else 0.5)


def test_in_a_slow_flight_mass_is_indistinguishable_from_thrust_and_advice_says_what_would_help() -> None:
    diagnosis = diagnose_flight(log_of(Truth({"mass": 1.25}), HOPS), the_vehicle(True))
    cause = diagnosis.causes[0]
    assert {cause.effect, *cause.indistinguishable_from} == {"mass", "thrust_scale"}
    assert "Weigh" in cause.advice


def test_two_causes_are_both_named_however_small_one_is() -> None:
    truth = Truth({"quad_all": 0.05}).plus(Truth(bias=(0.06, -0.04, 0.02)))
    diagnosis = diagnose_flight(log_of(truth), the_vehicle(True))
    assert diagnosis.verdict == "explained"
    assert {cause.effect for cause in diagnosis.causes} == {"body_drag_quadratic", "imu_bias"}
    assert sum(cause.closed_fraction for cause in diagnosis.causes) == pytest.approx(
        diagnosis.gap.closed_fraction, abs=1e-3
    )


def test_the_same_seed_gives_the_same_bytes() -> None:
    log = log_of(CAUSES["imu_bias"][0]).select(slice(None, 800))
    one, other = (diagnose_flight(log, the_vehicle(True), seed=3).to_json() for _ in range(2))
    assert one == other
    assert json.loads(one)["version"] == 1


def test_an_effect_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="is no effect of a flight"):
        diagnose_flight(log_of(Truth()), the_vehicle(True), without=["drag"])


def test_a_mass_that_is_wrong_in_the_file_is_mended() -> None:
    flown = investigate([log_of(Truth({"mass": 1.35}), EIGHT)], the_vehicle(True))
    cause = flown.diagnosis.causes[0]
    assert {"mass", "thrust_scale"} & {cause.effect, *cause.indistinguishable_from}
    if cause.effect == "mass":
        assert flown.vehicle.mass == pytest.approx(1.35, rel=0.01)
    assert the_vehicle(True).mass == MASS


def test_real_flights_show_drag_and_the_accelerometers_offset_by_themselves() -> None:
    names = "B2_circle_fast_rep3", "B3_figure8_medium_rep2", "B2_circle_medium_rep2", "B3_figure8_fast_rep2"
    files = [FLIGHTS / f"{name}.csv" for name in names]
    if not all(file.is_file() for file in files):
        pytest.skip(f"the flights of NanoBench are not in {FLIGHTS.parent.name}/{FLIGHTS.name}")
    *train, one, other = map(read_any, files)
    keys = load_vehicle("crazyflie").model_dump() | {"mass": 0.035, "drag": {"law": "none"}}
    flown = investigate(train, Vehicle.model_validate(keys))
    causes = [cause.effect for cause in flown.diagnosis.causes]
    assert causes[0] == "rotor_drag"
    assert {"imu_bias", "imu_misalignment"} & set(causes)
    before, after, _ = lateral_errors(flown, [one, other])
    assert before > 0.15
    assert after < 0.05
