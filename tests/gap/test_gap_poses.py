"""Poses that are off, and a pattern that stays, in a diagnosis as it is called; of other formulas than the effects'."""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from recordings import ROOM_CAMERA, room_path, write_room
from scipy.spatial.transform import Rotation
from shapes import Array

from depthsim.gap import Diagnosis, diagnose
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.data.registration import Registration, register
from depthsim.gap.depth.diagnose import investigate
from depthsim.gap.depth.fit import poses
from depthsim.gap.depth.fit.candidates import candidates, setting_of
from depthsim.gap.depth.fit.fitting import Fitting
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.poses import register_frames
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.validate import Validator
from depthsim.gap.depth.report.write import write_report
from depthsim.gap.report import words
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.png import encode_png
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.sensor import Profile, effect_class, load_profile
from depthsim.sensor.effect import effect_ids
from depthsim.trajectory import Trajectory

FRAMES = 24
CAMERA = ROOM_CAMERA.model_copy(
    update={"width": 112, "height": 84, "fx": 63.0, "fy": 63.0, "cx": 55.5, "cy": 41.5}
)  # as much to see, by half as many pixels
STAMPS = 50 + np.arange(FRAMES) / 10
BASE = Profile(name="made", effects=(effect_class("disparity_noise")(sigma=0.03),))
BANK = {"pose_noise", "fixed_pattern", "disparity_noise", "time_offset", "baseline_scale", "extrinsic_rotation",
        "extrinsic_translation", "rolling_shutter", "disparity_offset", "motion_noise"}  # fmt: skip
OTHERS = tuple(name for name in effect_ids() if name not in BANK)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return load_scene(write_room(tmp_path_factory.mktemp("poses") / "room.obj"))


def record(scene: Scene, folder: Path, off: Array | None = None, **effects: dict[str, Any]) -> Run:
    """A run whose poses, as it has them, are off: (frames, 6) turns [rad] and shifts [m] in the camera's axes."""
    profile = BASE.model_copy(
        update={"effects": (*BASE.effects, *(effect_class(i)(**keys) for i, keys in effects.items()))}
    )
    generate(scene, room_path(STAMPS), CAMERA, profile, folder, seed=4)
    run = Run.open(folder)
    if off is None:
        return run
    true = room_path(STAMPS)
    positions = true.positions + np.einsum("nij,nj->ni", true.matrices()[:, :3, :3], off[:, 3:])
    turns = Rotation.from_quat(true.quaternions) * Rotation.from_rotvec(off[:, :3])
    told = Trajectory(STAMPS, positions, turns.as_quat())
    return replace(run, trajectory=told, truth=told)


def jumps() -> Array:
    """Either way by one size, every frame anew: no normal numbers."""
    rng = np.random.default_rng(2)
    return np.asarray(rng.choice([-1.0, 1.0], (FRAMES, 6)) * np.array([np.radians(0.4)] * 3 + [0.003] * 3))


def found_in(run: Run, scene: Scene, *without: str) -> Diagnosis:
    return diagnose(run, scene=scene, sensor=BASE, without=(*OTHERS, *without), threads=1, tasks=False)


