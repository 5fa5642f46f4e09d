"""The two effects of the paper, and what must hold for every effect of the bank."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy import stats
from shapes import MATERIALS, Array, as_scene, camera, soup, strips, wall

from depthsim.gap.flight.effect import flight_effect_ids
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor, effect_class, effect_ids
from depthsim.sensor.effect import parameters_of
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.parameter import learned_of
from depthsim.sensor.sensor import Measurement

CAMERA = camera(300, 200, 300)
M = {"cement": 0.35, "formboard": 0.50, "plastic": 0.85}


def measure(effects: list[Effect], distance: float = 2.0, **keys: Any) -> Measurement:
    sensor = Sensor(Caster(strips(distance, CAMERA)), CAMERA, effects, MATERIALS)
    return sensor.measure(np.eye(4), **keys)


def scores(measured: Measurement, distance: float, m: dict[str, float] = M, floor: float = 0.005) -> dict[str, Array]:
    """By material, the error of every pixel in units of the law's standard deviation."""
    error = measured.depth.astype(np.float64) - distance
    std = {tag: floor * np.exp(m[tag] * distance) for tag in M}
    return {tag: error[measured.clean.tag == index] / std[tag] for index, tag in enumerate(M)}


@pytest.mark.parametrize("distance", [0.5, 1.0, 2.0, 3.5, 5.0, 6.5, 8.0])
def test_material_noise_follows_the_law(distance: float) -> None:
    for tag, z in scores(measure([MaterialNoise()], distance), distance).items():
        assert z.size == 20_000
        # Where the noise puts the surface behind the camera there is a hole: plastic from 6 m on.
        least = -distance / (0.005 * np.exp(M[tag] * distance))
        lost = z <= least * (1 - 1e-6)
        share = stats.norm.cdf(least)
        assert stats.binom.cdf(lost.sum(), z.size, share) > 1e-4
        assert stats.binom.sf(lost.sum() - 1, z.size, share) > 1e-4
        assert stats.kstest(z[~lost], stats.truncnorm(least, np.inf).cdf).pvalue > 1e-4
        if share < 1e-6:
            low, high = stats.chi2.ppf([5e-5, 1 - 5e-5], z.size - 1) / (z.size - 1)
            assert low < z.var(ddof=1) < high
            assert abs(z.mean()) < 4 / np.sqrt(z.size)


def test_noise_neither_shifts_nor_leans_over_many_frames() -> None:
    z = np.concatenate([scores(measure([MaterialNoise()], 1.0, index=n), 1.0)["cement"] for n in range(50)])
    assert abs(z.mean()) < 4 / np.sqrt(z.size)
    assert abs((z**3).mean()) < 4 * np.sqrt(15 / z.size)
    assert abs((z**4).mean() - 3) < 4 * np.sqrt(96 / z.size)


def test_an_m_in_the_profile_goes_before_that_of_the_material() -> None:
    changed = {**M, "formboard": 0.1}
    # Glass is no material of this scene, and so is left alone.
    effect = MaterialNoise(m={"formboard": 0.1, "cement": 0.35}, floor=0.01)
    for z in scores(measure([effect], 3.0), 3.0, changed, 0.01).values():
        assert abs(z.std() - 1) < 4 / np.sqrt(2 * z.size)


def holes(rate: float, **keys: Any) -> NDArray[np.bool_]:
    return measure([FillRate(rate=rate)], **keys).depth_raw == 0


@pytest.mark.parametrize("rate", [0.01, 0.5, 1e-4, 1.0])
def test_the_share_of_holes_is_binomial(rate: float) -> None:
    found = np.stack([holes(rate, index=n) for n in range(20)])
    count, size = int(found.sum()), found.size
    assert stats.binom.cdf(count, size, rate) > 1e-4
    assert stats.binom.sf(count - 1, size, rate) > 1e-4
    # Per frame too: the counts vary as a binomial's do, and not less.
    if rate < 1:
        z = (found.sum(axis=(1, 2)) - found[0].size * rate) / np.sqrt(found[0].size * rate * (1 - rate))
        assert stats.chi2.ppf(1e-4, 20) < (z**2).sum() < stats.chi2.ppf(1 - 1e-4, 20)


@pytest.mark.parametrize(
    "other", [{"index": 1}, {"index": 1_000_000}, {"seed": 1}], ids=["next frame", "far frame", "seed"]
)
def test_frames_and_seeds_have_holes_and_noise_of_their_own(other: dict[str, int]) -> None:
    both = (holes(0.3) & holes(0.3, **other)).sum()
    assert abs(both - 60_000 * 0.09) < 4 * np.sqrt(60_000 * 0.09 * 0.91)
    a, b = (np.concatenate(list(scores(measure([MaterialNoise()], **k), 2.0).values())) for k in ({}, other))
    assert abs((a * b).mean()) < 4 / np.sqrt(a.size)


