"""Active stereo as a sensor: what its depth does by nature, in profiles and in runs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from shapes import as_scene, camera, quad, wall

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.materials import Material, Materials
from depthsim.presets import preset
from depthsim.runs.generate import IR_STREAMS, generate
from depthsim.runs.png import decode_png
from depthsim.scene import Scene
from depthsim.sensor import Effect, Profile, Sensor, load_profile
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.shadow import StereoShadow
from depthsim.sensor.sensor import Measurement
from depthsim.stereo.settings import ActiveStereo
from depthsim.trajectory import Trajectory

CAMERA = camera(320, 200, 300.0)
MATERIALS = Materials(
    {
        "grey": Material(m=0, ir_reflectance=0.4, gloss=0.02, texture=0.1),
        "black": Material(m=0, ir_reflectance=0.002, gloss=0, texture=0),
        "mirror": Material(m=0, ir_reflectance=0.01, gloss=0.9, texture=0),
    }
)
NIGHT = {"ambient": 0.0}
POSE = np.eye(4)


def measure(scene: Scene, eye: Camera = CAMERA, index: int = 0, **parts: object) -> Measurement:
    sensor = stereo(scene, eye, parts)
    return sensor.measure(POSE, index=index, threads=1)


def stereo(
    scene: Scene,
    eye: Camera = CAMERA,
    parts: object = None,
    effects: Sequence[Effect] = (),
    materials: Materials = MATERIALS,
) -> Sensor:
    settings = ActiveStereo.model_validate(parts or {})
    return Sensor(scene, eye, Profile(name="stereo", stereo=settings, effects=tuple(effects)), materials)


def facing(distance: float, tag: str = "grey") -> Scene:
    return as_scene(wall(distance), tags=[tag])


def errors(seen: Measurement, eye: Camera = CAMERA) -> np.ndarray:
    """Of the disparity [px], where there is depth, away from the border."""
    inner = np.s_[15:-15, 70:-15]
    valid = seen.depth[inner] > 0
    return eye.focal_baseline / seen.depth[inner][valid] - eye.focal_baseline / seen.clean.depth[inner][valid]


@pytest.mark.parametrize("distance", [0.4, 0.8, 1.6, 3.1])
def test_a_wall_has_noise_of_some_hundredths_of_a_pixel(distance: float) -> None:
    seen = measure(facing(distance))
    error = errors(seen)
    assert error.size > 0.998 * (170 * 235)
    assert abs(error.mean()) < 0.02
    assert 0.02 < error.std() < 0.1


@pytest.mark.parametrize("size", [(424, 240), (848, 480)])
@pytest.mark.parametrize("fraction", [0.125, 0.375, 0.625])
def test_no_fraction_of_a_disparity_is_preferred(size: tuple[int, int], fraction: float) -> None:
    eye = preset("d435", *size)
    seen = measure(facing(eye.focal_baseline / (13 + fraction)), eye)
    assert abs(errors(seen, eye).mean()) < 0.02


def test_depth_is_in_steps_of_a_32nd_of_disparity() -> None:
    seen = measure(facing(1.0))
    steps = 32 * CAMERA.focal_baseline / seen.depth[seen.depth > 0]
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-3)


def test_noise_is_alike_in_neighbours_and_new_in_every_frame() -> None:
    pictures = [measure(facing(1.5), index=index).depth[20:-20, 80:-20] for index in range(2)]
    assert (pictures[0] != pictures[1]).mean() > 0.3
    error = pictures[0] - np.median(pictures[0])
    both = [(error[:, 4:] * error[:, :-4]).mean(), (error**2).mean()]
    assert both[0] > 0.4 * both[1]


def test_the_band_at_the_left_is_about_as_wide_as_the_disparity() -> None:
    for distance in (0.5, 1.0):
        seen = measure(facing(distance))
        width = np.median(np.argmax(seen.depth_raw[20:-20] > 0, axis=1))
        assert abs(width - CAMERA.focal_baseline / distance - 7.5) < 1


def test_a_plate_has_a_shadow_on_its_left() -> None:
    plate = quad((-0.08, -0.08, 0.5), (0.16, 0, 0), (0, 0.16, 0))
    seen = measure(as_scene(wall(1.0), plate, tags=["grey"] * 2))
    middle = seen.depth_raw[80:120]
    edge = round(CAMERA.cx - CAMERA.fx * 0.16)
    step = CAMERA.focal_baseline * (1 / 0.5 - 1 / 1.0)
    holes = (middle[:, edge - 40 : edge + 8] == 0).sum(axis=1)
    # A D435 leaves 1.7 px more than the step.
    assert 1.2 < holes.mean() - step < 2.2
    assert np.abs(np.median(middle[:, 150:170]) - 500) < 10
    # Above and below the plate nothing is hidden, and a D435 leaves holes there as well.
    columns = seen.depth_raw[:, 130:190].astype(int)
    bare = (columns[:-1] > 0) & (columns[1:] > 0) & (np.abs(np.diff(columns, axis=0)) > 100)
    assert bare.sum() < 0.2 * 2 * 60


def test_what_gives_no_light_back_gives_no_depth() -> None:
    holes = {
        name: (measure(facing(distance, tag), light=NIGHT).depth_raw[:, 70:] == 0).mean()
        for name, distance, tag in (
            ("near", 1.0, "grey"), ("far", 17.0, "grey"), ("farther", 50.0, "grey"), ("black", 5.0, "black")
        )
    }  # fmt: skip
    assert holes["near"] < 0.002
    assert min(holes["far"], holes["farther"]) > 0.95
    assert holes["black"] > 0.93


def test_nothing_is_farther_than_a_disparity_of_one_pixel() -> None:
    for distance in (10.0, 40.0, 150.0):
        depth = measure(facing(distance), light=NIGHT).depth
        assert depth.max() <= CAMERA.focal_baseline * 1.001


@pytest.mark.parametrize("distance", [0.8, 1.5, 2.5])
def test_a_mirror_gives_no_depth_and_a_wall_does(distance: float) -> None:
    holes = [(measure(facing(distance, tag)).depth_raw[:, 70:] == 0).mean() for tag in ("grey", "mirror")]
    assert holes[0] < 0.002
    assert holes[1] > 0.93


def test_a_dimmer_projector_makes_more_noise() -> None:
    spread = [errors(measure(facing(2.0), projector={"power": power})).std() for power in (0.02, 0.005)]
    assert spread[0] < 0.6 * spread[1]


def test_sunlight_drowns_the_dots() -> None:
    sun = {"ambient": 50.0, "sun": 300.0, "sun_direction": [0.0, 0.0, -1.0]}
    plain = MATERIALS.model_copy(update={"root": {"grey": MATERIALS["grey"].model_copy(update={"texture": 0.0})}})
    found = []
    for light in (NIGHT, sun):
        sensor = stereo(facing(2.0), parts={"light": light}, materials=plain)
        found.append((sensor.measure(POSE).depth_raw[:, 70:] == 0).mean())
    assert found[0] < 0.02
    assert found[1] > found[0] + 0.3


def test_the_same_seed_gives_the_same_bytes_for_any_number_of_threads() -> None:
    sensor = stereo(facing(1.0))
    one = sensor.measure(POSE, index=3, seed=9, threads=1)
    again = [sensor.measure(POSE, index=3, seed=9, threads=threads, out=None) for threads in (2, 3)]
    assert all((one.depth_raw == other.depth_raw).all() and (one.left == other.left).all() for other in again)
    assert (one.depth_raw != sensor.measure(POSE, index=3, seed=8).depth_raw).any()


def test_buffers_are_taken_again() -> None:
    sensor = stereo(facing(1.0))
    first = sensor.measure(POSE, index=1)
    kept = first.depth_raw.copy()
    sensor.measure(POSE, index=2, out=first)
    assert (sensor.measure(POSE, index=1, out=first).depth_raw == kept).all()


def test_a_distorted_camera_gets_the_depth_along_its_own_rays() -> None:
    bent = camera(320, 200, 300.0, model="brown_conrady", distortion=(-0.1, 0.02, 0.001, 0.0, 0.0))
    slanted = as_scene(quad((-3, -3, 0.7), (6, 0, 0.9), (0, 6, 0)), tags=["grey"])
    assert np.abs(np.median(errors(measure(slanted, bent), bent))) < 0.03


def test_effects_may_follow() -> None:
    plain = stereo(facing(1.0)).measure(POSE)
    holed = stereo(facing(1.0), effects=[FillRate(rate=0.3)]).measure(POSE)
    assert (holed.depth_raw == 0).mean() > (plain.depth_raw == 0).mean() + 0.1
    kept = holed.depth_raw > 0
    assert (holed.depth_raw[kept] == plain.depth_raw[kept]).all()


def test_an_effect_that_asks_what_the_right_imager_sees_may_follow() -> None:
    scene = as_scene(wall(1.0), quad((-0.08, -0.08, 0.5), (0.16, 0, 0), (0, 0.16, 0)), tags=["grey"] * 2)
    sensor = stereo(scene, effects=[StereoShadow(share=1)])
    seen = sensor.measure(POSE)
    assert seen.clean.right_sees is not None
    hidden = seen.clean.right_sees == 0
    assert hidden.any() and not seen.depth_raw[hidden].any()


def write(path: Path, camera: str) -> Path:
    file = path / "mine.yaml"
    file.write_text(f"camera: {camera}\neffects: []\n")
    return file


def test_a_profile_says_so_and_says_what_differs(tmp_path: Path) -> None:
    text = "{sensor: active_stereo, preset: d455, light: {ambient: 0}, matcher: {window: [7, 5]}}"
    profile = load_profile(write(tmp_path, text))
    assert profile.camera is not None
    assert profile.camera.name == "D455"
    assert profile.stereo is not None
    assert profile.stereo.light.ambient == 0
    assert profile.stereo.matcher.window == (7, 5)
    assert profile.stereo.projector == ActiveStereo().projector


@pytest.mark.parametrize(
    "text", ["{sensor: active_stereo}", "{sensor: active_stereo, preset: d415, imager: {gain: 2}}"]
)
def test_a_profile_is_written_as_it_is_read(tmp_path: Path, text: str) -> None:
    profile = load_profile(write(tmp_path, text))
    copy = tmp_path / "copy.yaml"
    copy.write_text(profile.to_yaml())
    assert load_profile(copy) == profile.model_copy(update={"name": profile.name})


def test_the_profile_that_comes_with_depthsim_matches_images() -> None:
    seen = Sensor(facing(1.0), CAMERA, "active_stereo", MATERIALS).measure(POSE)
    assert seen.left is not None and seen.right is not None and seen.left.shape == CAMERA.shape
    assert Sensor(facing(1.0), CAMERA, "clean", MATERIALS).measure(POSE).left is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{sensor: lidar}", "camera.sensor: 'lidar' is no sensor"),
        ("{sensor: active_stereo, preset: d999}", "camera: 'd999' is no camera"),
        ("{sensor: active_stereo, preset: d435, width: 3}", "camera.width: stands beside preset"),
        ("{sensor: active_stereo, light: {ambient: -1}}", "camera.light.ambient: "),
        ("{sensor: active_stereo, light: {moon: 1}}", "camera.light.moon: "),
        ("{sensor: active_stereo, light: {sun_direction: [0, 0, 0]}}", "sun_direction has no length"),
        ("{sensor: active_stereo, matcher: {window: [4, 3]}}", "window must be two odd numbers"),
        ("{sensor: active_stereo, matcher: {smoothing_step: 0}}", "greater than 0"),
        ("{sensor: active_stereo, matcher: {window: [41, 31]}}", "must fit in 16 bits"),
        ("{sensor: active_stereo, imager: {exposure: -1.0}}", "exposure must be auto or"),
        ("{sensor: active_stereo, projector: {field: [200, 57]}}", "field must be two angles"),
        ("{sensor: active_stereo, projector: 3}", "camera.projector: "),
    ],
)
def test_a_broken_profile_is_reported_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        load_profile(write(tmp_path, text))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def still(count: int) -> Trajectory:
    return Trajectory(np.arange(count) / 30, np.zeros((count, 3)), np.tile([0.0, 0, 0, 1], (count, 1)))


def test_a_run_holds_the_pair_it_was_matched_from(tmp_path: Path) -> None:
    small = camera(160, 100, 150.0)
    profile = Profile(name="stereo", stereo=ActiveStereo())
    streams = ("depth", *IR_STREAMS)
    for name, threads in (("one", 1), ("two", 2)):
        generate(
            facing(0.8), still(3), small, profile, tmp_path / name,
            materials=MATERIALS, streams=streams, threads=threads,
        )  # fmt: skip
    for file in sorted((tmp_path / "one").rglob("*.png")):
        other = tmp_path / "two" / file.relative_to(tmp_path / "one")
        assert file.read_bytes() == other.read_bytes()
    assert decode_png(tmp_path / "one" / "ir_left" / "0.000000.png").dtype == np.uint8
    assert (tmp_path / "one" / "ir_right.txt").read_text().count("ir_right/") == 3
    assert "stereo:" in (tmp_path / "one" / "run.yaml").read_text()


def test_a_sensor_without_images_cannot_write_them(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="without infrared images"):
        generate(
            facing(1.0), still(1), CAMERA, load_profile("clean"), tmp_path / "run",
            materials=MATERIALS, streams=("depth", *IR_STREAMS),
        )  # fmt: skip
    assert not (tmp_path / "run").exists()
