"""The parts of the diagnosis: axes against casting, counts, distances, fits."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from shapes import as_scene, box, quad

from depthsim.camera import Camera
from depthsim.gap.config import DepthData
from depthsim.gap.depth.data import counting, histograms
from depthsim.gap.depth.data.axis import Axis
from depthsim.gap.depth.data.covariates import covariates
from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.frames import (
    MARGIN,
    counted_rows,
    deal_blocks,
    inner_rows,
    select_frames,
    select_rows,
)
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.data.quantization import _steps_of
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.candidates import candidates
from depthsim.gap.diagnosis import Cause, Cut, Diagnosis, Gap, Unexplained
from depthsim.gap.resampling import jackknife
from depthsim.materials import load_materials
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.runs.generate import generate
from depthsim.scene import Scene
from depthsim.sensor import load_profile
from depthsim.sensor.effect import Effect, effect_ids
from depthsim.sensor.effects.calibration import BaselineScale
from depthsim.sensor.effects.noise import DisparityNoise
from depthsim.sensor.effects.subpixel import DisparityQuantization
from depthsim.sensor.motion import Motion
from depthsim.sensor.parameter import Setting
from depthsim.trajectory import Trajectory

CAMERA = Camera(name="small", width=64, height=48, fx=40, fy=40, cx=31.5, cy=23.5, baseline=0.05)


def room() -> Scene:
    """A box to stand in, and one to look at."""
    return as_scene(
        box((-3, -3, 0), (4, 3, 3)), box((1.5, -0.5, 0), (2, 0.5, 1.1)), quad((2.5, 1, 0), (0.5, 1, 0), (0, 0, 2))
    )


def _pose(x: float = 0.0, yaw: float = 0.0) -> NDArray[np.float64]:
    """Looking along the world's x, turned left by ``yaw``."""
    pose = np.eye(4)
    forward = np.array([np.cos(yaw), np.sin(yaw), -0.2])
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = [x, 0.1, 1.2]
    return pose


def _still(pose: NDArray[np.float64]) -> Motion:
    return Motion.still(pose)


def test_slopes_are_those_of_the_cast_depth() -> None:
    scene = room()
    caster = Caster(scene)
    met = caster.cast(CAMERA, _pose())
    found = covariates(met, _pose(), CAMERA, scene, _still(_pose()), 0.0)
    step = np.float32(1e-3)
    for axis, slope in enumerate((found.slope_x, found.slope_y)):
        rays = CAMERA.rays.copy()
        rays[axis] += step
        moved = caster.cast(CAMERA, _pose(), rays=rays)
        same = (moved.face == met.face) & (met.cosine > 0.1)
        np.testing.assert_allclose(((moved.depth - met.depth) / step)[same], slope[same], rtol=0.05, atol=0.05)


def test_drift_is_the_change_of_depth_along_the_path() -> None:
    scene = room()
    caster = Caster(scene)
    stamps = np.linspace(0, 0.1, 11)
    poses = np.stack([_pose(0.5 * t, 0.8 * t) for t in stamps])
    turns = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    motion = Motion.along(Trajectory(stamps, poses[:, :3, 3], turns))
    before, after = (caster.cast(CAMERA, motion.at(t)[0]) for t in (0.049, 0.051))
    met = caster.cast(CAMERA, motion.at(0.05)[0])
    found = covariates(met, motion.at(0.05)[0], CAMERA, scene, motion, 0.05)
    same = (before.face == after.face) & (met.face == before.face) & (met.cosine > 0.15)
    np.testing.assert_allclose(((after.depth - before.depth) / 0.002)[same], found.drift[same], rtol=0.05, atol=0.03)


def test_edges_are_found_on_both_sides() -> None:
    depth = np.full((10, 40), 2.0, np.float32)
    depth[:, 20:] = 3.0
    from depthsim.gap.depth.data.covariates import _edges

    edge, across = np.zeros(depth.shape, np.uint8), np.zeros(depth.shape, np.float32)
    zero = np.zeros(depth.shape, np.float32)
    _edges(depth, zero, zero, edge, across)
    assert (edge[:, 19] > 0).all() and (edge[:, 20] > 0).all()
    assert (across[:, 19] == 3).all() and (across[:, 20] == 2).all()
    assert edge[5, 19] != edge[5, 20]
    assert (edge[:, :8] == 0).all() and (edge[:, 32:] == 0).all()


