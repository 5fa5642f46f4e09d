"""Poses that are off, found by registration, and errors of the sensor that it must not take for them."""

import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recordings import ROOM_CAMERA, room_path, write_room
from scipy.spatial.transform import Rotation

from depthsim.gap.depth.data.registration import Registration, register
from depthsim.gap.depth.fit.poses import no_poses
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import Profile, effect_class
from depthsim.trajectory import Trajectory

FRAMES = 30
STAMPS = 50 + np.arange(FRAMES) / 10
SIZE = np.array([np.radians(0.4)] * 3 + [0.003] * 3)
Floats = Any


def pulled_walk() -> Floats:
    """(frames, 6) steps of one size either way, with a pull back to 0."""
    rng, x, out = np.random.default_rng(5), np.zeros(6), []
    for _ in range(FRAMES + 40):
        x = 0.7 * x + np.sqrt(1 - 0.49) * rng.choice([-1.0, 1.0], 6)
        out.append(x)
    return np.array(out[40:]) * SIZE


class Room:
    def __init__(self, folder: Path) -> None:
        self.folder, self.count = folder, 0
        self.scene = load_scene(write_room(folder / "room.obj"))
        self.caster = Caster(self.scene)

    def record(self, off: Floats | None = None, **effects: dict[str, Any]) -> Run:
        """A run that is taken from poses that are off from what it says."""
        given, off = room_path(STAMPS), np.zeros((FRAMES, 6)) if off is None else off
        matrices = given.matrices()
        positions = given.positions + np.einsum("nij,nj->ni", matrices[:, :3, :3], off[:, 3:])
        turns = Rotation.from_matrix(matrices[:, :3, :3]) * Rotation.from_rotvec(off[:, :3])
        noise = effect_class("disparity_noise")(sigma=0.01)
        profile = Profile(name="made", effects=(noise, *(effect_class(i)(**keys) for i, keys in effects.items())))
        self.count += 1
        out = self.folder / str(self.count)
        seed = zlib.crc32(repr(sorted(effects)).encode()) % 1000  # whatever was recorded before, by this worker
        generate(self.scene, Trajectory(STAMPS, positions, turns.as_quat()), ROOM_CAMERA, profile, out, seed=seed)
        return replace(Run.open(out), trajectory=given, truth=given)

    def register(self, run: Run, **keys: Any) -> Registration:
        return register(run, self.caster, **keys)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Room:
    return Room(tmp_path_factory.mktemp("room"))


@pytest.fixture(scope="module")
def walk(room: Room) -> Run:
    return room.record(pulled_walk())


def test_poses_that_are_off_are_found_and_put_right(room: Room, walk: Run) -> None:
    off, found = pulled_walk(), room.register(walk)
    random = off - off.mean(axis=0)
    mean = found.corrections.mean(axis=0)
    left = random - (found.corrections - mean)
    # What random errors leave on average is theirs.
    assert np.abs(off.mean(axis=0) - mean)[:3].max() < np.radians(0.1)
    assert (left[:, :3].std() < 0.25 * random[:, :3].std()) and (left[:, 3:].std() < 0.6 * random[:, 3:].std())
    errors = found.errors
    assert errors.rotation == pytest.approx(np.degrees(random[:, :3].std()), rel=0.2)
    assert errors.translation == pytest.approx(random[:, 3:].std(), rel=0.4)
    assert 0.05 < errors.correlation_time < 0.8  # 0.28 s on the average of many such walks
    assert errors.removed > 0.7 and "deg per frame" in errors.text
    # As sure as it says.
    sizes = np.sqrt(np.einsum("fii->fi", found.covariance))
    assert 0.5 < np.sqrt(np.mean((left[:, :3] / sizes[:, :3]) ** 2)) < 2
    # The poses themselves.
    true = walk.poses[:, :3, 3] + np.einsum("nij,nj->ni", walk.poses[:, :3, :3], off[:, 3:])
    corrected = found.applied(walk)
    assert np.std(corrected.poses[:, :3, 3] - true) < 0.7 * np.std(walk.poses[:, :3, 3] - true)
    assert room.register(corrected).errors.rotation < 0.3 * errors.rotation


def test_the_same_on_any_threads(room: Room, walk: Run) -> None:
    one, two = (room.register(walk, threads=k) for k in (1, 2))
    assert one.corrections.tobytes() == two.corrections.tobytes() and one.errors.text == two.errors.text


