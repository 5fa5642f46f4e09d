"""What the imagers see, against what optics says they should."""

import numpy as np
import pytest
from shapes import MATERIALS, as_scene, box, camera, quad, wall

from depthsim.camera import Camera
from depthsim.draws import Draws
from depthsim.materials import Material, Materials
from depthsim.raycast import Caster
from depthsim.scene import Scene
from depthsim.stereo import imager
from depthsim.stereo.pattern import PITCH, dot_pattern
from depthsim.stereo.render import Renderer
from depthsim.stereo.settings import ActiveStereo, Imager, Light, Projector

CAMERA = camera(160, 120, 90.0)
DARK, OFF = Light(ambient=0), Projector(power=0)
POSE = np.eye(4)


def renderer(scene: Scene, eye: Camera = CAMERA, **parts: object) -> Renderer:
    return Renderer(Caster(scene), eye, ActiveStereo.model_validate(parts), MATERIALS)


def light(scene: Scene, side: int = 0, eye: Camera = CAMERA, **parts: object) -> np.ndarray:
    return renderer(scene, eye, **parts)._light(side, POSE, 0, 1, 0.0)


PLAIN = as_scene(wall(1.0), tags=["formboard"])  # a material without texture


def test_the_pattern_has_the_power_of_the_projector() -> None:
    projector = Projector(power=0.5, dots=300)
    pattern = dot_pattern(projector)
    rows, columns = ((np.arange(size) - (size - 1) / 2) * PITCH for size in pattern.shape)
    solid = PITCH**2 / (1 + columns[None] ** 2 + rows[:, None] ** 2) ** 1.5
    assert abs((pattern * solid).sum() / 0.5 - 1) < 0.02


def test_the_pattern_has_its_dots_and_is_another_with_another_number() -> None:
    projector = Projector(dots=200, dot_width=2.0)
    pattern = dot_pattern(projector)
    inner = pattern[1:-1, 1:-1]
    neighbours = [pattern[1 + j : pattern.shape[0] - 1 + j, 1 + i : pattern.shape[1] - 1 + i]
                  for j in (-1, 0, 1) for i in (-1, 0, 1) if i or j]  # fmt: skip
    peaks = np.all([inner > one for one in neighbours], axis=0) & (inner > inner.max() / 50)
    assert 185 <= peaks.sum() <= 210
    assert (dot_pattern(Projector(dots=200, dot_width=2.0, pattern=1)) != pattern).any()
    assert not dot_pattern(Projector(dots=0)).any()


def test_ambient_light_alone_is_albedo_over_pi_through_the_lens() -> None:
    seen = light(PLAIN, projector=OFF, light={"ambient": 2.0}, imager={"vignetting": 0, "f_number": 2.0})
    material = MATERIALS["formboard"]
    share = material.gloss + (1 - material.gloss) * material.ir_reflectance
    middle = seen[50:70, 70:90]
    assert middle == pytest.approx(share * 2.0 / np.pi * np.pi / 16, rel=0.01)


def test_the_image_darkens_by_the_fourth_power_of_the_cosine() -> None:
    flat = light(PLAIN, projector=OFF, imager={"vignetting": 0})
    dark = light(PLAIN, projector=OFF, imager={"vignetting": 1})
    cosine = 1 / np.sqrt(1 + CAMERA.rays[0] ** 2 + CAMERA.rays[1] ** 2)
    np.testing.assert_allclose(dark / flat, cosine**4, rtol=1e-4)


def test_dots_fall_with_the_square_of_the_range() -> None:
    parts = {"light": DARK, "projector": {"speckle": 0}}
    seen = [light(as_scene(wall(z), tags=["formboard"]), **parts)[20:100, 30:130].mean() for z in (1.0, 2.0, 4.0)]
    assert seen[0] / seen[1] == pytest.approx(4, rel=0.06)
    assert seen[1] / seen[2] == pytest.approx(4, rel=0.06)


