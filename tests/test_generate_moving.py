"""Runs of scenes in which objects move: poses and instances, effects that see the motion, resumed and swept."""

import logging
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from moving import CAMERA, write_scene
from typer.testing import CliRunner

from depthsim.camera import Camera
from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.flight.contact import first_contact
from depthsim.moving import poses
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.sensor import Sensor, load_profile
from depthsim.sensor.motion import Motion
from depthsim.trajectory import Trajectory, read_tum

STAND = np.array([-0.5, 0.5, -0.5, 0.5])  # a level camera that looks along x


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return load_scene(write_scene(tmp_path))


def files(run: Path) -> dict[str, bytes]:
    return {str(p.relative_to(run)): p.read_bytes() for p in sorted(run.rglob("*")) if p.is_file()}


def standing(count: int = 6, first: float = 0.0) -> Trajectory:
    return Trajectory(first + np.arange(count) / 30, np.zeros((count, 3)), np.tile(STAND, (count, 1)))


def test_a_run_has_poses_and_instances_of_its_objects(scene: Scene, tmp_path: Path) -> None:
    out = tmp_path / "run"
    generate(scene, standing(first=10.0), CAMERA, "paper", out, threads=2)
    run = Run.open(out)
    assert {k: (i.name, i.tags, i.poses) for k, i in run.instances.items()} == {
        1: ("wall", ("cement",), None), 2: ("parcel", ("plastic",), "objects/parcel.txt")
    }  # fmt: skip
    track = read_tum(out / "objects" / "parcel.txt")
    assert np.array_equal(track.stamps, run.stamps)
    assert np.allclose(track.positions[:, 1], -0.5 + 2.0 * (run.stamps - 10.0), atol=1e-6)
    for index in range(len(run)):
        shown, clean, tag = run.instance(index), run.clean(index), run.material(index)
        assert shown is not None and clean is not None and tag is not None
        assert np.array_equal(shown == 2, tag == run.tags.index("plastic"))
        assert np.allclose(clean[shown == 1], 3.0, atol=1e-3)
        front = shown == 2
        columns = np.flatnonzero(front.any(axis=0))
        middle = 31.5 - 50 * track.positions[index, 1] / 1.7
        assert abs((columns[0] + columns[-1]) / 2 - middle) < 2.5  # its left side is at 1.7 m; another shows, too
        assert np.allclose(np.sort(clean[front])[: front.sum() // 2], 1.7, atol=1e-3)


def test_the_same_bytes_whatever_the_threads_after_a_break_and_like_a_run(scene: Scene, tmp_path: Path) -> None:
    first, second, third = (tmp_path / name for name in ("first", "second", "third"))
    for out, threads in ((first, 1), (second, 3)):
        generate(scene, standing(), CAMERA, "d435", out, seed=3, threads=threads)
    assert files(first) == files(second)
    for name in ("depth.txt", "clean.txt", "rgb.txt"):
        (second / name).unlink()
    shutil.rmtree(second / "instance")
    generate(scene, standing(), CAMERA, "d435", second, seed=3)
    assert files(first) == files(second)
    model = Run.open(first)
    generate(first, model.trajectory, model.camera, "d435", third, seed=3)
    assert yaml.safe_load((first / "run.yaml").read_text()) == yaml.safe_load((third / "run.yaml").read_text())
    assert files(first) == files(third)


def test_another_motion_is_another_run(scene: Scene, tmp_path: Path) -> None:
    out = tmp_path / "run"
    generate(scene, standing(), CAMERA, "paper", out)
    other = tmp_path / "other"
    other.mkdir()
    faster = load_scene(write_scene(other, shape="waypoints", points=[[2, -0.5, 0], [2, 0.5, 0]], speed=3.0))
    with pytest.raises(InputError, match=r"scene_digest"):
        generate(faster, standing(), CAMERA, "paper", out)
    still = Scene("still", scene.vertices, scene.faces, scene.face_tags, scene.tags)
    generate(still, standing(), CAMERA, "paper", out, overwrite=True)
    assert not (out / "instances.yaml").exists() and not (out / "objects").exists() and not (out / "instance").exists()


def test_instances_of_a_scene_that_stands_are_made_when_asked_for(scene: Scene, tmp_path: Path) -> None:
    posed = scene.at(0.2)
    generate(posed, standing(2), CAMERA, "paper", tmp_path / "plain")
    assert not (tmp_path / "plain" / "instances.yaml").exists()
    generate(posed, standing(2), CAMERA, "paper", tmp_path / "run", streams=("depth", "instance"))
    shown = Run.open(tmp_path / "run").instance(0)
    assert shown is not None and set(np.unique(shown)) == {1, 2}
    assert not (tmp_path / "run" / "objects").exists()


def effect(profile: str, tmp_path: Path) -> object:
    (tmp_path / "sensor.yaml").write_text(f"effects:\n{profile}")
    return load_profile(tmp_path / "sensor.yaml")


def test_a_late_stamp_and_a_rolling_shutter_see_objects_where_they_were(scene: Scene, tmp_path: Path) -> None:
    pose = standing().matrices()[0]
    late = Sensor(scene, CAMERA, effect("  - time_offset: {offset: 0.05}\n", tmp_path))
    plain = Sensor(scene, CAMERA, ())
    motion = Motion.still(pose)
    shifted = late.measure(pose, stamp=0.1, motion=motion)
    assert np.array_equal(shifted.depth_raw, plain.measure(pose, stamp=0.15, motion=motion).depth_raw)
    assert not np.array_equal(shifted.depth_raw, plain.measure(pose, stamp=0.1, motion=motion).depth_raw)
    rolling = Sensor(scene, CAMERA, effect("  - rolling_shutter: {readout: 0.1}\n", tmp_path))
    bent = rolling.measure(pose, stamp=0.25, motion=motion).depth_raw
    for row in (12, 24, 36):
        at = 0.25 + 0.1 * ((row + 0.5) / 48 - 0.5)
        assert np.array_equal(bent[row], plain.measure(pose, stamp=at, motion=motion).depth_raw[row])


def test_motion_noise_is_that_of_the_object_on_the_object(scene: Scene, tmp_path: Path) -> None:
    sensor = Sensor(scene, CAMERA, effect("  - motion_noise: {sigma: 0.1}\n", tmp_path))
    pose = standing().matrices()[0]
    depths = np.stack([sensor.measure(pose, stamp=0.25, index=k).depth for k in range(60)])
    met = sensor.caster.cast(CAMERA, pose, stamps=0.25)
    flat = (met.tag == scene.tags.index("plastic")) & (np.abs(met.depth - 1.7) < 1e-3)
    assert depths[:, met.tag == scene.tags.index("cement")].std(axis=0).max() == 0  # the camera stands
    disparity = CAMERA.focal_baseline / depths[:, flat]
    assert disparity.std() == pytest.approx(0.1 * 2.0 / 1.7, rel=0.1)  # 2 m/s at 1.7 m


def test_what_is_odd_about_a_path_is_noted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    cases = {
        "parcel stands still for 0.10 s, beyond the ends of its path": [[2, 0, 0], [2, 0.2, 0]],
        "parcel is outside the scene in 7 of 7 frames": [[9, 0, 0], [9, 2, 0]],
    }
    for number, (said, points) in enumerate(cases.items()):
        caplog.clear()
        file = write_scene(tmp_path, shape="waypoints", points=points, speed=2.0)
        with caplog.at_level(logging.INFO, "depthsim"):
            generate(file, standing(7), CAMERA, "paper", tmp_path / f"run{number}")
        assert any(said in record.getMessage() for record in caplog.records), caplog.text


def test_an_object_that_begins_inside_another_is_noted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    file = write_scene(tmp_path, shape="waypoints", points=[[2, 0, 0], [2, 1, 0]], speed=2.0)
    spec = yaml.safe_load(file.read_text())
    spec["meshes"].append({"file": "box.obj", "translate": [2, 0, 0], "scale": 3})
    spec["meshes"].append({"file": "box.obj", "translate": [-9, 0, 0]})
    file.write_text(yaml.safe_dump(spec))
    with caplog.at_level(logging.INFO, "depthsim"):
        generate(file, standing(2), CAMERA, "paper", tmp_path / "run")
    assert "parcel begins inside a wall or another object" in caplog.text


def test_active_stereo_sees_objects_move(scene: Scene) -> None:
    keys = {"width": 160, "height": 120, "fx": 150, "fy": 150, "cx": 79.5, "cy": 59.5, "baseline": 0.05}
    sensor = Sensor(scene, Camera.model_validate(keys), "active_stereo")
    pose = standing().matrices()[0]
    here, there = (sensor.measure(pose, stamp=stamp) for stamp in (0.05, 0.45))
    assert here.left is not None and there.left is not None
    assert np.mean(here.left != there.left) > 0.1
    on = sensor.caster.cast(sensor.camera, pose, stamps=0.45).tag == scene.tags.index("plastic")
    assert np.abs(np.median(there.depth[on & (there.depth > 0)]) - 1.7) < 0.1


def test_a_texture_goes_along_with_its_object(scene: Scene, tmp_path: Path) -> None:
    """The pixels of the box are the same two frames later, shifted by as many pixels as it has moved."""
    moved = poses(scene.movers, [0.0, 0.34])[:, 0, 1, 3]
    pixels = 50 * (moved[1] - moved[0]) / 1.7
    assert pixels == pytest.approx(20.0)
    generate(scene, Trajectory([0.0, 0.34], np.zeros((2, 3)), [STAND, STAND]), CAMERA, "clean", tmp_path / "run")
    run = Run.open(tmp_path / "run")
    first, second = (run.rgb(index) for index in (0, 1))
    clean = run.clean(0)
    assert first is not None and second is not None and clean is not None
    v, u = np.nonzero(np.abs(clean - 1.7) < 1e-3)
    inner = (u > 41) & (u < 51)
    assert inner.sum() > 100
    assert np.abs(first[v, u][inner].astype(int) - second[v, u - 20][inner]).max() <= 2
    assert first[v, u][inner].std() > 1  # there is a texture


def test_a_flight_does_not_touch_what_moves(scene: Scene) -> None:
    """Its vertices are in its own frame, about the origin, where the flight begins."""
    positions = np.linspace([-1, 0, 0], [2.5, 0, 0], 8)
    assert first_contact(scene, np.arange(8) / 10, positions, 0.2) is None
    assert first_contact(scene.at(0.25), np.arange(8) / 10, positions, 0.2) is not None


def test_a_sweep_makes_and_mends_runs_with_objects(tmp_path: Path) -> None:
    write_scene(tmp_path)
    sweep = {"scenes": ["scene.yaml"], "profiles": ["paper"], "seeds": 2, "frames": 3, "camera": CAMERA.model_dump()}
    sweep |= {"streams": ["depth", "clean", "instance"], "random": {"materials": {"plastic": ["wood", "plastic"]}}}
    (tmp_path / "sweep.yaml").write_text(yaml.safe_dump(sweep))
    command = ["sweep", str(tmp_path / "sweep.yaml"), "--out", str(tmp_path / "out"), "--workers", "1"]
    assert CliRunner().invoke(app, command).exit_code == 0
    runs = sorted(path.parent for path in (tmp_path / "out").rglob("depth.txt"))
    assert len(runs) == 2
    before = [files(run) for run in runs]
    assert all(
        "objects/parcel.txt" in one and "objects/parcel.ply" in one and "instances.yaml" in one for one in before
    )
    assert load_scene(runs[0]).movers[0].name == "parcel"
    broken = next((runs[1] / "instance").glob("*.png"))
    broken.unlink()
    (runs[1] / "depth.txt").unlink()
    assert CliRunner().invoke(app, command).exit_code == 0
    assert [files(run) for run in runs] == before
