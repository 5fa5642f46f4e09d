"""What depthsim fit-material refuses, and how it says so."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from captures import write_run
from typer.testing import CliRunner

from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.material_fit import fit_points
from depthsim.runs.png import encode_png

FAULTS: dict[str, tuple[Callable[[Path], list[str]], str]] = {}


def fault(name: str, message: str) -> Callable[[Callable[[Path], list[str]]], None]:
    def keep(make: Callable[[Path], list[str]]) -> None:
        FAULTS[name] = (make, message)

    return keep


def small(root: Path, names: tuple[str, ...], value: int = 1000) -> str:
    rng = np.random.default_rng(2)
    for name in names:
        (root / name).mkdir(parents=True)
        noise = rng.integers(-9, 9, (64, 64)) if value else 0
        (root / name / "0.png").write_bytes(encode_png((value + noise * np.ones((64, 64))).astype(np.uint16)))
    return str(root)


@fault("no such folder", "no such folder")
def _(path: Path) -> list[str]:
    return [str(path / "nothing"), "--tag", "a"]


@fault("empty folder", "holds no depth pictures; put depth PNGs into folders named by their distance")
def _(path: Path) -> list[str]:
    return [str(path), "--tag", "a"]


@fault("name without distance", "'near' is no distance")
def _(path: Path) -> list[str]:
    return [small(path, ("near",)), "--tag", "a"]


@fault("no tag", "--tag: is not given; name the one material")
def _(path: Path) -> list[str]:
    return [small(path, ("1m", "1.1m"))]


@fault("no camera", "camera.yaml: is missing")
def _(path: Path) -> list[str]:
    return [small(path, ("1m", "1.1m")), "--tag", "a"]


@fault("one distance", "has 1 distance of a; record at least 2")
def _(path: Path) -> list[str]:
    return [small(path, ("1m",)), "--tag", "a", "--depth-scale", "0.001"]


@fault("two distances for two unknowns", "has 2 distances of a; record at least 3")
def _(path: Path) -> list[str]:
    return [small(path, ("1m", "1.1m")), "--tag", "a", "--depth-scale", "0.001", "--fit-floor"]


@fault("all holes", "no distance can be measured (1 m: 1m has no frame with 100 depths")
def _(path: Path) -> list[str]:
    return [small(path, ("1m", "2m"), 0), "--tag", "a", "--depth-scale", "0.001"]


@fault("wrong scale", "the wall is 10 m away by its depth, 1 m by its name; correct the distance or the depth scale")
def _(path: Path) -> list[str]:
    return [small(path, ("1m",)), "--tag", "a", "--depth-scale", "0.01"]


@fault("scale that is no scale", "--depth-scale: is -1")
def _(path: Path) -> list[str]:
    return [small(path, ("1m",)), "--tag", "a", "--depth-scale", "-1"]


@fault("roi of nothing", "--roi: is 0")
def _(path: Path) -> list[str]:
    return [small(path, ("1m",)), "--tag", "a", "--roi", "0"]


@fault("another camera", "is 64x64, the camera is 848x480")
def _(path: Path) -> list[str]:
    return [small(path, ("1m",)), "--tag", "a", "--camera", "d435"]


@fault("8-bit pictures", "is not 16-bit grey")
def _(path: Path) -> list[str]:
    root = small(path, ("1m",))
    (path / "1m" / "1.png").write_bytes(encode_png(np.ones((64, 64), np.uint8)))
    return [root, "--tag", "a", "--depth-scale", "0.001"]


@fault("truncated picture", "is a damaged PNG")
def _(path: Path) -> list[str]:
    root = small(path, ("1m",))
    (path / "1m" / "0.png").write_bytes((path / "1m" / "0.png").read_bytes()[:100])
    return [root, "--tag", "a", "--depth-scale", "0.001"]


@fault("list with other columns", "distances.csv: line 1: has the columns 'name,metres'; write `folder,distance_m`")
def _(path: Path) -> list[str]:
    (path / "distances.csv").write_text("name,metres\n1m,1\n")
    return [small(path, ("1m",)), "--tag", "a"]


@fault("list that leaves the folder", "leaves the folder of this file")
def _(path: Path) -> list[str]:
    (path / "distances.csv").write_text("folder,distance_m\n../1m,1\n")
    return [small(path, ("1m",)), "--tag", "a"]


@fault("list with a missing folder", "line 2: 2m: no such folder")
def _(path: Path) -> list[str]:
    (path / "distances.csv").write_text("folder,distance_m\n2m,1\n")
    return [small(path, ("1m",)), "--tag", "a"]


@fault("list with a distance that is none", "line 2: 'nan' is no distance")
def _(path: Path) -> list[str]:
    (path / "distances.csv").write_text("folder,distance_m\n1m,nan\n")
    return [small(path, ("1m",)), "--tag", "a"]


@fault("a run beside others", "is given beside a run")
def _(path: Path) -> list[str]:
    return [str(write_run(path / "run")), small(path, ("1m",))]


@fault("a run without a scene", "holds no scene; name it with --scene")
def _(path: Path) -> list[str]:
    folder = write_run(path / "run")
    (folder / "scene.obj").unlink()
    return [str(folder)]


@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_one_line(tmp_path: Path, name: str) -> None:
    make, message = FAULTS[name]
    out = tmp_path / "out"
    with pytest.raises(InputError) as caught:
        CliRunner().invoke(app, ["fit-material", *make(tmp_path), "--out", str(out)], catch_exceptions=False)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not out.exists()


@pytest.mark.parametrize(
    ("d", "s", "n", "message"),
    [
        ([1, 2], [0.01], None, "differ in length"),
        ([1, np.nan], [0.01, 0.02], None, "point 1: the distance is nan"),
        ([1, 2], [0.01, 0], None, "point 1: the std is 0"),
        ([1, 2], [0.01, 0.02], [10, 1], "point 1: the count is 1"),
        ([1, 1], [0.01, 0.02], None, "has 1 distance; record at least 2"),
        ([], [], None, "has 0 distances"),
    ],
)
def test_numbers_that_cannot_be_fitted(d: list, s: list, n: list | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        fit_points(d, s, n)
