"""Effects at depth edges: foreground that grows, and depths in between."""

import numpy as np
import pytest
from scipy import ndimage, stats
from sensing import CAMERA, FAR, LEFT, OPEN_CASTER, RIGHT, STEP, column, disparity, measure, z_score
from shapes import MATERIALS, as_scene, quad, soup, sphere, wall

from depthsim.materials import Materials
from depthsim.raycast import Caster
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.effects.dropout import IncidenceDropout, MaterialDropout, SpecularDropout
from depthsim.sensor.effects.edges import EdgeFattening, FlyingPixels, _mix
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.effects.shadow import StereoShadow
from depthsim.sensor.effects.window import MatchingWindow

CLUTTER = Caster(as_scene(soup(np.random.default_rng(2), 40), wall(6), tags=["plastic", "cement"]))
POSE = np.eye(4)
POSE[2, 3] = -4


@pytest.mark.parametrize(("radius", "aspect", "down"), [(1, 1, 1), (2, 1, 2), (5, 1, 5), (3, 0, 0), (4, 0.5, 2)])
def test_the_foreground_grows_by_whole_pixels_as_a_dilation_does(radius: int, aspect: float, down: int) -> None:
    flat = as_scene(sphere(2, 0.3, (0, 0, 1.5)), sphere(2, 0.2, (0.4, 0.1, 2)), wall(4))
    sensor = Sensor(Caster(flat), CAMERA, [EdgeFattening(radius=radius, aspect=aspect, step=0.5)], MATERIALS)
    measured, clean = sensor.measure(np.eye(4)), Sensor(Caster(flat), CAMERA, [], MATERIALS).measure(np.eye(4))
    nearest = ndimage.minimum_filter(clean.clean.depth, (2 * down + 1, 2 * radius + 1), mode="nearest")
    fb = CAMERA.focal_baseline
    edge = fb / nearest > fb / clean.clean.depth + 0.5
    assert np.array_equal(measured.depth != clean.depth, edge) and 0.01 < edge.mean() < 0.5
    # Each takes a depth from within the radius, and never one that is farther than its own.
    assert (measured.depth[edge] >= nearest[edge] * (1 - 1e-6)).all()
    assert (measured.depth <= clean.depth).all()


def test_a_fraction_of_a_pixel_is_a_chance() -> None:
    d = np.concatenate([disparity(measure(EdgeFattening(radius=1.3), index=n)) for n in range(20)])
    near = d > 8
    assert near[:, LEFT - 1 : RIGHT + 1].all() and not near[:, : LEFT - 2].any() and not near[:, RIGHT + 2 :].any()
    for bordering in (LEFT - 2, RIGHT + 1):
        assert abs(z_score(near[:, bordering].sum(), np.full(len(near), 0.3))) < 4


def test_what_grows_is_the_measured_depth() -> None:
    noise = MaterialNoise(floor=0.02)
    plain, grown = measure(noise).depth, measure(noise, EdgeFattening(radius=1)).depth
    changed = plain != grown
    assert np.array_equal(np.flatnonzero(changed.any(axis=0)), [LEFT - 1, RIGHT])
    for v in range(1, CAMERA.height - 1):
        assert grown[v, LEFT - 1] in plain[v - 1 : v + 2, LEFT]
        assert grown[v, RIGHT] in plain[v - 1 : v + 2, RIGHT - 1]


def test_the_shadow_moves_with_the_edge_and_keeps_its_width() -> None:
    plain = measure(StereoShadow(share=1, left=0, right=0)).depth == 0
    moved = measure(StereoShadow(share=1, left=0, right=0), EdgeFattening(radius=3)).depth == 0
    assert np.array_equal(np.flatnonzero(plain.any(axis=0)), np.arange(LEFT - STEP, LEFT))
    assert np.array_equal(moved, np.roll(plain, -3, axis=1))


def test_no_shadow_moves_from_open_background_into_the_foreground() -> None:
    lost = measure(StereoShadow(), EdgeFattening(radius=3), caster=OPEN_CASTER).depth[:, LEFT:RIGHT] == 0
    assert not lost.any()


