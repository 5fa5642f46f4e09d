"""Logs as they come: without columns, with gaps and NaN; and the report that is written."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosed import gap_of, log_of
from typer.testing import CliRunner

from benchmarks.withheld_flight import the_vehicle
from benchmarks.withheld_flight_data import Path as Flown
from benchmarks.withheld_flight_data import Truth
from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.flight.flying import fly
from depthsim.flight.log import FlightLog, read_flight, write_flight
from depthsim.flight.pathspec import resolve_path
from depthsim.flight.vehicle import load_vehicle
from depthsim.gap.flight import diagnose_flight, investigate

DRAG = Truth({"quad_all": 0.03})


@pytest.fixture(scope="module")
def log() -> FlightLog:
    return log_of(DRAG)


def test_without_an_accelerometer_the_force_is_from_velocities(log: FlightLog) -> None:
    diagnosis = diagnose_flight(replace(log, specific_force=None), the_vehicle(True))
    assert diagnosis.causes[0].effect == "body_drag_quadratic"
    assert any("no accelerometer" in note for note in diagnosis.notes)


def test_without_thrust_the_lateral_force_is_diagnosed(log: FlightLog) -> None:
    diagnosis = diagnose_flight(replace(log, rotor_thrusts=None), the_vehicle(True))
    assert diagnosis.causes[0].effect == "body_drag_quadratic"
    assert any("only the lateral force" in note for note in diagnosis.notes)


def test_without_single_rotors_and_places(log: FlightLog) -> None:
    assert log.rotor_thrusts is not None
    total = replace(log, thrust=log.rotor_thrusts.sum(axis=1), rotor_thrusts=None, position=None)
    diagnosis = diagnose_flight(total, the_vehicle(True))
    assert diagnosis.causes[0].effect == "body_drag_quadratic"
    assert any("single rotors" in note for note in diagnosis.notes)
    assert any("no positions" in note for note in diagnosis.notes)


def test_places_alone_are_enough(log: FlightLog, tmp_path: Path) -> None:
    write_flight(log, tmp_path / "log.csv")
    lines = [line.split(",") for line in (tmp_path / "log.csv").read_text().splitlines()]
    kept = [index for index, name in enumerate(lines[0]) if name[0] in "tpqT"]
    (tmp_path / "places.csv").write_text("\n".join(",".join(line[index] for index in kept) for line in lines))
    diagnosis = diagnose_flight(tmp_path / "places.csv", the_vehicle(True))
    assert diagnosis.causes and diagnosis.causes[0].effect == "body_drag_quadratic"
    assert any("velocities from positions" in note for note in diagnosis.notes)


def test_gaps_nan_and_uneven_stamps(log: FlightLog, tmp_path: Path) -> None:
    rows = np.ones(len(log), dtype=bool)
    rows[1500:1600] = False
    rows[np.random.default_rng(0).random(len(log)) < 0.1] = False
    write_flight(log.select(rows), tmp_path / "log.csv")
    lines = (tmp_path / "log.csv").read_text().splitlines()
    cells = lines[100].split(",")
    cells[1] = "nan"
    lines[100] = ",".join(cells)
    (tmp_path / "log.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match="line 101"):
        read_flight(tmp_path / "log.csv")
    diagnosis = diagnose_flight(tmp_path / "log.csv", the_vehicle(True))
    assert diagnosis.causes[0].effect == "body_drag_quadratic"
    assert any("1 rows left out" in note for note in diagnosis.notes)
    assert any("cut at 1 gap" in note for note in diagnosis.notes)


def test_a_log_that_is_all_gaps_is_refused(log: FlightLog) -> None:
    with pytest.raises(InputError, match="give a log that is whole for longer"):
        diagnose_flight(log.select(np.arange(len(log)) % 400 < 200), the_vehicle(True))


def test_the_report_is_whole_and_its_vehicle_flies_without_a_gap(log: FlightLog, tmp_path: Path) -> None:
    out = tmp_path / "report"
    diagnosis = diagnose_flight(log, the_vehicle(True), out)
    names = ["diagnosis.json", "drawing.json", "index.html", "vehicle.yaml"]
    assert sorted(file.name for file in out.iterdir()) == names
    assert (out / "diagnosis.json").read_text() == diagnosis.to_json()
    page = (out / "index.html").read_text()
    assert page.count("data:image/png;base64,") == 2
    assert "http" not in page and 'src="data:' in page
    measured = load_vehicle(out / "vehicle.yaml")
    assert diagnose_flight(log, measured).verdict == "no_gap"
    flown = fly(resolve_path("circle:radius=8,center=0/0/3", 6.0), measured)
    assert flown.log.specific_force is not None
    assert diagnose_flight(flown.log, measured).verdict == "no_gap"


@pytest.mark.parametrize(
    "truth",
    [
        Truth(rotors=(1.05,) * 4, bias=(0.3, 0.1, -0.2), late={"imu": 0.02}),
        Truth({"lag": 0.09}, logs_command=True),
        Truth({"ground_exp": 0.2, "ground_height": 0.25}, rotors=(0.88, 1, 1, 1)),
    ],
    ids=["sensor and scale", "lag", "ground and rotor"],
)
def test_what_is_found_has_a_place_in_the_vehicle(truth: Truth, tmp_path: Path) -> None:
    hops = Flown("hops", 3.0, 4.0, 0.15, 0.9, turning=True, phase=1.3)
    log = log_of(truth, hops, 5)
    found = investigate([log], the_vehicle(True))
    assert found.diagnosis.causes
    (tmp_path / "vehicle.yaml").write_text(found.vehicle.to_yaml())
    measured = load_vehicle(tmp_path / "vehicle.yaml")
    assert gap_of(log, measured) < 0.3 * found.diagnosis.gap.before
    assert fly(resolve_path("circle:radius=8,center=0/0/3", 5.0), measured).error.max() < 5


def test_the_command_shows_and_writes(log: FlightLog, tmp_path: Path) -> None:
    write_flight(log.select(slice(None, 1200)), tmp_path / "log.csv")
    (tmp_path / "vehicle.yaml").write_text(the_vehicle(True).to_yaml())
    command = ["diagnose-flight", str(tmp_path / "log.csv"), "--vehicle", str(tmp_path / "vehicle.yaml")]
    result = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    assert "body_drag_quadratic" in result.output and "written to" in result.output
    assert (tmp_path / "out" / "index.html").is_file()


@pytest.mark.parametrize(
    ("text", "problem"),
    [("", "is empty"), ("t,px,py,pz\n0,0,0,0\n", "has no attitude"), ("a,b\n1,2\n", "has no column t")],
)
def test_bad_logs_are_one_line_and_leave_nothing(text: str, problem: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(text)
    command = ["diagnose-flight", str(tmp_path / "log.csv"), "--vehicle", "f450", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, command)
    assert isinstance(result.exception, InputError)
    assert problem in str(result.exception) and "\n" not in str(result.exception)
    assert not (tmp_path / "out").exists()
