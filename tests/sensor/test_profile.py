"""Sensor profiles and materials files: every accepted form, and what is wrong with the others in one line."""

from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from depthsim.errors import InputError
from depthsim.materials import load_materials
from depthsim.sensor import Profile, load_profile
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.profile import profile_names


def write(folder: Path, text: str | bytes, name: str = "profile.yaml") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_paper_is_the_two_effects_of_the_paper_with_their_defaults() -> None:
    paper = load_profile("paper")
    assert paper.name == "paper"
    assert paper.effects == (MaterialNoise(), FillRate())
    assert paper.effects == (MaterialNoise(floor=0.005, m={}), FillRate(rate=0.01))
    assert paper.camera is not None and paper.camera.name == "D435" and paper.camera.depth_scale == 0.001


@pytest.mark.parametrize("name", profile_names())
def test_every_profile_that_comes_with_depthsim_loads(name: str) -> None:
    assert load_profile(name).name == name
    assert load_profile("clean").effects == ()


@pytest.mark.parametrize(
    "entry",
    [
        "fill_rate",
        "{fill_rate: {rate: 0.01}}",
        "fill_rate: {}",
        "fill_rate:",
        "{effect: fill_rate}",
        "{effect: fill_rate, parameters: {rate: 0.01}}",
        "{effect: fill_rate, parameters: {rate: 1e-2}, ci95: {rate: [0.009, 0.011]}, closed_fraction: 0.3}",
    ],
)
def test_every_form_of_an_effect(tmp_path: Path, entry: str) -> None:
    assert load_profile(write(tmp_path, f"effects:\n  - {entry}\n")).effects == (FillRate(),)


def test_camera_and_name_and_effects_may_be_left_out(tmp_path: Path) -> None:
    profile = load_profile(write(tmp_path, "description: nothing at all\n", "bare.yml"))
    assert profile == Profile(name="bare", camera=None, effects=())


def test_a_name_goes_before_a_folder_of_that_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # as within a run, which has a folder `clean`
    (tmp_path / "clean").mkdir()
    assert load_profile("clean").name == "clean"


def test_a_camera_file_beside_the_profile(tmp_path: Path) -> None:
    camera = load_profile("paper").camera
    assert camera is not None
    camera.write(tmp_path / "mine.yaml")
    for value in ("mine.yaml", yaml.safe_dump(yaml.safe_load(camera.to_yaml()), default_flow_style=True).strip()):
        assert load_profile(write(tmp_path, f"camera: {value}\n")).camera == camera
    assert load_profile(write(tmp_path, "camera: D415\n")).camera is not None


NUMBERS = st.floats(0, 1) | st.floats(0, 1e-300)


@settings(max_examples=50)
@given(
    st.text(st.characters(exclude_categories=["Cs"]), min_size=1),
    st.sampled_from([None, "paper"]),
    st.lists(
        NUMBERS.map(lambda rate: FillRate(rate=rate))
        | st.builds(
            lambda floor, m: MaterialNoise(floor=floor, m=m),
            st.floats(0, 0.1),
            st.dictionaries(st.text(st.characters(exclude_categories=["Cs"])), st.floats(0, 20)),
        )
    ),
)
def test_a_profile_written_is_read_back_as_it_was(
    tmp_path_factory: pytest.TempPathFactory, name: str, camera: str | None, effects: list
) -> None:
    known = load_profile("paper").camera if camera else None
    profile = Profile(name=name, camera=known, effects=tuple(effects))
    path = write(tmp_path_factory.mktemp("profile"), profile.to_yaml())
    again = load_profile(path)
    assert again == profile
    assert again.to_yaml() == profile.to_yaml()