@pytest.mark.parametrize(
    ("effect", "left_over"),
    [
        # The plate has holes and the wall has none, or the other way round; the plate is 3 px wider on either side.
        (MaterialDropout(rate=0, rates={"plastic": 1}), False),
        (MaterialDropout(rate=0, rates={"cement": 1}), True),
        (SpecularDropout(width=90, matt=0.5, rate=1), False),
    ],
)
def test_what_the_foreground_covers_has_its_material(effect: Effect, left_over: bool) -> None:
    looks = Materials.model_validate({"plastic": {"m": 0, "gloss": 1, "ir_reflectance": 0.001}, "cement": {"m": 0}})
    lost = measure(EdgeFattening(radius=3), effect, materials=looks).depth == 0
    inside = np.zeros(CAMERA.width, np.bool_)
    inside[LEFT - 3 : RIGHT + 3] = True
    assert np.array_equal(lost.mean(axis=0) > 0.5, inside != left_over)


def test_what_the_foreground_covers_has_its_incidence() -> None:
    # A plate square to the axis before a floor seen at 82 degrees and more, which has hardly any return.
    floor = quad((-40, 0.5, -1), (80, 0, 0), (0, 0, 60))
    scene = as_scene(floor, quad((-0.2, 0.1, 1.5), (0.4, 0, 0), (0, 0.1, 0)), tags=["cement", "plastic"])
    grazing, grown = IncidenceDropout(start=60, rate=1), EdgeFattening(radius=4)
    plain, seen, both = (
        Sensor(Caster(scene), CAMERA, effects, MATERIALS).measure(np.eye(4))
        for effects in ([], [grown], [grown, grazing])
    )
    covered = seen.depth != plain.depth
    # What covers it is on the plate, but for the floor that grows over farther floor.
    by_plate = covered & (np.abs(seen.depth - 1.5) < 1e-5)
    assert by_plate.sum() > 300
    assert (both.depth[by_plate] > 0).all() and (both.depth == 0)[~covered & plain.clean.hit].mean() > 0.2


def test_the_clean_geometry_is_not_touched() -> None:
    measured, plain = measure(EdgeFattening(radius=4), StereoShadow()).clean, measure().clean
    for name in ("depth", "face", "cosine", "tag"):
        assert np.array_equal(getattr(measured, name), getattr(plain, name))
    assert np.array_equal(measured.right_sees, measure(StereoShadow()).clean.right_sees)


@pytest.mark.parametrize(("rate", "reach"), [(0.024, 2), (0.3, 1), (1.0, 4)])
def test_flying_pixels_are_between_and_near_edges_and_as_many_as_said(rate: float, reach: int) -> None:
    frames = [disparity(measure(FlyingPixels(rate=rate, reach=reach), index=n)) for n in range(20)]
    d = np.concatenate(frames)
    between = (d > 4.001) & (d < 9.999)
    near = np.zeros(CAMERA.width, np.bool_)
    near[[*range(LEFT - reach, LEFT + reach), *range(RIGHT - reach, RIGHT + reach)]] = True
    assert not between[:, ~near].any()
    # A pixel for each patch of 4x4: the others of the patch go with it.
    columns = [u for u in np.flatnonzero(near) if not near[u - 1] or u % 4 == 0]
    drawn = between[::4, columns]
    assert abs(z_score(drawn.sum(), np.full(drawn.size, rate * 0.9997))) < 4
    share = (d[::4, columns][drawn] - 4) / STEP
    # w is counted from the pixel's own disparity, and it is uniform either way.
    assert stats.kstest(share, "uniform").pvalue > 1e-4


def test_other_pixels_keep_every_bit_in_clutter() -> None:
    plain = Sensor(CLUTTER, CAMERA, [], MATERIALS).measure(POSE)
    flying = Sensor(CLUTTER, CAMERA, [FlyingPixels(rate=1, reach=1)], MATERIALS).measure(POSE)
    d = np.where(plain.clean.hit, CAMERA.focal_baseline / np.maximum(plain.clean.depth, 1e-6), np.nan)
    with np.errstate(all="ignore"):
        spread = ndimage.generic_filter(d, lambda w: np.nanmax(np.abs(w - w[4])), 3, mode="nearest")
    far_from_edges = ~(spread > 1)
    assert np.array_equal(plain.depth[far_from_edges], flying.depth[far_from_edges])
    assert (plain.depth != flying.depth)[spread > 1.001].mean() > 0.95
    assert (flying.depth > 0)[plain.depth > 0].all()


@pytest.mark.parametrize("reach", [1, 2, 5])
def test_flying_pixels_by_place_are_as_a_window_over_the_edge_sees_both_sides(reach: int) -> None:
    d = disparity(measure(FlyingPixels(rate=1, reach=reach, by_place=1)))
    ramp = 4 + STEP * np.clip((np.arange(CAMERA.width) - LEFT + reach + 1) / (2 * reach + 1), 0, 1)
    np.testing.assert_allclose(d[:, : LEFT + 10], np.broadcast_to(ramp, d.shape)[:, : LEFT + 10], atol=2e-3)


