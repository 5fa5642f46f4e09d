"""Presets against the datasheet's angles, its minimum depths and a unit in hand."""

from math import atan, degrees
from pathlib import Path

import pytest

from depthsim.camera import read_camera
from depthsim.errors import InputError
from depthsim.presets import DISPARITIES, MODES, PRESETS, preset, resolve_camera

FLOOR = Path(__file__).parents[1] / "../shared/data/d435_floor"

MODES_OF_ALL = [(name, size) for name in PRESETS for size in MODES]


def angle(length: float, focal: float) -> float:
    return 2 * degrees(atan(length / 2 / focal))


@pytest.mark.parametrize("name", PRESETS)
def test_baselines_and_defaults(name: str) -> None:
    camera = preset(name.upper())
    assert camera.name.lower() == name
    assert camera.baseline == {"d405": 0.018, "d415": 0.055, "d435": 0.05, "d435i": 0.05, "d455": 0.095}[name]
    assert (camera.width, camera.height) == ((1280, 720) if name == "d415" else (848, 480))
    assert camera.depth_scale == (1e-4 if name == "d405" else 1e-3)
    assert camera.rate == 30
    assert camera.rate in MODES[camera.width, camera.height]


@pytest.mark.parametrize("name", PRESETS)
def test_every_fact_has_a_source(name: str) -> None:
    facts = set(vars(PRESETS[name])) - {"name", "sources"}
    assert facts == set(PRESETS[name].sources)


@pytest.mark.parametrize(("name", "size"), MODES_OF_ALL)
def test_angles_are_the_nominal_ones(name: str, size: tuple[int, int]) -> None:
    width, height = size
    camera = preset(name, width, height, rate=15)
    assert camera.fx == camera.fy
    assert (camera.cx, camera.cy) == ((width - 1) / 2, (height - 1) / 2)
    assert camera.rate == 15
    if size != (640, 480):
        assert angle(width, camera.fx) == pytest.approx(PRESETS[name].fov[0], abs=1e-9)
        assert angle(height, camera.fx) == pytest.approx(PRESETS[name].fov[1], abs=2)
        return
    # Depth FOV for VGA in the same table of the datasheet, with its tolerances.
    nominal = (50, 40) if name == "d415" else (75, 62)
    assert angle(width, camera.fx) == pytest.approx(nominal[0], abs=2)
    assert angle(height, camera.fx) == pytest.approx(nominal[1], abs=1)


def test_vga_is_a_crop_of_the_full_height() -> None:
    assert preset("d435", 640, 480).fx == pytest.approx(0.6 * preset("d435", 1280, 720).fx)
    assert preset("d415", 640, 480).fx == pytest.approx(480 / 720 * preset("d415", 1280, 720).fx)
    assert preset("d435", 460, 320).fx == pytest.approx(0.4 * preset("d435", 1280, 800).fx)


def test_a_unit_in_hand_is_within_the_lens_tolerance() -> None:
    if not (FLOOR / "camera.yaml").exists():
        pytest.skip("needs ../shared/data/d435_floor")
    unit, nominal = read_camera(FLOOR / "camera.yaml"), preset("d435", 640, 480)
    assert 1.04 < nominal.fx / unit.fx < 1.06
    assert abs(angle(1280, nominal.fx / 0.6) - angle(1280, unit.fx / 0.6)) < 3.1
    assert nominal.baseline == pytest.approx(unit.baseline, rel=0.01)


@pytest.mark.parametrize(("name", "size"), MODES_OF_ALL)
def test_minimum_depth_follows_from_the_disparities(name: str, size: tuple[int, int]) -> None:
    rule = preset(name, *size).focal_baseline / DISPARITIES
    least = PRESETS[name].min_z(*size)
    assert rule <= least < rule + 0.020
    assert least < 1.26 * rule
    if size == (1280, 720):
        assert size in PRESETS[name].min_z_table
        assert least < 1.05 * rule


def test_minimum_depth_beyond_the_table() -> None:
    assert PRESETS["d435"].min_z(848, 480) == 0.195
    assert PRESETS["d455"].min_z(848, 480) == pytest.approx(0.337, abs=0.001)
    assert PRESETS["d435"].min_z(460, 320) == pytest.approx(269.8 * 0.05 / 126, rel=1e-3)


def test_a_camera_is_a_name_a_mapping_or_a_path(tmp_path: Path) -> None:
    camera = preset("D455", 640, 360, 60)
    camera.write(tmp_path / "camera.yaml")
    assert resolve_camera("D455") == preset("d455")
    assert resolve_camera(camera.model_dump()) == camera
    assert resolve_camera(tmp_path / "camera.yaml") == camera
    assert resolve_camera(str(tmp_path / "camera.yaml")) == camera
    assert resolve_camera("camera.yaml", file=tmp_path / "profile.yaml") == camera


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("d999", ["profile.yaml: camera: ", "'d999' is no camera", "d405, d415, d435, d435i, d455"]),
        (435, ["435 is no camera", "d435i"]),
        (None, ["None is no camera", "d435i"]),
        ({"width": 640}, ["profile.yaml: camera.height: field required", "the keys are model, name, width"]),
        ({"preset": "d435"}, ["camera.width: field required"]),
        ("none.yaml", ["none.yaml: no such file"]),
        ("../camera.yaml", ["profile.yaml: camera: ", "leaves the folder"]),
        ("/camera.yaml", ["leaves the folder"]),
    ],
)
def test_broken_cameras_say_what_to_do(tmp_path: Path, value: object, words: list[str]) -> None:
    with pytest.raises(InputError) as error:
        resolve_camera(value, file=tmp_path / "profile.yaml")
    line = str(error.value)
    assert "\n" not in line
    assert all(word in line for word in words), line


def test_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    preset("d435").write(tmp_path / "camera.yaml")
    (inside / "camera.yaml").symlink_to(tmp_path / "camera.yaml")
    with pytest.raises(InputError, match="leaves the folder"):
        resolve_camera("camera.yaml", file=inside / "profile.yaml")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("d436",), "d436: is no camera preset; the presets are d405"),
        (("d435", 640), "d435: width and height go together; give both or neither"),
        (("d435", 0, 480), "d435: width: input should be greater than 0"),
        (("d435", 640, 480, -1), "d435: rate: input should be greater than 0"),
    ],
)
def test_broken_presets(arguments: tuple, words: str) -> None:
    with pytest.raises(InputError) as error:
        preset(*arguments)
    assert words in str(error.value)
