"""The paper's protocol, a short slice of it: the simulator gives the law, and the benchmark says so."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks import paper, paper_wall


@pytest.fixture(scope="module")
def series() -> dict[str, paper_wall.Series]:
    distances = np.linspace(0.5, 8, 16)
    return {tag: paper_wall.measure(tag, distances) for tag in paper_wall.M}


def test_the_std_is_the_law(series: dict[str, paper_wall.Series]) -> None:
    for tag, one in series.items():
        inside = one.distance <= 6.5
        # 1 mm units add a twelfth of their square; 147,200 pixels give the std to 0.2 %.
        expected = np.sqrt(paper_wall.law(tag, one.distance) ** 2 + 1e-6 / 12)
        assert one.std[inside] == pytest.approx(expected[inside], rel=0.01)
        assert one.zeros[inside] == pytest.approx(0.01, abs=0.0015)
        assert not one.saturated.any()


def test_where_depths_fall_below_zero_the_std_is_that_of_a_cut_gaussian(series: dict[str, paper_wall.Series]) -> None:
    plastic = series["plastic"]
    assert plastic.std == pytest.approx(paper_wall.clipped_std("plastic", plastic.distance), rel=0.01)
    assert plastic.std[-1] < 0.93 * paper_wall.law("plastic", plastic.distance)[-1]
    assert plastic.zeros[-1] > 0.04
    assert paper_wall.first_off(plastic, "plastic") == pytest.approx(7.5)
    assert paper_wall.first_off(series["cement"], "cement") is None


def test_a_real_d435_is_as_measured() -> None:
    for distance, std in paper_wall.REAL_D435:
        assert paper_wall.real_d435(np.array([distance]))[0] == pytest.approx(std, rel=0.06)


def test_the_wall_is_square_to_the_camera() -> None:
    eye = paper_wall.sensor("cement")
    clean = eye.measure(paper_wall.pose(8.0), threads=1).clean
    assert clean.hit.all()
    assert clean.depth == pytest.approx(8.0, abs=1e-5)
    assert 2 * np.degrees(np.arctan(eye.camera.width / 2 / eye.camera.fx)) == pytest.approx(87)


def test_both_ways_of_the_noise_step_give_the_same_noise() -> None:
    eye = paper_wall.sensor("cement")
    clean = eye.measure(paper_wall.pose(3.0), threads=1).clean
    ours, plain = paper.noise_step(eye, clean, 2), paper.numpy_step(clean, np.random.default_rng(0))
    for units in (ours, plain):
        assert (units == 0).mean() == pytest.approx(0.01, abs=0.0015)
        assert units[units > 0].std() == pytest.approx(1000 * paper_wall.law("cement", np.array(3.0)), rel=0.01)
        assert units[units > 0].mean() == pytest.approx(3000, abs=0.3)


def test_it_prints_the_published_figures_beside_ours(tmp_path: Path) -> None:
    from typer import Typer

    app = Typer()
    app.command()(paper.main)
    done = CliRunner().invoke(app, ["--step", "0.5", "--rounds", "2", "--out", str(tmp_path)], catch_exceptions=False)
    assert done.exit_code == 0
    assert "16 positions" in done.output
    for published in ("0.71", "0.54", "0.26", "0.62", "12.1", "i7-10750H", "Table 1"):
        assert published in done.output
    row = next(line for line in done.output.splitlines() if line.startswith("│ cement "))
    ours = [float(value) for value in re.findall(r"\d\.\d{4}", row)]
    assert len(ours) == 3 and min(ours) > 0.999
    lines = (tmp_path / "paper.csv").read_text().splitlines()
    assert len(lines) == 1 + 3 * 16
    assert (tmp_path / "paper.png").read_bytes().startswith(b"\x89PNG")