@pytest.mark.parametrize("by_place", [False, True])
@pytest.mark.parametrize(("width", "reach", "step"), [(7, 1, 0.5), (13, 3, 1.0), (33, 2, 3.0)])
def test_depths_in_between_by_their_definition(width: int, reach: int, step: float, by_place: bool) -> None:
    """Pictures with holes, pixel by pixel: the kernel looks at a patch of them at once."""
    random = np.random.default_rng(width)
    height, focal_baseline = 11, np.float32(10)
    clean = (focal_baseline / random.choice([1.0, 1.2, 3.0, 9.0], (height, width))).astype(np.float32)
    clean[random.random(clean.shape) < 0.1] = 0
    measured = np.where(random.random(clean.shape) < 0.9, clean * np.float32(1.01), np.float32(0))
    chance, weight = (random.random((3, -(-width // 4)), np.float32) for _ in range(2))
    depth, wanted = measured.copy(), measured.copy()
    _mix(
        0, depth.size, width, reach, np.float32(0.5), np.float32(step), by_place, focal_baseline, chance, weight,
        clean.reshape(-1), measured.reshape(-1), depth.reshape(-1),
    )  # fmt: skip
    valid = (clean > 0) & (measured > 0)
    d = np.where(valid, focal_baseline / np.where(valid, clean, 1), np.nan).astype(np.float32)
    for v, u in np.argwhere(valid & (chance.repeat(4, 0)[:height].repeat(4, 1)[:, :width] < 0.5)):
        rows, columns = slice(max(v - reach, 0), v + reach + 1), slice(max(u - reach, 0), u + reach + 1)
        apart = np.nan_to_num(np.abs(d[rows, columns] - d[v, u]))
        if apart.max() > step:
            own, other = measured[v, u], measured[rows, columns].reshape(-1)[apart.argmax()]
            w = np.float32((apart > apart.max() / 2).sum() / apart.size) if by_place else weight[v // 4, u // 4]
            wanted[v, u] = own * other / (other + w * (own - other))
    assert (wanted != measured).mean() > 0.05
    np.testing.assert_array_equal(depth, wanted)


def step_of(near: float) -> Caster:
    """A wall that stands before another one from column LEFT on."""
    return Caster(as_scene(quad((column(LEFT, near), -5, near), (0, 10, 0), (9, 0, 0)), wall(FAR)))


@pytest.mark.parametrize("radius", [1, 4, 7])
def test_a_matching_window_makes_a_straight_ramp_of_a_small_step(radius: int) -> None:
    """From 4 px to 6 px of disparity."""
    d = disparity(measure(MatchingWindow(radius=radius), caster=step_of(CAMERA.focal_baseline / 6)))
    ramp = 4 + 2 * np.clip((np.arange(CAMERA.width) - LEFT + radius + 1) / (2 * radius + 1), 0, 1)
    np.testing.assert_allclose(d, np.broadcast_to(ramp, d.shape), atol=2e-3)


@pytest.mark.parametrize("effects", [(), (EdgeFattening(radius=3),), (StereoShadow(),)])
def test_a_matching_window_leaves_a_large_step(effects: tuple[Effect, ...]) -> None:
    with_window, without = (measure(*effects, *extra).depth for extra in ((MatchingWindow(),), ()))
    np.testing.assert_allclose(with_window, without, atol=2e-4)


def test_a_matching_window_averages_what_has_grown() -> None:
    caster = step_of(CAMERA.focal_baseline / 6)
    plain, grown = (
        disparity(measure(MatchingWindow(), *extra, caster=caster)) for extra in ((), (EdgeFattening(radius=3),))
    )
    np.testing.assert_allclose(grown[:, 80:120], plain[:, 83:123], atol=2e-3)


def test_a_matching_window_bends_slanted_surfaces_at_the_border() -> None:
    """The last row is the mean of itself and the four above it, two rows off; noise stays as it is."""
    floor = Caster(as_scene(quad((-20, 0.5, 0.1), (40, 0, 0), (0, 0, 20))))
    noise = MaterialNoise(floor=0.002)
    with_window, without = (
        disparity(measure(noise, *extra, caster=floor)) for extra in ((MatchingWindow(radius=4),), ())
    )
    moved = (with_window - without).mean(axis=1)
    slope = np.diff(disparity(measure(caster=floor)).mean(axis=1))[-1]
    np.testing.assert_allclose(moved[-6:], slope * np.array([0, 0, -0.5, -1, -1.5, -2]), atol=0.02 * slope)
