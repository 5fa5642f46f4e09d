"""What holds for the whole bank of effects, and for any set of them together."""

import itertools
import sys
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import Array, as_scene, box, camera, quad, sphere, wall

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from depthsim.gap.flight.effect import flight_effect_ids
from depthsim.materials import Materials
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Profile, Sensor, Setting, Stage, effect_class, effect_ids, load_profile
from depthsim.sensor.effect import parameters_of
from depthsim.sensor.motion import Motion
from depthsim.sensor.sensor import Measurement
from depthsim.trajectory import Trajectory
from docs.effects import formats, page

# fmt: off
WANTED = {
    "material_noise", "fill_rate", "disparity_noise", "baseline_scale", "disparity_offset", "lens_distortion",
    "extrinsic_rotation", "time_offset", "rolling_shutter", "subpixel_bias", "disparity_quantization",
    "thermal_drift", "incidence_noise", "lateral_noise", "vignetting_noise", "motion_noise", "spatial_correlation",
    "temporal_correlation", "heavy_tails", "stereo_shadow", "incidence_dropout", "range_dropout", "material_dropout",
    "specular_dropout", "ambient_light", "min_range", "max_range", "invalid_band", "flying_pixels", "edge_fattening",
    "spatial_filter", "pose_noise", "fixed_pattern", "decimation", "temporal_filter", "hole_filling", "align_to_color",
    "matching_window", "intrinsics", "empty_border", "extrinsic_translation",
}
# fmt: on
"""The ids that files and other programs rely on."""

MATERIALS = Materials.model_validate(
    {
        "cement": {"m": 0.35, "ir_reflectance": 0.4, "gloss": 0.02},
        "glass": {"m": 0.5, "ir_reflectance": 0.05, "gloss": 0.3},
        "plastic": {"m": 0.85, "ir_reflectance": 0.5, "gloss": 0.15},
    }
)
CAMERA = camera(96, 72, 80)
ROOM = Caster(
    as_scene(
        wall(4),
        quad((-20, 0.8, -1), (40, 0, 0), (0, 0, 21)),
        box((-0.6, -0.1, 1.4), (-0.1, 0.8, 1.8)),
        sphere(2, 0.25, (0.35, 0.2, 1.1)),
        quad((0.1, -1, 2.5), (0, 0.9, 0), (0.9, 0, 0.3)),
        tags=["cement", "cement", "plastic", "plastic", "glass"],
    )
)
"""A wall and a floor, a box, a ball and a pane."""
TURNING = Trajectory(
    np.array([0.0, 1.0, 2.0]),
    np.array([[-0.1, 0, 0], [0, 0, 0], [0.1, 0.02, 0]]),
    np.array([[0, -0.05, 0, 1], [0, 0, 0, 1], [0.02, 0.05, 0, 1]]),
)
MOTION = Motion.along(TURNING)


def measure(*effects: Effect, **keys: Any) -> Measurement:
    """The frame at 1 s of a camera that moves and turns."""
    sensor = Sensor(ROOM, CAMERA, effects, MATERIALS)
    return sensor.measure(MOTION.at(1.0)[0], **{"motion": MOTION, "stamp": 1.0, "index": 30, **keys})


def same(a: Measurement, b: Measurement) -> bool:
    return a.depth.tobytes() == b.depth.tobytes() and a.depth_raw.tobytes() == b.depth_raw.tobytes()


def bounds(kind: type[Effect], name: str) -> tuple[float, float] | None:
    """The bounds of a parameter that is one number."""
    found = {type(item).__name__: item for item in kind.model_fields[name].metadata}
    return (found["Ge"].ge, found["Le"].le) if {"Ge", "Le"} <= found.keys() else None


def numbers(kind: type[Effect]) -> dict[str, tuple[float, float]]:
    return {name: b for name in kind.model_fields if (b := bounds(kind, name)) is not None}