ERRORS_OF_THE_SENSOR: dict[str, dict[str, Any]] = {
    "disparity_noise": {"sigma": 0.04},
    "baseline_scale": {"scale": 1.01},
    "disparity_offset": {"offset": 0.3},
    "time_offset": {"offset": 0.02},
    "rolling_shutter": {"readout": 0.02},
    "thermal_drift": {"drift": -0.02, "time_constant": 1.0},
    "lens_distortion": {"k1": 0.01},
    "lens_distortion of two terms": {"k1": -0.05, "k2": 0.02},
    "intrinsics": {"fx": 1.005, "fy": 1.002, "cx": 1.0, "cy": -0.8},
    "extrinsic_rotation": {"x": 0.8, "y": -0.6, "z": 0.3},
    "extrinsic_translation": {"x": 0.03, "y": -0.02, "z": 0.01},
    "fixed_pattern": {"amplitude": 0.1, "size": 12},
    "subpixel_bias": {},
    "temporal_correlation": {"correlation": 0.8},
    "heavy_tails": {"share": 0.05},
    "range_dropout": {"rate": 0.3},
    "material_noise": {},
}


@pytest.mark.parametrize("effect_id", ERRORS_OF_THE_SENSOR)
def test_errors_of_the_sensor_are_none_of_the_poses(effect_id: str, room: Room) -> None:
    run = room.record(**{effect_id.split(maxsplit=1)[0]: ERRORS_OF_THE_SENSOR[effect_id]})
    found = room.register(run)
    assert found.errors.is_none and not found.corrections.any(), found.errors
    assert found.applied(run) is run and found.errors.rotation == found.errors.translation == 0


def test_times_that_wander_are_told_from_poses_that_are_off(room: Room, walk: Run) -> None:
    """Frames taken now early, now late, at poses that are right."""
    late = 0.06 * np.sin(1.3 * np.arange(FRAMES))
    given, taken = room_path(STAMPS), room_path(STAMPS + late)
    there, away = given.matrices(), taken.matrices()
    turns = Rotation.from_matrix(there[:, :3, :3].transpose(0, 2, 1) @ away[:, :3, :3]).as_rotvec()
    shifts = np.einsum("nji,nj->ni", there[:, :3, :3], taken.positions - given.positions)
    errors = room.register(room.record(np.hstack([turns, shifts]))).errors
    assert errors.are_of_time, errors.along_motion
    assert not room.register(walk).errors.are_of_time


