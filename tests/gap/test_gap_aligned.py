"""Recordings whose depth was resampled into the colour camera: those that say so, and those that do not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from commands import depthsim_here
from sensing import STEP_CASTER

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.doubling import find_doubling, line_of
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.frames import cast_clean
from depthsim.gap.depth.data.load import load_evidence, notes_of
from depthsim.gap.depth.fit.agreement import disagreement
from depthsim.gap.depth.fit.alignment import select_aligned
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.candidates import candidates, setting_of
from depthsim.gap.depth.fit.intervals import parameter_intervals
from depthsim.gap.depth.fit.marks import makes_doubling
from depthsim.gap.depth.fit.optimize import Model, best_neighbour
from depthsim.gap.depth.fit.pattern import learn, learn_beside
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.validate import Validator
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.png import decode_png, encode_png
from depthsim.scenefile import load_scene
from depthsim.sensor import Effect, Sensor
from depthsim.sensor.effects.align import AlignToColor
from depthsim.sensor.effects.fill_rate import FillRate
from depthsim.sensor.effects.fixed_pattern import FixedPattern, picture
from depthsim.sensor.effects.noise import DisparityNoise
from depthsim.sensor.effects.shadow import StereoShadow
from depthsim.sensor.pipeline import camera_for
from depthsim.trajectory import load_trajectory

BASE = (DisparityNoise(sigma=0.06), FillRate(rate=0.01))
ZOOM = 1.5342
"""Of a D435 at 640x480 and other pictures of 4:3."""


@pytest.fixture(scope="module")
def aligned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the office, aligned."""
    folder = tmp_path_factory.mktemp("aligned") / "run"
    camera = preset("d435", 160, 120, rate=3.0)
    generate("office", None, camera, [*BASE, AlignToColor()], folder, frames=10, seed=5, streams=("depth",), threads=1)
    return folder


SAID = ("color", "aligned", "depth")


def unsaid(aligned: Path, base: tuple[Effect, ...], less: tuple[str, ...] = SAID) -> Evidence:
    """The run without what says that it is aligned. less: keys of its camera.yaml."""
    file = aligned / "camera.yaml"
    text = file.read_text()
    keys = yaml.safe_load(text)
    try:
        file.write_text(yaml.safe_dump({k: v for k, v in keys.items() if k not in less}))
        return load_evidence(aligned, None, base)[0]
    finally:
        file.write_text(text)


def geometry_looked_at(evidence: Evidence, validator: Validator, bank: list[Candidate]) -> Evidence:
    """The frames in the alignment's own geometry, in which nothing is found."""
    looked_at: list[Evidence] = []

    def nothing(own: Evidence) -> Selection:
        looked_at.append(own)
        return Selection(Model((), np.empty(0)), {}, (), ())

    select_aligned(evidence, validator, bank, nothing, lambda _: None)
    return looked_at[0]


def test_one_that_says_so_has_no_gap(aligned: Path) -> None:
    evidence, _ = load_evidence(aligned, None, BASE)
    assert evidence.camera.aligned
    score = Validator(evidence, evidence.test).score(BASE)
    assert not score.stands_out(evidence.config.significance)
    assert score.gap < 1.3 * score.floor


def test_of_large_pictures_some_rows_are_counted(aligned: Path) -> None:
    """A camera of some rows of an aligned picture is no camera: its colour camera has all of them."""
    few = DepthConfig()
    few = few.model_copy(update={"data": few.data.model_copy(update={"pixels_of_frame": 5_000})})
    evidence, _ = load_evidence(aligned, None, BASE, config=few)
    assert evidence.counted_of_frame < 160 * 120 / 2
    assert not Validator(evidence, evidence.test).score(BASE).stands_out(few.significance)


