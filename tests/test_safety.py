"""Nothing that a file holds is run, and no file names a path outside its folder."""

import ast
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from broken.scenes import gltf
from recordings import write_run

from depthsim.errors import InputError
from depthsim.exporting import export
from depthsim.flight.spec import read_flight_spec
from depthsim.flight.windfile import resolve_wind
from depthsim.importing import import_recording
from depthsim.material_fit.captures import find_captures
from depthsim.runs import Run
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory
from depthsim.yamlfile import beside

ROOT = Path(__file__).parents[1]
SOURCES = sorted(file for package in ("depthsim", "viewer") for file in (ROOT / package).rglob("*.py"))

_RUNS_CODE = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "marshal", "shelve", "jsonpickle"}
_CALLS = {"eval", "exec", "compile", "__import__"}
_YAML = {"load", "load_all", "full_load", "full_load_all", "unsafe_load", "unsafe_load_all"}
_YAML |= {"Loader", "FullLoader", "UnsafeLoader", "CLoader", "CFullLoader", "CUnsafeLoader"}
_ARCHIVES = {"extractall", "extract", "unpack_archive"}


def dangers(source: str) -> list[str]:
    """What in a Python source could run what a file holds, or write where an archive says: "line: what"."""
    found = []
    for node in ast.walk(ast.parse(source)):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name.split(".")[0] for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [(node.module or "").split(".")[0]]
            if names == ["yaml"]:
                found += [f"{node.lineno}: yaml.{alias.name}" for alias in node.names if alias.name in _YAML]
        found += [f"{node.lineno}: import {name}" for name in names if name in _RUNS_CODE]
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.value.id == "yaml" and node.attr in _YAML:
                found.append(f"{node.lineno}: yaml.{node.attr}")
            if (node.value.id, node.attr) in (("os", "system"), ("os", "popen")):
                found.append(f"{node.lineno}: os.{node.attr}")
        if isinstance(node, ast.Call):
            found += [f"{node.lineno}: {what}" for what in _calls(node)]
    return found


def _calls(node: ast.Call) -> list[str]:
    function = node.func
    keywords = {word.arg: word.value for word in node.keywords}
    if isinstance(function, ast.Name):
        return [function.id] if function.id in _CALLS else []
    if not isinstance(function, ast.Attribute):
        return []
    found = []
    pickled = keywords.get("allow_pickle")
    safe = isinstance(pickled, ast.Constant) and pickled.value is False
    of_numpy = isinstance(function.value, ast.Name) and function.value.id in ("np", "numpy", "npyio")
    if (function.attr == "load" and of_numpy and not safe) or (pickled is not None and not safe):
        found.append("numpy.load with pickle")
    if function.attr in _ARCHIVES and "filter" not in keywords:
        found.append(f"{function.attr} without filter")
    shell = keywords.get("shell")
    if shell is not None and not (isinstance(shell, ast.Constant) and shell.value is False):
        found.append("a shell")
    if function.attr in ("read_pickle", "to_pickle"):
        found.append(function.attr)
    return found


@pytest.mark.parametrize("file", SOURCES, ids=lambda file: str(file.relative_to(ROOT)))
def test_nothing_in_a_file_is_run(file):
    assert dangers(file.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "text",
    [
        "import pickle", "from pickle import loads", "import dill as d", "yaml.load(x, Loader=yaml.SafeLoader)",
        "from yaml import load", "yaml.unsafe_load(x)", "class L(yaml.UnsafeLoader): pass", "np.load(x)",
        "np.load(x, allow_pickle=True)", "np.load(x, allow_pickle=reported)", "eval(x)", "exec(x)", "tar.extractall(x)",
        "shutil.unpack_archive(x)", "subprocess.run(x, shell=True)", "os.system(x)",
    ],
)  # fmt: skip
def test_the_check_sees_what_it_is_for(text):
    assert len(dangers(text)) >= 1


def test_the_check_lets_the_rest_pass():
    harmless = "np.load(x, allow_pickle=False); tar.extractall(x, filter='data'); yaml.safe_load(x); model.eval()"
    assert dangers(harmless) == []


OUTSIDE = ("../secret{}", "{root}/secret{}", "sub/../../secret{}", "link/secret{}")