@st.composite
def effects(draw: st.DrawFn) -> Effect:
    """Any effect, each parameter anywhere between its bounds, at them, or as it comes."""
    kind = effect_class(draw(st.sampled_from(effect_ids())))
    values: dict[str, float] = {}
    for name, (low, high) in numbers(kind).items():
        whole = kind.model_fields[name].annotation is int
        inside = st.integers(int(low), int(high)) if whole else st.floats(low, high)
        value = draw(st.none() | st.sampled_from([low, high]) | inside, label=f"{kind.id}.{name}")
        if value is not None:
            values[name] = int(value) if whole else value
    return kind(**values)


def test_every_effect_that_was_promised_is_there() -> None:
    assert set(effect_ids()) >= WANTED and len(WANTED) == 41


@pytest.mark.parametrize("effect_id", effect_ids())
def test_defaults_do_something(effect_id: str) -> None:
    kind = effect_class(effect_id)
    assert not kind().is_neutral
    assert not same(measure(kind(), index=4), measure(index=4)) or effect_id in (
        "spatial_correlation",  # alone they correlate nothing
        "temporal_correlation",
        "max_range",  # nothing here is farther
        "min_range",  # or nearer
        "thermal_drift",  # at 1 s a camera is cold
    )


@pytest.mark.parametrize("effect_id", effect_ids())
def test_all_neutral_changes_not_one_bit(effect_id: str) -> None:
    kind = effect_class(effect_id)
    neutral = {name: one.neutral for name, one in parameters_of(kind).items() if one.neutral is not None}
    assert neutral, "no value of any parameter leaves the effect out"
    effect = kind.model_validate(neutral)
    assert effect.is_neutral
    others = [effect_class(i)() for i in ("disparity_noise", "stereo_shadow", "fill_rate")]
    assert same(measure(effect), measure())
    assert same(measure(*others, effect), measure(*others))


def holes(m: Measurement) -> float:
    return float((m.depth == 0).mean())


def spread(m: Measurement) -> float:
    """Root of the mean squared error of the disparity, holes aside."""
    use = (m.depth > 0) & (m.clean.depth > 0)
    error = CAMERA.focal_baseline * (1 / m.depth[use].astype(float) - 1 / m.clean.depth[use])
    return float(np.sqrt((error**2).mean()))


@cache
def noisy() -> tuple[Effect, Measurement]:
    noise = effect_class("disparity_noise")(sigma=0.1)
    return noise, measure(noise)


def smoothness(m: Measurement) -> float:
    """Correlation of the error with that of the next pixel, where it is noise."""
    error = CAMERA.focal_baseline * (1 / m.depth.astype(float) - 1 / m.clean.depth)
    return float(np.corrcoef(error[:, 1:].ravel(), error[:, :-1].ravel())[0, 1])


def memory(effect: Effect) -> float:
    """Correlation of the error with that of the next frame."""
    pair = [measure(noisy()[0], effect, index=k) for k in (16, 17)]
    a, b = (CAMERA.focal_baseline * (1 / m.depth.astype(float) - 1 / m.clean.depth) for m in pair)
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