@pytest.mark.parametrize("shift", [(0, 1), (1, 0), (1, 1), (0, 2), (2, 0), (0, 4), (0, 64), (0, 128)])
def test_pixels_are_independent(shift: tuple[int, int]) -> None:
    noise = measure([MaterialNoise(m=dict.fromkeys(M, 0.0))], 1.0).depth.astype(np.float64) - 1
    missing = holes(0.3).astype(float) - 0.3
    rows, columns = shift
    for picture in (noise, missing):
        a, b = picture[: 200 - rows, : 300 - columns], picture[rows:, columns:]
        assert abs((a * b).mean() / picture.var()) < 4 / np.sqrt(a.size)


def test_holes_leave_the_noise_of_the_other_pixels_as_it_was() -> None:
    noise, both = measure([MaterialNoise()]), measure([MaterialNoise(), FillRate(rate=0.2)])
    kept = both.depth > 0
    assert 0.7 < kept.mean() < 0.9
    assert np.array_equal(both.depth[kept], noise.depth[kept])
    assert np.array_equal(~kept, holes(0.2))
    # And whether a pixel is a hole does not depend on its noise.
    z = (noise.depth - 2.0)[both.clean.tag == 0]
    missing = ~kept[both.clean.tag == 0]
    assert stats.ks_2samp(z[missing], z[~missing]).pvalue > 1e-4


def test_the_order_in_the_profile_makes_no_difference() -> None:
    effects = [MaterialNoise(), FillRate(rate=0.1)]
    assert np.array_equal(measure(effects).depth, measure(effects[::-1]).depth)


def test_an_effect_that_stands_twice_draws_twice() -> None:
    once, twice = (scores(measure([MaterialNoise()] * n, 1.0), 1.0)["cement"] for n in (1, 2))
    assert abs(twice.std() - np.sqrt(2)) < 4 / np.sqrt(twice.size)
    assert abs(np.corrcoef(once, twice - once)[0, 1]) < 4 / np.sqrt(twice.size)


def test_the_noise_depends_on_the_true_range_and_not_on_the_measured_one() -> None:
    def second_noise(floor_of_the_first: float) -> Array:
        first = MaterialNoise(floor=floor_of_the_first, m=dict.fromkeys(M, 0.0))
        with_it, without = measure([first, MaterialNoise()]).depth, measure([first]).depth
        return with_it.astype(np.float64) - without

    assert np.abs(second_noise(0.1) - second_noise(1e-4)).max() < 1e-6


def test_where_nothing_is_nothing_is_measured() -> None:
    sensor = Sensor(Caster(as_scene(wall(2, half=0.3))), CAMERA, [MaterialNoise(floor=0.1)], MATERIALS)
    measured = sensor.measure(np.eye(4))
    assert not measured.depth[~measured.clean.hit].any()
    assert (~measured.clean.hit).mean() > 0.5


# What follows holds for every effect that is added to the bank.


def limits(kind: type[Effect], name: str) -> tuple[float, float] | None:
    """The bounds of a parameter that is a number."""
    found = {type(item).__name__: item for item in kind.model_fields[name].metadata}
    return (found["Ge"].ge, found["Le"].le) if {"Ge", "Le"} <= found.keys() else None


NUMBERS = [(i, name) for i in effect_ids() for name in effect_class(i).model_fields if limits(effect_class(i), name)]


@pytest.mark.parametrize("effect_id", effect_ids())
def test_an_effect_says_what_it_is(effect_id: str) -> None:
    kind = effect_class(effect_id)
    assert kind.id == effect_id and kind.source and kind.__doc__ and kind.recording and kind.kinds
    assert kind.axes or kind.id in ("fill_rate", "decimation")  # which are alike everywhere
    assert len(set(kind.axes)) == len(kind.axes) and len(set(kind.kinds)) == len(kind.kinds)
    assert set(kind.seen_on) <= set(effect_ids())
    known = parameters_of(kind)
    assert [*known, *learned_of(kind)] == list(kind.model_fields) and all(learned_of(kind).values())
    assert all(one.unit and one.source and one.about for one in known.values())
    for form in (*kind.forms, *kind.spare_forms):
        held = {name: value for name, value in form.items() if not known[name].by_material}
        assert all(known[name].low <= value <= known[name].high for name, value in held.items())
        assert all(form[name] == {} for name in form.keys() - held.keys())


