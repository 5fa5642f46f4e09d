"""The sensor on clean depth from elsewhere: as in its own scenes, as far as depth shows what effects ask for."""

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
from shapes import MATERIALS, as_scene, box, camera, quad, sphere, wall

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor, effect_class, effect_ids
from depthsim.sensor.motion import Motion
from depthsim.sensor.seen import Seen
from depthsim.trajectory import Trajectory

EYE = camera(160, 120, 130)
COLOR = {"width": 200, "height": 140, "fx": 170.0, "fy": 170.0, "cx": 99.5, "cy": 69.5, "translation": (-0.015, 0, 0)}
BESIDE = EYE.model_copy(update={"color": COLOR})
ROOM = Caster(
    as_scene(
        wall(4),
        quad((-20, 0.8, -1), (40, 0, 0), (0, 0, 21)),
        box((-0.6, -0.1, 1.4), (-0.1, 0.8, 1.8)),
        sphere(3, 0.25, (0.35, 0.2, 1.1)),
        quad((0.1, -1, 2.5), (0, 0.9, 0), (0.9, 0, 0.3)),
        tags=["cement", "cement", "plastic", "plastic", "plastic"],
    )
)
MOVING = Motion.along(
    Trajectory(np.array([0.0, 1.0]), np.array([[0.0, 0, 0], [0.5, 0, 0]]), np.array([[0, 0, 0, 1.0], [0, 0.02, 0, 1]]))
)


FARTHER = {"incidence_noise": (0.12, 0.01), "time_offset": (0.15, 0.01), "extrinsic_rotation": (0.12, 0.03),
           "extrinsic_translation": (0.3, 0.05),
           "pose_noise": (0.15, 0.05), "intrinsics": (0.2, 0.16)}  # fmt: skip
"""What is farther from the scene: the shares of pixels that are off by 0.02 px, and that are holes in one alone.

Off the picture's border a turned camera sees what the depth does not show, and beside edges a moved one does, here by
10 cm.
"""


@cache
def clean() -> Any:
    return ROOM.cast(EYE, MOVING.at(0.5)[0], right=True)


def both(*effects: Effect, **keys: Any) -> tuple[Any, Any]:
    """The frame cast in the scene, and that of its depth."""
    keys = {"index": 9, "seed": 4, **keys}
    cast = Sensor(ROOM, EYE, effects, MATERIALS).measure(MOVING.at(0.5)[0], stamp=0.5, motion=MOVING, **keys)
    given = Sensor(camera=EYE, profile=effects, materials=MATERIALS).apply(
        clean().depth, tag=clean().tag, tags=ROOM.scene.tags, stamps=[0.5], motion=MOVING, **keys
    )
    return cast, given


def test_incidence_and_the_right_view_are_those_of_the_scene() -> None:
    met, pose = clean(), MOVING.at(0.5)[0]
    surfaces = Seen(met.depth, EYE, met.tag, ROOM.scene.tags, pose)
    seen = surfaces.cast(EYE, pose, right=True)
    angle, true = (np.degrees(np.arccos(np.clip(g.cosine, 0, 1)))[met.hit] for g in (seen, met))
    off = np.abs(angle - true)
    assert np.median(off) < 0.01 and np.percentile(off, 90) < 4 and abs(angle.mean() - true.mean()) < 0.5
    facing = np.abs((surfaces.normals[np.maximum(seen.face, 0)] * met.normals(ROOM.scene)).sum(axis=-1))[met.hit]
    assert np.percentile(facing, 15) > 0.995
    hidden, wanted = (g.right_sees == 0 for g in (seen, met))
    assert 0.01 < wanted.mean() < 0.2 and (hidden != wanted).mean() < 0.01


