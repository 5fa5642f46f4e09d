"""A slice of qa/fuzz.py: broken inputs for every reader end in a value or in one line."""

import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[2]))

from depthsim.camera import read_camera
from depthsim.errors import InputError
from depthsim.flight.pathspec import resolve_path
from depthsim.flight.spec import read_flight_spec
from depthsim.flight.vehicle import load_vehicle
from depthsim.flight.windfile import resolve_wind
from depthsim.materials import load_materials
from depthsim.scenefile import load_scene
from depthsim.scenefile.polygons import triangulate
from depthsim.sensor import load_profile
from depthsim.sensor.effect import effect_ids
from depthsim.trajectory import load_trajectory
from depthsim.yamlfile import MOST_NODES, parse_yaml
from qa.fuzzing.documents import mutate_yaml
from qa.fuzzing.guided import Fuzzed
from qa.fuzzing.readers import READERS
from qa.fuzzing.worker import ACCEPTED, HANG, REFUSED, TRACEBACK, outcome, run_inputs

SLOW = {
    "scene YAML": 10,
    "scene builder": 6,
    "report": 16,
    "run": 25,
    "bag ROS 1": 25,
    "bag MCAP": 10,
    "bag sqlite3": 10,
    "bag MCAP file": 25,
    "bag sqlite3 file": 25,
    "flight YAML": 25,
}
INPUTS = 40
SEED = 20_000  # not that of the benchmark: other inputs


@pytest.mark.parametrize("name", READERS)
def test_a_reader_takes_or_refuses_what_is_broken(name):
    tally = run_inputs(READERS[name], SEED, range(SLOW.get(name, INPUTS)))
    assert tally.failed == 0, tally.bad
    assert tally.counts[REFUSED] > 0  # the inputs are broken, indeed


def test_the_inputs_that_atheris_chooses_are_read_and_counted(tmp_path):
    """Without atheris: what stands between libFuzzer and a reader."""
    (tmp_path / "keep").mkdir()
    names = {"reader": "camera", "home": str(tmp_path), "keep": str(tmp_path / "keep")}
    fuzzed = Fuzzed(names | {"inputs": 1000, "seconds": 0, "seed": 1})
    assert fuzzed.seeds(tmp_path / "corpus") > 4096
    (valid,) = [file.read_bytes() for file in (tmp_path / "corpus").iterdir()]
    for data in [valid] * 30 + [b"", b"\x00", b"\x07fx: ["] * 10:
        fuzzed.one(data)
    reported = json.loads((tmp_path / "report.json").read_text())
    assert reported["counts"] == {ACCEPTED: 30, REFUSED: 20}
    assert (tmp_path / "in" / "camera.yaml").read_bytes() == valid[1:]


def test_the_same_seed_gives_the_same_inputs():
    data = yaml.safe_dump({"a": 1, "b": [1.0, {"c": "x"}]}).encode()
    assert [mutate_yaml(data, Random(k)) for k in range(50)] == [mutate_yaml(data, Random(k)) for k in range(50)]


def test_what_is_wrong_is_counted():
    def fails() -> None:
        raise KeyError("x")

    def reported() -> None:
        raise InputError("a.yaml", "line 1", "is broken", "correct it")

    def endless() -> None:
        while True:
            pass

    assert outcome(fails)[0] == TRACEBACK
    assert outcome(reported)[0] == REFUSED
    assert outcome(endless, seconds=0.2)[0] == HANG


KEYS = [
    "name", "camera", "effects", "effect", "parameters", "sensor", "preset", "light", "matcher", "meshes", "file",
    "build",
    "tags", "scale", "rotate", "units", "trajectories", "shape", "points", "speed", "look_at", "center", "radius",
    "size",
    "width", "height", "fx", "distortion", "m", "gloss", "mass", "inertia", "rotors", "drag", "law", "wind", "kind",
    "velocity", "path", "vehicle", "time", "position", "duration", "start", "end", "laps", "model", "baseline",
]  # fmt: skip
WORDS = [
    "d435",
    "paper",
    "circle",
    "waypoints",
    "hover",
    "line",
    "lemniscate",
    "shuttle",
    "minimum_snap",
    "active_stereo",
]
WORDS += ["cement", "wall", "constant", "gusts", "shear", "field", "f450", "linear", "tangent", "*", "x.obj", "x.yaml"]
SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=6), st.binary(max_size=4), st.dates(),
    st.sampled_from([*WORDS, *effect_ids()]),
)  # fmt: skip
POINTS = st.lists(st.lists(st.floats(-5, 5), min_size=3, max_size=3), max_size=4)
VALUES = st.recursive(
    SCALARS | POINTS,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from([*KEYS, *effect_ids()]), inner, max_size=6)
    ),
    max_leaves=12,
)
DOCUMENTS = st.dictionaries(st.sampled_from(KEYS), VALUES, max_size=8)


