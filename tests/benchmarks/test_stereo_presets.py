"""The presets beside a chip's depth: what is counted."""

from pathlib import Path

import numpy as np
import typer
from typer.testing import CliRunner

from benchmarks.stereo_presets import at_pixels_of, beside_the_chip, hidden_from, holes_of


def test_shares_are_of_what_the_chip_has_and_has_not() -> None:
    chip = np.full((40, 40), 10, np.float32)
    chip[10:20, 10:20] = 0
    found = chip + np.float32(0.3)
    found[10:20, 10:15], found[10:20, 15:20] = 5, -1
    found[30:32], found[32:33] = -1, 13
    shares = list(beside_the_chip(found, chip).values())
    kept = 40 * 40 - 100
    np.testing.assert_allclose(shares, [50, 100 * 80 / kept, 100 * (kept - 120) / kept, 100 * 40 / (kept - 80)])


def test_cracks_and_what_touches_the_border_are_no_holes() -> None:
    valid = np.ones((30, 30), bool)
    valid[:, 7] = valid[5, 5] = False
    valid[:6, 20:] = False
    valid[12:20, 12:22] = False
    expected = np.zeros_like(valid)
    expected[12:20, 12:22] = True
    assert (holes_of(valid) == expected).all()


def test_a_camera_on_the_left_does_not_see_what_is_right_of_a_plate() -> None:
    disparity = np.full((3, 60), 10, np.float32)
    disparity[:, 20:30] = 40
    disparity[1, 30:36] = -1  # a hole is what lies behind
    hidden = hidden_from(disparity, 0.25)
    expected = np.zeros_like(hidden)
    expected[:, 30:36] = True  # a quarter of the step of 30 px is 7.5 px, less half a pixel at both ends
    assert (hidden == expected).all()
    assert not hidden_from(disparity, 0.0).any()


def test_what_no_colour_camera_saw_is_no_hole() -> None:
    chip = np.full((40, 40), 10, np.float32)
    chip[10:20, 10:20] = 0
    hidden = np.zeros(chip.shape, bool)
    hidden[:, :15] = True
    found = np.where(hidden, np.float32(10), chip)
    assert beside_the_chip(found, chip)["filled where the chip is empty"] == 50
    assert beside_the_chip(found, chip, hidden)["filled where the chip is empty"] == 0


def test_pictures_of_another_size_have_the_nearest_values() -> None:
    assert at_pixels_of(np.arange(8, dtype=np.float32)[None].repeat(4, 0), (2, 4)).tolist() == [[1, 3, 5, 7]] * 2


def test_a_row_for_every_preset(tmp_path: Path) -> None:
    from stereo_pairs import textured

    from benchmarks.stereo_presets import main
    from depthsim.runs.png import encode_png

    left, right = textured((80, 200), 12.0)
    (tmp_path / "camera.yaml").write_text(
        "model: pinhole\nname: pair\nwidth: 200\nheight: 80\nfx: 200.0\nfy: 200.0\ncx: 99.5\ncy: 39.5\nbaseline: 0.06\n"
        "depth_scale: 0.001\nrate: 30\n"
    )
    depth = np.full((80, 200), 1000, np.uint16)
    for name, image in (("left", left), ("right", right), ("depth", depth)):
        (tmp_path / f"{name}.png").write_bytes(encode_png(image))

    app = typer.Typer()
    app.command()(main)
    result = CliRunner().invoke(app, [str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert all(name in result.output for name in ("default", "high_accuracy", "high_density", "medium_density"))