def _count(units: NDArray[np.uint16], clean: NDArray[np.float32], kind: int) -> NDArray[np.uint32]:
    pixels, width = units.size, units.shape[1]
    error, coarse = np.empty(pixels, np.float32), np.empty(pixels, np.uint8)
    flat, unit = clean.reshape(-1), np.float32(0.001)
    per_spread, across = np.full(pixels, 100, np.float32), np.zeros(pixels, np.float32)
    histograms.errors(units.reshape(-1), unit, flat, per_spread, error, coarse)
    bins = np.zeros((len(histograms.BINS), pixels), np.uint8)
    rows = np.arange(units.shape[0])
    histograms.codes(
        units.reshape(-1),
        unit,
        flat,
        across,
        np.float32(20),
        width,
        error,
        coarse,
        np.empty(0, np.uint8),
        5,
        4,
        np.array(histograms.STEPS, np.float32),
        rows,
        bins,
    )
    kinds, offsets, size = np.array([kind]), np.array([0]), int(histograms.BINS[kind])
    cells = np.zeros((1, pixels), np.uint16)
    where = counting.places(cells, kinds, offsets, size, rows=rows, across=across, follows=False, left=5, up=4)
    counts = np.zeros(size + counting.SPARE, np.uint32)
    counting.count(bins, kinds, where, np.array([0]), counts)
    counts = counts[:size]
    return counts


@settings(max_examples=40)
@given(st.integers(0, 2**31), st.floats(0, 0.5))
def test_every_pixel_is_counted_once(seed: int, holes: float) -> None:
    rng = np.random.default_rng(seed)
    clean = rng.uniform(0.5, 5, (12, 17)).astype(np.float32)
    units = np.where(rng.random(clean.shape) < holes, 0, (clean + rng.normal(0, 0.01, clean.shape)) * 1000)
    counts = _count(units.astype(np.uint16), clean, histograms.ERROR)
    assert counts.sum() == clean.size
    assert counts[histograms.ERROR_HOLE] == (units.astype(np.uint16) == 0).sum()


