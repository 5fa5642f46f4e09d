"""`depthsim diagnose` as it is called."""

import io
import json
import sys
from pathlib import Path

import pytest
from reports import LACKED, OTHERS, PAPER, found, recorded
from rich.console import Console
from test_gap_report import checked

from depthsim.__main__ import main
from depthsim.gap.depth.compare import compare_runs
from depthsim.gap.depth.report.compare import show_comparison, write_comparison
from depthsim.gap.report import words
from depthsim.gap.report.terminal import show
from depthsim.gap.report.words import Origin
from depthsim.runs import Run


def call(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["depthsim", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def test_a_diagnosis_runs_and_its_sensor_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run, report = recorded(LACKED), tmp_path / "report"
    without = [word for name in OTHERS for word in ("--without", name)]
    assert call(monkeypatch, "diagnose", str(run), "--sensor", "paper", "--out", str(report), *without) == 0
    out, err = capsys.readouterr()
    assert out.startswith("Explained: incidence_noise added") and err == ""
    command = next(line.strip() for line in out.splitlines() if line.strip().startswith("depthsim generate"))
    words_of = command.split()[1:]
    assert words_of[:3] == ["generate", "--like", str(run)]
    words_of[-1] = str(tmp_path / "simulated")
    assert call(monkeypatch, *words_of, "--only-depth") == 0
    simulated = Run.open(tmp_path / "simulated")
    assert (simulated.stamps == Run.open(run).stamps).all()
    assert json.loads((report / "diagnosis.json").read_text())["verdict"] == "explained"


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["nowhere"], "nowhere: no such folder; give the folder of a run"),
        (["RUN", "--without", "gremlins"], "--without: gremlins: there is no effect 'gremlins'"),
        (["RUN", "--sensor", "nothing"], "nothing: is no sensor profile"),
        (["RUN", "--scene", "nothing"], "nothing"),
        (["RUN", "RUN", "RUN"], "diagnose: has 3 runs"),
        (["RUN", "RUN", "--sensor", "paper"], "diagnose: --sensor: is of no use"),
        (["RUN", "RUN", "--no-tasks"], "diagnose: --no-tasks: is of no use with two recordings; give one recording"),
        (["RUN", "--tag", "cement"], "--tag: cement: is not NAME=TAG"),
    ],
)
def test_bad_input_gets_one_line(
    arguments: list[str],
    line: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    run = str(recorded(PAPER))
    arguments = [run if word == "RUN" else word for word in arguments]
    assert call(monkeypatch, "diagnose", *arguments, "--out", str(tmp_path / "report")) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and err.startswith(line)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_others_is_refused_before_anything_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "thesis.tex").write_text("")
    assert call(monkeypatch, "diagnose", "nowhere", "--out", str(tmp_path)) == 2
    assert "such as thesis.tex" in capsys.readouterr().err


@pytest.mark.parametrize("width", [30, 60, 80, 200])
def test_the_page_fits_the_terminal_and_commands_are_whole(width: int) -> None:
    origin = Origin("a run", "report", "paper")
    console = Console(width=width, record=True, file=io.StringIO(), highlight=False)
    show(console, found().diagnosis, origin)
    lines = console.export_text().splitlines()
    assert f"    {words.generate_command(origin)}" in lines
    commands = ("    depthsim ", "    report/")
    assert all(len(line.rstrip()) <= width for line in lines if not line.startswith(commands))


def test_two_runs_of_one_sensor_do_not_differ(tmp_path: Path) -> None:
    compared = compare_runs(recorded(PAPER), recorded(PAPER, 2), threads=1)
    assert compared.diagnosis.verdict == "no_gap"
    assert compared.overlap == pytest.approx(1)
    write_comparison(compared, tmp_path / "report")
    checked((tmp_path / "report" / "index.html").read_text())


def test_the_noisier_of_two_runs_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    compared = compare_runs(recorded(PAPER), recorded(LACKED, 3, 1.5), threads=1)
    d = compared.diagnosis
    assert d.verdict == "unexplained" and d.causes == () and d.gap.before > 2 * d.gap.floor
    assert "B is noisier" in d.where[0].text
    show_comparison(Console(width=80, highlight=False), compared, tmp_path / "report")
    assert "The two differ: B is noisier" in " ".join(capsys.readouterr().out.split())