@pytest.fixture(params=OUTSIDE)
def reported(request, tmp_path):
    """A function from an ending to a name that leads out of tmp_path/in, to a file that is there and is valid."""
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "sub").mkdir()
    (folder / "link").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "secret.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl cement\nf 1 2 3\n")
    (tmp_path / "secret.bin").write_bytes(np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], "<f4").tobytes() + bytes(8))
    (tmp_path / "secret.txt").write_text("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n")
    (tmp_path / "secret.csv").write_text("x,y,z,wx,wy,wz\n0,0,0,1,0,0\n")
    (tmp_path / "secret.yaml").write_text("{shape: hover, time: 3}")
    return lambda ending: request.param.format(ending, root=tmp_path)


def refused(what: str = "leaves the folder"):
    return pytest.raises(InputError, match=what)


def test_scene_files_stay_in_their_folder(reported, tmp_path):
    scene = tmp_path / "in" / "scene.yaml"
    scene.write_text(json.dumps({"meshes": [{"file": reported(".obj")}]}))
    with refused():
        load_scene(scene)
    shutil.copy(tmp_path / "secret.obj", tmp_path / "in" / "own.obj")
    scene.write_text(json.dumps({"meshes": [{"file": "own.obj"}], "trajectories": {"a": {"file": reported(".txt")}}}))
    with refused():
        load_trajectory("a", load_scene(scene))
    (tmp_path / "in" / "scene.gltf").write_text(gltf(buffers=[{"byteLength": 44, "uri": reported(".bin")}]))
    with refused():
        load_scene(tmp_path / "in" / "scene.gltf", tags={"*": "cement"})
    escaped = reported(".bin").replace(".", "%2e").replace("/", "%2F")
    (tmp_path / "in" / "scene.gltf").write_text(gltf(buffers=[{"byteLength": 44, "uri": escaped}]))
    with refused():
        load_scene(tmp_path / "in" / "scene.gltf", tags={"*": "cement"})


def test_profiles_paths_winds_and_flights_stay_in_their_folder(reported, tmp_path):
    file = tmp_path / "in" / "reported.yaml"
    file.write_text(json.dumps({"effects": [], "camera": reported(".yaml")}))
    with refused():
        load_profile(file)
    file.write_text(json.dumps({"file": reported(".txt")}))
    with refused():
        load_trajectory(file, rate=10)
    file.write_text(json.dumps({"kind": "field", "file": reported(".csv")}))
    with refused():
        resolve_wind(str(file))
    for key, ending in (("vehicle", ".yaml"), ("path", ".yaml"), ("wind", ".csv")):
        file.write_text(json.dumps({"path": {"shape": "hover", "time": 3}, key: reported(ending)}))
        with refused():
            read_flight_spec(file)


def test_lists_of_runs_and_captures_stay_in_their_folder(reported, tmp_path):
    run = write_run(tmp_path / "in" / "run").path
    (tmp_path / "in" / "run" / "link").symlink_to(tmp_path, target_is_directory=True)
    (run / "sub").mkdir()
    picture = next((run / "depth").iterdir())
    shutil.copy(picture, tmp_path / "secret.png")
    shutil.copy(picture, tmp_path / "in" / "secret.png")
    for name in ("depth.txt", "rgb.txt"):
        text = (run / name).read_text()
        (run / name).write_text(text.rsplit("\n", 2)[0] + f"\n1700000000.75 {reported('.png')}\n")
        with refused():
            Run.open(run)
        (run / name).write_text(text)
    (tmp_path / "in" / "distances.csv").write_text(f"folder,distance_m\n{reported('')},1\n")
    (tmp_path / "secret").mkdir()
    shutil.copy(picture, tmp_path / "secret")
    with refused():
        find_captures([tmp_path / "in"])


@pytest.mark.parametrize("kind", ["ros2", "ros2-sqlite3"])
def test_a_bag_names_no_file_outside_its_folder(tmp_path, kind):
    export(write_run(tmp_path / "run"), kind, tmp_path / "whole")
    storage = next(file for file in (tmp_path / "whole").iterdir() if file.name != "metadata.yaml")
    (tmp_path / "empty").mkdir()
    for name in (f"../whole/{storage.name}", str(storage)):
        text = (tmp_path / "whole" / "metadata.yaml").read_text().replace(storage.name, name)
        (tmp_path / "empty" / "metadata.yaml").write_text(text)
        with refused("names no .mcap or .db3 that is there"):
            import_recording(tmp_path / "empty", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["a" * 300, "loop", "a\0b", "é" * 200])
def test_names_that_are_no_paths_are_reported_in_one_line(tmp_path, name):
    (tmp_path / "loop").symlink_to("loop")
    with refused("cannot be a path|leaves the folder"):
        beside(tmp_path / "scene.yaml", name, "meshes.0.file")