def test_a_dot_lies_at_its_place_in_both_images() -> None:
    """One dot on the axis of the projector: its centre of mass is where the geometry has it."""
    parts = {"light": DARK, "imager": {"vignetting": 0}}
    projector = Projector(dots=1, position=0.25, speckle=0, dot_width=8.0)
    pattern = dot_pattern(projector)
    peak = np.array(np.unravel_index(np.argmax(pattern), pattern.shape)) - (np.array(pattern.shape) - 1) / 2
    y, x = peak * PITCH
    for z in (0.8, 1.7):
        for side in (0, 1):
            seen = light(as_scene(wall(z), tags=["formboard"]), side, projector=projector, **parts)
            v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
            place = x * z + (0.25 - side) * CAMERA.baseline
            assert (u * seen).sum() / seen.sum() == pytest.approx(CAMERA.cx + CAMERA.fx * place / z, abs=0.05)
            assert (v * seen).sum() / seen.sum() == pytest.approx(CAMERA.cy + CAMERA.fy * y, abs=0.05)


def test_a_plate_throws_a_shadow_as_seen_from_the_projector() -> None:
    near, half = 0.4, 0.1
    plate = quad((-half, -0.5, near), (2 * half, 0, 0), (0, 1, 0))
    scene = as_scene(wall(1.0), plate, tags=["formboard"] * 2)
    projector = {"speckle": 0, "dots": 100_000, "position": 0.6}
    columns = light(scene, projector=projector, light=DARK, imager={"blur": 0, "samples": 1})[40:80].mean(axis=0)
    place = 0.6 * CAMERA.baseline
    edge = CAMERA.cx - CAMERA.fx * half / near
    # The projector's ray past the plate's left edge goes on to the wall.
    shadow = CAMERA.cx + CAMERA.fx * (place - (place + half) / near)
    band = columns[int(np.ceil(shadow)) + 1 : int(edge)]
    assert band.size >= 2
    assert band.max() == 0
    assert columns[10 : int(shadow) - 1].min() > 0.2 * columns[10 : int(shadow) - 1].mean()


def test_noise_is_shot_and_read_noise() -> None:
    settings = Imager(read_noise=20, full_well=5000, exposure=0.01)
    flat = np.full((100, 100), 0.02, np.float32)
    electrons = 0.02 * imager.electrons_per_second(settings, CAMERA) * 0.01
    flat *= 2000 / electrons
    grey = [imager.develop(flat, settings, CAMERA, 0.01, 1.0, Draws(0, "test", k), 1).astype(float) for k in range(8)]
    assert np.mean(grey) == pytest.approx(2000 / 5000 * 255, rel=0.005)
    expected = np.hypot(np.sqrt(2000), 20) / 5000 * 255
    assert np.std(grey) == pytest.approx(np.hypot(expected, 1 / np.sqrt(12)), rel=0.03)


def test_auto_exposure_reaches_its_target_or_its_limits() -> None:
    settings = Imager(target=0.3)
    rate = imager.electrons_per_second(settings, CAMERA)
    for irradiance, ends in ((0.5, False), (1e-6, True)):
        time, gain = imager.exposure([np.full((4, 4), irradiance, np.float32)], settings, CAMERA)
        mean = irradiance * rate * time * gain / settings.full_well
        if ends:
            assert (time, gain) == (settings.longest_exposure, settings.highest_gain)
        else:
            assert mean == pytest.approx(0.3)
            assert gain == 1


def test_rows_and_columns_are_seen_at_the_pixels_middle() -> None:
    """An edge of brightness lies where the geometry has it, whatever the number of rays and the blur."""
    looks = Materials({"dark": Material(m=0, ir_reflectance=0.1, texture=0), "bright": Material(m=0, texture=0)})
    dark = quad((-5, -5, 1.0), (5.05, 0, 0), (0, 10, 0))
    bright = quad((0.05, -5, 1.0), (5, 0, 0), (0, 10, 0))
    scene = as_scene(dark, bright, tags=["dark", "bright"])
    for samples in (1, 2, 3, 4):
        for blur in (0.0, 3.0):
            parts = ActiveStereo(projector=OFF, imager=Imager(vignetting=0, samples=samples, blur=blur))
            row = Renderer(Caster(scene), CAMERA, parts, looks)._light(0, POSE, 0, 1, 0.0)[60, 40:120]
            share = (row - row[0]) / (row[-1] - row[0])
            place = 119.5 - share.sum()  # where a sharp edge with as much on its right would be
            assert place == pytest.approx(CAMERA.cx + CAMERA.fx * 0.05, abs=0.55 / samples)


