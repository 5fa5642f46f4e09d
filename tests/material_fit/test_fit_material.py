"""depthsim fit-material: the law it finds, how sure it is of it, and what it refuses."""

from pathlib import Path

import numpy as np
import pytest
from captures import CAMERA, DISTANCES, smooth, tilted_wall, write_captures
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.material_fit import Curve, fit_curve, fit_points, measure_wall
from depthsim.material_fit.captures import find_captures
from depthsim.material_fit.plane import plane_depth
from depthsim.material_fit.report import entry
from depthsim.material_fit.spread import block_numbers, effective_count, spread_of, tile_numbers
from depthsim.material_fit.words import comparison, result, warnings
from depthsim.materials import load_materials
from depthsim.runs.png import encode_png


@given(st.floats(0.05, 2), st.floats(0.001, 0.02), st.integers(3, 30))
@settings(max_examples=25)
def test_an_exact_curve_gives_its_m_and_floor(m: float, floor: float, points: int) -> None:
    d = np.linspace(0.5, 5, points)
    std = floor * np.exp(m * d)
    held = fit_points(d, std, np.full(points, 500), floor=floor)
    assert held.m == pytest.approx(m, abs=2e-3)  # E[log s] of 500 numbers is 0.1 % off log sigma
    both = fit_points(d, std, floor=None)
    assert (both.m, both.floor) == pytest.approx((m, floor), rel=1e-6)
    assert both.r2 == pytest.approx(1)
    assert both.std(d) == pytest.approx(std, rel=1e-6)


@pytest.mark.parametrize("points", [3, 6, 20])
@pytest.mark.parametrize("scatter", [0, 0.1])
@pytest.mark.parametrize("floor", [0.005, None])
def test_the_interval_holds_the_truth_19_times_of_20(points: int, scatter: float, floor: float | None) -> None:
    rng = np.random.default_rng([points, int(scatter * 10), floor is None])
    d, m, runs = np.linspace(0.5, 3, points), 0.5, 300
    n = np.geomspace(1000, 100, points).round()
    held = 0
    for _ in range(runs):
        s = 0.005 * np.exp(m * d + scatter * rng.standard_normal(points)) * np.sqrt(rng.chisquare(n - 1) / (n - 1))
        fit = fit_points(d, s, n, floor=floor)
        held += fit.ci95[0] <= m <= fit.ci95[1]
    assert 0.91 <= held / runs <= 0.985


@pytest.mark.parametrize("size", [1, 4])
def test_the_effective_count_tells_how_exact_a_std_is(size: int) -> None:
    """For noise correlated over some pixels, the scatter of the std from picture to picture is as predicted."""
    rng = np.random.default_rng(size)
    tile = tile_numbers(96, 96).ravel()
    noise = smooth(rng.standard_normal((150, 96, 96)), size).reshape(150, -1)
    spreads = [spread_of(item, (tile,), 0.0) for item in noise]
    scatter = np.std(np.log([item.std for item in spreads]))
    predicted = np.sqrt(1 / (2 * (np.median([item.count for item in spreads]) - 1)))
    assert scatter == pytest.approx(predicted, rel=0.25)
    # Independent pixels count one each; a sum of 4 in a row has Σρ² = 2.75 in each direction.
    expected = 96 * 96 / (1.0 if size == 1 else 2.75**2)
    assert np.median([item.count for item in spreads]) == pytest.approx(expected, rel=0.2)


def test_frames_that_repeat_themselves_count_once() -> None:
    rng = np.random.default_rng(0)
    one = rng.standard_normal((64, 64))
    errors = np.repeat(one.reshape(1, -1), 20, axis=0).ravel()
    tile, block = np.tile(tile_numbers(64, 64).ravel(), 20), np.repeat(block_numbers(20), 64 * 64)
    assert effective_count(errors**2, np.ones_like(errors), (tile, block)) < 1.5 * 64 * 64


