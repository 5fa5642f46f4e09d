"""A report is drawn again from what lies in its folder, to the byte, without recording, scene or simulation."""

import shutil
from pathlib import Path

import pytest
from reports import LACKED, PAPER, found, recorded

from benchmarks.withheld_flight import the_vehicle
from benchmarks.withheld_flight_data import Noise, Truth, flight
from benchmarks.withheld_flight_data import Path as Flown
from depthsim.errors import InputError
from depthsim.gap import Diagnosis
from depthsim.gap.depth.compare import compare_runs
from depthsim.gap.depth.report.compare import write_comparison
from depthsim.gap.depth.report.write import write_report
from depthsim.gap.flight import investigate
from depthsim.gap.flight.report.write import write_report as write_flight_report
from depthsim.gap.report.drawing import DRAWING
from depthsim.gap.report.redraw import PAGE, redraw

EIGHT = Flown("lemniscate", 8.0, 18.0, 3.0, 1.2, turning=True, phase=0.7)


def _again(report: Path) -> None:
    before = (report / PAGE).read_bytes()
    (report / PAGE).unlink()
    assert redraw(report) == report / PAGE
    assert (report / PAGE).read_bytes() == before


def test_a_report_of_depth_is_drawn_again(tmp_path: Path) -> None:
    write_report(found(), tmp_path / "report")
    _again(tmp_path / "report")
    assert Diagnosis.read(tmp_path / "report") == found().diagnosis


def test_a_comparison_is_drawn_again(tmp_path: Path) -> None:
    runs = [tmp_path / name for name in "ab"]
    for run, effects in zip(runs, (LACKED, PAPER), strict=True):
        shutil.copytree(recorded(effects), run)
    write_comparison(compare_runs(*runs, threads=1), tmp_path / "report")
    for run in runs:
        shutil.rmtree(run)
    _again(tmp_path / "report")


def test_a_report_of_flights_is_drawn_again(tmp_path: Path) -> None:
    flown = investigate([flight(EIGHT, Truth(), Noise(), 1)], the_vehicle(False))
    write_flight_report(tmp_path / "report", flown)
    _again(tmp_path / "report")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda text: text[:100], "Invalid JSON"),
        (lambda text: text.replace('"depth"', '"width"', 1), "kind"),
        (lambda text: text.replace('"data":"', '"data":"AAAA', 1), "array"),
        (lambda _: "[" * 5000, "Invalid JSON"),
    ],
)
def test_a_damaged_drawing_is_told_in_one_line(tmp_path: Path, change, told: str) -> None:
    write_report(found(), tmp_path / "report")
    file = tmp_path / "report" / DRAWING
    file.write_text(change(file.read_text()))
    page = (tmp_path / "report" / PAGE).read_bytes()
    with pytest.raises(InputError, match=DRAWING) as caught:
        redraw(tmp_path / "report")
    assert told in str(caught.value) and "\n" not in str(caught.value)
    assert (tmp_path / "report" / PAGE).read_bytes() == page