def test_one_that_does_not_has_its_alignment_among_the_candidates(aligned: Path) -> None:
    # Nothing in the file says what the left imager's focal length is: its noise in pixels is this much smaller.
    base = (DisparityNoise(sigma=0.06 * ZOOM), BASE[1])
    evidence = unsaid(aligned, base)
    bank = [one for one in candidates(base, setting_of(evidence)) if one.effect == AlignToColor.id]
    assert {free.name for one in bank for free in one.free} == {"x", "zoom"}
    validator = Validator(evidence, evidence.test)
    before, after = (validator.score(effects) for effects in (base, (*BASE, AlignToColor(x=-0.015, zoom=ZOOM))))
    assert before.stands_out(evidence.config.significance)
    assert before.gap - after.gap > 0.97 * (before.gap - after.floor)


def test_a_fit_leaves_the_minimum_beside_the_true_one(aligned: Path) -> None:
    """At 1.565 the picture is a pixel wider at its border than at 1.534, and nearly the same pixels are doubled."""
    evidence = unsaid(aligned, BASE)
    bank = next(one for one in candidates(BASE, setting_of(evidence)) if one.effect == AlignToColor.id)
    ruler, blocks = Ruler.of(evidence.axes), evidence.train
    target = ruler.roots(evidence.real_counts(blocks).sum(axis=0))
    begun = {"x": -0.015, "zoom": 1.565}
    beside = Model((bank,), bank.encode([begun[free.name] for free in bank.free]))
    found = best_neighbour(beside, BASE, target, lambda effects: ruler.roots(evidence.total(effects, blocks)))
    assert found.parameters(0)["zoom"] == pytest.approx(ZOOM, abs=0.004)
    # From there no slope is known; with one of nothing the interval is what the blocks do not distinguish.
    flat = Model(found.parts, found.x, found.loss, np.zeros((len(target), len(found.x))))
    (interval,) = parameter_intervals(evidence, ruler, BASE, flat)
    assert interval["x"][0] <= -0.015 <= interval["x"][1]
    assert interval["zoom"][0] <= ZOOM <= interval["zoom"][1]


@pytest.mark.parametrize(("zoom", "roll"), [(ZOOM, 0.0), (1.2, -1.5), (2.4, 2.0)])
def test_doubled_rows_show_zoom_and_roll(zoom: float, roll: float) -> None:
    effects = (*BASE, AlignToColor(zoom=zoom, roll=roll))
    camera = preset("d435", 320, 240).model_copy(update={"color": None})
    scene = load_scene("office")
    path = load_trajectory(None, scene, camera.rate).matrices()
    sensor = Sensor(Caster(scene), camera_for(camera, effects), effects)
    pictures = [sensor.measure(path[k], index=k).depth_raw.copy() for k in (0, 100, 200, 300)]
    assert find_doubling(pictures, DepthConfig().data) == pytest.approx((zoom, roll), rel=0.01, abs=0.1)
    plain = Sensor(Caster(scene), camera, BASE)
    assert find_doubling([plain.measure(path[k], index=k).depth_raw for k in (0, 100)], DepthConfig().data) is None


def test_fits_of_an_alignment_begin_where_doubled_rows_say(aligned: Path) -> None:
    evidence = unsaid(aligned, BASE)
    setting = replace(setting_of(evidence), doubled=(1.58, -1.2))
    one, other = (one for one in candidates(BASE, setting) if one.effect == AlignToColor.id)
    assert (one.fixed["overlap"], other.fixed["overlap"]) == (1, 0)
    assert one.fixed["roll"] == -1.2 and one.starts[0] == (-0.015, 1.58)
    (zoom,) = (free for free in one.free if free.name == "zoom")  # a fit that follows slopes went from 1.58 to 1.72
    assert (zoom.low, zoom.high) == pytest.approx((1.58, 1.58), rel=0.006) and zoom.low < 1.58 < zoom.high


def test_a_resampling_has_lines_of_doubled_rows_and_noise_has_none() -> None:
    noise = np.random.default_rng(0).integers(400, 500, (300, 300)).astype(np.uint16)
    doubled = noise[(np.arange(300) / 1.6).astype(int)]
    assert find_doubling([doubled], DepthConfig().data) == pytest.approx((1.6, 0), rel=0.01, abs=0.1)
    assert line_of([doubled], (1.6, 0.0)) > 0.4
    assert line_of([doubled], (1.4, 0.0)) < 0.1 and line_of([noise], (1.6, 0.0)) < 0.02