STRENGTHS: dict[str, tuple[str, list[float], Any]] = {
    "material_noise": ("floor", [0.002, 0.005, 0.02], spread),
    "fill_rate": ("rate", [0.01, 0.1, 0.5], holes),
    "disparity_noise": ("sigma", [0.02, 0.1, 0.4], spread),
    "baseline_scale": ("scale", [1.005, 1.02, 1.1], spread),
    "disparity_offset": ("offset", [0.05, 0.2, 1.0], spread),
    "lens_distortion": ("k1", [0.002, 0.02, 0.1], spread),
    "extrinsic_rotation": ("x", [0.5, 2.0, 8.0], spread),
    "extrinsic_translation": ("x", [0.02, 0.1, 0.4], spread),
    "intrinsics": ("cy", [1.0, 4.0, 16.0], spread),
    "time_offset": ("offset", [0.01, 0.05, 0.3], spread),
    "rolling_shutter": ("readout", [0.005, 0.02, 0.1], spread),
    "subpixel_bias": ("amplitude", [0.01, 0.05, 0.3], spread),
    "disparity_quantization": ("step", [0.03, 0.1, 1.0], spread),
    "thermal_drift": ("drift", [0.005, 0.02, 0.1], spread),
    "incidence_noise": ("sigma", [0.01, 0.05, 0.2], spread),
    "lateral_noise": ("sigma", [0.2, 1.0, 3.0], spread),
    "vignetting_noise": ("corner", [0.02, 0.1, 0.5], spread),
    "motion_noise": ("sigma", [0.05, 0.3, 1.0], spread),
    "spatial_correlation": ("x", [1.0, 2.0, 5.0], smoothness),
    "temporal_correlation": ("correlation", [0.2, 0.5, 0.9], memory),
    "heavy_tails": ("share", [0.003, 0.03, 0.2], spread),
    "stereo_shadow": ("left", [0.0, 2.0, 6.0], holes),
    "incidence_dropout": ("rate", [0.1, 0.4, 1.0], holes),
    "range_dropout": ("rate", [0.05, 0.2, 0.8], holes),
    "material_dropout": ("rate", [0.2, 0.5, 1.0], holes),
    "specular_dropout": ("rate", [0.2, 0.5, 1.0], holes),
    "ambient_light": ("holes", [0.1, 0.4, 1.0], holes),
    "min_range": ("depth", [0.9, 1.2, 2.0], holes),
    "max_range": ("depth", [3.9, 2.0, 1.2], holes),
    "invalid_band": ("margin", [2.0, 8.0, 20.0], holes),
    "empty_border": ("share", [0.2, 0.6, 1.0], holes),
    "flying_pixels": ("rate", [0.05, 0.3, 1.0], spread),
    "edge_fattening": ("radius", [0.5, 2.0, 5.0], spread),
    "spatial_filter": ("alpha", [0.9, 0.6, 0.3], smoothness),
    "matching_window": ("radius", [1, 3, 8], spread),
    "pose_noise": ("translation", [0.001, 0.01, 0.1], spread),
    "fixed_pattern": ("amplitude", [0.02, 0.1, 0.5], spread),
    "decimation": ("factor", [2, 4, 8], lambda m: 1 / m.depth.size),
    "temporal_filter": ("alpha", [0.9, 0.6, 0.3], memory),
    "align_to_color": ("x", [-0.015, -0.03, -0.06], holes),
}
"""Of every effect but hole_filling a parameter from weak to strong, and the statistic that it moves."""


@pytest.mark.parametrize("effect_id", sorted(WANTED - {"hole_filling"}))
def test_the_stronger_the_more(effect_id: str) -> None:
    name, values, statistic = STRENGTHS[effect_id]
    kind = effect_class(effect_id)
    found = [0.0 if statistic is not smoothness else smoothness(noisy()[1])]
    for value in values:
        effect = kind(**{name: value, **({"time_constant": 1.0} if effect_id == "thermal_drift" else {})})
        if statistic is memory:
            found.append(memory(effect))
        else:
            found.append(statistic(measure(noisy()[0], effect) if statistic is smoothness else measure(effect)))
    assert all(a < b for a, b in itertools.pairwise(found)), found


@pytest.mark.parametrize("effect_id", [i for i in sorted(WANTED) if effect_class(i).stage == Stage.HOLES])
def test_holes_leave_every_other_pixel_as_it_was(effect_id: str) -> None:
    noise = effect_class("disparity_noise")()
    plain, with_holes = measure(noise), measure(noise, effect_class(effect_id)())
    kept = with_holes.depth > 0
    assert np.array_equal(with_holes.depth[kept], plain.depth[kept])


HOLES = ["fill_rate", "incidence_dropout", "material_dropout", "range_dropout", "specular_dropout", "stereo_shadow"]


