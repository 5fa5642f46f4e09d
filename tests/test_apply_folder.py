"""`depthsim apply`: folders of clean depth into what a camera would store, or one line and nothing."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shapes import camera
from typer.testing import CliRunner

from depthsim.camera import read_camera
from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.runs.png import decode_png, encode_png
from depthsim.sensor import Sensor

EYE = camera(64, 48, 50)


def depth(count: int) -> np.ndarray:
    z = np.linspace(1.0, 3.0, 64 * 48).reshape(48, 64)
    return np.stack([z + 0.01 * k for k in range(count)]).astype(np.float32)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    folder = tmp_path / "in"
    folder.mkdir()
    EYE.write(folder / "camera.yaml")
    for k in (2, 10):
        (folder / f"{k}.png").write_bytes(encode_png(np.rint(depth(1)[0] * 1000).astype(np.uint16)))
    np.save(folder / "30.npy", depth(20))
    np.save(folder / "4.npy", depth(1)[0])
    return folder


def run(*words: Any) -> Any:
    return CliRunner().invoke(app, ["apply", *map(str, words)])


@pytest.mark.parametrize("profile", ["d435", "d435_filtered"])
def test_a_folder_is_one_sequence_in_the_order_of_its_numbers(profile: str, source: Path, tmp_path: Path) -> None:
    done = run(profile, source, tmp_path / "out", "--seed", 3)
    assert done.exit_code == 0 and "23 frames" in done.output
    png = decode_png(source / "2.png") * np.float32(0.001)
    whole = np.concatenate([png[None], depth(1), png[None], depth(20)])
    wanted = Sensor(camera=EYE, profile=profile).apply(whole, seed=3)
    np.testing.assert_array_equal(decode_png(tmp_path / "out" / "2.png"), wanted.depth_raw[0])
    np.testing.assert_array_equal(np.load(tmp_path / "out" / "4.npy"), wanted.depth_raw[1])
    np.testing.assert_array_equal(np.load(tmp_path / "out" / "30.npy"), wanted.depth_raw[3:])
    assert read_camera(tmp_path / "out" / "camera.yaml") == wanted.camera
    assert wanted.camera.shape == ((24, 32) if profile == "d435_filtered" else (48, 64))


def test_a_preset_has_the_size_of_the_pictures(source: Path, tmp_path: Path) -> None:
    (source / "camera.yaml").unlink()
    assert run("paper", source, tmp_path / "out", "--camera", "d435").exit_code == 0
    assert read_camera(tmp_path / "out" / "camera.yaml").shape == (48, 64)


def nan(folder: Path) -> None:
    spoilt = depth(3)
    spoilt[2, 4, 5] = np.nan
    np.save(folder / "30.npy", spoilt)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (nan, "30.npy: frame 2, pixel (5, 4): is nan; give metres"),
        (lambda f: np.save(f / "30.npy", np.ones((48, 64), np.int32)), "30.npy: is int32, not float"),
        (lambda f: np.save(f / "30.npy", np.ones((48, 65))), "30.npy: has the shape (48, 65)"),
        (lambda f: np.save(f / "30.npy", np.ones(5)), "30.npy: has the shape (5,)"),
        (lambda f: (f / "30.npy").write_bytes(b"no"), "30.npy: is no whole .npy"),
        (
            lambda f: (f / "10.png").write_bytes(encode_png(np.ones((48, 64), np.uint8))),
            "10.png: is an image of 8 bits",
        ),
        (lambda f: (f / "10.png").write_bytes(b"no"), "10.png"),
        (lambda f: (f / "camera.yaml").unlink(), "has no camera.yaml; write one there, or give --camera"),
        (lambda f: [file.unlink() for file in f.iterdir()], "holds no .png and no .npy"),
    ],
)
def test_a_bad_folder_is_one_line_and_nothing_is_written(spoil: Any, words: str, source: Path, tmp_path: Path) -> None:
    spoil(source)
    error = run("paper", source, tmp_path / "out").exception
    assert isinstance(error, InputError) and words in str(error) and "\n" not in str(error)
    assert [path.name for path in tmp_path.iterdir()] == ["in"]


def test_what_is_there_stays(source: Path, tmp_path: Path) -> None:
    assert "holds files" in str(run("paper", source, source).exception)
    assert "is no folder" in str(run("paper", tmp_path / "none", tmp_path / "out").exception)
    assert "there is no material 'tin'" in str(run("paper", source, tmp_path / "out", "--material", "tin").exception)


PAGE = (Path(__file__).parents[1] / "docs" / "apply.md").read_text(encoding="utf-8")
RECIPES = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("recipe", RECIPES, ids=["any", "mujoco", "pybullet"])
def test_each_recipe_of_the_page_runs_as_it_is_written(recipe: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "egl")
    for package in re.findall(r"^import (mujoco|pybullet)$", recipe, re.MULTILINE):
        pytest.importorskip(package, reason=f"needs `pip install {package}`")
    there: dict[str, Any] = {}
    exec(compile(recipe, "docs/apply.md", "exec"), there)
    raw = there["stored"].depth_raw
    assert raw.dtype == np.uint16 and 0.01 < (raw == 0).mean() < 0.6
    assert 0.5 < np.median(raw[raw > 0]) / 1000 < 5
