"""Effects that lose returns: each loses the share that its formula says, where it says, and leaves the rest alone."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage
from sensing import CAMERA, FAR, LEFT, NEAR, OPEN_CASTER, RIGHT, STEP, STEP_CASTER, column, measure, plate, z_score
from shapes import Array, as_scene, quad, strips, wall

from depthsim.materials import Materials
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.effects.dropout import IncidenceDropout, MaterialDropout, RangeDropout, SpecularDropout
from depthsim.sensor.effects.limits import MaxRange, MinRange
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.effects.shadow import InvalidBand, StereoShadow
from depthsim.sensor.sensor import Measurement

SLANTED = Caster(as_scene(quad((-40, 0.8, -1), (80, 0, 0), (0, 1.2, 60))))
"""A floor seen at every slant up to grazing, from 4 m on."""


def assert_holes(measured: Measurement, clean: Measurement, chances: Array) -> None:
    """The holes are as many as ``chances`` say, among the likely and the unlikely pixels; the others are untouched."""
    hit, lost = clean.depth > 0, measured.depth == 0
    assert np.array_equal(measured.depth[~lost], clean.depth[~lost])
    assert not lost[hit & (chances <= 0)].any() and lost[hit & (chances >= 1)].all()
    open_ = hit & (chances > 0) & (chances < 1)
    for part in np.array_split(np.argsort(chances[open_]), 4):
        assert abs(z_score(lost[open_][part].sum(), chances[open_][part])) < 4


@pytest.mark.parametrize("effect", [RangeDropout(), RangeDropout(start=0.5, rate=0.3), RangeDropout(rate=2)])
@pytest.mark.parametrize("caster", [SLANTED, STEP_CASTER])
def test_holes_grow_with_range(effect: RangeDropout, caster: Caster) -> None:
    clean = measure(caster=caster)
    chances = effect.rate * (clean.clean.depth.astype(float) - effect.start)
    assert_holes(measure(effect, caster=caster), clean, np.clip(chances, 0, 1))


@pytest.mark.parametrize(
    "effect", [IncidenceDropout(), IncidenceDropout(start=45, rate=0.4), IncidenceDropout(start=0)]
)
def test_holes_grow_with_incidence(effect: IncidenceDropout) -> None:
    clean = measure(caster=SLANTED)
    x, y = CAMERA.rays.astype(float)
    angle = np.arccos(np.clip((60 * y - 1.2) / np.hypot(60, 1.2) / np.sqrt(1 + x**2 + y**2), 0, 1))
    begin = np.radians(effect.start)
    chances = np.where(angle > begin, effect.rate * (1 - np.cos(angle) / np.cos(begin)), 0)
    assert (chances > 0).mean() > 0.1
    assert_holes(measure(effect, caster=SLANTED), clean, chances)


GLOSSY = Materials.model_validate(
    {
        "cement": {"m": 0.35, "ir_reflectance": 0.4, "gloss": 0.02},
        "formboard": {"m": 0.5, "ir_reflectance": 0.03, "gloss": 0.09},
        "plastic": {"m": 0.85, "ir_reflectance": 0.1, "gloss": 0.9},
    }
)
STRIPS = Caster(strips(2.0, CAMERA))


@pytest.mark.parametrize(
    ("effect", "by_tag"),
    [
        (MaterialDropout(), [0, 0.8 * 0.7, 0]),
        (MaterialDropout(rate=1, dark=0.3), [0, 0.9, 2 / 3]),
        (MaterialDropout(rates={"formboard": 0.1, "glass": 1}), [0, 0.1, 0]),
        (MaterialDropout(rate=0, rates={"plastic": 1, "cement": 0.5}), [0.5, 0, 1]),
    ],
)
def test_holes_on_a_material(effect: MaterialDropout, by_tag: list[float]) -> None:
    materials = Materials.model_validate({**GLOSSY.model_dump(), "glass": {"m": 0.85}})
    clean = measure(caster=STRIPS)
    measured = measure(effect, caster=STRIPS, materials=materials)
    assert_holes(measured, clean, np.array(by_tag)[clean.clean.tag])


def test_material_dropout_is_neutral_when_it_loses_nothing() -> None:
    assert MaterialDropout(rate=0).is_neutral and MaterialDropout(rate=0, rates={"cement": 0}).is_neutral
    assert not MaterialDropout().is_neutral and not MaterialDropout(rate=0, rates={"cement": 0.1}).is_neutral


@pytest.mark.parametrize(
    "effect",
    [
        SpecularDropout(),
        SpecularDropout(rate=0.5, width=25, matt=0),
        SpecularDropout(matt=0.5),
        SpecularDropout(gloss={"plastic": 0.0, "cement": 0.6}),
    ],
)
def test_holes_where_a_glossy_surface_mirrors(effect: SpecularDropout) -> None:
    x, y = CAMERA.rays.astype(float)
    angle = np.arctan(np.hypot(x, y))  # of incidence on a wall square to the axis
    gloss, scatter = np.array([[0.02, 0.09, 0.9], [0.4, 0.03, 0.1]])
    gloss = np.array([effect.gloss.get(*one) for one in zip(("cement", "formboard", "plastic"), gloss, strict=True)])
    share = np.where(gloss > effect.matt, gloss / (gloss + scatter), 0)
    lobe = np.maximum(1 - (np.sin(angle) / np.sin(np.radians(effect.width))) ** 2, 0) ** 2
    clean = measure(caster=STRIPS)
    measured = measure(effect, caster=STRIPS, materials=GLOSSY)
    assert_holes(measured, clean, effect.rate * share[clean.clean.tag] * lobe)


@pytest.mark.parametrize("limit", [1.7, 1.0, 2.5])
def test_limits_cut_the_measured_depth(limit: float) -> None:
    noise = MaterialNoise(floor=0.05)
    plain = measure(noise).depth
    near, far = measure(noise, MinRange(depth=limit)).depth, measure(noise, MaxRange(depth=limit)).depth
    assert np.array_equal(near, np.where(plain >= np.float32(limit), plain, 0))
    assert np.array_equal(far, np.where(plain <= np.float32(limit), plain, 0))
    assert 0 < (near > 0).mean() < 1 and 0 < (far > 0).mean() < 1


@pytest.mark.parametrize("effect", [MinRange(depth=1.7, error=0), MaxRange(depth=1.7, error=0)])
def test_limits_may_cut_the_true_depth(effect: Effect) -> None:
    noise = MaterialNoise(floor=0.05)
    plain, measured = measure(noise), measure(noise, effect)
    true = plain.clean.depth
    beyond = true < np.float32(1.7) if isinstance(effect, MinRange) else true > np.float32(1.7)
    assert np.array_equal(measured.depth, np.where(beyond, 0, plain.depth))
    assert 0 < beyond.mean() < 1


@pytest.mark.parametrize("kind", [MinRange, MaxRange])
@pytest.mark.parametrize("error", [0.0, 1.0])
def test_limits_may_be_of_the_distance_along_the_ray(kind: type[MinRange | MaxRange], error: float) -> None:
    noise = MaterialNoise(floor=0.01)
    plain = measure(noise)
    limit = 1.03 * float(np.median(plain.clean.depth))
    measured = measure(noise, kind(depth=limit, error=error, along_ray=1))
    x, y = CAMERA.rays.astype(np.float64)
    away = (plain.depth if error else plain.clean.depth) * np.sqrt(1 + x**2 + y**2) - limit
    lost = away < 0 if kind is MinRange else away > 0
    sure = np.abs(away) > 1e-5
    assert np.array_equal(measured.depth[sure], np.where(lost, 0, plain.depth)[sure])
    by_depth = plain.depth < limit if kind is MinRange else plain.depth > limit
    assert 0 < lost.mean() < 1 and (lost != by_depth).mean() > 0.05


@pytest.mark.parametrize("reach", [1, 3])
def test_what_is_too_near_takes_its_surroundings_with_it(reach: int) -> None:
    sensor = MaterialNoise(floor=0.05), RangeDropout(rate=0.2)
    plain, near = measure(*sensor).depth, measure(*sensor, MinRange(depth=1.3)).depth
    lost = np.argwhere((plain > 0) & (near == 0))
    expected = plain.copy()
    for v, u in lost:
        expected[max(v - reach, 0) : v + reach + 1, max(u - reach, 0) : u + reach + 1] = 0
    wide = measure(*sensor, MinRange(depth=1.3, reach=reach)).depth
    assert np.array_equal(wide, expected)
    assert len(lost) and ((wide == 0) & (near > 0)).any() and (wide > 0).any()


@pytest.mark.parametrize("error", [0.0, 1.0])
def test_soft_limits_are_logistic(error: float) -> None:
    measured = measure(MaxRange(depth=1.7, softness=0.2, error=error))
    chance = 1 / (1 + np.exp(-(measured.clean.depth.astype(np.float64) - 1.7) / 0.2))
    assert abs(z_score(int((measured.depth == 0).sum()), chance)) < 4


def holes(*effects: Effect, **keys: int) -> NDArray[np.bool_]:
    return measure(*effects, **keys).depth == 0


def test_the_shadow_is_what_two_imagers_leave() -> None:
    found = holes(StereoShadow(share=1, left=0, right=0))
    expected = np.zeros_like(found)
    expected[:, LEFT - round(STEP) : LEFT] = True
    assert np.array_equal(found, expected)


@pytest.mark.parametrize("first", [*range(60, 70), *range(94, 100), 127, 128, 129])
def test_a_shadow_is_found_wherever_it_begins(first: int) -> None:
    """The kernel passes over stretches of a row in which nothing begins: a narrow plate at each of their borders."""
    left, right = column(first, NEAR), column(first + 3, NEAR)
    caster = Caster(as_scene(quad((left, -5, NEAR), (0, 10, 0), (right - left, 0, 0)), wall(FAR)))
    hidden = np.zeros(CAMERA.width, np.bool_)
    hidden[first - round(STEP) : first - round(STEP) + 3] = True
    exact = measure(StereoShadow(share=1, left=0, right=0), caster=caster).depth == 0
    np.testing.assert_array_equal(exact, np.broadcast_to(hidden, exact.shape))
    wider = measure(StereoShadow(share=1, left=0, right=20), caster=caster).depth == 0
    assert wider[:, first + 3].all() and not wider[:, first : first + 3].any()


def test_a_thin_thing_has_a_margin_on_its_left_too() -> None:
    """Of 3 px, before a wall whose disparity is 6 px less: what it hides does not touch it."""
    left, right = column(97, NEAR), column(100, NEAR)
    caster = Caster(as_scene(quad((left, -5, NEAR), (0, 10, 0), (right - left, 0, 0)), wall(FAR)))
    lost = np.concatenate([(measure(StereoShadow(), caster=caster, index=n).depth == 0)[::12] for n in range(200)])
    bare = ~lost[:, 96]
    u = np.linspace(0, 1, 100_001)[1:-1]
    none = (np.floor(1.6 * np.minimum(np.sqrt(u / (1 - u)), 4) + 0.5) < 1).mean()
    assert abs(z_score(bare.sum(), np.full(bare.size, 1 - 0.998 * (1 - none)))) < 4
    assert not lost[:, 97:100].any()


def test_the_margins_of_the_shadow() -> None:
    # Every twelfth row, as twelve have one margin.
    found = np.concatenate([holes(StereoShadow(), index=n)[::12] for n in range(200)])
    left = found[:, :LEFT].sum(axis=1) - STEP
    right = found[:, RIGHT:].sum(axis=1)
    assert not found[:, LEFT:RIGHT].any()
    shadow = left > -STEP
    assert abs(z_score(shadow.sum(), np.full(len(found), 0.998))) < 4
    for width, median in ((left[shadow], 1.6), (right, 3.0)):
        u = np.linspace(0, 1, 100_001)[1:-1]
        law = np.floor(median * np.minimum(np.sqrt(u / (1 - u)), 4) + 0.5)
        for least in range(1, 8):
            share = (law >= least).mean()
            assert abs(z_score((width >= least).sum(), np.full(width.size, share))) < 4.5, (median, least)
    # Both sides of an object are drawn apart.
    assert abs(np.corrcoef(left[shadow], right[shadow])[0, 1]) < 4 / np.sqrt(len(left))


def test_what_is_lost_of_the_object_itself() -> None:
    """By the same law, beside its shadow and nowhere else; never the wall behind it."""
    exact = holes(StereoShadow(share=1, left=0, right=0))
    inner = StereoShadow(share=1, left=0, right=0, inside=3)
    lost = np.concatenate([(holes(inner, index=n) & ~exact)[::12] for n in range(200)])
    assert not lost[:, :LEFT].any() and not lost[:, RIGHT:].any()
    width = lost.sum(axis=1)
    assert (lost[:, LEFT : LEFT + 12] == (np.arange(12) < width[:, None])).all()
    u = np.linspace(0, 1, 100_001)[1:-1]
    law = np.floor(3 * np.minimum(np.sqrt(u / (1 - u)), 4) + 0.5)
    for least in range(1, 8):
        assert abs(z_score((width >= least).sum(), np.full(width.size, (law >= least).mean()))) < 4.5, least


@pytest.mark.parametrize("around", [0.8, 1.5, 4.0, 9.5])
def test_what_is_lost_all_round_a_shadow(around: float) -> None:
    """A disc about every pixel of the shadow, rounded up by so much of a pixel that it is the distance on average."""
    box = Caster(as_scene(quad((column(LEFT, NEAR), -0.2, NEAR), (0, 0.4, 0), (0.5, 0, 0)), wall(FAR)))
    only = StereoShadow(share=1, left=0, right=0)
    away = ndimage.distance_transform_edt(measure(only, caster=box).depth > 0)
    wider = only.model_copy(update={"around": around})
    lost = [measure(wider, caster=box, index=n).depth == 0 for n in range(40)]
    assert np.all(lost, axis=0)[away <= around - 0.5].all() and not np.any(lost, axis=0)[away > around + 0.5].any()
    between = (away > max(around - 0.5, 0)) & (away <= around + 0.5)
    share = around + 0.5 - away[between]
    # The pixels of a patch go together, and there are some hundred patches of 40 frames.
    assert abs(np.mean(lost, axis=0)[between].mean() - share.mean()) < 0.1


def test_narrow_shadows_lose_nothing_around_them() -> None:
    only = StereoShadow(share=1, left=0, right=0, step=STEP + 1)
    assert np.array_equal(holes(only.model_copy(update={"around": 5.0})), holes(only))


def test_a_margin_never_eats_the_foreground() -> None:
    wide = holes(StereoShadow(share=1, left=20, right=20))
    assert not wide[:, LEFT:RIGHT].any() and wide[:, LEFT - 20 : LEFT].mean() > 0.8


def test_open_background_casts_no_shadow() -> None:
    lost = [measure(StereoShadow(), caster=OPEN_CASTER, index=n).depth[:, LEFT:RIGHT] == 0 for n in range(10)]
    assert not np.any(lost)


def test_a_shadow_reaches_across_open_background() -> None:
    """A wall that ends 2 px left of the plate: of the 6 px that the plate hides, 4 are on the wall."""
    edge = column(LEFT - 2, FAR)
    behind = quad((edge - 5, -5, FAR), (0, 10, 0), (5, 0, 0))
    caster = Caster(as_scene(plate(), behind, tags=["plastic", "cement"]))
    exact = measure(StereoShadow(share=1, left=0, right=0), caster=caster).depth == 0
    assert np.array_equal(np.flatnonzero(exact[60, :RIGHT]), np.arange(LEFT - 6, LEFT))
    wider = np.array([(measure(StereoShadow(share=1), caster=caster, index=n).depth == 0)[::12] for n in range(40)])
    margin = wider[..., : LEFT - 6].sum(axis=-1)
    assert 1.2 < np.median(margin) < 2.2 and not wider[..., LEFT:RIGHT].any()


def test_shadows_stay_empty_with_their_share() -> None:
    lost = np.concatenate([holes(StereoShadow(share=0.3, left=0), index=n)[::12, LEFT - 1] for n in range(100)])
    assert abs(z_score(lost.sum(), np.full(lost.size, 0.3))) < 4


@pytest.mark.parametrize("effect", [InvalidBand(), InvalidBand(slope=2, margin=0), InvalidBand(slope=0, margin=12)])
@pytest.mark.parametrize("distance", [0.43, NEAR, FAR, 30.0])
def test_the_band_is_as_wide_as_the_disparity_and_a_margin(effect: InvalidBand, distance: float) -> None:
    lost = Sensor(Caster(as_scene(wall(distance))), CAMERA, [effect]).measure(np.eye(4)).depth == 0
    width = effect.slope * CAMERA.focal_baseline / distance + effect.margin
    assert np.array_equal(lost, np.broadcast_to(np.arange(CAMERA.width) < width - 1e-5, lost.shape))


def test_without_the_right_view_the_shadow_says_so() -> None:
    from depthsim.sensor import Frame
    from depthsim.sensor.motion import Motion

    clean = measure()
    frame = Frame(clean.depth, clean.clean, CAMERA, STEP_CASTER.scene, GLOSSY, Motion.still(np.eye(4)))
    with pytest.raises(ValueError, match="right=True"):
        StereoShadow().apply(frame)