def _trajectory(file: Path) -> object:
    return load_trajectory(file, rate=10)


def _wind(file: Path) -> object:
    return resolve_wind(str(file))


YAML_READERS: tuple[Callable[[Path], object], ...] = (
    load_profile, read_camera, load_materials, load_scene, load_vehicle, read_flight_spec, _trajectory, _wind,
)  # fmt: skip


@pytest.mark.parametrize("read", YAML_READERS, ids=lambda read: read.__name__)
def test_any_document_ends_in_a_value_or_in_one_line(read, tmp_path_factory):
    file = tmp_path_factory.mktemp("document") / "reported.yaml"

    @settings(max_examples=40, derandomize=True, database=None)
    @given(DOCUMENTS)
    def check(document: dict) -> None:
        try:
            text = yaml.safe_dump(document, allow_unicode=True)
            file.write_text(text, encoding="utf-8")
        except (UnicodeEncodeError, yaml.YAMLError):
            return
        try:
            read(file)
        except InputError as error:
            assert "\n" not in str(error)

    check()


@settings(max_examples=200, derandomize=True, database=None)
@given(
    st.text(max_size=40)
    | st.from_regex(r"(circle|line|waypoints|hover|lemniscate):([a-z_]{1,6}=[-0-9./;e]{0,9},?){0,5}")
)
def test_any_line_for_a_trajectory_ends_in_a_value_or_in_one_line(text):
    try:
        load_trajectory(text, rate=10)
    except InputError as error:
        assert str(error).isprintable()


def test_aliases_do_not_unfold_without_end():
    lines = ["a0: &a0 [x, x]", *(f"a{k}: &a{k} [*a{k - 1}, *a{k - 1}]" for k in range(1, 40))]
    with pytest.raises(InputError, match=f"aliases for over {MOST_NODES:,} values"):
        parse_yaml("\n".join(lines), Path("a.yaml"))
    with pytest.raises(InputError, match="an alias that holds itself"):
        parse_yaml("a: &a [*a]", Path("a.yaml"))
    assert parse_yaml("a: &a [1, 2]\nb: [*a, *a]\n", Path("a.yaml"))["b"] == [[1, 2], [1, 2]]


@pytest.mark.parametrize("path", ["circle:radius=1e6", "circle:radius=5,acceleration=5e-324"])
def test_a_path_that_would_never_end_is_reported_in_one_line(path):
    with pytest.raises(InputError, match="too near to zero"):
        resolve_path(path, speed=5e-324)


def test_a_short_scene_file_does_not_fill_the_memory(tmp_path):
    file = tmp_path / "scene.yaml"
    file.write_text("meshes:\n" + "- {build: corridor}\n" * 400)
    with pytest.raises(InputError, match=r"meshes\.\d+: the meshes placed again have over 5,000,000 faces"):
        load_scene(file)
    file.write_text("meshes: [" + "1, " * 200_000 + "]")
    with pytest.raises(InputError, match="more than the 500,000 that are read as YAML"):
        load_scene(file)


def test_a_polygon_of_thousands_of_corners_is_cut_up_in_time():
    import numpy as np

    angle = np.linspace(0, 2 * np.pi, 4000, endpoint=False)
    radius = np.where(np.arange(4000) % 2, 1.0, 0.4)
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    faces, _ = triangulate(ring, np.array([4000]), np.arange(4000))
    a, b, c = (ring[faces[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(2000 * 0.4 * math.sin(2 * math.pi / 4000) * 2 / 2)
    crossing = np.random.default_rng(1).random((1500, 3))
    assert len(triangulate(crossing, np.array([1500]), np.arange(1500))[0]) == 1498