@pytest.mark.parametrize(("first", "second"), [*itertools.combinations([*HOLES, "invalid_band", "empty_border"], 2)])
def test_two_kinds_of_holes_are_the_union_of_both(first: str, second: str) -> None:
    a, b = effect_class(first)(), effect_class(second)()
    lost = [m.depth == 0 for m in (measure(a), measure(b), measure(a, b))]
    assert np.array_equal(lost[0] | lost[1], lost[2])


def test_a_mirror_that_is_bright_enough_loses_all_about_its_middle() -> None:
    """Of a surface whose share of mirrored light is small, and never more than all."""
    specular = effect_class("specular_dropout")
    seen = [measure(specular(rate=rate, width=60)) for rate in (1.0, 20.0)]
    geometry = measure().clean
    plastic = geometry.tag == ROOM.scene.tags.index("plastic")
    near = plastic & (geometry.cosine > np.cos(0.5))
    assert (seen[1].depth[near] == 0).all() and near.sum() > 50
    assert 0.05 < (seen[0].depth[near] == 0).mean() < 0.4
    assert (seen[1].depth[plastic & (geometry.cosine < np.cos(np.radians(61)))] > 0).all()


@pytest.mark.parametrize("tags", [("cement", "plastic"), ("cement", "plastic", "steel"), ("steel", "glass", "plastic")])
def test_one_shiny_material_may_mirror_and_the_others_not(tags: tuple[str, ...]) -> None:
    """As materials.yaml has them, or each alone, where there are two at least."""
    materials = Materials.model_validate({tag: {"m": 0.5, "gloss": 0.02 if tag == "cement" else 0.3} for tag in tags})
    setting = cast("Setting", SimpleNamespace(tags=tags, materials=materials))
    shiny = [tag for tag in tags if tag != "cement"]
    alone = [
        [tag for tag in shiny if form["gloss"].get(tag, 0.3)]
        for form in effect_class("specular_dropout").forms_in(setting)
    ]
    assert alone == [shiny, *([[tag] for tag in shiny] if len(shiny) > 1 else [])]


@given(st.floats(0, 50), st.floats(8, 1024))
def test_false_matches_are_no_holes(spread: float, search: float) -> None:
    false = effect_class("heavy_tails")(share=1.0, spread=spread, search=search)
    assert np.array_equal(measure(false).depth > 0, measure().depth > 0)


def test_a_border_is_empty_and_nothing_else_is() -> None:
    border = effect_class("empty_border")(left=2, right=30, top=7, bottom=1)
    lost = measure(border).depth == 0
    assert not lost[7:-1, 2:-30].any()
    assert lost.sum() == lost.size - lost[7:-1, 2:-30].size
    rows = np.array([3, 8, 9, 70, 71])
    part = Sensor(ROOM, CAMERA.window(rows), [border], MATERIALS).measure(np.eye(4))
    assert np.array_equal(part.depth == 0, lost[rows])


NOISES = ["disparity_noise", "incidence_noise", "vignetting_noise", "motion_noise", "ambient_light"]


@pytest.mark.parametrize(("first", "second"), [*itertools.combinations(NOISES, 2)])
def test_the_variances_of_two_noises_add(first: str, second: str) -> None:
    clean = CAMERA.focal_baseline / measure().depth.astype(float)

    def error(*kinds: str) -> Array:
        made = [effect_class(kind)(**({"holes": 0} if kind == "ambient_light" else {})) for kind in kinds]
        return np.asarray(CAMERA.focal_baseline / measure(*made).depth.astype(float) - clean)

    # On common random numbers, pixel by pixel.
    assert np.abs(np.abs(error(first, second)) - np.hypot(error(first), error(second))).max() < 2e-4