def test_steps_without_noise_make_lines_too() -> None:
    """Of a tilted plane: so they are evidence only where a simulator of the same steps has none."""
    v, u = np.mgrid[:300, :300]
    steps = np.floor(400 + 0.37 * v + 0.01 * u).astype(np.uint16)
    found = find_doubling([steps], DepthConfig().data)
    assert found is not None and line_of([steps], found) > 0.4


def test_doubled_rows_that_only_an_alignment_makes_name_it(aligned: Path) -> None:
    base = (DisparityNoise(sigma=0.06 * ZOOM), BASE[1])
    evidence = unsaid(aligned, base)
    assert evidence.doubled == pytest.approx((ZOOM, 0), rel=0.005, abs=0.1)
    validator = Validator(evidence, evidence.held_out)
    after, elsewhere = (*BASE, AlignToColor(zoom=ZOOM)), (*BASE, AlignToColor(zoom=1.7))
    assert makes_doubling(validator, AlignToColor, base, after)
    assert disagreement(validator, AlignToColor, base, after, alone=True) is None
    assert not makes_doubling(validator, AlignToColor, base, elsewhere)
    assert not makes_doubling(validator, AlignToColor, after, after)  # where there are lines without it
    assert not makes_doubling(validator, DisparityNoise, base, after)


@pytest.mark.parametrize("less", [SAID, ("aligned", "depth")])
def test_causes_beside_an_alignment_are_looked_for_in_its_own_geometry(aligned: Path, less: tuple[str, ...]) -> None:
    evidence, said = unsaid(aligned, BASE, less), []
    validator = Validator(evidence, evidence.held_out)
    bank = candidates(BASE, setting_of(evidence))
    (noise,) = (one for one in bank if one.effect == DisparityNoise.id)

    def find(own: Evidence) -> Selection:
        said.append(own.camera)
        return Selection(Model((noise,), noise.encode((0.1,))), {}, (), ())

    found = select_aligned(evidence, validator, bank, find, lambda _: None)
    assert found is not None and said[0].aligned and said[0].fx / said[0].left.fx == pytest.approx(ZOOM, rel=0.006)
    effects = found.model.build(BASE)
    assert any(isinstance(effect, AlignToColor) for effect in effects)
    (sigma,) = (effect.sigma for effect in effects if isinstance(effect, DisparityNoise))
    assert sigma == pytest.approx(0.06, rel=0.15)  # fitted anew with the alignment, or not named


def test_an_alignment_is_not_taken_that_is_known_or_shown_by_nothing(aligned: Path) -> None:
    base = (*BASE, AlignToColor(zoom=ZOOM))
    evidence = unsaid(aligned, BASE)
    validator, bank = Validator(evidence, evidence.held_out), candidates(BASE, setting_of(evidence))

    def find(_: Evidence) -> Selection:
        raise AssertionError

    rest = [one for one in bank if one.effect != AlignToColor.id]
    assert select_aligned(evidence, validator, rest, find, lambda _: None) is None
    known = unsaid(aligned, base)
    assert select_aligned(known, Validator(known, known.held_out), bank, find, lambda _: None) is None
    said, _ = load_evidence(aligned, None, BASE)
    assert said.doubled is None
    assert select_aligned(said, Validator(said, said.held_out), bank, find, lambda _: None) is None


