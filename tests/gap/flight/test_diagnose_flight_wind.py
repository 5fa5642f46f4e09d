"""Winds that change: one family with the constant wind, named with their mean; and logs of a hover."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import log_of

from benchmarks.withheld_flight import WINDS, the_vehicle
from benchmarks.withheld_flight_data import Noise, Truth, flight
from benchmarks.withheld_flight_data import Path as Flown
from benchmarks.withheld_flight_wind import FORMS, mean_of
from depthsim.flight.fit.motion import motion_of
from depthsim.gap.config import FlightConfig
from depthsim.gap.flight import diagnose_flight
from depthsim.gap.flight.data.evidence import FIT, REPORT, SELECT, make_problem
from depthsim.gap.flight.data.records import prepare
from depthsim.gap.flight.data.settings import base_settings
from depthsim.gap.flight.data.simulate import Model
from depthsim.gap.flight.fit.optimize import _solve

HOVER = Flown("hover", 0.2, 0.3, 2.0, 0.0, turning=False, phase=0.7)
SHUTTLE = Flown("shuttle", 6.0, 12.0, 3.0, 0.5, turning=False, phase=0.7)
CONFIG = FlightConfig()


@pytest.mark.parametrize(("form", "path"), [("sine", HOVER), ("step", SHUTTLE)], ids=["sine", "step"])
def test_a_wind_that_changes_is_named_with_its_mean(form: str, path: Flown) -> None:
    truth = Truth(wind=FORMS[form](np.random.default_rng(5), 8.5))
    cause = diagnose_flight(flight(path, truth, Noise(), 5), the_vehicle(True)).causes[0]
    assert cause.effect in WINDS
    ends = cause.ci95["velocity"]
    assert all(low <= at <= high for (low, high), at in zip(ends, cause.parameters["velocity"], strict=True))
    assert cause.ci95["intensity"][0] < cause.parameters["intensity"] < cause.ci95["intensity"][1]
    assert max(high - low for low, high in ends) < 0.2, "of 8.5 m/s"
    assert ("correlation_time" in cause.parameters) == ("correlation_time" in cause.ci95) == (form == "sine")
    mean = mean_of(truth)
    assert np.linalg.norm(np.array(cause.parameters["velocity"][:2]) - mean) < 0.05 * np.linalg.norm(mean)
    assert cause.closed_fraction > 0.9


def test_without_gusts_in_the_bank_the_constant_wind_is_named_and_the_rest_is_left_in_time() -> None:
    truth = Truth(wind=FORMS["sine"](np.random.default_rng(5), 8.5))
    diagnosis = diagnose_flight(log_of(truth, SHUTTLE, 5), the_vehicle(True), without=["gusting_wind"])
    assert diagnosis.verdict == "partly_explained"
    assert diagnosis.causes[0].effect == "constant_wind"
    assert diagnosis.unexplained is not None
    assert "time" in {cut.axis for cut in diagnosis.unexplained.where[:2]}


def test_a_hover_that_wanders_is_in_the_air_throughout() -> None:
    log = flight(replace(HOVER, size=0.25), Truth(), Noise(), 1)
    assert log.position is not None
    there = np.linalg.norm(log.position - log.position[0], axis=1)
    assert (there > 0.25).any() and (there < 0.25).any()
    motion = motion_of(log)
    assert len(motion) > 0.9 * len(log)
    raised = replace(
        log, position=log.position + np.array([0, 0, 1.0]) * (np.abs(np.arange(len(log)) - 2000) < 900)[:, None]
    )
    assert len(motion_of(raised)) < len(motion), "what stands below is on the ground"


def test_a_fit_stays_within_its_bounds() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        x = rng.normal(size=(40, 4))
        matrix, vector = x.T @ x, x.T @ rng.normal(size=40) * 5
        low, high = np.array([0.0, -0.1, -np.inf, -1.0]), np.array([1.0, 0.1, np.inf, 0.0])
        step = _solve(matrix, vector, (low, high))
        assert (step >= low).all() and (step <= high).all()
        slope = vector - matrix @ step  # of the gain; it may point nowhere but out of the bounds
        inside = (step > low + 1e-6) & (step < high - 1e-6)
        scale = np.abs(vector).max()
        assert np.abs(slope[inside]).max(initial=0.0) < 1e-4 * scale
        assert (slope[step <= low] < 1e-4 * scale).all() and (slope[step >= high] > -1e-4 * scale).all()


def test_of_three_logs_one_is_fitted_one_selected_on_and_one_reported() -> None:
    whole = flight(SHUTTLE, Truth(), Noise(), 2)
    logs = [replace(whole.select(slice(900 * n, 900 * n + 1200)), source=f"log {n}") for n in range(3)]
    vehicle = the_vehicle(True)
    records = prepare(logs, vehicle, CONFIG)
    problem = make_problem(records, Model(vehicle), base_settings(vehicle, [log.duration for log in logs]), CONFIG)
    assert list(dict.fromkeys(problem.roles.tolist())) == [FIT, SELECT, REPORT]
    for role, trains in ((FIT, {FIT}), (SELECT, {FIT}), (REPORT, {FIT, SELECT})):
        for fold in np.unique(problem.folds[problem.roles == role]):
            held = problem.folds == fold
            shared, own = problem.training(fold)
            assert set(problem.roles[shared].tolist()) == trains
            assert set(problem.roles[own].tolist()) == {role}
            assert not (held & (shared | own)).any()
    reported = problem.reported
    assert len(reported.records.parts) == 1 and reported.records.parts[0].file == 2
    assert len(reported.measured) == problem.reported_rows.sum() == reported.counts.sum()
    assert make_problem(prepare(logs[:2], vehicle, CONFIG), Model(vehicle), problem.base, CONFIG).reporting.all()
