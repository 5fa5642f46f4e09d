"""The report of a diagnosis: a folder that is whole, runs as it is, and can be read."""

import ast
import json
import shutil
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import yaml
from reports import LACKED, OTHERS, PAPER, found, recorded

from depthsim.errors import InputError
from depthsim.gap import Diagnosis, investigate
from depthsim.gap.depth.report.write import Named, write_report
from depthsim.gap.diagnosis import Cut
from depthsim.gap.report import words
from depthsim.gap.report.folder import check_report_folder, report_folder
from depthsim.gap.report.words import place as place_in_words
from depthsim.runs import Run
from depthsim.runs.png import encode_png
from depthsim.sensor import effect_ids, load_profile

_VOID = {"meta", "img", "br", "hr", "link", "input"}


class _Checker(HTMLParser):
    """Fails on tags that do not match, and counts pictures and what is loaded from outside."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.pictures, self.outside, self.text = 0, 0, ""

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        if tag not in _VOID:
            self.open.append(tag)
        for name, value in attributes:
            self.pictures += tag == "img" and name == "src" and (value or "").startswith("data:image/png;base64,")
            self.outside += name in ("src", "href") and not (value or "").startswith("data:")

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def checked(text: str) -> _Checker:
    checker = _Checker()
    checker.feed(text)
    checker.close()
    assert checker.open == []
    return checker


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reports") / "report"
    write_report(found(), folder, Named(None, "paper"))
    return folder


def test_the_folder_holds_what_is_promised(report: Path) -> None:
    assert sorted(path.name for path in report.iterdir()) == [
        "diagnosis.json", "drawing.json", "index.html", "report.yaml", "sensor.yaml", "where.npz",
    ]  # fmt: skip
    stored = Diagnosis.model_validate(json.loads((report / "diagnosis.json").read_text()))
    assert stored == found().diagnosis
    assert stored.causes[0].effect == "incidence_noise"
    origin = yaml.safe_load((report / "report.yaml").read_text())
    assert origin == {"run": str(found().evidence.run.path), "sensor": "paper"}


def test_the_sensor_has_the_causes_and_says_so(report: Path) -> None:
    profile = load_profile(report / "sensor.yaml")
    assert profile.effects == found().fixed.effects
    text = (report / "sensor.yaml").read_text()
    assert "# - incidence_noise closes" in text and "--like" in text


def test_the_shares_are_those_of_the_gap(report: Path) -> None:
    with np.load(report / "where.npz", allow_pickle=False) as arrays:
        face, image = arrays["face_share"], arrays["image_share"]
    assert face.shape == (len(found().evidence.scene.faces),) and face.dtype == np.float32
    assert image.shape == (12, 16) and image.dtype == np.float32
    assert face.sum() == pytest.approx(1, abs=1e-3) and image.sum() == pytest.approx(1, abs=1e-3)


def test_the_page_is_whole_html_with_pictures(report: Path) -> None:
    text = (report / "index.html").read_text()
    page = checked(text)
    assert page.pictures >= 5 and page.outside == 0 and len(text) < 1_500_000
    for part in ("Where the gap lies", "Which effects cause it", "What to do next", "incidence_noise", "sigma"):
        assert part in page.text


def test_an_unexplained_gap_gets_the_beginning_of_an_effect(tmp_path: Path) -> None:
    findings = found(LACKED, (*OTHERS, "incidence_noise", "disparity_noise"))
    assert findings.diagnosis.unexplained is not None
    origin = write_report(findings, tmp_path / "report")
    text = (tmp_path / "report" / "new_effect.py").read_text()
    names = [node.name for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ClassDef)]
    assert len(names) == 1 and names[0].startswith("New")
    page = checked((tmp_path / "report" / "index.html").read_text())
    assert "What stays unexplained" in page.text and names[0] in page.text
    assert any("new_effect.py" in step.text for step in words.next_steps(findings.diagnosis, origin))


@pytest.mark.parametrize(("closed", "blamed"), [(0.996, True), (0.5, False)])
def test_a_little_that_is_left_may_be_due_to_formulas(closed: float, blamed: bool) -> None:
    whole = found(LACKED, (*OTHERS, "incidence_noise", "disparity_noise")).diagnosis
    cause = found().diagnosis.causes[0]
    gap = whole.gap.model_copy(update={"closed_fraction": closed})
    partly = whole.model_copy(update={"verdict": "partly_explained", "causes": (cause,), "gap": gap})
    (step,) = (s for s in words.next_steps(partly, words.Origin("run", "report", "paper")) if words.STUB in s.text)
    assert ("0.4 % of the gap" in step.text) == ("these formulas" in step.text) == blamed


def test_no_gap_gives_back_the_same_sensor(tmp_path: Path) -> None:
    findings = found(PAPER)
    assert findings.diagnosis.verdict == "no_gap"
    write_report(findings, tmp_path / "report")
    assert load_profile(tmp_path / "report" / "sensor.yaml").effects == load_profile("paper").effects
    assert "No gap" in checked((tmp_path / "report" / "index.html").read_text()).text
    with np.load(tmp_path / "report" / "where.npz") as arrays:
        assert not arrays["face_share"].any() and not arrays["image_share"].any()


def test_objects_are_written_beside_the_report(tmp_path: Path) -> None:
    findings = found(PAPER)
    named = Named(findings.evidence.scene, load_profile("paper"))
    write_report(findings, tmp_path / "report", named)
    origin = yaml.safe_load((tmp_path / "report" / "report.yaml").read_text())
    assert (origin["scene"], origin["sensor"]) == ("scene.yaml", "before.yaml")
    assert load_profile(tmp_path / "report" / "before.yaml").effects == load_profile("paper").effects
    assert (tmp_path / "report" / "scene.ply").is_file()


def test_a_report_is_replaced_whole(tmp_path: Path) -> None:
    folder = tmp_path / "report"
    with report_folder(folder) as part:
        (part / "diagnosis.json").write_text("old")
        (part / "new_effect.py").write_text("old")
    with report_folder(folder) as part:
        (part / "diagnosis.json").write_text("new")
    assert [(path.name, path.read_text()) for path in folder.iterdir()] == [("diagnosis.json", "new")]
    with pytest.raises(RuntimeError), report_folder(folder) as part:
        (part / "diagnosis.json").write_text("half")
        raise RuntimeError
    assert (folder / "diagnosis.json").read_text() == "new"
    assert list(tmp_path.iterdir()) == [folder]


@pytest.mark.parametrize("names", [("notes.txt",), ("diagnosis.json", "notes.txt"), ("sensor.yaml",)])
def test_a_folder_with_other_files_is_refused(tmp_path: Path, names: tuple[str, ...]) -> None:
    for name in names:
        (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match="not of a report"):
        check_report_folder(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file"):
        check_report_folder(tmp_path / "file")


def test_comments_stay_comments() -> None:
    text = words.comment("a recording\nnamed: [strangely] " + "word " * 40)
    assert all(line.startswith("#") and len(line) <= 120 for line in text.splitlines())
    assert yaml.safe_load(text) is None


def test_time_is_reported_from_the_first_frame_whatever_the_clock(tmp_path: Path) -> None:
    """Stamps of a clock of today make `1.31e+09 to 1.31e+09 s` of every part of a recording."""
    run = Path(shutil.copytree(recorded(PAPER), tmp_path / "run"))
    for name in ("depth.txt", "groundtruth.txt"):
        rows = [line.split(" ", 1) for line in (run / name).read_text().splitlines() if line[0] != "#"]
        (run / name).write_text("".join(f"{1305031102.16 + float(stamp):.6f} {rest}\n" for stamp, rest in rows))
    opened = Run.open(run)
    for index in range(4, 8):  # the camera grows warm
        opened.files[index].write_bytes(encode_png((opened.depth_raw(index) * 1.06).astype(np.uint16)))
    late = investigate(run, sensor="paper", without=effect_ids(), threads=1).diagnosis
    time = next(cut for cut in late.where if cut.axis == "time")
    assert time.interval is not None and time.interval[1] == pytest.approx(7, abs=1e-6)
    assert 2 < time.interval[0] < 6
    assert place_in_words(time).endswith(" to 7 s")
    both = next((cut for cut in late.where if cut.axis == "time x range"), None)
    assert both is None or "130503" not in place_in_words(both)


def test_figures_of_long_recordings_are_whole_numbers() -> None:
    long = Cut(axis="time", interval=(0.0, 3725.4), unit="s", share_of_gap=1.0, what="bias")
    assert place_in_words(long) == "time 0 to 3725 s"
