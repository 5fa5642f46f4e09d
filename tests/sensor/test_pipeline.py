"""One frame pipeline: what the diagnosis simulates is what the sensor measures, bit for bit."""

import ast
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from shapes import as_scene, box, quad

import depthsim
from depthsim.camera import Camera
from depthsim.gap.depth.data.frames import CleanFrame, inner_rows
from depthsim.gap.depth.data.simulate import FITTING, Replay
from depthsim.materials import load_materials
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor, effect_class, effect_ids, load_profile
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import acting, camera_for
from depthsim.sensor.profile import profile_names
from depthsim.trajectory import Trajectory

CAMERA = Camera(name="small", width=64, height=48, fx=40, fy=40, cx=31.5, cy=23.5, baseline=0.05)
INDEX, STAMP = 3, 0.1
STAMPS = np.linspace(0, 0.2, 7)
MOVING = Motion.along(
    Trajectory(STAMPS, np.stack([0.8 * STAMPS, 0.3 * STAMPS, 0 * STAMPS], axis=1), np.tile([0, 0, 0, 1.0], (7, 1)))
)


@cache
def caster(kind: str) -> Caster:
    """Boxes in a closed room, or two plates before nothing; the camera looks along z, y is down."""
    if kind == "closed":
        return Caster(as_scene(box((-2, -1.5, -1), (2.5, 1.5, 4)), box((-0.3, -0.3, 1.2), (0.2, 0.6, 1.7))))
    return Caster(
        as_scene(quad((-0.5, -0.5, 1.2), (0.7, 0, 0), (0, 0.8, 0)), quad((-0.6, -0.9, 2.5), (2, 0, 0), (0, 2, 0)))
    )


def agree(effects: list[Effect], kind: str, seed: int = 7) -> None:
    """The sensor's frame and the diagnosis', of a camera that moves; and the diagnosis' again, by casts it has kept."""
    materials, pose = load_materials(), MOVING.at(STAMP)[0]
    keys = {"index": INDEX, "stamp": STAMP, "seed": seed, "motion": MOVING}
    imager = camera_for(CAMERA, effects)
    seen = Sensor(caster(kind), imager, effects, materials).measure(pose, **keys)
    none = np.empty(0, np.float32)
    met = caster(kind).cast(CAMERA, pose, right=True)
    frame = CleanFrame(INDEX, STAMP, pose, CAMERA, CAMERA.rows, met, none, none, np.empty((0, 0), np.uint16))
    replay = Replay(caster(kind), materials, MOVING)
    for _ in range(2):
        np.testing.assert_array_equal(replay.measure(acting(effects), frame, seed), seen.depth_raw)
    assert met.hit.all() if kind == "closed" else 0.1 < met.hit.mean() < 0.9


@pytest.mark.parametrize("kind", ["closed", "open"])
@pytest.mark.parametrize("name", [name for name in profile_names() if load_profile(name).stereo is None])
def test_the_diagnosis_simulates_what_a_profile_measures(name: str, kind: str) -> None:
    agree(list(load_profile(name).effects), kind)


@pytest.mark.parametrize("kind", ["closed", "open"])
@pytest.mark.parametrize("name", effect_ids())
def test_the_diagnosis_simulates_what_an_effect_does(name: str, kind: str) -> None:
    agree([effect_class(name)()], kind)


def test_shadows_that_are_kept_are_those_that_are_cast() -> None:
    """From sides that are asked for in turn, as a fit does, and from more than there is room for."""
    materials, pose, none = load_materials(), np.diag([1.0, -1, -1, 1]), np.empty(0, np.float32)
    scene = as_scene(box((-2, -1.5, -3), (2.5, 1.5, -2.9)), box((-0.3, -0.3, -1.7), (0.2, 0.6, -1.2)))
    still, caster = Motion.still(pose), Caster(scene)
    met = caster.cast(CAMERA, pose)
    frame = CleanFrame(INDEX, STAMP, pose, CAMERA, CAMERA.rows, met, none, none, np.empty((0, 0), np.uint16))
    replay, found = Replay(caster, materials, still), set()
    sides = [(10.0, 40.0), (130.0, 20.0), (10.0, 40.0), *((a / 2, 30.0) for a in range(-300, 300)), (10.0, 40.0)]
    for azimuth, elevation in sides:
        effects = [effect_class("ambient_light")(azimuth=azimuth, elevation=elevation, holes=0.9, shadows=1.0)]
        units = replay.measure(effects, frame, FITTING)
        found.add(units.tobytes())
        if elevation != 30 or azimuth % 90 == 0:
            fresh = Sensor(caster, CAMERA, effects, materials)
            seen = fresh.measure(pose, index=INDEX, stamp=STAMP, seed=FITTING, motion=still)
            np.testing.assert_array_equal(units, seen.depth_raw)
    assert len(found) > 20


def _taken(effects: list[Effect], camera: Camera, seed: int) -> NDArray[np.float64]:
    """The disparity that the diagnosis makes of a frame [px], NaN in holes."""
    pose, none = MOVING.at(STAMP)[0], np.empty(0, np.float32)
    met = caster("closed").cast(camera, pose, right=True)
    frame = CleanFrame(INDEX, STAMP, pose, camera, camera.rows, met, none, none, np.empty((0, 0), np.uint16))
    units = Replay(caster("closed"), load_materials(), MOVING).measure(acting(effects), frame, seed).astype(float)
    return camera.focal_baseline / np.where(units > 0, units * camera.depth_scale, np.nan)


@pytest.mark.parametrize("name", [name for name in effect_ids() if not effect_class(name).resizes()])
def test_some_rows_are_simulated_as_the_whole_picture_is(name: str) -> None:
    given = {"grid": ((0.1, 0.3, -0.2), (0.4, -0.2, 0.1))} if name == "fixed_pattern" else {}
    effects = [effect_class(name)(**given)]
    camera = Camera(width=212, height=180, fx=120, fy=120, cx=105.5, cy=89.5, baseline=0.05, depth_scale=1e-4)
    window = camera.window(np.r_[0:60, 90:150])
    inner = inner_rows(window)
    rows = window.rows[inner]
    whole, part = ([_taken(effects, c, seed)[i] for seed in range(12)] for c, i in ((camera, rows), (window, inner)))
    if np.array_equal(whole[0], whole[1], equal_nan=True):  # nothing is drawn
        assert np.isclose(part[0], whole[0], atol=1e-3, rtol=0, equal_nan=True).mean() > 0.999
        return
    clean = _taken([], camera, 1)[rows]
    assert np.isnan(part).mean() == pytest.approx(np.isnan(whole).mean(), abs=0.01)
    for some in np.array_split(np.arange(len(clean)), 2):  # what changes with the row must change alike
        a, b = (np.nanstd((np.array(x) - clean)[:, some]) for x in (part, whole))
        assert a == pytest.approx(b, rel=0.3, abs=0.01)


@pytest.mark.parametrize("seed", [7, FITTING])
@pytest.mark.parametrize("kind", ["closed", "open"])
def test_the_diagnosis_simulates_all_effects_together(kind: str, seed: int) -> None:
    agree([effect_class(name)() for name in effect_ids()], kind, seed)


def test_stereo_knows_nothing_of_the_sensor() -> None:
    """The sensor is made of stereo, its random numbers lie below both: so there is no cycle."""
    package = Path(depthsim.__file__).parent
    files = [*package.glob("stereo/*.py"), package / "draws.py", package / "scratch.py"]
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(name.startswith("depthsim.sensor") for name in names), (file, names)
