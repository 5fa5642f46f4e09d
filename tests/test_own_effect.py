"""An effect in a file of one's own: with nothing else written, everything that knows the bank's effects knows it."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from depthsim.runs import Run as Recording

ROOT = Path(__file__).resolve().parents[1]
EFFECT = '''
from typing import ClassVar

import numpy as np

from depthsim.sensor import Effect, Frame, Stage, parameter


class DirtyWindow(Effect):
    """Holes that grow towards the right of the picture, where dirt lies on the window."""

    id: ClassVar[str] = "dirty_window"
    stage: ClassVar[Stage] = Stage.HOLES
    source: ClassVar[str] = "a test"
    axes = ("image_column", "image_position")
    kinds = ("missing",)
    recording = "a wall with the window wiped"

    dirt: float = parameter(0.2, low=0, high=1, unit="share", neutral=0, about="lost at the border", source="assumed")

    def apply(self, frame: Frame) -> None:
        chance = self.dirt * np.arange(frame.camera.width, dtype=np.float32) / frame.camera.width
        frame.depth[frame.draws(self.id).uniform(frame.depth.shape) < chance] = 0
'''
FLIGHT = '''
from typing import ClassVar

from depthsim.flight.drag import BODY_QUADRATIC
from depthsim.gap.flight.effect import Candidate, FlightEffect, Parameter


class Banner(FlightEffect):
    """A banner that is towed."""

    id: ClassVar[str] = "banner"
    title = "a towed banner"
    axes = ("speed",)
    recording = "Fly without the banner."

    @classmethod
    def candidates(cls, records, base, radius):
        def towed(s, v):
            return s.with_law("banner", (BODY_QUADRATIC, (0.6 * v[0],) * 3))

        return [Candidate(cls.id, "square", (Parameter("area", "m²", 0.0, 0.01, 0.0, 1.0),), towed)]
'''
LISTED = """
from depthsim.gap.depth.fit.advice import advice_for
from depthsim.sensor import effect_ids

print(*effect_ids())
print(advice_for("dirty_window", ("fill_rate",)))
"""
KNOWS = """
import json, sys
import viser
from depthsim.materials import load_materials
from depthsim.sensor import load_profile
from docs.effects import page
from viewer.controls.effects import EffectControls

profile = load_profile(sys.argv[1])
server = viser.ViserServer(port=0, verbose=False)
controls = EffectControls(server.gui, ("cement",), load_materials(), lambda: None)
controls.fill(profile.effects)
reported = {"page": page(), "sliders": controls.folders["dirty_window"].parameters,
        "shown": [effect.id for effect in controls.effects()]}
print("FOUND" + json.dumps(reported))
sys.stdout.flush()
import os
os._exit(0)
"""
FLOWN = """
import sys
from benchmarks.withheld_flight import the_vehicle
from depthsim.gap.flight import diagnose_flight
from pathlib import Path
from benchmarks.withheld_flight_data import Noise, Path as Flown, Truth, flight

others = ("body_drag_quadratic", "vertical_damping", "gusting_wind", "constant_wind")
path = Flown("lemniscate", 8.0, 18.0, 3.0, 1.2, turning=True, phase=0.7)
log = flight(path, Truth({"quad_all": 0.04}), Noise(), 1)
diagnose_flight(log, the_vehicle(True), Path(sys.argv[1]), without=others)
"""
TRIES = """
import os, sys
from depthsim.errors import InputError
from depthsim.sensor import effect_ids

for file in sys.argv[1:]:
    sys.stdout.flush()
    if os.fork() == 0:
        os.environ["DEPTHSIM_EFFECTS"] = file
        try:
            effect_ids()
        except InputError as error:
            print(error)
        sys.stdout.flush()
        os._exit(0)
    os.wait()
"""

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Runs Python in the repository's folder, with the files of the effects named."""
    (tmp_path / "dirty.py").write_text(EFFECT)
    (tmp_path / "banner.py").write_text(FLIGHT)
    names = os.pathsep.join(str(tmp_path / name) for name in ("dirty.py", "banner.py"))

    def call(*arguments: object, own: str = names) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "DEPTHSIM_EFFECTS": own, "COLUMNS": "200"}
        command = [sys.executable, *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, check=False, env=environment, cwd=ROOT)

    return call


def depthsim(run: Run, *arguments: object) -> None:
    done = run("-m", "depthsim", *arguments)
    assert done.returncode == 0, done.stderr


def test_simulator_and_diagnosis_know_it(run: Run, tmp_path: Path) -> None:
    (tmp_path / "dirty.yaml").write_text("effects: [material_noise, fill_rate, dirty_window]")
    small = ("--camera", "d435", "--resolution", "106x60", "--rate", 1, "--frames", 8, "--only-depth", "--threads", 1)
    depthsim(run, "generate", "office", *small, "--sensor", tmp_path / "dirty.yaml", "--out", tmp_path / "run")
    rivals = {"dirty_window", "fill_rate", "vignetting_noise", "invalid_band"}
    names, advice = run("-c", LISTED).stdout.splitlines()
    listed = names.split()
    without = [word for name in listed if name not in rivals for word in ("--without", name)]
    assert "dirty_window" in listed and len(without) > 40
    report = tmp_path / "report"
    depthsim(run, "diagnose", tmp_path / "run", "--sensor", "paper", *without, "--out", report, "--threads", 1)
    found = json.loads((report / "diagnosis.json").read_text())
    assert found["verdict"] == "explained"
    cause = found["causes"][0]
    assert cause["effect"] == "dirty_window"
    assert cause["parameters"]["dirt"] == pytest.approx(0.2, abs=0.03) and cause["closed_fraction"] > 0.9
    assert "a wall with the window wiped" in advice
    assert "Holes that grow towards the right" in (report / "index.html").read_text()
    like = ("generate", "--like", tmp_path / "run", "--sensor", report / "sensor.yaml")
    depthsim(run, *like, "--out", tmp_path / "again", "--only-depth")