def test_no_other_file_lists_effects() -> None:
    root = Path(__file__).resolve().parents[2]
    files = [root / "docs" / "effects.py", root / "benchmarks" / "effects.py", *(root / "viewer").rglob("*.py")]
    for part in ("gap/depth", "gap/report", "sweep", "cli"):
        files += (root / "depthsim" / part).rglob("*.py")
    files = [file for file in files if file.parent.name != "tasks"]  # figures that have the field's names, too
    named = re.compile("|".join(f"[\"']{name}[\"']" for name in effect_ids()))
    assert [(file.name, found) for file in files if (found := named.findall(file.read_text()))] == []
    keys_of_a_vehicle = {"mass", "ground_effect", "thrust_scale", "imu_bias"}
    of_flight = set(flight_effect_ids()) - keys_of_a_vehicle
    named = re.compile("|".join(f"[\"']{name}[\"']" for name in of_flight))
    flown = [file for file in (root / "depthsim/gap/flight").rglob("*.py") if file.parent.name != "effects"]
    assert [(file.name, found) for file in flown if (found := named.findall(file.read_text()))] == []


@pytest.mark.parametrize("effect_id", effect_ids())
def test_the_defaults_of_an_effect_are_those_of_a_camera_and_do_something(effect_id: str) -> None:
    effect = effect_class(effect_id)()
    assert not effect.is_neutral


@pytest.mark.parametrize(("effect_id", "name"), NUMBERS)
def test_a_neutral_parameter_changes_not_one_bit(effect_id: str, name: str) -> None:
    kind = effect_class(effect_id)
    neutral = parameters_of(kind)[name].neutral
    if neutral is None:
        pytest.skip("has no neutral value")
    effect = kind(**{name: neutral})
    if not effect.is_neutral:  # where several together do nothing, such as the angles of a rotation
        effect = kind(**{n: one.neutral for n, one in parameters_of(kind).items() if one.neutral is not None})
    assert effect.is_neutral
    for others in ([], [MaterialNoise(), FillRate()]):
        a, b = measure([*others, effect]), measure(list(others))
        assert a.depth.tobytes() == b.depth.tobytes()
        assert a.depth_raw.tobytes() == b.depth_raw.tobytes()


@pytest.mark.parametrize(("effect_id", "name"), NUMBERS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, "lots", None, [1.0]])
def test_a_parameter_out_of_its_bounds_is_refused(effect_id: str, name: str, value: object) -> None:
    kind = effect_class(effect_id)
    low, high = limits(kind, name) or (0, 0)
    for bad in (value, low - 1e-6 - abs(low), high + 1e-6 + abs(high)):
        with pytest.raises(ValidationError):
            kind.model_validate({name: bad})
    with pytest.raises(ValidationError):
        kind.model_validate({"no_such_parameter": 1})


@pytest.mark.parametrize("m", [-0.1, 21, np.nan, np.inf])
def test_an_m_out_of_its_bounds_is_refused(m: float) -> None:
    with pytest.raises(ValidationError):
        MaterialNoise(m={"cement": m})


SOUP = Caster(as_scene(soup(np.random.default_rng(1), 300), wall(-30), tags=["plastic", "cement"]))


@settings(max_examples=35)
@given(st.data())
def test_any_parameters_within_their_bounds_give_a_depth_picture(data: st.DataObject) -> None:
    effects = []
    for effect_id in effect_ids():
        kind = effect_class(effect_id)
        bounds = {name: limits(kind, name) for name in kind.model_fields}
        whole = {name for name, info in kind.model_fields.items() if info.annotation is int}
        draws = {name: st.integers(*b) if name in whole else st.floats(*b) for name, b in bounds.items() if b}
        numbers = {name: data.draw(draw, label=f"{effect_id}.{name}") for name, draw in draws.items()}
        effects.append(kind(**numbers))
    effects.append(MaterialNoise(m={"plastic": data.draw(st.floats(0, 20), label="m of plastic")}))
    pose = np.eye(4)
    pose[:3, :3], pose[2, 3] = np.diag([1, -1, -1]), data.draw(st.floats(-29.9, 4), label="height")
    cam = camera(45, 31, 40, depth_scale=data.draw(st.sampled_from([0.001, 0.0001, 1e-6]), label="unit"))
    seed = data.draw(st.integers(-(2**70), 2**70), label="seed")
    measured = Sensor(SOUP, cam, effects, MATERIALS).measure(
        pose, seed=seed, index=data.draw(st.integers(0, 2**32 - 1))
    )
    assert measured.depth.dtype == np.float32 and measured.depth_raw.dtype == np.uint16
    assert np.isfinite(measured.depth).all() and (measured.depth >= 0).all()
    assert not measured.depth_raw[measured.depth == 0].any()
