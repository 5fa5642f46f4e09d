"""The public face: names that cost nothing until they are asked for, and take names, paths or objects."""

import ast
import pkgutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import ClassVar

import numpy as np
import pytest
from captures import write_captures, write_run
from shapes import MATERIALS, as_scene, box, camera

import depthsim
import depthsim.flight
from depthsim.gap.diagnosis import Cause, Cut, Gap, Unexplained
from depthsim.raycast import Caster
from depthsim.sensor.effect import effect_ids

FACES = [depthsim, depthsim.flight]
SMALL = camera(64, 48, 40)
POSE = np.eye(4)


def python(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("code", ["import depthsim, depthsim.flight; dir(depthsim)", "import depthsim.__main__"])
def test_importing_loads_nothing_heavy(code: str) -> None:
    heavy = "numpy", "numba", "pydantic", "scipy", "yaml", "trimesh", "matplotlib", "PIL", "viser"
    assert python(f"import sys; {code}; print([name for name in {heavy} if name in sys.modules])").strip() == "[]"


@pytest.mark.parametrize("face", FACES)
def test_every_name_is_there_and_is_listed(face: ModuleType) -> None:
    assert set(face.__all__) <= set(dir(face))
    assert set(face._HOMES) == set(face.__all__) - {"__version__"}
    for name in face.__all__:
        assert getattr(face, name).__doc__
        assert not isinstance(getattr(face, name), ModuleType)
    with pytest.raises(AttributeError, match="nothing_of_that_name"):
        face.nothing_of_that_name  # noqa: B018


@pytest.mark.parametrize("face", FACES)
def test_no_module_has_the_name_of_a_verb(face: ModuleType) -> None:
    """Importing it would put the module in the verb's place."""
    assert not {module.name for module in pkgutil.iter_modules(face.__path__)} & set(face.__all__)


@pytest.mark.parametrize("face", FACES)
def test_type_checkers_see_the_same_objects(face: ModuleType) -> None:
    tree = ast.parse(Path(str(face.__file__)).read_text(encoding="utf-8"))
    seen = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("depthsim."):
            seen |= {alias.asname or alias.name: (node.module, alias.name) for alias in node.names}
    assert set(seen) == set(face._HOMES)
    for name, (module, there) in seen.items():
        assert getattr(face, name) is getattr(sys.modules[module or ""], there)
    assert (Path(depthsim.__file__).parent / "py.typed").is_file()


@pytest.fixture(scope="module")
def room() -> depthsim.Scene:
    return as_scene(
        box((-2, -1.5, -1), (2.5, 1.5, 4)), box((-0.3, -0.3, 1.2), (0.2, 0.6, 1.7)), tags=["plastic", "cement"]
    )


def test_a_sensor_takes_names_paths_and_objects(room: depthsim.Scene, tmp_path: Path) -> None:
    SMALL.write(tmp_path / "camera.yaml")
    paper = depthsim.load_profile("paper")
    (tmp_path / "mine.yaml").write_text(paper.to_yaml())
    seen = depthsim.Sensor(room, SMALL, paper.effects, MATERIALS).measure(POSE, seed=3)
    for scene, eye, profile in [
        (room, tmp_path / "camera.yaml", "paper"),
        (Caster(room), str(tmp_path / "camera.yaml"), paper),
        (room, SMALL, tmp_path / "mine.yaml"),
    ]:
        other = depthsim.Sensor(scene, camera=eye, profile=profile, materials=MATERIALS).measure(POSE, seed=3)
        assert np.array_equal(seen.depth_raw, other.depth_raw)


def test_an_effect_is_written_with_public_names(room: depthsim.Scene) -> None:
    effect_ids()  # before the class below, so that the registry of the other tests lacks it

    class Halves(depthsim.Effect):
        """An effect outside the package, made of public names alone."""

        id: ClassVar[str] = "test_public_halves"
        stage: ClassVar[depthsim.Stage] = depthsim.Stage.DISPARITY
        source: ClassVar[str] = "this test"

        share: float = depthsim.parameter(
            0.5, low=0, high=1, unit="1", neutral=0, about="what is lost", source="this test"
        )

        def apply(self, frame: depthsim.Frame) -> None:
            frame.depth[:] *= 1 - self.share

    halved = depthsim.Sensor(room, SMALL, [Halves()], MATERIALS).measure(POSE)
    np.testing.assert_allclose(halved.depth, halved.clean.depth / 2)


def test_by_name_alone_it_is_a_d435_with_the_papers_noise() -> None:
    sensor = depthsim.Sensor("wall")
    assert (sensor.camera.name, sensor.camera.shape) == ("D435", (480, 848))
    assert sensor.effects == list(depthsim.Sensor(sensor.caster, "d435", "paper").effects)
    assert depthsim.Sensor("wall", profile="d455").camera.name == "D455"


def test_what_is_loaded_already_stays_as_it_is(room: depthsim.Scene) -> None:
    profile, eye = depthsim.load_profile("paper"), depthsim.load_camera("d435")
    path = depthsim.load_trajectory("tour", "office", rate=30, frames=5)
    assert depthsim.load_scene(room) is room
    assert depthsim.load_profile(profile) is profile
    assert depthsim.load_camera(eye) is eye
    assert len(path) == 5 and len(depthsim.load_trajectory(path, frames=3)) == 3
    assert depthsim.load_camera(eye, rate=15).rate == 15
    assert depthsim.load_camera("d435", 424, 240).shape == (240, 424)


def test_a_camera_of_one_size_has_no_other() -> None:
    with pytest.raises(depthsim.InputError, match="has a size of its own"):
        depthsim.load_camera(SMALL, 424, 240)


def test_a_run_is_made_and_opened_by_names_and_by_objects(tmp_path: Path) -> None:
    SMALL.write(tmp_path / "camera.yaml")
    one, two = tmp_path / "one", tmp_path / "two"
    made = depthsim.generate("office", "tour", camera=tmp_path / "camera.yaml", out=str(one), frames=2, seed=5)
    assert (made.frames, made.made) == (2, 2)
    scene = depthsim.load_scene("office")
    path = depthsim.load_trajectory("tour", scene, rate=SMALL.rate)
    depthsim.generate(scene, path, SMALL, depthsim.load_profile("paper"), two, frames=2, seed=5)
    files = sorted(file.relative_to(one) for file in one.rglob("*") if file.is_file())
    assert files == sorted(file.relative_to(two) for file in two.rglob("*") if file.is_file())
    assert all((one / file).read_bytes() == (two / file).read_bytes() for file in files)
    run = depthsim.open_run(str(one))
    assert depthsim.open_run(run) is run
    sensor = depthsim.Sensor(run.scene, run.camera, "paper")
    seen = sensor.measure(run.poses[1], index=1, stamp=float(run.stamps[1]), seed=5)
    assert np.array_equal(seen.depth_raw, run.depth_raw(1))


def test_a_material_is_fitted_to_a_run_and_to_a_wall(tmp_path: Path) -> None:
    run = write_run(tmp_path / "run")
    known = tmp_path / "materials.yaml"
    known.write_text("a: {m: 0.4}\nb: {m: 0.9}\n")
    for recording in (run, depthsim.open_run(run)):
        fits = {fit.tag: fit.m for fit in depthsim.fit_material(recording, materials=known)}
        assert fits == pytest.approx({"a": 0.4, "b": 0.9}, abs=0.03)
    wall = write_captures(tmp_path / "wall", lambda d: 0.005 * np.exp(0.4 * d))
    (fit,) = depthsim.fit_material(wall, tag="cement")
    assert fit.tag == "cement" and fit.m == pytest.approx(depthsim.fit_material([wall], tag="cement")[0].m)
    with pytest.raises(depthsim.InputError, match="name the one material"):
        depthsim.fit_material(wall)


CUT = Cut(axis="range", interval=(1, 2), unit="m", share_of_gap=0.5, what="bias", text="simulated <nearer>")
GAP = Gap(measure="x", unit="bits", before=1, after=0.2, floor=0.1, closed_fraction=0.9, ci95=(0.8, 1))
CAUSE = Cause(
    effect="disparity_noise",
    parameters={"sigma": 0.05},
    ci95={"sigma": (0.04, 0.06)},
    closed_fraction=0.9,
    ci95_closed=(0.8, 1),
    indistinguishable_from=("material_noise",),
)
REST = Unexplained(fraction=0.1, where=(CUT,), description="what is left")
FOUND = depthsim.Diagnosis(verdict="partly_explained", gap=GAP, where=(CUT,), causes=(CAUSE,), unexplained=REST)


def test_a_diagnosis_tells_itself() -> None:
    assert repr(FOUND) == "<Diagnosis: partly_explained, causes: disparity_noise, gap: 1 to 0.2 bits, floor 0.1>"
    assert str(FOUND).splitlines()[0].startswith("Partly explained: disparity_noise added, 90 % of the gap is closed")
    for words in (
        "sigma 0.05 px (95 %: 0.04 to 0.06)",
        "range 1 to 2 m",
        "disparity_noise is indistinguishable from material_noise",
        "What is left.",
    ):
        assert words in str(FOUND)
        assert words in FOUND._repr_html_()
    assert "simulated &lt;nearer&gt;" in FOUND._repr_html_() and "<nearer>" not in FOUND._repr_html_()
    assert "<img" not in FOUND._repr_html_()


def test_a_diagnosis_shows_the_pictures_of_its_report_and_nothing_else_of_it(tmp_path: Path) -> None:
    FOUND.write(tmp_path)
    read = depthsim.Diagnosis.read(tmp_path)
    assert read == FOUND and read.report == tmp_path and FOUND.report is None
    assert "<img" not in read._repr_html_(), "without a page there are none"
    from depthsim.gap.report.page import Page

    page = Page("a report").section("curves").picture(b"curves", "the curves").picture(b"errors", "their <errors>")
    (tmp_path / "index.html").write_text(page.picture(b"more").html() + "<figure><script>1</script></figure>")
    shown = read._repr_html_()
    assert shown.count("<img") == 2 and "the curves" in shown and "&lt;errors&gt;" in shown
    assert "<script" not in shown


def test_a_flight_takes_names_paths_and_objects(tmp_path: Path) -> None:
    one = depthsim.flight.fly("circle:radius=3,laps=1,center=0/0/2", "f450", speed=2, wind="1/0/0", seed=3)
    from depthsim.flight.pathspec import resolve_path
    from depthsim.flight.vehicle import load_vehicle
    from depthsim.flight.windfile import resolve_wind

    path = resolve_path("circle:radius=3,laps=1,center=0/0/2", 2)
    two = depthsim.flight.fly(path, load_vehicle("f450"), wind=resolve_wind("1/0/0"), seed=3)
    np.testing.assert_array_equal(one.log.position, two.log.position)
    one.write(str(tmp_path / "flight"))
    read, known = tmp_path / "flight" / "flight.csv", depthsim.flight.FlightLog
    assert isinstance(one.log, known)
    fits = [
        depthsim.flight.fit_drag([log], vehicle) for log, vehicle in [(read, "f450"), (str(read), load_vehicle("f450"))]
    ]
    assert fits[0].best == fits[1].best
    assert depthsim.flight.diagnose(read, "f450").verdict == depthsim.flight.diagnose([str(read)], one.vehicle).verdict


def test_the_tour_shows_the_code_that_it_runs() -> None:
    import runpy

    tour = Path(depthsim.__file__).parents[1] / "docs" / "tour.py"
    parts, page = runpy.run_path(str(tour))["PARTS"], tour.with_suffix(".md").read_text(encoding="utf-8")
    assert all(reported in page and code in page for reported, code in parts.items())
    assert sum(bool(line) for code in parts.values() for line in code.splitlines()) <= 25