@pytest.mark.parametrize("effect_id", [i for i in effect_ids() if i not in ("temporal_filter", "align_to_color")])
def test_each_effect_is_that_of_the_scene(effect_id: str) -> None:
    """On common random numbers: the same but where the depth does not show what the scene has."""
    kind = effect_class(effect_id)
    effects = [effect_class(other)() for other in kind.seen_on] + [kind(**kind.shown)]
    cast, given = (m.depth.astype(float) for m in both(*effects))
    share, holes = FARTHER.get(effect_id, (0.05, 0.01))
    assert np.mean((cast > 0) != (given > 0)) < holes
    valid = (cast > 0) & (given > 0)
    error = EYE.focal_baseline * np.abs(1 / cast[valid] - 1 / given[valid])
    assert (error > 0.02).mean() < share
    assert cast[valid].std() == pytest.approx(given[valid].std(), rel=0.01)


def test_aligned_to_colour_it_is_what_the_scene_gives() -> None:
    effects = [effect_class(name)() for name in ("disparity_noise", "fill_rate", "decimation", "align_to_color")]
    # The scene's poses are the colour camera's; the depth, and where it was taken, are the left imager's.
    beside = BESIDE.aligned_to_color().left_pose
    met = ROOM.cast(BESIDE, beside)
    cast = Sensor(ROOM, BESIDE, effects, MATERIALS).measure(np.eye(4), index=9, seed=4)
    sensor = Sensor(camera=BESIDE, profile=effects, materials=MATERIALS)
    given = sensor.apply(met.depth, tag=met.tag, tags=ROOM.scene.tags, index=9, seed=4)
    np.testing.assert_array_equal(given.depth_raw, cast.depth_raw)
    assert given.camera == cast.camera == sensor.stored_camera and given.camera.aligned
    assert given.depth_raw.shape == (140, 200) and given.camera.left.shape == (60, 80) and (given.depth_raw > 0).any()
    again = sensor.apply(np.stack([met.depth, met.depth]), tag=met.tag, tags=ROOM.scene.tags, index=8, seed=4)
    np.testing.assert_array_equal(again.depth_raw[1], cast.depth_raw)