def test_viewer_page_and_benchmark_know_it(run: Run, tmp_path: Path) -> None:
    (tmp_path / "dirty.yaml").write_text("effects: [fill_rate, {dirty_window: {dirt: 0.4}}]")
    done = run("-c", KNOWS, tmp_path / "dirty.yaml")
    assert done.returncode == 0, done.stderr
    reported = json.loads(done.stdout.partition("FOUND")[2])
    entry = reported["page"].partition("### dirty_window")[2].partition("###")[0]
    assert "| `dirt` | 0.2 | 0 | 1 | 0 | share |" in entry
    assert "holes along image column and image position" in entry and "a wall with the window wiped" in entry
    assert reported["sliders"] == ["dirt"] and reported["shown"] == ["dirty_window", "fill_rate"]
    timed = run("benchmarks/effects.py", "dirty_window", "--rounds", 1, "--scene", "corridor")
    assert re.search(r"dirty_window\W+holes\W+-?\d", timed.stdout), timed.stdout + timed.stderr


def test_an_effect_of_a_flight_is_found_as_well(run: Run, tmp_path: Path) -> None:
    done = run("-c", FLOWN, tmp_path / "report")
    assert done.returncode == 0, done.stderr
    causes = json.loads((tmp_path / "report" / "diagnosis.json").read_text())["causes"]
    assert causes[0]["effect"] == "banner" and causes[0]["advice"] == "Fly without the banner."
    assert "a towed banner" in (tmp_path / "report" / "index.html").read_text()


BROKEN = {
    "syntax.py": ("class Dirty(", "line 1: cannot be imported (SyntaxError"),
    "crash.py": (EFFECT + "\n1 / 0\n", "line 25: cannot be imported (ZeroDivisionError: division by zero)"),
    "empty.py": ("x = 1", "holds no effect; write a class"),
    "notes.txt": ("x = 1", "is no Python file; name files that end in .py"),
    "taken.py": (EFFECT.replace('"dirty_window"', '"fill_rate"'), "the id 'fill_rate' is that of"),
    "axes.py": (re.sub(r"    axes = .*\n", "", EFFECT), "DirtyWindow: has no `axes`; write axes in the class"),
    "word.py": (
        EFFECT.replace('("image_column"', '("image_colum"'),
        "there is no 'image_colum' that `axes` could have",
    ),
    "text.py": (EFFECT.replace('("missing",)', '"missing"'), "`kinds` is no tuple; write kinds = ('missing',)"),
    "kinds.py": (EFFECT.replace('("missing",)', "()"), "`kinds` is empty; name the kind"),
    "field.py": (
        EFFECT.replace("    dirt:", "    more: float = 1.0\n    dirt:"),
        "DirtyWindow.more is not declared with",
    ),
    "forms.py": (
        EFFECT.replace("    kinds", '    forms = ({"dust": 0.0},)\n    kinds'),
        "'dust', which is no parameter",
    ),
}


def test_a_file_that_cannot_be_used_is_reported_in_one_line(run: Run, tmp_path: Path) -> None:
    for name, (text, _) in BROKEN.items():
        (tmp_path / name).write_text(text)
    done = run("-c", TRIES, *(tmp_path / name for name in BROKEN), own="")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == len(BROKEN), done.stdout + done.stderr
    for (name, (_, problem)), line in zip(BROKEN.items(), lines, strict=True):
        assert problem in line and name in line, line


def test_the_example_in_the_docs_is_an_effect(run: Run, tmp_path: Path) -> None:
    text = (ROOT / "docs" / "own_effect.md").read_text().partition("```python\n")[2].partition("```")[0]
    (tmp_path / "example.py").write_text(text.replace('"range_dropout"', '"dropout_of_range"'))
    (tmp_path / "example.yaml").write_text("effects: [dropout_of_range: {start: 1.0, rate: 0.5}]")
    arguments = ("office", "--camera", "d435", "--resolution", "64x36", "--frames", 1, "--out", tmp_path / "run")
    made = run(
        *("-m", "depthsim", "generate", *arguments, "--sensor", tmp_path / "example.yaml"),
        own=str(tmp_path / "example.py"),
    )
    assert made.returncode == 0, made.stderr
    opened = Recording.open(tmp_path / "run")
    clean, depth = opened.clean(0), opened.depth(0)
    assert clean is not None and (depth[clean < 1] > 0).all() and (depth[clean > 3.1] == 0).all()


def test_a_file_that_is_not_there_is_reported_by_the_command_line(run: Run, tmp_path: Path) -> None:
    done = run("-m", "depthsim", "generate", "office", "--out", tmp_path / "out", own=str(tmp_path / "none.py"))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "DEPTHSIM_EFFECTS" in done.stderr and "is no file" in done.stderr