def test_the_same_seed_gives_the_same_images_for_any_number_of_threads() -> None:
    one = renderer(as_scene(wall(1.0), tags=["cement"])).render(POSE, 3, 5, 1)
    for threads in (2, 3):
        again = renderer(as_scene(wall(1.0), tags=["cement"])).render(POSE, 3, 5, threads)
        assert all((a == b).all() for a, b in zip(one, again, strict=True))
    other = renderer(as_scene(wall(1.0), tags=["cement"])).render(POSE, 4, 5, 1)
    assert all((a != b).any() for a, b in zip(one, other, strict=True))


def test_speckle_stays_while_the_camera_stays_and_noise_does_not() -> None:
    scene = as_scene(wall(1.0), tags=["formboard"])
    mine = renderer(scene, light=DARK)
    assert (mine._light(0, POSE, 0, 1, 0.0) == mine._light(0, POSE, 0, 1, 0.0)).all()
    moved = POSE.copy()
    moved[0, 3] = 0.01
    still, shifted = (mine._light(0, pose, 0, 1, 0.0).std() for pose in (POSE, moved))
    assert still == pytest.approx(shifted, rel=0.1)
    assert (mine.render(POSE, 0, 0, 1)[0] != mine.render(POSE, 0, 1, 1)[0]).any()


def test_rays_that_the_camera_has_made_before_are_not_taken_for_the_imagers() -> None:
    """A copy of a camera keeps its rays; the imagers have finer ones."""
    fresh = camera(160, 120, 90.0)
    first = renderer(PLAIN, fresh).render(POSE, 0, 0, 1)
    assert fresh.rays.shape == (2, 120, 160)
    second = renderer(PLAIN, fresh).render(POSE, 0, 0, 1)
    assert all((a == b).all() for a, b in zip(first, second, strict=True))


def test_sunlight_comes_from_its_side() -> None:
    """The same wall, lit along its normal and at 60 degrees: half the light; and none from behind."""
    parts = {"projector": OFF, "imager": {"vignetting": 0}}
    seen = [
        light(PLAIN, light={"ambient": 0, "sun": 10, "sun_direction": direction}, **parts)[10:20, 10:20].mean()
        for direction in ((0, 0, -1), (np.sqrt(3), 0, -1), (0, 0, 1))
    ]
    assert seen[1] / seen[0] == pytest.approx(0.5, rel=0.15)
    assert seen[2] == 0


@pytest.mark.parametrize("backend", ["embree", "embreex"])
def test_the_sun_casts_shadows(backend: str) -> None:
    """A plate before a wall keeps the sun from it: the shadow lies where the rays from the sun have it."""
    near, half, far = 0.8, 0.1, 1.0
    plate = quad((-half, -half, near), (2 * half, 0, 0), (0, 2 * half, 0))
    scene = as_scene(wall(far), plate, tags=["formboard"] * 2)
    direction = np.array([1.5, 0.0, -1.0])
    parts = ActiveStereo.model_validate(
        {
            "projector": OFF,
            "light": {"ambient": 0, "sun": 10, "sun_direction": direction.tolist()},
            "imager": {"blur": 0, "samples": 1, "vignetting": 0},
        }
    )
    row = Renderer(Caster(scene, backend), CAMERA, parts, MATERIALS)._light(0, POSE, 0, 1, 0.0)[60]
    # The plate's corner x lands on the wall at x - 1.5 (far - near).
    ends = [CAMERA.cx + CAMERA.fx * (side * half - 1.5 * (far - near)) / far for side in (-1, 1)]
    edge = CAMERA.cx - CAMERA.fx * half / near
    dark = np.flatnonzero(row < 0.1 * row.max())
    assert abs(dark.min() - ends[0]) < 1.5
    assert abs(dark.max() - min(ends[1], edge)) < 1.5
    assert dark.size == dark.max() - dark.min() + 1


def test_a_closed_room_has_no_sun() -> None:
    room = box((-1, -1, -1), (1, 1, 2))
    assert not light(as_scene(room, tags=["formboard"]), projector=OFF, light={"ambient": 0, "sun": 10}).any()