@pytest.fixture(scope="module")
def shaken(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Run:
    return record(scene, tmp_path_factory.mktemp("shaken") / "run", jumps())


def test_poses_that_are_off_are_a_cause(scene: Scene, shaken: Run, tmp_path: Path) -> None:
    found = investigate(shaken, scene=scene, sensor=BASE, without=OTHERS, threads=1, tasks=False)
    said = found.diagnosis
    assert [cause.effect for cause in said.causes] == ["pose_noise"]
    (cause,) = said.causes
    assert cause.closed_fraction == pytest.approx(said.gap.closed_fraction) and cause.closed_fraction > 0.9
    for name, true in (("rotation", 0.4), ("translation", 0.003)):
        low, high = cause.ci95[name]
        assert low < cause.parameters[name] < high and low < 1.1 * true and high > 0.9 * true
    assert cause.ci95["correlation_time"][0] == 0
    assert any("deg per frame" in note for note in said.notes)
    assert "deg" in words.parameters(cause)[0].text
    # As recorded, so that the place is that of the whole gap.
    assert said.where and found.evidence.run is shaken
    write_report(found, tmp_path / "report")
    profile = load_profile(tmp_path / "report" / "sensor.yaml")
    assert profile.effects[-1].id == "pose_noise"
    again = diagnose(shaken, scene=scene, sensor=profile, without=OTHERS, threads=1, tasks=False)
    assert again.verdict in ("no_gap", "explained") and not again.causes


def test_without_it_nothing_is_registered(scene: Scene, shaken: Run) -> None:
    found = found_in(shaken, scene, *(BANK - {"disparity_noise", "extrinsic_rotation"}))
    assert "pose_noise" not in [cause.effect for cause in found.causes] and not any("regist" in n for n in found.notes)


@pytest.mark.parametrize(
    ("effect", "keys"),
    [
        ("time_offset", {"offset": 0.04}),
        ("rolling_shutter", {"readout": 0.05}),
        ("baseline_scale", {"scale": 1.01}),
        ("extrinsic_rotation", {"x": 0.8, "y": -0.6, "z": 0.3}),
        ("extrinsic_translation", {"x": 0.03, "y": -0.02, "z": 0.01}),
    ],
)
def test_errors_of_the_sensor_keep_their_names(effect: str, keys: Any, scene: Scene, tmp_path: Path) -> None:
    run = record(scene, tmp_path / "run", **{effect: keys})
    evidence, _ = load_evidence(run, scene, BASE, threads=1)
    assert register_frames(evidence)[1] is None
    rivals = tuple(BANK - {effect, "pose_noise", "disparity_noise"})
    found = found_in(run, scene, *rivals)
    assert [cause.effect for cause in found.causes] == [effect]


@pytest.mark.parametrize(("lags", "turned"), [(True, False), (True, True), (False, False)])
def test_what_lags_behind_is_no_error_of_the_poses(
    lags: bool, turned: bool, scene: Scene, shaken: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mean of the depth over the frames before, written into the pictures that the run has, also of a camera that is
    turned against its poses. Where nothing lags, nothing is fitted in full."""
    mount = {"extrinsic_rotation": {"x": 1.0, "y": -0.7, "z": 0.5}} if turned else {}
    run = record(scene, tmp_path / "run", **mount) if lags else shaken
    state = run.depth_raw(0).astype(float)
    for index, file in enumerate(run.files if lags else ()):
        now = run.depth_raw(index).astype(float)
        same = (now > 0) & (state > 0) & (np.abs(now - state) < 150)
        state = np.where(same, 0.35 * now + 0.65 * state, now)
        file.write_bytes(encode_png(np.round(state).astype(np.uint16)))
    evidence, _ = load_evidence(Run.open(run.path) if lags else run, scene, BASE)
    without = [name for name in effect_ids() if name not in ("temporal_filter", "extrinsic_rotation")]
    errors = register_frames(evidence)[0]
    fitted: list[Model] = []
    fit = Fitting.fit
    monkeypatch.setattr(Fitting, "fit", lambda self, model, rounds: (fitted.append(model), fit(self, model, rounds))[1])
    assert poses.is_for_what_lags(evidence, errors, evidence.held_out, without, lambda _: None) == lags
    assert bool(fitted) == lags


@pytest.mark.parametrize(
    ("effect", "off"), [("lens_distortion", False), ("lens_distortion", True), ("fill_rate", False)]
)
def test_poses_are_right_where_the_causes_do_as_well_without_registering(
    effect: str, off: bool, scene: Scene, tmp_path: Path
) -> None:
    """Part of what a decentred lens does to a frame is like a motion of it, and registering takes that off."""
    keys = {"lens_distortion": {"k1": 0.04, "p1": 0.004, "p2": -0.003}, "fill_rate": {"rate": 0.1}}[effect]
    given, _ = load_evidence(record(scene, tmp_path / "run", jumps() if off else None, **{effect: keys}), scene, BASE)
    frames = [int(i) for block in given.blocks for i in block]
    registered = poses._registered(given, register(given.run, given.caster, frames, 1))
    validator = Validator(registered, registered.held_out)
    bank = [one for one in candidates(given.base, setting_of(given)) if one.effect == effect]
    fitting = Fitting(registered, validator, bank, registered.base, lambda _: None)
    model = fitting.fit(fitting.begin(bank[-1], registered.base), 4)
    selection = Selection(model, {}, (), ())
    found = poses.explained_as_given(given, validator, selection, lambda _: None)
    assert (found is not None) == (effect == "lens_distortion" and not off)
    assert found is None or found.run is given.run


def test_a_mount_that_is_turned_beside_poses_that_are_off(scene: Scene, tmp_path: Path) -> None:
    run = record(scene, tmp_path / "run", jumps(), extrinsic_rotation={"x": 1.5, "y": -1.2, "z": 0.8})
    found = found_in(run, scene, "time_offset", "rolling_shutter", "motion_noise")
    assert {cause.effect for cause in found.causes} == {"pose_noise", "extrinsic_rotation"}
    assert sum(cause.closed_fraction for cause in found.causes) == pytest.approx(found.gap.closed_fraction)


def test_of_few_frames_nothing_is_known(scene: Scene, shaken: Run) -> None:
    few = {name: getattr(shaken, name)[:5] for name in ("files", "rgb_files")}
    part = replace(shaken.trajectory, **{f.name: getattr(shaken.trajectory, f.name)[:5] for f in
                   fields(Trajectory) if f.name in ("stamps", "positions", "quaternions")})  # fmt: skip
    evidence, _ = load_evidence(replace(shaken, trajectory=part, truth=part, **few), scene, BASE, threads=1)
    assert register_frames(evidence)[1] is None


@dataclass(frozen=True, eq=False)
class Dented(Run):
    """A recording whose disparity has dents that stay."""

    def depth(self, index: int) -> Any:
        """Depth [m]."""
        return self.depth_raw(index).astype(np.float32) * np.float32(self.camera.depth_scale)

    def depth_raw(self, index: int) -> Any:
        """Depth in units."""
        units = super().depth_raw(index)
        z = units.astype(float) * self.camera.depth_scale
        v, u = np.mgrid[: z.shape[0], : z.shape[1]]
        dents = np.zeros(z.shape)
        for at, size, depth in (
            ((28, 21), 8.4, 1), ((77, 42), 10.5, 1), ((56, 14), 7, -1), ((14, 49), 9.8, -1), ((91, 14), 8.4, -1),
            ((52, 49), 8.4, -1),
        ):  # fmt: skip
            dents += 0.12 * depth / (1 + (((u - at[0]) ** 2 + (v - at[1]) ** 2) / size**2) ** 2)
        fb = self.camera.focal_baseline
        d = fb / np.maximum(z, 1e-3) + dents
        return np.where(units > 0, np.round(fb / d / self.camera.depth_scale), 0).astype(np.uint16)


def test_a_pattern_is_named_with_its_grid(scene: Scene, tmp_path: Path) -> None:
    run = record(scene, tmp_path / "run")
    run = Dented(**{one.name: getattr(run, one.name) for one in fields(run)})
    found = investigate(run, scene=scene, sensor=BASE, without=OTHERS, threads=1, tasks=False)
    causes = found.diagnosis.causes
    assert [cause.effect for cause in causes] == ["fixed_pattern"]
    assert causes[0].closed_fraction > 0.6  # what a mount or an offset explains as well is not learned
    assert [p.name for p in words.parameters(causes[0])] == ["amplitude", "size"]
    write_report(found, tmp_path / "report")
    text = (tmp_path / "report" / "sensor.yaml").read_text()
    grid = load_profile(tmp_path / "report" / "sensor.yaml").effects[-1].model_dump()["grid"]
    assert text.count("    - [") == len(grid) > 2
    page = (tmp_path / "report" / "index.html").read_text()
    row = str(grid[1])  # a row, as one number's digits may come up in a picture's path
    assert row.removeprefix("[").removesuffix("]") not in page


@pytest.mark.parametrize(("registered", "whole", "nearer"), [(1.05, 9.0, True), (1.2, 0.4, True), (1.2, 0.6, False)])
def test_frames_beside_a_turned_mount_are_judged_without_it(
    monkeypatch: pytest.MonkeyPatch, registered: float, whole: float, nearer: bool
) -> None:
    """Of a gap of 1 as it is; whole: where what is alike in all frames is taken off, too."""

    def judge(gap: float) -> Any:
        return SimpleNamespace(quick=lambda base: gap, evidence=SimpleNamespace(base=()), blocks=[0])

    monkeypatch.setattr(poses, "_registered", lambda given, found, constant: whole if constant else None)
    monkeypatch.setattr(poses, "Validator", lambda evidence, blocks: judge(evidence))
    found = poses.Poses(cast("Registration", None), None, judge(0).evidence)
    assert found.bring_nearer(judge(1.0), judge(registered)) is nearer
