"""A report is drawn again from what lies in its folder, to the byte, without recording, scene or simulation."""

import shutil
from functools import cache
from pathlib import Path

import pytest
from reports import LACKED, PAPER, found, recorded

from benchmarks.withheld_flight import the_vehicle
from benchmarks.withheld_flight_data import Noise, Truth, flight
from benchmarks.withheld_flight_data import Path as Flown
from depthsim.errors import InputError
from depthsim.gap import Diagnosis, diagnose
from depthsim.gap.depth.compare import compare_runs
from depthsim.gap.depth.report.compare import write_comparison
from depthsim.gap.depth.report.write import write_report
from depthsim.gap.flight import Findings, diagnose_flight, investigate
from depthsim.gap.flight.report import write
from depthsim.gap.flight.report.drawing import measure_drawing
from depthsim.gap.flight.report.write import write_report as write_flight_report
from depthsim.gap.report import drawing
from depthsim.gap.report.drawing import DRAWING
from depthsim.gap.report.redraw import PAGE, redraw
from depthsim.runs.storing import write_whole

EIGHT = Flown("lemniscate", 8.0, 18.0, 3.0, 1.2, turning=True, phase=0.7)


@cache
def _flown() -> Findings:
    return investigate([flight(EIGHT, Truth(), Noise(), 1)], the_vehicle(False))


@cache
def _page() -> str:
    return write.report_page(_flown().diagnosis, measure_drawing(_flown()))


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of depth, which the tests copy."""
    folder = tmp_path_factory.mktemp("redraw") / "report"
    write_report(found(), folder)
    return folder


def _again(report: Path) -> None:
    before = (report / PAGE).read_bytes()
    (report / PAGE).unlink()
    assert redraw(report) == report / PAGE
    assert (report / PAGE).read_bytes() == before


def test_a_report_of_depth_is_drawn_again(report: Path, tmp_path: Path) -> None:
    shutil.copytree(report, tmp_path / "report")
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
    write_flight_report(tmp_path / "report", _flown())
    _again(tmp_path / "report")


@pytest.mark.parametrize("last", ["vehicle.yaml", DRAWING, PAGE])
def test_a_report_of_flights_is_written_whole_or_not_at_all(
    tmp_path: Path, last: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown, folder = _flown(), tmp_path / "report"
    page = _page()
    monkeypatch.setattr(write, "report_page", lambda *_: page)  # to draw it takes longer than all else
    write_flight_report(folder, flown)
    (folder / "vehicle.yaml").write_text("of an earlier diagnosis")
    before = {file.name: file.read_bytes() for file in folder.iterdir()}

    def fail(file: Path, data: bytes) -> None:
        if file.name == last:
            raise OSError(28, "No space left on device")
        write_whole(file, data)

    with monkeypatch.context() as full:
        for module in (drawing, write):
            full.setattr(module, "write_whole", fail)
        with pytest.raises(InputError, match="no space left"):
            write_flight_report(folder, flown)
        with pytest.raises(InputError, match="no space left"):
            write_flight_report(tmp_path / "other", flown)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before
    assert list(tmp_path.iterdir()) == [folder]
    write_flight_report(folder, flown)
    assert (folder / "vehicle.yaml").read_text() == flown.vehicle.to_yaml()


def test_a_folder_with_other_files_is_refused_before_anything_is_diagnosed(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    for refused in (
        lambda: diagnose(tmp_path / "run", out=tmp_path),
        lambda: diagnose_flight(tmp_path / "flight.csv", "f450", out=tmp_path),
    ):
        with pytest.raises(InputError, match=r"notes\.txt; give another `out`"):
            refused()
    assert [file.name for file in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[:100], "Invalid JSON"),
        (lambda text: text.replace('"depth"', '"width"', 1), "kind"),
        (lambda text: text.replace('"data":"', '"data":"AAAA', 1), "array"),
        (lambda _: "[" * 5000, "Invalid JSON"),
    ],
)
def test_a_damaged_drawing_is_reported_in_one_line(report: Path, tmp_path: Path, change, said: str) -> None:
    shutil.copytree(report, tmp_path / "report")
    file = tmp_path / "report" / DRAWING
    file.write_text(change(file.read_text()))
    page = (tmp_path / "report" / PAGE).read_bytes()
    with pytest.raises(InputError, match=DRAWING) as caught:
        redraw(tmp_path / "report")
    assert said in str(caught.value) and "\n" not in str(caught.value)
    assert (tmp_path / "report" / PAGE).read_bytes() == page