@settings(max_examples=20)
@given(st.integers(0, 2**31))
def test_axes_that_are_counted_together_have_the_counts_of_each_alone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bins, pixels = int(histograms.BINS[histograms.ERROR]), 4000
    u, v = rng.integers(0, 6, pixels), rng.integers(0, 5, pixels)
    cells = np.stack([u, v, 5 * u + v, u // 2, rng.integers(0, 300, pixels)]).astype(np.uint16)
    cells[2][u == 3] = counting.NO_CELL
    kinds, offsets = np.full(5, histograms.ERROR), bins * np.array([0, 6, 11, 41, 44])
    size, across = 344 * bins, np.zeros(pixels, np.float32)
    where = counting.places(cells, kinds, offsets, size, rows=np.arange(40), across=across, follows=False, left=5, up=4)
    codes = rng.integers(0, bins, (1, pixels)).astype(np.uint8)
    expected, counts = np.zeros((2, size + counting.SPARE), np.uint32)
    counting.count(codes, kinds, where, np.arange(5), expected)
    (axes,) = counting.bundles(where, kinds)
    assert axes == [0, 1, 2, 3]
    some = counting.together(where, axes)
    counting.count(codes, kinds, where, np.array([4]), counts)
    shared = np.zeros(len(some.begins) * counting.ROOM, np.uint32)
    counting.count_together(codes[0], some.places, some.begins, shared, counts)
    np.testing.assert_array_equal(counts[:size], expected[:size])
    assert not shared.any()


@settings(max_examples=20)
@given(st.integers(0, 2**31), st.integers(1, 700), st.booleans())
def test_axes_of_one_cell_have_the_counts_of_any_other(seed: int, pixels: int, wide: bool) -> None:
    rng = np.random.default_rng(seed)
    kinds = np.array([histograms.PHASE, histograms.ERROR, histograms.PHASE + 3])
    bins = histograms.BINS[kinds]
    offsets, size = np.concatenate([[0], np.cumsum(bins)[:-1]]), 70_000 if wide else int(bins.sum())
    cells = np.where(rng.random((3, pixels)) < 0.3, counting.NO_CELL, 0).astype(np.uint16)
    across = np.zeros(pixels, np.float32)
    where = counting.places(cells, kinds, offsets, size, rows=np.arange(1), across=across, follows=False, left=5, up=4)
    codes = rng.integers(0, histograms.BINS[: kinds.max() + 1, None], (kinds.max() + 1, pixels)).astype(np.uint8)
    expected, counts = np.zeros((2, size + counting.SPARE), np.uint32)
    counting.count(codes, kinds, where, np.array([0, 2]), expected)
    counting.count_whole(codes, kinds, where, offsets, np.array([0, 2]), counts)
    np.testing.assert_array_equal(counts[:size], expected[:size])
    assert counts[: bins[0]].sum() == (cells[0] == 0).sum()


@given(st.lists(st.floats(-100, 100, width=32), min_size=1, max_size=100))
def test_the_bin_of_an_error_is_that_of_its_thresholds(values: list[float]) -> None:
    above = np.concatenate([histograms.MAGNITUDES, [0], -histograms.MAGNITUDES])
    given = np.concatenate([np.array(values, np.float32), above.astype(np.float32)])
    ranks = np.empty(len(given), np.uint8)
    histograms._signed_rank(given, histograms.MAGNITUDES, ranks)
    beyond = [(x > histograms.MAGNITUDES).sum() for x in given]
    within = [(x >= -histograms.MAGNITUDES).sum() for x in given]  # nearer to zero, on the threshold itself
    np.testing.assert_array_equal(ranks, np.add(beyond, within) + (given > 0))


def test_a_bias_moves_the_bins_and_its_sign_is_kept() -> None:
    clean = np.full((20, 20), 2.0, np.float32)
    near, far = (_count(np.full(clean.shape, v, np.uint16), clean, histograms.ERROR) for v in (1990, 2010))
    assert near.argmax() < 16 <= far.argmax()
    assert near.argmax() + far.argmax() == 31


def _ruler(cells: int = 3) -> Ruler:
    return Ruler.of([Axis("range", histograms.ERROR, cells, lambda *_: np.zeros(1, int), str)])


@settings(max_examples=50)
@given(st.integers(0, 2**31))
def test_divergence_is_a_distance_in_bits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.integers(0, 50, (2, 3 * 35))
    ruler = _ruler()
    found = ruler.divergence(a, b)
    assert ((found >= -1e-12) & (found <= 1 + 1e-12)).all()
    np.testing.assert_allclose(found, ruler.divergence(b, a), atol=1e-12)
    np.testing.assert_allclose(ruler.divergence(a, 3 * a), 0, atol=1e-12)
    # Hellinger's distance, which the fits make least, bounds the divergence from both sides.
    from scipy.spatial.distance import jensenshannon

    for cell in range(3):
        own = slice(35 * cell, 35 * cell + 35)
        assert found[cell] == pytest.approx(jensenshannon(a[own], b[own], base=2) ** 2, abs=1e-9)


def test_disjoint_histograms_are_one_bit_apart() -> None:
    a, b = np.zeros(105, int), np.zeros(105, int)
    a[[0, 35, 70]] = 10
    b[[1, 36, 71]] = 10
    np.testing.assert_allclose(_ruler().divergence(a, b), 1)
    assert _ruler().gap(a, b) == pytest.approx(1)


def test_an_axis_that_counts_few_pixels_has_less_weight() -> None:
    """In the gap and in the roots alike: 10 of 10,000 pixels have a twentieth of the weight of 2 %, and of all."""
    axes = [Axis(name, histograms.ERROR, 1, lambda *_: np.zeros(1, int), str) for name in ("range", "edge_distance")]
    ruler, a, b = Ruler.of(axes), np.zeros(70, int), np.zeros(70, int)
    a[0], b[0], a[35], b[36] = 10_000, 10_000, 10, 10
    assert ruler.gap(a, b) == pytest.approx(0.05 / 1.05)
    assert np.square(ruler.roots(a) - ruler.roots(b)).sum() == pytest.approx(2 * 0.05 / 1.05)
    assert ruler.gap(np.zeros(70, int), b) == 0


def test_roots_have_the_squared_hellinger_distance() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.integers(1, 50, (2, 35))
    ruler = _ruler(1)
    apart = ruler.roots(a) - ruler.roots(b)
    expected = 2 - 2 * np.sqrt(a / a.sum() * b / b.sum()).sum()
    assert apart @ apart == pytest.approx(expected)


def test_errors_are_measured_in_what_is_smaller_by_far(tmp_path: Path) -> None:
    """In the spread of a simulator that is ten times too noisy all that the recording does lies in the first bins."""
    quiet, loud = (DisparityNoise(sigma=0.05),), (DisparityNoise(sigma=0.5),)
    camera = preset("d435", 160, 120, rate=3.0)
    generate("office", None, camera, quiet, tmp_path / "run", frames=4, seed=2, streams=("depth",), threads=1)
    own, other = (load_evidence(tmp_path / "run", None, base)[0].cuts for base in (quiet, loud))
    assert np.median(other.spread / own.spread) == pytest.approx(1, abs=0.15)
    less = load_evidence(tmp_path / "run", None, (DisparityNoise(sigma=0.07),))[0].cuts
    assert np.median(less.spread / own.spread) == pytest.approx(1.4, abs=0.15)


def test_frames_are_measured_from_a_bias_that_is_small_and_whose_others_are_let_go(tmp_path: Path) -> None:
    """Registered frames that are measured behind a bias are compared with the frames as they were, from there, too."""
    base, scale = (DisparityNoise(sigma=0.05),), BaselineScale(scale=1.0005)
    camera = preset("d435", 160, 120, rate=3.0)
    generate("office", None, camera, (*base, scale), tmp_path / "run", frames=12, seed=2, streams=("depth",), threads=1)
    evidence, _ = load_evidence(tmp_path / "run", None, base)
    evidence.forget(evidence.test)
    assert evidence.centred((*base, scale)) is None
    moved = evidence.centred((*base, scale), however_small=True)
    assert moved is not None and set(moved.real) == set(evidence.test) < set(range(len(evidence.blocks)))
    assert all(frame.expected is not None for frame in moved.frames.values())


@pytest.mark.parametrize("count", [2, 3, 7, 10, 40, 41, 300, 10_000])
@pytest.mark.parametrize("width", [100, 424, 1280, 16_384])
def test_blocks_are_disjoint_and_span_the_run(count: int, width: int) -> None:
    blocks = select_frames(count, width, DepthData())
    frames = np.concatenate(blocks)
    assert len(blocks) >= 2
    assert len(np.unique(frames)) == len(frames) <= 45
    assert frames.min() == 0 and frames.max() == count - 1


@given(st.integers(2, 400), st.integers(2, 3))
def test_blocks_are_dealt_evenly(count: int, parts: int) -> None:
    dealt = deal_blocks(count, parts)
    assert sorted(np.concatenate(dealt).tolist()) == list(range(count))
    for begin in range(0, count - parts + 1, parts):
        assert all(sum(begin <= block < begin + parts for block in part) == 1 for part in dealt)


@pytest.mark.parametrize("period", range(2, 7))
def test_what_repeats_itself_is_dealt_to_all_parts(period: int) -> None:
    for part in deal_blocks(120, 3):
        assert {block % period for block in part} == set(range(period))


@pytest.mark.parametrize("count", [2, 10, 35, 300, 10_000])
@pytest.mark.parametrize("size", [(212, 120), (424, 240), (640, 480), (848, 480), (1280, 720), (4096, 3072)])
def test_the_pixels_that_are_looked_at_keep_to_their_budget(count: int, size: tuple[int, int]) -> None:
    limit, (width, height) = DepthData(), size
    camera = Camera(width=width, height=height, fx=400, fy=400, cx=width / 2, cy=height / 2, baseline=0.05)
    blocks = select_frames(count, width, limit)
    dealt = deal_blocks(len(blocks), 3 if len(blocks) >= limit.least_blocks else 2)
    windows = select_rows(blocks, camera, dealt, limit)
    looked_at = sum(len(block) * window.height * width for block, window in zip(blocks, windows, strict=True))
    least = limit.least_rows * width * limit.least_frames
    whole = sum(map(len, blocks)) * width * height
    assert min(whole, 0.9 * limit.pixels) <= looked_at <= max(limit.pixels, least)
    assert len({window.height for window in windows}) == 1
    if whole <= limit.pixels:
        assert all(window is camera for window in windows)
    elif len(blocks) > 12:
        for part in dealt:  # each sees the picture from its first row to its last, evenly
            firsts = sorted(windows[block].rows[0] for block in part)
            assert np.ptp(np.diff(firsts)) <= 1 and firsts[0] == 0
            assert max(windows[block].rows[-1] for block in part) == height - 1
        for window in windows:
            beside = np.setdiff1d(np.arange(height), window.rows)
            far = np.abs(window.rows[:, None] - beside).min(axis=1) > MARGIN
            np.testing.assert_array_equal(inner_rows(window), far)


@given(st.integers(0, 1000), st.integers(1, 5))
def test_rows_that_are_counted_are_of_no_one_parity(index: int, stride: int) -> None:
    camera = preset("d435", 424, 240)
    rows = counted_rows(camera, index, stride)
    assert len(rows) == 240 // stride and (rows // stride == np.arange(len(rows))).all()
    assert stride == 1 or 0.2 < np.mean(rows % 2) < 0.8


def test_the_bank_is_the_registry() -> None:
    setting = Setting(("cement", "wood"), np.linspace(0.5, 5, 12), 3.0, load_materials())
    base = load_profile("paper").effects
    bank = set(effect_ids()) - {"threshold_filter"}  # whose holes are those of min_range and max_range
    # A pattern of a random shape is none of this recording's, nor is a border that it has not.
    assert {h.effect for h in candidates(base, setting)} == bank - {"fixed_pattern", "empty_border"}
    grid = ((0.1, 0.3), (0.0, -0.2))
    setting = replace(
        setting, border=(0, 38, 34, 0), learned={"fixed_pattern": [{"amplitude": 0.1, "size": 30.0, "grid": grid}] * 2}
    )
    found = candidates(base, setting)
    assert {h.effect for h in found} == bank
    learned, in_place = [h for h in found if h.effect == "fixed_pattern"]
    assert in_place == replace(learned, in_place=True) and not learned.in_place
    assert [free.label for free in learned.free] == ["amplitude"]
    assert learned.starts == ((0.1,),) and learned.fixed["grid"] == grid
    assert {h.effect for h in candidates(base, setting, ("fill_rate",))} == bank - {"fill_rate"}
    for candidate in found:
        for values in candidate.starts:
            effects = candidate.build(base, candidate.encode(values))
            assert candidate.effect in {e.id for e in effects}
            assert not {e.id for e in effects} & candidate.replaces


def test_a_spare_form_is_tried_in_place_of_another_only() -> None:
    setting = Setting(("cement", "wood"), np.linspace(0.5, 5, 12), 3.0, load_materials())
    light = [one for one in candidates((), setting) if one.effect == "ambient_light"]
    assert [(one.fixed["falloff"], one.in_place) for one in light] == [(0, False), (0, False), (1, True), (1, True)]
    assert all("falloff" not in {free.name for free in one.free} for one in light)


@pytest.mark.parametrize("profile", ["clean", "paper"])
def test_a_factor_begins_at_each_material_in_turn(profile: str) -> None:
    setting = Setting(("cement", "glass", "wood"), np.linspace(0.5, 5, 12), 3.0, load_materials())
    louder = [
        c for c in candidates(load_profile(profile).effects, setting)
        if c.effect == "material_noise" and {free.name for free in c.free} == {"gain"}
    ]  # fmt: skip
    assert louder and all(c.starts == ((0, 0, 0), (3, 0, 0), (0, 3, 0), (0, 0, 3)) for c in louder)


def test_whole_numbers_of_an_effect_that_there_is_begin_at_others_too() -> None:
    setting = Setting(("cement",), np.linspace(0.5, 5, 12), 3.0, load_materials())
    window = [one for one in candidates(load_profile("d435").effects, setting) if one.effect == "matching_window"]
    assert all([free.label for free in one.free] == ["radius", "step"] for one in window)
    assert [one.starts for one in window] == [((4, 4),), ((2, 4),), ((7, 4),)]


def test_of_an_effect_that_there_is_the_recording_shows_other_steps() -> None:
    seen = Setting(("cement",), np.linspace(0.5, 5, 12), 3.0, load_materials(), steps=(0.125, 0.0))

    def shown(base: Sequence[Effect]) -> list[Candidate]:
        return [one for one in candidates(base, seen) if one.effect == "disparity_quantization"][1:]

    nearest, down = shown((DisparityQuantization(),))
    assert (nearest.fixed["down"], down.fixed["down"]) == (0, 1)
    assert all(free.label == "step" and free.low == free.high == 0.125 for one in (nearest, down) for free in one.free)
    assert [one.fixed["down"] for one in shown((DisparityQuantization(step=0.125),))] == [1]


def test_an_effect_that_there_is_begins_without_it_too() -> None:
    """A band as wide as the disparity is there without its margin; one that has a logarithm alone never comes to 0."""
    setting = Setting(("cement",), np.linspace(0.5, 5, 12), 3.0, load_materials())
    there = candidates(load_profile("d435").effects, setting)
    wide, narrow = (one for one in there if one.effect == "invalid_band")
    assert (wide.fixed["slope"], narrow.fixed["slope"]) == (1, 0)
    for one in (narrow, *(one for one in there if one.effect in ("fill_rate", "disparity_noise"))):
        assert [one.build((), one.encode(start))[0].is_neutral for start in one.starts] == [False, False, False, True]


@given(st.floats(-1, 2))
def test_parameters_survive_their_encoding(share: float) -> None:
    setting = Setting(("cement",), np.linspace(0.5, 5, 12), 3.0, load_materials())
    for candidate in candidates(load_profile("clean").effects, setting):
        for free in candidate.free:
            low, high = free.low, min(free.high, 100.0)
            value = min(max(low + share * (high - low), low), high)
            value = round(value) if free.whole else value
            assert free.decode(free.encode(value)) == pytest.approx(value, rel=1e-6, abs=1e-9)
            nothing = 0.0 if free.vanishes else free.low
            assert not free.log or free.decode(free.encode(0.0)) == pytest.approx(nothing, rel=1e-6)


def test_the_jackknife_of_a_mean_is_the_t_interval() -> None:
    from scipy import stats

    values = np.random.default_rng(0).normal(3, 2, 9)
    mean, (low, high) = jackknife(lambda kept: values[kept].mean(), 9)
    expected = stats.t.interval(0.95, 8, values.mean(), stats.sem(values))
    assert (mean, low, high) == pytest.approx((values.mean(), *expected))


def test_diagnosis_json_has_the_keys_that_others_read() -> None:
    import json

    cut = Cut(axis="range", interval=(1, 2), unit="m", share_of_gap=0.5, what="bias")
    gap = Gap(measure="x", unit="bits", before=1, after=0.2, floor=0.1, closed_fraction=0.9, ci95=(0.8, 1))
    cause = Cause(effect="fill_rate", parameters={"rate": 0.1}, closed_fraction=0.9, ci95_closed=(0.8, 1))
    rest = Unexplained(fraction=0.1, where=(cut,), description="words")
    stored = json.loads(
        Diagnosis(verdict="explained", gap=gap, where=(cut,), causes=(cause,), unexplained=rest).to_json()
    )
    assert stored["version"] == 1
    assert set(stored["gap"]) == {"measure", "unit", "before", "after", "floor", "closed_fraction", "ci95"}
    assert {"axis", "interval", "unit", "share_of_gap", "what"} <= set(stored["where"][0])
    assert "label" not in stored["where"][0]
    assert {"effect", "parameters", "ci95", "closed_fraction", "ci95_closed", "indistinguishable_from"} <= set(
        stored["causes"][0]
    )
    assert {"fraction", "where", "description"} <= set(stored["unexplained"])


@settings(max_examples=25)
@given(st.floats(0.02, 0.6), st.floats(-0.5, 0.5), st.integers(0, 2**31))
def test_steps_are_seen_in_the_spectrum(step: float, origin: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    there = rng.uniform(4, 30, 40_000)
    noisy = there + rng.normal(0, 0.08, there.size)
    seen = (np.round(noisy / step - origin) + origin) * step
    found = _steps_of(seen, there, DepthData())
    assert found is not None
    assert abs(found[0] / step - 1) < 3e-4
    # 17 px lie between the middle of the disparities and 0, where the origin is reported.
    apart = found[1] - origin
    assert abs(apart - round(apart)) < 17 * 3e-4 / step + 0.03
    assert _steps_of(noisy, there, DepthData()) is None