def test_outliers_are_counted_and_left_out() -> None:
    rng = np.random.default_rng(1)
    errors = rng.standard_normal(40_000)
    errors[::50] = 30
    spread = spread_of(errors, (np.arange(40_000) // 400,), 0.0)
    assert spread.outliers == pytest.approx(0.02, abs=1e-4)
    assert spread.std == pytest.approx(1, abs=0.02)
    assert spread.robust_std == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("degrees", [0, 5, -30])
def test_a_tilted_plane_leaves_nothing(degrees: float) -> None:
    depth = tilted_wall(2.0, degrees).astype(np.float32).ravel()
    v, u = np.mgrid[0 : CAMERA.height, 0 : CAMERA.width].astype(np.float32)
    assert plane_depth(depth, u.ravel(), v.ravel(), 1e-3) == pytest.approx(depth, abs=2e-6)


@pytest.mark.parametrize("degrees", [0, 8])
@pytest.mark.parametrize("spoil", [False, True])
def test_a_wall_gives_its_m(tmp_path: Path, degrees: float, spoil: bool) -> None:
    folder = write_captures(tmp_path / "wall", lambda d: 0.005 * np.exp(0.6 * d), degrees=degrees, spoil=spoil)
    curve = measure_wall([folder], "cement")
    fit = fit_curve(curve)
    assert fit.m == pytest.approx(0.6, abs=0.005)
    assert fit.ci95[0] - 0.002 < 0.6 < fit.ci95[1] + 0.002  # units of 1 mm add 0.1 % at the nearest distance
    assert fit.r2 > 0.999
    assert fit.better == "exponential"
    assert curve.column("std") == pytest.approx(0.005 * np.exp(0.6 * DISTANCES), rel=0.02)
    assert curve.column("temporal_std") == pytest.approx(curve.column("std"), rel=0.02)
    assert curve.column("bias") == pytest.approx(np.full(6, curve.column("bias").mean()), abs=0.03)
    assert curve.column("holes") == pytest.approx(0.15 if spoil else 0, abs=0.02)
    assert curve.column("outliers") == pytest.approx(0.02 / 0.85 if spoil else 0, abs=0.01)


def test_noise_that_stays_is_spatial_and_not_temporal(tmp_path: Path) -> None:
    folder = write_captures(tmp_path / "wall", lambda d: 0.02, fixed=True)
    curve = measure_wall([folder], "cement")
    assert curve.column("std") == pytest.approx(0.02, rel=0.03)
    assert (curve.column("temporal_std") == 0).all()
    single = measure_wall([write_captures(tmp_path / "single", lambda d: 0.02, frames=1)], "cement")
    with pytest.raises(InputError, match="no temporal std"):
        fit_curve(single, spread="temporal")


def test_correlated_noise_counts_less(tmp_path: Path) -> None:
    rough = measure_wall([write_captures(tmp_path / "a", lambda d: 0.02)], "cement").column("count")
    soft = measure_wall([write_captures(tmp_path / "b", lambda d: 0.02, size=3)], "cement").column("count")
    assert np.median(soft) < 0.5 * np.median(rough)


def test_a_real_camera_is_distinguished_from_the_law(tmp_path: Path) -> None:
    folder = write_captures(tmp_path / "wall", lambda d: 0.0055 * d**2)
    curve = measure_wall([folder], "cement")
    fit = fit_curve(curve)
    assert fit.better == "quadratic"
    assert fit.k == pytest.approx(0.0055, rel=0.02)
    assert fit.quadratic.r2 > 0.99 > fit.r2
    text = comparison(fit, curve.focal_baseline)
    assert f"{0.0055 * 90 * 0.05:.3f} px" in text and "disparity_noise" in text


@pytest.mark.parametrize(
    ("name", "metres"),
    [
        ("0.50m", 0.5),
        ("1.25", 1.25),
        ("150cm", 1.5),
        ("800mm", 0.8),
        ("cement_2.5m", 2.5),
        ("wall-3M", 3),
        (".75", 0.75),
    ],
)
def test_names_of_distances(tmp_path: Path, name: str, metres: float) -> None:
    folder = tmp_path / "captures" / name / "depth"
    folder.mkdir(parents=True)
    (folder / "0.png").write_bytes(encode_png(np.ones((8, 8), np.uint16)))
    for given_folder in (folder.parent, folder.parents[1]):
        (capture,) = find_captures([given_folder])
        assert capture.distance == pytest.approx(metres)


def test_a_list_of_distances(tmp_path: Path) -> None:
    root = write_captures(tmp_path / "wall", lambda d: 0.02, frames=2)
    names = [f"{distance:.2f}m" for distance in DISTANCES]
    lines = [f"{name}, {distance}" for name, distance in zip(names, DISTANCES, strict=True)]
    (root / "distances.csv").write_text("# by tape\nfolder,distance_m\n" + "\n".join(lines[::-1]) + "\n")
    by_list = measure_wall([root], "cement")
    (root / "distances.csv").unlink()
    by_name = measure_wall([root], "cement")
    each = measure_wall([root / name for name in names], "cement", camera=CAMERA)
    assert by_list.points == by_name.points == each.points


def test_the_command_writes_an_entry_that_is_read_back(tmp_path: Path) -> None:
    folder = write_captures(tmp_path / "captures", lambda d: 0.005 * np.exp(0.6 * d))
    written = []
    for name in ("one", "two"):
        arguments = ["fit-material", str(folder), "--tag", "brick: red", "--out", str(tmp_path / name)]
        done = CliRunner().invoke(app, arguments, catch_exceptions=False)
        assert done.exit_code == 0
        assert "brick: red: m = 0.6" in done.output and "fits better than std ∝ d²" in done.output
        written.append([file.read_bytes() for file in sorted((tmp_path / name).iterdir())])
    assert written[0] == written[1]
    assert {file.name for file in (tmp_path / "one").iterdir()} == {
        "fitted_materials.csv", "fitted_materials.png", "fitted_materials.yaml",
    }  # fmt: skip
    materials = load_materials(tmp_path / "one" / "fitted_materials.yaml")
    assert materials["brick: red"].m == pytest.approx(0.6, abs=0.005)
    assert "captures" in materials["brick: red"].source and "95 % interval" in materials["brick: red"].source
    assert (tmp_path / "one" / "fitted_materials.csv").read_text().count("\n") == 1 + DISTANCES.size


def test_a_negative_m_has_no_entry() -> None:
    d = np.array([0.5, 1, 1.5, 2])
    fit = fit_points(d, 0.002 * np.exp(0.05 * d))
    curve = Curve("cement", "here", ())
    assert fit.m < 0
    assert entry(fit, curve) is None
    assert "m = -" in result(fit)
    assert any("m is negative" in text for text in warnings(curve, fit))