BROKEN = [
    # (text, the place and the problem, the fix)
    ("- material_noise\n- fill_rate\n", "holds a list at its top, not a mapping", "`key: value` lines"),
    ("", "is empty", "write a sensor profile as"),
    ("# only a comment\n", "is empty", "write a sensor profile as"),
    ("paper", "holds a str at its top", "write a sensor profile as"),
    ("effects: [fill_rat]", "effects[0]: there is no effect 'fill_rat'", "the effects are time_offset, "),
    ("effects: {fill_rate: {rate: 0.1}}", "effects: is not a list", "write one `- effect_id` a line"),
    ("effects: fill_rate", "effects: is not a list", "write one `- effect_id` a line"),
    ("effects: 3", "effects: is not a list", "write one `- effect_id` a line"),
    ("effects: [material_noise, 7]", "effects[1]: is not an effect", "write `- id` or"),
    ("effects: [[fill_rate]]", "effects[0]: is not an effect", "write `- id` or"),
    ("effects:\n  - fill_rate:\n    rate: 0.1\n", "effects[0]: is not an effect", "write `- id` or"),
    ("effects: [fill_rate: {rat: 0.1}]", "effects[0].fill_rate.rat: extra inputs", "the keys are rate"),
    ("effects: [fill_rate: {rate: 1.5}]", "effects[0].fill_rate.rate: input should be less", "correct that value"),
    ("effects: [fill_rate: {rate: -0.01}]", "rate: input should be greater", "correct that value"),
    ("effects: [fill_rate: {rate: .nan}]", "rate: input should be a finite number (it is nan)", "correct that value"),
    ("effects: [fill_rate: {rate: -.inf}]", "rate: input should be a finite number", "correct that value"),
    ("effects: [fill_rate: {rate: lots}]", "valid number, unable to parse string", "correct that value"),
    ("effects: [fill_rate: {rate: [0.1]}]", "rate: input should be a valid number", "correct that value"),
    ("effects: [fill_rate: {rate: null}]", "rate: input should be a valid number", "correct that value"),
    ("effects: [fill_rate: {1: 2}]", "effects[0].fill_rate.1: keys should be strings", "correct that value"),
    ("effects: [fill_rate: 0.1]", "effects[0].fill_rate: has no parameters by name", "write {parameter: value}"),
    ("effects: [fill_rate: 0]", "effects[0].fill_rate: has no parameters by name", "write {parameter: value}"),
    ("effects: [fill_rate: []]", "effects[0].fill_rate: has no parameters by name", "write {parameter: value}"),
    ("effects: [{effect: fill_rate, parameters: 0.1}]", "has no parameters by name", "write {parameter: value}"),
    (
        "effects: [{effect: fill_rate, parameter: {rate: 0.1}}]",
        "effects[0].parameter: is not a key",
        "effect and param",
    ),
    ("effects: [{effect: [], parameters: {}}]", "effects[0]: is not an effect", "write `- id` or"),
    ("effects: [material_noise: {m: {cement: -0.3}}]", "material_noise.m.cement: input should be greater", "correct"),
    ("effects: [material_noise: {m: {cement: .inf}}]", "m.cement: input should be a finite number", "correct"),
    ("effects: [material_noise: {m: 0.3}]", "material_noise.m: input should be a valid dictionary", "correct"),
    ("effect: [fill_rate]", "effect: is not a key of a profile", "the keys are name, camera, effects, description"),
    ("effects: []\neffects: []", "line 2: is not YAML (key 'effects' twice)", "correct the syntax there"),
    ("effects: [fill_rate: {rate: 0.1, rate: 0.2}]", "line 1: is not YAML (key 'rate' twice)", "correct the syntax"),
    ("effects: [", "line 1: is not YAML", "correct the syntax there"),
    ("effects: [fill_rate]\n\tname: x", "line 2: is not YAML", "correct the syntax there"),
    (
        "effects: !!python/object:os.system x",
        "line 1: is not YAML (could not determine a constructor",
        "correct the syntax",
    ),
    ("effects: !!bool x", "is not YAML", "correct the syntax there"),
    ("effects: !!timestamp x", "is not YAML", "correct the syntax there"),
    ("effects: !!int ''", "is not YAML", "correct the syntax there"),
    ("effects: *nobody", "line 1: is not YAML (found undefined alias", "correct the syntax there"),
    ("[" * 5000, "is not YAML", "correct the syntax there"),
    (b"\x89PNG\r\n\x1a\n\x00\x00", "byte 0: is not UTF-8 text", "give a sensor profile"),
    (b"\x1f\x8b\x08\x00\x00", "byte 1: is not UTF-8 text", "give a sensor profile"),
    ("name: a\x00b", "is not YAML", "correct the syntax there"),
    ("camera: kinect", "camera: 'kinect' is no camera", "name one of d405, d415"),
    ("camera: 5", "camera: 5 is no camera", "name one of d405, d415"),
    ("camera: [d435]", "camera: ['d435'] is no camera", "name one of d405, d415"),
    ("camera: {width: 64}", "camera.height: field required", "the keys are"),
    ("camera: gone.yaml", "gone.yaml: no such file", "give the path of a camera.yaml"),
    ("camera: ../camera.yaml", "camera: '../camera.yaml' leaves the folder", "give a path inside the folder"),
    ("camera: /etc/camera.yaml", "camera: '/etc/camera.yaml' leaves the folder", "give a path inside the folder"),
]


def one_line(error: pytest.ExceptionInfo[InputError]) -> str:
    text = str(error.value)
    assert "\n" not in text and len(text) < 900  # the list of all effects is long
    return text