@pytest.mark.parametrize(
    ("eye", "words"),
    [(EYE, "color: is not given, and align_to_color needs it"), (BESIDE.aligned_to_color(), "aligned: is true")],
)
def test_a_camera_that_cannot_be_aligned_has_one_line(eye: Camera, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        Sensor(camera=eye, profile=[effect_class("align_to_color")()]).apply(np.ones(eye.shape))
    assert "\n" not in str(error.value)


def test_effects_that_ask_for_depth_and_material_alone_keep_every_bit() -> None:
    names = (
        *("material_noise", "disparity_noise", "spatial_correlation", "heavy_tails", "subpixel_bias", "fill_rate"),
        *("range_dropout", "material_dropout", "invalid_band", "flying_pixels", "motion_noise", "spatial_filter"),
    )
    cast, given = both(*(effect_class(name)() for name in names))
    np.testing.assert_array_equal(given.depth_raw, cast.depth_raw)


def test_frames_in_a_row_are_those_of_single_calls_and_look_back_at_each_other() -> None:
    rng = np.random.default_rng(1)
    depth = (2 + rng.random((6, 1, 1)) * np.ones((6, 120, 160))).astype(np.float64)
    plain, filtered = Sensor(camera=EYE, profile="d435"), Sensor(camera=EYE, profile="d435_filtered")
    made = plain.apply(depth, index=5, seed=2)
    np.testing.assert_array_equal(made.depth_raw[3], plain.apply(depth[3], index=8, seed=2).depth_raw)
    np.testing.assert_array_equal(made.depth_raw, plain.apply(depth, index=5, seed=2, threads=3).depth_raw)
    assert made.depth.shape == depth.shape and filtered.apply(depth[0]).depth_raw.shape == (60, 80)
    row = filtered.apply(np.repeat(depth[:1], 3, axis=0)).depth_raw
    apart = filtered.apply(np.repeat(depth[:1], 3, axis=0), index=[0, 1, 2], seed=[0, 1, 2]).depth_raw
    np.testing.assert_array_equal(row[0], apart[0])
    valid = (row[2] > 0) & (apart[2] > 0)
    assert row[2][valid].std() < 0.9 * apart[2][valid].std()


def test_more_cameras_at_one_moment() -> None:
    depth = np.full((2, 120, 160), 2.0, np.float32)
    sensor = Sensor(camera=EYE, profile="paper")
    made = sensor.apply(depth, index=[7, 7], seed=[1, 2], motion=[Motion.still(np.eye(4))] * 2, stamps=[0.2, 0.2])
    assert not np.array_equal(made.depth_raw[0], made.depth_raw[1])
    np.testing.assert_array_equal(made.depth_raw[1], sensor.apply(depth[0], index=7, seed=2).depth_raw)


class Tensor:
    """What of a torch tensor is asked for."""

    def __init__(self, array: np.ndarray, error: str = "") -> None:
        self.array, self.error = array, error

    def __dlpack__(self, **keys: Any) -> Any:
        if self.error:
            raise BufferError(self.error)
        return self.array.__dlpack__(**keys)

    def __dlpack_device__(self) -> tuple[int, int]:
        return 1, 0


def test_tensors_of_other_libraries() -> None:
    depth, sensor = np.full((120, 160), 1.5, np.float32), Sensor(camera=EYE, profile="paper")
    np.testing.assert_array_equal(sensor.apply(Tensor(depth)).depth_raw, sensor.apply(depth).depth_raw)
    np.testing.assert_array_equal(sensor.apply(depth.tolist()).depth_raw, sensor.apply(depth).depth_raw)
    assert (sensor.apply(np.zeros((120, 160))).depth_raw == 0).all()


def spoilt(value: float) -> np.ndarray:
    depth = np.ones((2, 120, 160))
    depth[1, 5, 7] = value
    return depth


GOOD = np.ones((120, 160), np.float32)


@pytest.mark.parametrize(
    ("depth", "keys", "words"),
    [
        (spoilt(np.nan), {}, "depth: frame 1, pixel (7, 5): is nan; give metres, and 0 where there is nothing"),
        (spoilt(np.inf), {}, "is inf"),
        (spoilt(-0.5), {}, "is -0.5"),
        (spoilt(np.nan)[1], {}, "depth: pixel (7, 5)"),
        (np.ones((120, 160), np.uint16), {}, "is uint16, not float"),
        (np.ones((160, 120)), {}, "(160, 120), not (120, 160) or (N, 120, 160)"),
        (np.ones((0, 120, 160)), {}, "shape"),
        (np.ones((1, 1, 120, 160)), {}, "shape"),
        (Tensor(GOOD, "is on a GPU"), {}, "depth: cannot be read (is on a GPU); give an array"),
        ([[1.0], [1.0, 2.0]], {}, "cannot be read"),
        (GOOD, {"tag": np.full((120, 160), 3)}, "tag: has the index 3, but there are 1 tags"),
        (GOOD, {"tag": GOOD}, "tag: is float32, not whole numbers"),
        (GOOD, {"tag": np.zeros((3, 3), int)}, "tag: has the shape (3, 3)"),
        (GOOD, {"tags": ["bronze"]}, "tags: there is no material 'bronze'"),
        (GOOD, {"seed": [1, 2]}, "seed: has 2 values for 1 frames"),
        (GOOD, {"camera": "d999"}, "'d999' is no camera"),
    ],
)
def test_bad_input_is_one_line(depth: Any, keys: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught, warnings.catch_warnings():
        warnings.simplefilter("error")
        Sensor(camera=EYE, profile="paper").apply(depth, **keys)
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_what_takes_the_scene_is_refused() -> None:
    with pytest.raises(InputError, match="active stereo"):
        Sensor(camera=EYE, profile="active_stereo").apply(GOOD)
    with pytest.raises(InputError, match="has no scene to measure in"):
        Sensor(camera=EYE, profile="paper").measure(np.eye(4))