@settings(max_examples=60)
@given(st.lists(effects(), max_size=6), st.randoms(use_true_random=False), st.integers(0, 2**32 - 1))
def test_any_set_of_effects_composes(
    tmp_path_factory: pytest.TempPathFactory, chosen: list[Effect], random: Any, index: int
) -> None:
    # Of one effect twice the order does count: both draw numbers, the first one first.
    chosen = list({effect.id: effect for effect in chosen}.values())
    measured = measure(*chosen, index=index, threads=1)
    assert np.isfinite(measured.depth).all() and (measured.depth >= 0).all()
    assert not measured.depth_raw[measured.depth == 0].any()
    assert np.array_equal(measured.clean.depth, ROOM.cast(measured.camera, MOTION.at(1.0)[0]).depth)
    shuffled = random.sample(chosen, len(chosen))
    assert same(measured, measure(*shuffled, index=index, threads=3))
    profile = Profile(name="any", effects=tuple(chosen))
    path = tmp_path_factory.mktemp("profile") / "any.yaml"
    path.write_text(profile.to_yaml(), encoding="utf-8")
    assert load_profile(path) == profile


def test_the_depth_of_next_to_no_disparity_is_a_number() -> None:
    measured = measure(effect_class("disparity_quantization")(step=4, origin=1e-45))
    assert np.isfinite(measured.depth).all() and (measured.depth_raw == 65535).any()


def test_all_effects_at_once_are_the_same_bytes_in_any_order_and_on_any_threads() -> None:
    everything = [effect_class(i)() for i in effect_ids()]
    first = measure(*everything, threads=1)
    assert same(first, measure(*everything[::-1], threads=3))
    assert same(first, measure(*everything, threads=2, out=measure(*everything, index=7)))
    assert 0.1 < (first.depth > 0).mean() < 0.98 and not same(first, measure(*everything, index=31))


@pytest.mark.parametrize("name", ["d435", "d415", "d455"])
def test_the_profiles_of_real_cameras(name: str, tmp_path: Path) -> None:
    profile = load_profile(name)
    assert profile.camera is not None and profile.camera.name.lower() == name and len(profile.effects) > 5
    measured = measure(*profile.effects)
    assert 0.5 < (measured.depth > 0).mean() < 0.97
    text = profile.to_yaml()
    (tmp_path / "again.yaml").write_text(text, encoding="utf-8")
    assert load_profile(tmp_path / "again.yaml") == profile


def test_the_page_of_the_effects_is_up_to_date() -> None:
    folder = Path(__file__).parents[2] / "docs"
    assert (folder / "effects.md").read_text(encoding="utf-8") == page(), "run docs/effects.py"
    text = (folder / "formats.md").read_text(encoding="utf-8")
    assert text == formats(text), "run docs/effects.py"
    assert [name for name in flight_effect_ids() if name not in text] == []
    missing = [i for i in effect_ids() if not (folder / "pictures" / "effects" / f"{i}.png").is_file()]
    assert not missing, "run docs/effects.py"


IN_BETWEEN, SHIFTED = {"flying_pixels", "matching_window"}, {"pose_noise", "extrinsic_translation"}


@pytest.mark.parametrize("effect_id", sorted(set(effect_ids()) - IN_BETWEEN - SHIFTED))
def test_open_background_does_to_the_foreground_what_one_very_far_away_does(effect_id: str) -> None:
    """All but depths in between, which there are none of where nothing is behind.

    And but a camera that is shifted: in a scene of 10 km the millimetres of its place are rounded.
    """
    plate, effect = quad((-0.3, -0.3, 1), (0.6, 0, 0), (0, 0.6, 0)), effect_class(effect_id)()
    open_, backed = (
        Sensor(
            Caster(as_scene(*meshes, tags=["plastic", "cement"][: len(meshes)])), CAMERA, [effect], MATERIALS
        ).measure(np.eye(4), index=1)
        for meshes in ([plate], [plate, wall(1e4, half=1e5)])
    )
    met = open_.clean.hit
    assert 0.2 < met.mean() < 0.5
    assert np.array_equal(open_.depth[met], np.where(backed.depth > 5e3, 0, backed.depth)[met])
