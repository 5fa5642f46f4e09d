"""Depth in the colour camera's pictures: against librealsense's rule in plain loops, and what it does at an edge."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from commands import depthsim_here
from sensing import CAMERA, FAR, LEFT, NEAR, RIGHT, STEP_CASTER
from shapes import MATERIALS, Array, as_scene, wall

from depthsim.camera import Camera, read_camera
from depthsim.errors import InputError
from depthsim.presets import PRESETS, preset
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.effects.align import AlignToColor
from depthsim.sensor.effects.noise import DisparityNoise

COLOR: dict[str, Any] = {"width": 240, "height": 120, "fx": 200.0, "fy": 200.0, "cx": 119.5, "cy": 59.5}
BESIDE = CAMERA.model_copy(update={"color": COLOR | {"translation": (-0.015, 0, 0)}})
"""A colour camera 15 mm left of the left imager, its equal: at 1 m all moves 3 px to the right, at 2.5 m by 1.2 px."""


def measured(eye: Camera, *effects: Effect, caster: Caster = STEP_CASTER, **keys: Any) -> Array:
    return Sensor(caster, eye, effects, MATERIALS).measure(np.eye(4), **keys).depth_raw.astype(float) / 1000


def by_loops(units: Array, eye: Camera) -> Array:
    """What librealsense does with a picture of whole units, pixel by pixel, in float64."""
    color = eye.color
    assert color is not None
    out = np.zeros(color.shape, np.int64)
    to = np.linalg.inv(color.pose)
    k1, k2, p1, p2, k3 = color.distortion
    for v, u in np.argwhere(units > 0):
        ends = []
        for step in (-0.5, 0.5):
            z = units[v, u] * eye.depth_scale
            x, y, z = (
                to[:3, :3] @ (np.array([(u + step - eye.cx) / eye.fx, (v + step - eye.cy) / eye.fy, 1]) * z) + to[:3, 3]
            )
            a, b = x / z, y / z
            r = a * a + b * b
            f = 1 + k1 * r + k2 * r**2 + k3 * r**3
            a, b = a * f + 2 * p1 * a * b + p2 * (r + 2 * a * a), b * f + p1 * (r + 2 * b * b) + 2 * p2 * a * b
            ends += [int(a * color.fx + color.cx + 0.5), int(b * color.fy + color.cy + 0.5)]
        left, top, right, bottom = ends
        if left < 0 or top < 0 or right >= color.width or bottom >= color.height:
            continue
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                out[y, x] = min(out[y, x] or units[v, u], units[v, u])
    return out


@pytest.mark.parametrize(
    "color",
    [
        {},
        {"fx": 290.0, "fy": 291.0, "width": 200, "height": 150, "cx": 101.2},
        {"fx": 130.0, "rotation": (0.01, -0.02, 0.03, 0.9993), "distortion": (0.1, -0.05, 0.003, -0.002, 0.01)},
    ],
)
def test_plain_loops_give_the_same_pixels(color: dict[str, Any]) -> None:
    keys = COLOR | {"translation": (-0.02, 0.003, 0.001)} | color
    eye = CAMERA.model_copy(update={"color": keys})
    before = np.round(1000 * measured(eye, DisparityNoise(sigma=0.3), seed=3)).astype(np.int64)
    after = np.round(1000 * measured(eye, DisparityNoise(sigma=0.3), AlignToColor(), seed=3, threads=2)).astype(
        np.int64
    )
    # The pose of the pictures is the colour camera's: the left imager stands beside it, and sees the scene from there.
    moved = Sensor(STEP_CASTER, eye, (DisparityNoise(sigma=0.3),), MATERIALS).measure(
        eye.aligned_to_color().left_pose, seed=3
    )
    expected = by_loops(moved.depth_raw.astype(np.int64), eye)
    assert before.shape == eye.shape and after.shape == (keys["height"], keys["width"])
    # float32 puts a corner that lies on the border of two pixels into the other one, now and then.
    assert np.mean(after != expected) < 5e-4


def test_an_edge_is_occluded_on_one_side_and_the_nearest_wins_on_the_other() -> None:
    eye = CAMERA.model_copy(update={"color": COLOR | {"translation": (-0.015, 0, 0)}}).aligned_to_color()
    # The wall and the plate of the helpers, seen from the left imager: its pose is eye(4).
    sensor = Sensor(STEP_CASTER, eye, (), MATERIALS)
    raw = sensor.measure(eye.color.pose if eye.color else np.eye(4)).depth_raw[60].astype(float) / 1000
    # The plate moves by f·15 mm / 1 m = 3 px and the wall by 1.2 px, to the right.
    near = np.flatnonzero(raw == NEAR)
    assert (near[0], near[-1]) == (LEFT + 3, RIGHT + 3)
    assert (raw[near] == NEAR).all()
    # What the left imager does not see lies left of the plate, 1.8 px wide; on the right nothing is free.
    holes = np.flatnonzero(raw == 0)
    assert set(holes) <= {0, *range(LEFT, LEFT + 3)} and len(holes) >= 2
    assert (raw[RIGHT + 4 :] == FAR).all()


def test_a_finer_picture_has_its_pixels_doubled() -> None:
    eye = preset("d435", 424, 240)
    aligned = Sensor(Caster(as_scene(wall(1.0))), eye, (DisparityNoise(sigma=0.1), AlignToColor()), MATERIALS)
    depth = aligned.measure(np.eye(4)).depth_raw
    assert aligned.stored_camera == eye.aligned_to_color()
    inner = depth[20:-20, 20:-20]
    assert (inner > 0).all()
    # 1.38 pixels for each: with both ends, 1 + 1.38 of them, of which the nearest stays.
    assert np.mean(inner[:, 1:] == inner[:, :-1]) > 0.4
    assert (
        np.mean(
            Sensor(aligned.caster, eye, (DisparityNoise(sigma=0.1),), MATERIALS).measure(np.eye(4)).depth_raw[:, 1:]
            == 1000
        )
        < 0.4
    )


def test_a_camera_that_does_not_say_so_is_aligned_by_the_parameters() -> None:
    aligned = BESIDE.aligned_to_color()
    plain = aligned.model_copy(update={"color": None, "aligned": False, "depth": None})
    said = measured(aligned)
    assert (measured(plain, AlignToColor(x=-0.015, zoom=1.0)) == said).all()
    assert (measured(plain) != said).any()


def test_the_bytes_depend_on_no_thread() -> None:
    eye = preset("d435", 320, 180)
    one, two = (measured(eye, DisparityNoise(), AlignToColor(), threads=threads) for threads in (1, 2))
    assert (one == two).all()


# The camera


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_an_aligned_camera_is_read_as_written_and_knows_its_left_imager(name: str, tmp_path: Path) -> None:
    eye = preset(name, 640, 480)
    assert eye.color is not None and "color" in PRESETS[name].sources
    eye.aligned_to_color().write(tmp_path / "camera.yaml")
    aligned = read_camera(tmp_path / "camera.yaml")
    assert aligned == eye.aligned_to_color() and aligned.left == eye
    assert aligned.focal_baseline == eye.focal_baseline and aligned.fx == eye.color.fx
    np.testing.assert_allclose(aligned.left_pose[:3, 3], [-x for x in eye.color.translation])
    keys = yaml.safe_load((tmp_path / "camera.yaml").read_text())
    del keys["depth"]
    assert Camera.model_validate(keys).left == eye  # by the preset of its name


def test_a_real_d435_has_the_nominal_colour_camera() -> None:
    color = preset("d435", 640, 480).color
    assert color is not None
    # One unit's calibration: librealsense issue 7300, and 15.0 mm in realsense-ros issue 2788.
    assert color.fx == pytest.approx(612.4, rel=0.02) and color.translation[0] == pytest.approx(-0.015, abs=1e-4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"color": None}, "aligned is true without `color`"),
        ({"fx": 300.0}, "color.fx"),
        ({"color.width": 0}, "color.width"),
        ({"color.rotation": [0, 0, 0, 0.5]}, "not of length 1"),
        ({"color.translation": None}, "color.translation"),
        ({"color.hue": 1}, "color.hue"),
        ({"aligned": False}, "`depth` is of an aligned camera"),
        ({"aligned": "sideways"}, "aligned"),
    ],
)
def test_a_broken_colour_camera_has_one_line(change: dict[str, Any], words: str, tmp_path: Path) -> None:
    keys = yaml.safe_load(BESIDE.aligned_to_color().to_yaml())
    for name, value in change.items():
        part, _, key = name.rpartition(".")
        place = keys[part] if part else keys
        place.pop(key, None)
        if value is not None:
            place[key] = value
    file = tmp_path / "camera.yaml"
    file.write_text(yaml.safe_dump(keys))
    with pytest.raises(InputError, match=words) as error:
        read_camera(file)
    assert str(file) in str(error.value) and "\n" not in str(error.value)


# Runs


def test_a_run_is_made_aligned_and_made_like(tmp_path: Path) -> None:
    (tmp_path / "sensor.yaml").write_text("effects: [{disparity_noise: {sigma: 0.002}}, align_to_color]\n")
    options = ["--camera", "d435", "--resolution", "160x120", "--frames", "2"]
    depthsim_here("generate", "office", "--sensor", tmp_path / "sensor.yaml", *options, "--out", tmp_path / "a")
    made = Run.open(tmp_path / "a")
    assert made.camera == preset("d435", 160, 120).aligned_to_color()
    assert made.depth(0).shape == made.camera.shape
    # The camera says that it is aligned: a profile that does not is aligned, too.
    (tmp_path / "plain.yaml").write_text("effects: [{disparity_noise: {sigma: 0.002}}]\n")
    like = ["--like", tmp_path / "a", "--sensor", tmp_path / "plain.yaml"]
    depthsim_here("generate", *like, "--out", tmp_path / "b")
    again = Run.open(tmp_path / "b")
    assert again.camera == made.camera and (again.depth_raw(1) == made.depth_raw(1)).all()
    both = (made.depth(0) > 0) & ((clean := made.clean(0)) is not None) & (clean > 0)
    assert np.median(np.abs(made.depth(0) - clean)[both]) < 0.05


def test_a_run_that_is_not_aligned_by_its_own_account_is_made_like_by_the_parameters(tmp_path: Path) -> None:
    options = ["--camera", "d435", "--resolution", "160x90", "--frames", "1", "--only-depth"]
    depthsim_here("generate", "office", *options, "--out", tmp_path / "a")
    (tmp_path / "sensor.yaml").write_text("effects: [{align_to_color: {x: -0.015, zoom: 1.4}}]\n")
    like = ["--like", tmp_path / "a", "--sensor", tmp_path / "sensor.yaml", "--only-depth"]
    depthsim_here("generate", *like, "--out", tmp_path / "b")
    made, again = Run.open(tmp_path / "a"), Run.open(tmp_path / "b")
    # The pictures are as they were recorded: their focal length stays, and the left imager's is another one.
    assert again.camera == made.camera.model_copy(update={"color": None})
    one = Sensor("office", again.camera, [AlignToColor(zoom=1.4)]).measure(made.poses[0])
    assert (again.depth_raw(0) == one.depth_raw).all()


@pytest.mark.parametrize("zoom", [1.0, 1.53])
def test_without_overlap_each_pixel_of_the_picture_is_one_of_the_imagers(zoom: float) -> None:
    """Of a wall with noise: where the nearest of several wins all of it is nearer, else it is where it was."""
    eye = CAMERA.model_copy(update={"color": None})
    given = {overlap: AlignToColor(x=0.0, zoom=zoom, overlap=overlap) for overlap in (1.0, 0.0)}
    caster = Caster(as_scene(wall(1.0)))
    found = {o: measured(eye, DisparityNoise(sigma=0.3), e, caster=caster)[5:-5, 5:-5] for o, e in given.items()}
    spread = zoom * measured(eye, DisparityNoise(sigma=0.3), caster=caster).std()  # of the imager's shorter lens
    alone = found[0.0][found[0.0] > 0]
    assert alone.size > 0.99 * found[0.0].size  # where float32 leaves a slit there is none
    assert alone.std() == pytest.approx(spread, rel=0.05)
    assert alone.mean() == pytest.approx(1.0, abs=5 * zoom * spread / np.sqrt(alone.size) + spread**2)
    assert found[1.0].mean() < alone.mean() - 0.5 * spread