def test_pixels_that_were_looked_up_are_those_of_an_alignment_without_overlap(tmp_path: Path) -> None:
    """Where the nearest of several wins, as in the driver's, noise brings all of the picture nearer."""
    camera = preset("d435", 160, 120, rate=3.0)
    generate("office", None, camera, BASE, tmp_path / "run", frames=10, seed=5, streams=("depth",), threads=1)
    for file in sorted((tmp_path / "run" / "depth").glob("*.png")):
        u, v = (((np.arange(n) - (n - 1) / 2) / ZOOM + (n - 1) / 2).round().astype(int) for n in (160, 120))
        file.write_bytes(encode_png(np.ascontiguousarray(decode_png(file.read_bytes())[np.ix_(v, u)])))
    keys = yaml.safe_load((tmp_path / "run" / "camera.yaml").read_text())
    zoomed = {"fx": keys["fx"] * ZOOM, "fy": keys["fy"] * ZOOM, "cx": 79.5 + (keys["cx"] - 79.5) * ZOOM}
    zoomed["cy"] = 59.5 + (keys["cy"] - 59.5) * ZOOM
    kept = {key: value for key, value in keys.items() if key not in SAID}
    (tmp_path / "run" / "camera.yaml").write_text(yaml.safe_dump(kept | zoomed))
    evidence, _ = load_evidence(tmp_path / "run", None, BASE)
    validator = Validator(evidence, evidence.held_out)
    assert evidence.doubled is not None
    bank = candidates(BASE, setting_of(evidence))
    own = geometry_looked_at(evidence, validator, bank)
    assert own.camera.aligned
    assert [effect.overlap for effect in own.base if isinstance(effect, AlignToColor)] == [0.0]

    def find(_: Evidence) -> Selection:
        raise AssertionError

    of_the_driver = [one for one in bank if one.effect != AlignToColor.id or one.fixed["overlap"] == 1]
    assert select_aligned(evidence, validator, of_the_driver, find, lambda _: None) is None


def test_a_colour_camera_is_not_put_where_its_holes_are_a_stereo_shadow(tmp_path: Path) -> None:
    """By itself the alignment is nearer with the colour camera at the other side, 59 mm to the right."""
    camera = preset("d435", 160, 120, rate=3.0)
    effects = *BASE, StereoShadow(share=0.95, left=1.0, right=0.1), AlignToColor(overlap=0.0)
    generate("office", None, camera, effects, tmp_path / "run", frames=10, seed=5, streams=("depth",), threads=1)
    evidence = unsaid(tmp_path / "run", BASE)
    validator, bank = Validator(evidence, evidence.held_out), candidates(BASE, setting_of(evidence))
    by_itself = [
        validator.quick((*BASE, AlignToColor(x=x, zoom=evidence.doubled[0], overlap=0.0))) if evidence.doubled else 0.0
        for x in (-0.015, 0.059)
    ]
    assert by_itself[1] < by_itself[0]
    without_overlap = [one for one in bank if one.effect != AlignToColor.id or one.fixed["overlap"] == 0]
    color = geometry_looked_at(evidence, validator, without_overlap).camera.color
    assert color is not None and color.translation[0] == pytest.approx(-0.015)


def test_a_camera_with_its_colour_cameras_intrinsics_is_noted(aligned: Path) -> None:
    evidence = unsaid(aligned, BASE, ("aligned", "depth"))
    assert evidence.camera.is_aligned_unsaid and any("`aligned: true`" in note for note in notes_of(evidence))
    bank = [one for one in candidates(BASE, setting_of(evidence)) if one.effect == AlignToColor.id]
    assert {free.name for one in bank for free in one.free} == {"x", "zoom"}
    assert not preset("d435", 320, 240).is_aligned_unsaid


@pytest.mark.parametrize("name", ["d435", "d455", "d405"])
def test_both_imagers_must_see_what_an_aligned_camera_sees(name: str) -> None:
    camera = preset(name, 424, 240).aligned_to_color()
    sees = cast_clean(STEP_CASTER, camera, np.eye(4)).right_sees
    assert sees is not None
    hidden, plate = np.flatnonzero(sees[120] == 0), (STEP_CASTER.cast(camera, np.eye(4)).depth[120] < 1.5).nonzero()[0]
    left, both = camera.left_pose[0, 3], camera.left_pose[0, 3] + camera.baseline
    # f·x·(1/1 m - 1/2.5 m) columns beside the plate, by where each imager is.
    shadows = [camera.fx * x * (1 - 1 / 2.5) for x in (left, both)]
    assert (hidden < plate[0]).sum() == pytest.approx(max(*shadows, 0), abs=1.01)
    assert (hidden > plate[-1]).sum() == pytest.approx(max(*(-one for one in shadows), 0), abs=1.01)


