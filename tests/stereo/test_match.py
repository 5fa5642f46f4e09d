"""`depthsim match`: depth from a pair of files, and what it refuses."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from shapes import camera
from stereo_pairs import textured
from typer.testing import CliRunner

from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.runs.png import decode_png, encode_png

CAMERA = camera(200, 90, 150.0)


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    for name, image in zip(("left", "right"), textured((90, 200), 15.0), strict=True):
        (tmp_path / f"{name}.png").write_bytes(encode_png(image))
    CAMERA.write(tmp_path / "camera.yaml")
    return tmp_path


def match(folder: Path, *more: str, **changes: str) -> str:
    names = {"left": "left.png", "right": "right.png", "camera": "camera.yaml", "out": "depth.png"} | changes
    left, right, eye, out = (str(folder / names[key]) for key in ("left", "right", "camera", "out"))
    result = CliRunner().invoke(app, ["match", left, right, "--camera", eye, "--out", out, *more])
    if result.exception is not None:
        raise result.exception
    return result.output


def test_the_depth_is_the_baseline_over_the_disparity(pair: Path) -> None:
    said = match(pair)
    depth = decode_png(pair / "depth.png")
    assert depth.dtype == np.uint16
    inner = depth[10:-10, 40:-10]
    assert np.median(inner) == pytest.approx(1000 * CAMERA.focal_baseline / 15, abs=2)
    assert (inner == 0).mean() < 0.02
    assert "depth" in said
    assert "median 0.50 m" in said


def test_sixteen_bits_and_grey_in_three_channels_are_read(pair: Path) -> None:
    match(pair)
    eight = decode_png(pair / "depth.png")
    for name in ("left", "right"):
        image = decode_png(pair / f"{name}.png")
        (pair / f"{name}3.png").write_bytes(encode_png(np.repeat(image[..., None], 3, axis=2)))
        (pair / f"{name}16.png").write_bytes(encode_png(image.astype(np.uint16) << 8))
    match(pair, left="left3.png", right="right3.png")
    assert (decode_png(pair / "depth.png") == eight).all()
    match(pair, left="left16.png", right="right16.png")
    sixteen = decode_png(pair / "depth.png").astype(int)
    assert (np.abs(sixteen - eight) <= 3).mean() > 0.97


def test_settings_are_taken_from_a_file(pair: Path) -> None:
    (pair / "how.yaml").write_text("disparities: 12\n")
    match(pair, "--settings", str(pair / "how.yaml"))
    depth = decode_png(pair / "depth.png")
    assert (depth[depth > 0] > 1000 * CAMERA.focal_baseline / 13).all()


def test_a_preset_is_named_in_a_flag_or_in_the_file(pair: Path) -> None:
    (pair / "how.yaml").write_text("preset: high_accuracy\n")
    match(pair, "--settings", str(pair / "how.yaml"))
    by_file = decode_png(pair / "depth.png")
    match(pair, "--preset", "high_accuracy")
    assert (decode_png(pair / "depth.png") == by_file).all()


@pytest.mark.parametrize(
    ("more", "message"),
    [(("--preset", "best"), "best: is no preset; name one of default, high_accuracy"),
     (("--preset", "high_accuracy", "--settings", "how.yaml"), "stands beside --settings; write preset")],
)  # fmt: skip
def test_a_preset_that_cannot_be_is_one_line(pair: Path, more: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError) as caught:
        match(pair, *more)
    assert message in str(caught.value)
    assert not (pair / "depth.png").exists()


FAULTS: dict[str, tuple[Callable[[Path], dict[str, str]], str]] = {}


def fault(name: str, message: str) -> Callable[[Callable[[Path], dict[str, str]]], None]:
    def keep(make: Callable[[Path], dict[str, str]]) -> None:
        FAULTS[name] = (make, message)

    return keep


@fault("no left image", "no such file or directory; give a PNG file")
def _(folder: Path) -> dict[str, str]:
    return {"left": "nothing.png"}


@fault("no camera", "no such file; give the path of a camera.yaml")
def _(folder: Path) -> dict[str, str]:
    return {"camera": "nothing.yaml"}


@fault("a broken camera", "camera.yaml: fx: ")
def _(folder: Path) -> dict[str, str]:
    text = (folder / "camera.yaml").read_text()
    (folder / "camera.yaml").write_text(text.replace("fx: 150.0", "fx: -1"))
    return {}


@fault("no PNG", "right.png: is not a PNG; give a PNG file")
def _(folder: Path) -> dict[str, str]:
    (folder / "right.png").write_text("hello")
    return {}


@fault("half a PNG", "right.png: is a damaged PNG: it ends too early")
def _(folder: Path) -> dict[str, str]:
    data = (folder / "right.png").read_bytes()
    (folder / "right.png").write_bytes(data[: len(data) // 2])
    return {}


@fault("another size", "is 100x90, but ")
def _(folder: Path) -> dict[str, str]:
    image = decode_png(folder / "right.png")
    (folder / "right.png").write_bytes(encode_png(np.ascontiguousarray(image[:, :100])))
    return {}


@fault("colour", "left.png: is a colour image; give the grey image")
def _(folder: Path) -> dict[str, str]:
    image = np.random.default_rng(0).integers(0, 255, (90, 200, 3), dtype=np.uint8)
    (folder / "left.png").write_bytes(encode_png(image))
    return {}


@fault("eight and sixteen bits", "right.png: has not as many bits as ")
def _(folder: Path) -> dict[str, str]:
    image = decode_png(folder / "right.png").astype(np.uint16)
    (folder / "right.png").write_bytes(encode_png(image))
    return {}


@fault("distortion", "camera.yaml: distortion: is not zero, so the pair is not rectified")
def _(folder: Path) -> dict[str, str]:
    camera(200, 90, 150.0, model="brown_conrady", distortion=(0.01, 0, 0, 0, 0)).write(folder / "camera.yaml")
    return {}


@fault("out is no PNG", "depth.tiff: is not the name of a PNG")
def _(folder: Path) -> dict[str, str]:
    return {"out": "depth.tiff"}


@fault("out lies nowhere", "cannot be written")
def _(folder: Path) -> dict[str, str]:
    return {"out": "nowhere/depth.png"}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_one_line_and_nothing_is_written(pair: Path, name: str) -> None:
    make, message = FAULTS[name]
    changes = make(pair)
    with pytest.raises(InputError) as caught:
        match(pair, **changes)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (pair / "depth.png").exists()
