"""depthsim fit-material on a run: the m of each material in it."""

from pathlib import Path

import numpy as np
import pytest
from captures import two_walls, write_run
from typer.testing import CliRunner

from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.material_fit import fit_curve, measure_run
from depthsim.runs.folder import Run
from depthsim.scene import Scene

FLOOR_RUN = Path(__file__).parents[2] / "../shared/data/d435_floor"


@pytest.mark.parametrize(("masks", "tilt"), [(False, 0.0), (True, 0.0), (False, 0.3)])
def test_a_run_gives_the_m_of_each_material(tmp_path: Path, masks: bool, tilt: float) -> None:
    run = Run.open(write_run(tmp_path / "run", masks=masks, tilt=tilt))
    fits = {curve.tag: fit_curve(curve) for curve in measure_run(run, two_walls(), width=0.25)}
    assert fits["a"].m == pytest.approx(0.4, abs=0.01)
    assert fits["b"].m == pytest.approx(0.9, abs=0.01)
    for tag, m in (("a", 0.4), ("b", 0.9)):
        assert fits[tag].ci95[0] - 0.005 < m < fits[tag].ci95[1] + 0.005


def test_surfaces_too_tilted_are_left_out(tmp_path: Path) -> None:
    run = Run.open(write_run(tmp_path / "run"))
    all_pixels = sum(curve.column("pixels").sum() for curve in measure_run(run, two_walls()))
    curves = measure_run(run, two_walls(), most_incidence=20)
    assert 0.05 < sum(curve.column("pixels").sum() for curve in curves) / all_pixels < 0.5
    assert max(curve.column("incidence").max() for curve in curves) < 20
    with pytest.raises(InputError, match="no material is seen"):
        measure_run(run, two_walls(), most_incidence=0)


def test_a_real_d435_follows_the_square() -> None:
    if not FLOOR_RUN.is_dir():
        pytest.skip("the recording d435_floor is not there")
    run = Run.open(FLOOR_RUN)
    corners = np.array([[-40, -40, 0], [40, -40, 0], [40, 40, 0], [-40, 40, 0]], np.float64)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    (curve,) = measure_run(run, Scene("floor", corners, faces, np.zeros(2, np.uint8), ("cement",)))
    fit = fit_curve(curve)
    assert fit.better == "quadratic"
    assert fit.quadratic.r2 > 0.95
    assert fit.r2 < 0.5
    assert 0.05 < fit.k * run.camera.focal_baseline < 0.1  # disparity noise [px]


def test_the_command_takes_a_run(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run")
    materials = tmp_path / "materials.yaml"
    materials.write_text("cement: {m: 0.3}\nplastic: {m: 0.3}\n")
    arguments = ["fit-material", str(folder), "--materials", str(materials), "--tag", "a=cement", "--tag", "*=plastic"]
    done = CliRunner().invoke(app, [*arguments, "--fit-floor"], catch_exceptions=False)
    assert done.exit_code == 0
    assert "cement: m = 0.4" in done.output or "cement: m = 0.39" in done.output
    assert "material_noise: {floor: 0.0" in done.output