def test_pictures_that_freeze_are_told_from_poses_that_are_off(room: Room, walk: Run) -> None:
    """Some pictures come twice, while the camera goes on."""
    run = room.record()
    held = [index - index % 4 if index < FRAMES // 2 else index for index in range(FRAMES)]
    frozen = replace(run, files=tuple(run.files[index] for index in held))
    errors = room.register(frozen).errors
    assert not errors.is_none and errors.are_of_time and errors.repeated > 0.3
    first = {
        name: np.repeat(getattr(run.trajectory, name)[:1], FRAMES, axis=0) for name in ("positions", "quaternions")
    }
    rest = replace(run.trajectory, **first)
    at_rest = replace(run, files=tuple(run.files[:1] * FRAMES), trajectory=rest, truth=rest)
    assert room.register(at_rest).errors.repeated == 0  # a camera that stands still and has no noise
    assert room.register(walk).errors.repeated == 0


def test_a_scale_of_each_frame_is_told_from_poses_that_are_off(room: Room, walk: Run) -> None:
    """Pictures that are by turns of two calibrations, which a rigid motion comes near to."""
    run = room.record()
    by_turns = 1 + 0.01 * (-1.0) ** np.arange(FRAMES)
    read = type(run).depth

    class Alternating(Run):
        def depth(self, index: int) -> Floats:
            return np.asarray(read(self, index) * np.float32(by_turns[index]))

    errors = room.register(Alternating(**{name: getattr(run, name) for name in run.__dataclass_fields__})).errors
    assert not errors.is_none and errors.are_of_disparity, errors.of_disparity
    assert not room.register(walk).errors.are_of_disparity


def test_a_drift_that_lasts_is_of_the_poses_unless_disparities_explain_it(room: Room, walk: Run) -> None:
    """What a bias of another shape leaves lasts as long as a short recording, and looks like biases."""
    errors = room.register(walk).errors
    assert errors.independent > 3 and not errors.are_lasting
    drift = np.linspace(-1.5, 1.5, FRAMES)[:, None] * SIZE
    lasting = room.register(room.record(drift)).errors
    assert not lasting.is_none and lasting.independent < 3 and not lasting.are_lasting, lasting.of_disparity
    bias = replace(lasting, of_disparity=0.5)
    assert bias.are_lasting and "longer recording" in no_poses(bias)


def test_what_is_constant_is_told_and_left_in(room: Room) -> None:
    off = pulled_walk()
    turned = room.register(room.record(off, extrinsic_rotation={"x": 0.8, "y": -0.6, "z": 0.3}))
    assert np.degrees(turned.errors.constant[:3]) == pytest.approx([0.8, -0.6, 0.3], abs=0.25)
    assert np.abs(turned.corrections.mean(axis=0)[:3]).max() < np.radians(0.15)
    late = room.register(room.record(off, time_offset={"offset": 0.03})).errors
    assert late.late == pytest.approx(0.03, abs=0.006) and late.late_error < 0.01
    assert late.rotation == pytest.approx(0.37, rel=0.3)  # 0.457 to 0.467 over eight seeds


def test_a_frontal_wall_shows_three_directions(tmp_path: Path) -> None:
    (tmp_path / "wall.obj").write_text("usemtl cement\nv 2 -30 -30\nv 2 30 -30\nv 2 30 30\nv 2 -30 30\nf 1 2 3 4\n")
    plain = Room(tmp_path)
    plain.scene = load_scene(tmp_path / "wall.obj")
    plain.caster = Caster(plain.scene)
    straight = replace(room_path(STAMPS), quaternions=np.tile([-0.5, 0.5, -0.5, 0.5], (FRAMES, 1)))
    run, off = Run.open(plain_run(plain, straight)), pulled_walk()
    found = plain.register(replace(run, trajectory=straight, truth=straight))
    assert not found.corrections[:, 2:5].any()
    assert np.isnan(found.errors.deviation[3:5]).all()
    random = off - off.mean(axis=0)
    assert np.corrcoef(found.corrections[:, 0], random[:, 0])[0, 1] > 0.95
    assert np.corrcoef(found.corrections[:, 1], random[:, 1])[0, 1] > 0.95


def plain_run(room: Room, given: Trajectory) -> Path:
    """A recording of a wall by a camera whose poses are off."""
    off, matrices = pulled_walk(), given.matrices()
    positions = given.positions + np.einsum("nij,nj->ni", matrices[:, :3, :3], off[:, 3:])
    turns = Rotation.from_matrix(matrices[:, :3, :3]) * Rotation.from_rotvec(off[:, :3])
    noise = effect_class("disparity_noise")(sigma=0.01)
    out = room.folder / "off"
    profile = Profile(name="made", effects=(noise,))
    generate(room.scene, Trajectory(STAMPS, positions, turns.as_quat()), ROOM_CAMERA, profile, out)
    return out


def test_a_recording_without_a_picture_of_the_scene(room: Room) -> None:
    run = room.record()
    away = replace(room_path(STAMPS), positions=room_path(STAMPS).positions + np.array([500.0, 0, 0]))
    found = room.register(replace(run, trajectory=away, truth=away))
    assert found.errors.is_none and np.isnan(found.errors.deviation).all()


def test_some_frames_only(room: Room, walk: Run) -> None:
    found = room.register(walk, frames=range(0, FRAMES, 2))
    assert len(found.corrections) == FRAMES // 2 and found.errors.rotation > 0.2


def test_the_effect_of_what_was_found_is_found_again(room: Room, walk: Run) -> None:
    found = room.register(walk).errors
    effect = found.effect()
    assert effect.rotation == pytest.approx(found.rotation, rel=1e-3) and not effect.is_neutral
    again = room.register(room.record(**{effect.id: effect.model_dump()})).errors
    assert again.rotation == pytest.approx(effect.rotation, rel=0.5)
    assert room.register(room.record()).errors.effect().is_neutral


def test_too_few_frames_say_nothing(room: Room, walk: Run) -> None:
    for count in (1, 2, 5):
        found = room.register(walk, frames=range(count))
        assert found.errors.is_none and found.corrections.shape == (count, 6)