def test_a_fixed_pattern_is_learned_where_the_left_imager_has_it(tmp_path: Path) -> None:
    grid = np.random.default_rng(2).normal(size=(7, 9))
    pattern = FixedPattern(amplitude=0.3, grid=tuple(map(tuple, grid.tolist())))
    camera = preset("d435", 160, 120, rate=3.0)
    effects = [DisparityNoise(sigma=0.02), pattern, AlignToColor()]
    generate("office", None, camera, effects, tmp_path / "run", frames=16, seed=1, streams=("depth",), threads=1)
    run = Run.open(tmp_path / "run")
    assert run.camera.aligned
    found = learn(run, Caster(load_scene(run.scene or "")))
    seen = (slice(40, 80), slice(45, 110))  # of the left imager's picture, by the colour camera
    true, learned = (picture(np.array(one), camera.shape)[seen] for one in (grid, found.grid))
    assert not found.is_none and np.corrcoef(true.ravel(), learned.ravel())[0, 1] > 0.8
    # Of one that does not say where its left imager is, the alignment that was found does.
    evidence = unsaid(run.path, effects[:1])
    fine = learn_beside(evidence, (*evidence.base, AlignToColor(zoom=ZOOM)), fine=True)
    assert fine is not None
    assert np.corrcoef(true.ravel(), picture(fine.grid, camera.shape)[seen].ravel())[0, 1] > 0.9


def test_the_left_imager_of_aligned_pictures_is_seen_in_their_rows(tmp_path: Path) -> None:
    """Whose camera says the colour camera's intrinsics alone, as the driver's camera_info does."""
    usual = preset("d435", 160, 120, rate=3.0)
    other = usual.model_copy(update={"fx": 0.9 * usual.fx, "fy": 0.9 * usual.fy})
    for name, camera in (("usual", usual), ("other", other)):
        run, effects = tmp_path / name, [*BASE, AlignToColor()]
        generate("office", None, camera, effects, run, frames=10, seed=5, streams=("depth",), threads=1)
        shown = load_evidence(run, None, BASE, threads=1)[0]
        assert not shown.run.left_by_rows and shown.camera.left.fx == pytest.approx(camera.fx)
        unsaid_left = unsaid(run, BASE, ("depth",))
        assert unsaid_left.camera.left.fx == pytest.approx(camera.fx, rel=0.005)
        assert unsaid_left.run.left_by_rows == (name == "other")
        assert any("left imager" in note and "depth:" in note for note in notes_of(unsaid_left)) == (name == "other")
    like = tmp_path / "like"
    file = tmp_path / "other" / "camera.yaml"
    file.write_text(yaml.safe_dump({k: v for k, v in yaml.safe_load(file.read_text()).items() if k != "depth"}))
    command = ["generate", "office", "--like", str(tmp_path / "other"), "--frames", "1", "--out", str(like)]
    result = depthsim_here(*command)
    assert result.returncode == 0 and "by the rows that were doubled" in result.stderr
    assert Run.open(like).camera.left.fx == pytest.approx(camera.fx, rel=0.005)
    as_usual = replace(unsaid_left.run, camera=unsaid_left.camera.model_copy(update={"depth": None}))
    blind = Evidence(as_usual, unsaid_left.scene, unsaid_left.materials, BASE, 1)
    left, whole = (Validator(one, one.held_out).score(one.base).above for one in (unsaid_left, blind))
    assert left < 0.3 * whole  # so small a picture shows the zoom to 0.3 %


def test_few_equal_pixels_in_lines_are_no_doubled_rows() -> None:
    """Such as those of ground that goes far away: one in a hundred is equal, more so in some rows."""
    rng = np.random.default_rng(0)
    noise, other = rng.integers(400, 500, (2, 8, 480, 640)).astype(np.uint16)
    doubled = noise[:, (np.arange(480) / 1.6).astype(int)]
    assert find_doubling(doubled, DepthConfig().data) == pytest.approx((1.6, 0), rel=0.01, abs=0.1)
    some = np.where(rng.random(noise.shape) < 0.3, doubled, other)
    assert line_of(some, (1.6, 0)) > 0.02
    assert find_doubling(some, DepthConfig().data) is None