@pytest.mark.parametrize(("text", "problem", "fix"), BROKEN)
def test_a_broken_profile_is_reported_in_one_line(tmp_path: Path, text: str | bytes, problem: str, fix: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(InputError) as error:
        load_profile(path)
    line = one_line(error)
    assert line.startswith(str(tmp_path)) and problem in line and fix in line.partition(problem)[2], line


@pytest.mark.parametrize("choice", ["papr", "", "x" * 5000, "a\0b", "../paper", "no/such/profile", "no/such.yaml", "."])
def test_a_profile_that_is_not_there(choice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as error:
        load_profile(choice)
    assert "give " in str(error.value)
    if choice == "papr":
        names = ", ".join(profile_names())
        assert one_line(error) == f"papr: is no sensor profile; give a YAML file or one of {names}"
        assert {"clean", "d415", "d435", "d455", "paper"} <= set(profile_names())


def test_a_folder_and_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "folder.yaml").mkdir()
    with pytest.raises(InputError, match=r"folder.yaml: is a folder; give the path of a sensor profile"):
        load_profile(tmp_path / "folder.yaml")
    (tmp_path / "loop.yaml").symlink_to(tmp_path / "loop.yaml")
    with pytest.raises(InputError, match=r"loop.yaml: .*; give a sensor profile that can be read"):
        load_profile(tmp_path / "loop.yaml")


KEYS = st.sampled_from(["effects", "camera", "fill_rate", "effect", "parameters", "rate", "m"]) | st.text(max_size=3)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text("a{}[]:,-&*! \n\t", max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
)


@settings(max_examples=150)
@given(VALUES)
def test_whatever_a_profile_holds_it_loads_or_is_reported(
    tmp_path_factory: pytest.TempPathFactory, value: object
) -> None:
    path = write(tmp_path_factory.mktemp("profile"), yaml.safe_dump({"effects": [value], "name": "x"}))
    for text in (path.read_text(), yaml.safe_dump(value)):
        try:
            load_profile(write(path.parent, text))
        except InputError as error:
            assert "\n" not in str(error)


MATERIALS = [
    ("- cement", "holds a list at its top", "write a materials file as"),
    ("", "is empty", "write a materials file as"),
    ("{}", "names no material", "write entries such as `cement:"),
    ("cement: 0.35", "cement: input should be a valid dictionary", ""),
    ("cement: {m: -0.35}", "cement.m: input should be greater than or equal to 0 (it is -0.35)", "correct that value"),
    ("cement: {m: 35}", "cement.m: input should be less than or equal to 20", "correct that value"),
    ("cement: {m: .nan}", "cement.m: input should be a finite number", "correct that value"),
    ("cement: {m: much}", "cement.m: input should be a valid number", "correct that value"),
    ("cement: {source: guess}", "cement.m: field required", "add it"),
    ("cement: {m: 0.3, albedo: 1.2}", "cement.albedo: input should be less than or equal to 1", "correct that value"),
    ("cement: {m: 0.3, gloss: shiny}", "cement.gloss: input should be a valid number", "correct that value"),
    ("cement: {m: 0.3}\ncement: {m: 0.4}", "line 2: is not YAML (key 'cement' twice)", "correct the syntax there"),
    ("cement: {m: 0.3", "is not YAML", "correct the syntax there"),
    (b"\xff\xfe\x00", "byte 0: is not UTF-8 text", "give a materials file"),
]


@pytest.mark.parametrize(("text", "problem", "fix"), MATERIALS)
def test_a_broken_materials_file_is_reported_in_one_line(
    tmp_path: Path, text: str | bytes, problem: str, fix: str
) -> None:
    path = write(tmp_path, text, "materials.yaml")
    with pytest.raises(InputError) as error:
        load_materials(path)
    line = one_line(error)
    assert line.startswith(f"{path}: ") and problem in line and fix in line.partition(problem)[2], line


def test_materials_that_are_not_there_and_keys_that_are_kept(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gone.yaml: no such file; give the path of a materials file"):
        load_materials(tmp_path / "gone.yaml")
    with pytest.raises(InputError, match="is a folder; give the path of a materials file"):
        load_materials(tmp_path)
    materials = load_materials(write(tmp_path, "\ufeffcement: {m: 0.35, speckle: 0.2}\n7: {m: 1}\n"))
    assert materials.tags == ["7", "cement"]
    assert materials["cement"].m == 0.35 and materials["cement"].model_extra == {"speckle": 0.2}
    assert "cement" in materials and "glass" not in materials


def test_the_paper_materials_have_the_values_of_its_text() -> None:
    materials = load_materials()
    assert [materials[tag].m for tag in ("cement", "formboard", "plastic")] == [0.35, 0.5, 0.85]
    assert all(materials[tag].source for tag in materials.tags)
