"""`moves:` and `parent:` in scene files: what they mean, what is wrong with them, and how they are saved."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from depthsim.errors import InputError
from depthsim.moving import mover_of_face, poses
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.scenefile.save import save_scene
from depthsim.trajectory import Trajectory, write_tum

WALL = {"build": "wall", "parameters": {"material": "cement"}}


def scene_of(folder: Path, *meshes: dict, **keys: object) -> Scene:
    file = folder / "test.yaml"
    file.write_text(yaml.safe_dump({"meshes": list(meshes), **keys}))
    return load_scene(file)


def line(first: list[float], last: list[float], speed: float = 1.0, **when: object) -> dict:
    """The `moves:` along a straight line, by way-points, as `start` of a shape line is a point."""
    return {"shape": "waypoints", "points": [first, last], "speed": speed, **when}


def drone(name: str, moves: dict | None = None, **keys: object) -> dict:
    return {"name": name, "build": "drone", **({} if moves is None else {"moves": moves}), **keys}


def test_an_object_goes_along_its_path_and_looks_ahead(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, drone("a", line([0, 0, 1], [0, 4, 1], 2.0)), WALL)
    assert [mover.name for mover in scene.movers] == ["a"]
    assert [instance.name for instance in scene.instances] == ["wall", "a"]  # what moves comes last
    found = poses(scene.movers, [-1.0, 0.0, 0.5, 1.0, 2.0, 9.0])[:, 0]
    assert np.allclose(found[:, 1, 3], [0, 0, 1, 2, 4, 4], atol=1e-6)  # held at the ends
    assert np.allclose(found[:, :3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-9)  # x forward, y left, z up
    assert scene.movers[0].held(np.array([0.0, 3.0])) == pytest.approx(1.0)
    first = scene.movers[0].faces[0]
    assert list(mover_of_face(scene.movers, np.array([-1, 0, first - 1, first], np.int32))) == [-1, -1, -1, 0]
    assert scene.instance_of_face[first + 1] == 2 and scene.instance_of_face[0] == 0


def test_begin_stamp_and_repeat(tmp_path: Path) -> None:
    paths = {
        "plain": line([0, 0, 0], [4, 0, 0]),
        "later": line([0, 0, 0], [4, 0, 0], begin=1.0),
        "fixed": line([0, 0, 0], [4, 0, 0], stamp=101.0),
        "again": line([0, 0, 0], [4, 0, 0], repeat=True),
    }
    scene = scene_of(tmp_path, WALL, *(drone(name, moves) for name, moves in paths.items())).started(100.0)
    found = poses(scene.movers, [102.5, 105.0])[..., 0, 3]
    assert np.allclose(found, [[2.5, 1.5, 1.5, 2.5], [4.0, 4.0, 4.0, 1.0]], atol=1e-6)


def test_recorded_poses_keep_their_stamps_unless_told(tmp_path: Path) -> None:
    turn = np.array([[0, 0, 0, 1.0], [0, 0, np.sqrt(0.5), np.sqrt(0.5)]])
    write_tum(Trajectory([50.0, 52.0], [[0, 0, 0], [2, 0, 0]], turn), tmp_path / "poses.txt")
    scene = scene_of(
        tmp_path, WALL, drone("own", {"file": "poses.txt"}), drone("moved", {"file": "poses.txt", "begin": 1.0})
    ).started(100.0)
    found = poses(scene.movers, [51.0, 102.0])
    assert np.allclose(found[..., 0, 3], [[1.0, 0.0], [2.0, 1.0]])
    half = np.sqrt(0.5)
    assert np.allclose(found[0, 0, :3, :3], [[half, -half, 0], [half, half, 0], [0, 0, 1]], atol=1e-9)


def test_the_camera_of_a_run_and_the_body_of_a_flight_go_ahead(tmp_path: Path) -> None:
    run, flight = tmp_path / "run", tmp_path / "flight"
    run.mkdir()
    flight.mkdir()
    optical = np.array([[-0.5, 0.5, -0.5, 0.5]] * 2)  # a level camera that looks along x
    write_tum(Trajectory([0.0, 1.0], [[0, 0, 0], [1, 0, 0]], optical), run / "groundtruth.txt")
    head = "t,px,py,pz,vx,vy,vz,qx,qy,qz,qw,wx,wy,wz\n"
    rows = head + "".join(f"{t},{t},0,2,1,0,0,0,0,0,1,0,0,0\n" for t in (0, 0.5, 1))
    (flight / "flight.csv").write_text(rows)
    scene = scene_of(tmp_path, WALL, drone("a", {"run": "run"}), drone("b", {"run": "flight"}))
    found = poses(scene.movers, 0.5)[0]
    assert np.allclose(found[0], [[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], atol=1e-9)
    assert np.allclose(found[1, :3, 3], [0.5, 0, 2])


def test_a_child_goes_along_and_a_door_swings(tmp_path: Path) -> None:
    swing = {"shape": "swing", "position": [1, 0, 0], "angles": [0, 90], "period": 2.0}
    scene = scene_of(
        tmp_path, drone("child", swing, parent="base"), drone("rider", parent="child"),
        drone("base", line([0, 0, 0], [0, 4, 0])), WALL,
    )  # fmt: skip
    names = [mover.name for mover in scene.movers]
    assert names == ["base", "child", "rider"]
    base, child, rider = poses(scene.movers, 1.0)[0]
    assert np.allclose(base[:3, 3], [0, 1, 0])
    assert np.allclose(child[:3, 3], [0, 2, 0])  # 1 m ahead of the base, which looks along y
    assert np.allclose(child, rider)
    assert np.allclose(child[:3, :3], base[:3, :3] @ [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-9)


@settings(max_examples=10)
@given(st.floats(-2, 2), st.booleans(), st.integers(0, 2))
def test_a_saved_scene_is_the_same_scene(s: float, again: bool, k: int) -> None:
    folder = Path(tempfile.mkdtemp())
    write_tum(Trajectory([0.5, 1.5], [[0, 0, 0], [s, 0, 0]], [[0, 0, 0, 1.0]] * 2), folder / "poses.txt")
    when: dict = ({}, {"begin": s}, {"stamp": s})[k]
    scene = scene_of(
        folder, WALL, {**WALL, "name": "other", "translate": [0, 0, 3]}, drone("a", {"file": "poses.txt", **when}),
        drone("b", line([0, 0, 0], [1, 1, 0], repeat=again, **when)), drone("c", parent="b"),
    )  # fmt: skip
    for number, one in enumerate((scene, scene.started(7.25))):
        saved = folder / f"saved{number}"
        saved.mkdir()
        save_scene(one, saved)
        read = load_scene(saved)
        assert read.digest == one.digest
        assert read.instances == one.instances
        for name in ("vertices", "faces", "face_tags"):
            assert np.array_equal(getattr(read, name), getattr(one, name))
        assert np.array_equal(poses(read.movers, [0.3, 8.1]), poses(one.movers, [0.3, 8.1]))


def test_a_scene_of_one_mesh_is_saved_as_ever(tmp_path: Path) -> None:
    save_scene(load_scene("wall"), tmp_path)
    assert list(yaml.safe_load((tmp_path / "scene.yaml").read_text())["meshes"][0]) == ["file"]


@pytest.mark.parametrize(
    ("meshes", "reported"),
    [
        ([drone("a", {"shape": "orbit"})], "meshes.1.moves: shape is 'orbit'; give `shape:`"),
        ([drone("a", {"shape": [1]})], "meshes.1.moves: shape is '[1]'"),
        ([drone("a", {"speed": 1})], "meshes.1.moves: says no way to move"),
        ([drone("a", line([0, 0, 0], [1, 0, 0], begin=1, stamp=2))], "begin and stamp are both given"),
        ([drone("a", line([0, 0, 0], [0, 0, 0]))], "points 0 and 1 are the same"),
        ([drone("a", {"file": "none.txt"})], "none.txt: no such file"),
        ([drone("a", {"run": ".."})], "'..' leaves the folder of this file"),
        ([drone("a", {"run": "none"})], "holds neither flight.csv nor groundtruth.txt"),
        ([drone("a", {"shape": "swing", "angles": [0, 1], "period": 1, "axis": [0, 0, 0]})], "axis has no length"),
        ([drone("a", parent="b")], "meshes.1.parent: there is no mesh 'b'; the names are wall, a"),
        ([drone("a", parent="b"), drone("b", parent="a")], "meshes.1.parent: goes round in a circle: a -> b -> a"),
        ([drone("a", parent="a")], "goes round in a circle: a -> a"),
        ([drone("a"), drone("a")], "meshes.2.name: a is the name of another mesh, too"),
        ([drone("../a")], "meshes.1.name: '../a' is no name"),
        ([drone("a", line([0, 0, 0], [1, 0, 0]), parts=[["x", 3]])], "parts: is given of a mesh that moves"),
        ([drone("a", parts=[["x", 3]])], "parts: counts 3 faces of"),
    ],
)
def test_what_is_wrong_is_one_line(meshes: list[dict], reported: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        scene_of(tmp_path, WALL, *meshes)
    assert reported in str(caught.value)
    assert "\n" not in str(caught.value)


def test_something_has_to_stand(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="everything moves"):
        scene_of(tmp_path, drone("a", line([0, 0, 0], [1, 0, 0])))


@pytest.mark.parametrize("name", ["office_moving", "race_moving"])
def test_the_shipped_scenes_move_what_they_say(name: str) -> None:
    scene = load_scene(name)
    assert scene.movers
    start, later = poses(scene.movers, [0.0, 2.0])
    assert (np.abs(start - later).reshape(len(scene.movers), -1).max(axis=1) > 0.05).all()
    still = load_scene(name.removesuffix("_moving"))
    assert scene.standing[1] == pytest.approx(len(still.faces), rel=0.01)


def test_every_shape_of_the_camera_moves_objects(tmp_path: Path) -> None:
    shapes = {
        "line": {"shape": "line", "start": [0, 0, 1], "end": [2, 0, 1], "speed": 1.0, "begin": 0.5},
        "circle": {"shape": "circle", "center": [0, 0, 1], "radius": 1.0, "speed": 1.0},
        "eight": {"shape": "lemniscate", "center": [0, 0, 1], "size": [2, 1], "speed": 1.0},
        "hover": {"shape": "hover", "position": [0, 0, 1], "look_at": [1, 0, 1], "duration": 2.0},
    }
    scene = scene_of(tmp_path, WALL, *(drone(name, moves) for name, moves in shapes.items()))
    found = poses(scene.movers, 1.0)[0]
    assert np.allclose(found[0][:3, 3], [0.5, 0, 1], atol=1e-6)
    assert np.allclose(found[1][:3, 3], [np.cos(1), np.sin(1), 1], atol=1e-4)
    assert np.allclose(found[3], [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]], atol=1e-9)
