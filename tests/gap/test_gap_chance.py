"""What is chance in a diagnosis: whose random numbers it draws, and what it takes for a gap."""

from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from reports import LACKED, OTHERS, PAPER, found, recorded

from benchmarks.nulls import excesses
from depthsim.draws import Seed
from depthsim.gap import diagnose, investigate
from depthsim.gap.config import DepthSignificance
from depthsim.gap.depth.data.axis import Axis
from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.frames import CleanFrame
from depthsim.gap.depth.data.histograms import BINS, ERROR
from depthsim.gap.depth.data.simulate import Replay
from depthsim.gap.depth.fit.validate import Validator, excess
from depthsim.materials import load_materials
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import Effect, Sensor, load_profile
from depthsim.sensor.effect import effect_class, effect_ids
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import acting
from depthsim.trajectory import load_trajectory

TWO = "effects: [material_noise, {fill_rate: {rate: 0.06}}, {incidence_noise: {sigma: 0.05}}]"
LIMIT = DepthSignificance()
WITHOUT = tuple(name for name in (*OTHERS, "disparity_noise", "vignetting_noise") if name != "fill_rate")


@cache
def evidence(profile: str, frames: int) -> Evidence:
    """Of a few small frames in the office, against a shipped profile."""
    folder = Path(recorded(PAPER)).parent / f"clean_{frames}"
    scene, camera = load_scene("office"), preset("d435", 80, 46).model_copy(update={"rate": 2.0})
    if not folder.exists():
        path = load_trajectory("tour", scene, camera.rate, frames)
        generate(scene, path, camera, load_profile("clean"), folder, streams=("depth",), threads=1)
    return Evidence(Run.open(folder), scene, load_materials(), load_profile(profile).effects, 1)


@pytest.mark.parametrize("name", ["clean", "paper", "d435"])
def test_a_replay_is_what_the_sensor_measures(name: str) -> None:
    looked, effects, seed = evidence(name, 4), load_profile(name).effects, Seed("test", 3)
    motion = Motion.along(looked.run.trajectory)
    sensor = Sensor(Caster(looked.scene), looked.camera, effects, looked.materials)
    replay = Replay(sensor.caster, looked.materials, motion)
    for frame in looked.frames.values():
        keys = {"index": frame.index, "stamp": frame.stamp, "seed": seed, "motion": motion, "threads": 1}
        measured = sensor.measure(frame.pose, **keys)
        assert (replay.measure(acting(effects), frame, seed) == measured.depth_raw).all()


@pytest.mark.parametrize("seed", [0, 1, 7, 8, 31, 1000])
def test_no_recording_has_the_random_numbers_of_the_diagnosis(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    run, drawn = Run.open(recorded(PAPER, seed)), []
    measure = Replay.measure

    def watched(self: Replay, effects: list[Effect], frame: CleanFrame, number: Seed) -> NDArray[np.uint16]:
        picture = measure(self, effects, frame, number)
        drawn.append((picture == run.depth_raw(frame.index)).mean())
        return picture

    monkeypatch.setattr(Replay, "measure", watched)
    assert investigate(run, sensor="paper", without=OTHERS, threads=1).diagnosis.verdict == "no_gap"
    looked = Evidence(run, load_scene("office"), load_materials(), load_profile("paper").effects, 1)
    looked.simulate(looked.base, looked.train)
    looked.total(looked.base, looked.train)
    assert len(drawn) > 40 and max(drawn) < 0.6


def test_sensors_side_by_side_are_counted_as_one_after_the_other() -> None:
    given = Evidence(
        Run.open(recorded(PAPER)), load_scene("office"), load_materials(), load_profile("paper").effects, 3
    )
    sensors = [(*given.base, effect_class("baseline_scale")(scale=1 + k / 100)) for k in range(7)]
    sensors += [(*given.base, effect_class("temporal_filter")(alpha=k / 10)) for k in (3, 5)]
    together = list(given.side_by_side(lambda effects: given.total(effects, given.train), sensors))
    judged = list(given.side_by_side(lambda effects: given.simulate(effects, given.test, Seed("test")), sensors))
    given._totals.clear()
    for effects, total, simulated in zip(sensors, together, judged, strict=True):
        assert np.array_equal(total, given.total(effects, given.train))
        assert np.array_equal(simulated, given.simulate(effects, given.test, Seed("test")))
        assert np.array_equal(total, given.simulate(effects, given.train).sum(axis=0))
    one = Evidence(given.run, given.scene, given.materials, given.base, 1)
    assert all(map(np.array_equal, one.side_by_side(lambda effects: one.total(effects, one.train), sensors), together))
    with pytest.raises(ZeroDivisionError):  # and not on what another thread was waiting for
        list(given.side_by_side(lambda k: 1 // k, [2, 1, 0, 3]))
    assert list(given.side_by_side(lambda k: given.each(lambda n: n * k, range(4)), range(4)))[3] == [0, 3, 6, 9]


def test_a_fit_is_as_sure_of_a_run_made_with_seed_1_as_of_any(tmp_path: Path) -> None:
    (tmp_path / "truth.yaml").write_text(LACKED)
    scene, camera = load_scene("office"), preset("d435", 80, 46).model_copy(update={"rate": 2.0})
    path, profile = load_trajectory("tour", scene, camera.rate, 16), load_profile(tmp_path / "truth.yaml")
    generate(scene, path, camera, profile, tmp_path / "run", streams=("depth",), seed=1, threads=1)
    without = tuple(name for name in effect_ids() if name != "incidence_noise")
    (cause,) = diagnose(tmp_path / "run", sensor="paper", without=without, threads=1).causes
    low, high = cause.ci95["sigma"]
    assert high - low > 0.0003 and abs((low + high) / 2 - 0.05) < 0.05 * 0.05


def test_causes_close_together_what_the_diagnosis_closes() -> None:
    d = found(TWO, WITHOUT).diagnosis
    assert {cause.effect for cause in d.causes} == {"fill_rate", "incidence_noise"}
    assert sum(cause.closed_fraction for cause in d.causes) == pytest.approx(d.gap.closed_fraction, abs=1e-9)
    assert d.gap.closed_fraction == pytest.approx((d.gap.before - d.gap.after) / (d.gap.before - d.gap.floor), abs=1e-9)


def test_one_cause_closes_what_the_diagnosis_closes() -> None:
    d = found(LACKED).diagnosis
    (cause,) = d.causes
    assert cause.closed_fraction == pytest.approx(d.gap.closed_fraction, abs=1e-9)
    assert cause.ci95_closed == pytest.approx(d.gap.ci95, abs=1e-9)


def _axes(*sizes: int) -> Ruler:
    return Ruler.of([Axis("range", ERROR, size, lambda *_: np.zeros(1, int), str) for size in sizes])


def test_views_without_pixels_do_not_count_and_those_without_chance_do() -> None:
    ruler, bins = _axes(1, 1, 1), int(BINS[ERROR])
    a, b = np.zeros((2, 3 * bins))
    a[0], b[1] = 10, 10  # the first view at odds, the second the same, the third without a pixel
    a[bins], b[bins] = 10, 10
    assert ruler.by_axis(a, b).tolist() == [1, 0, 0]
    assert ruler.gap(a, b) == pytest.approx(0.5)
    assert ruler.over_axes(np.array([[1.0, 0, 0], [0.5, 0.25, 7]]), a) == pytest.approx([0.5, 0.375])
    assert ruler.gap(0 * a, 0 * b) == 0


def test_what_has_no_chance_in_it_is_at_its_floor_or_far_above() -> None:
    ruler, counts = _axes(1, 1), np.full(2 * int(BINS[ERROR]), 100)
    nothing = np.zeros((LIMIT.runs, 2))
    same, by_axis = excess(ruler, np.zeros(2), nothing, counts, LIMIT)
    assert same == pytest.approx(0, abs=1e-9) and by_axis == pytest.approx(0, abs=1e-9)
    other, by_axis = excess(ruler, np.array([0.01, 0]), nothing, counts, LIMIT)
    assert other > LIMIT.excess and by_axis[0] > LIMIT.excess_along_axis and by_axis[1] < 1


@pytest.mark.parametrize(("profile", "frames"), [("paper", 4), ("d435", 4), ("d435", 8), ("d415", 20)])
def test_two_runs_of_one_sensor_are_hardly_ever_a_gap(profile: str, frames: int) -> None:
    looked = evidence(profile, frames)
    scored = excesses(Validator(looked, looked.test), 24, 4)
    assert (scored > [LIMIT.excess, LIMIT.excess_along_axis]).any(axis=1).mean() < 0.01
    assert np.abs(np.median(scored[:, 0])) < 1


@pytest.mark.parametrize(
    ("effect", "value"),
    [
        ("disparity_offset", {"offset": 0.002}),
        ("incidence_noise", {"sigma": 0.003, "gain": 0.0}),
        ("stereo_shadow", {"share": 0.8}),
        ("fill_rate", {"rate": 0.017}),
    ],
)
def test_weak_effects_stand_out(effect: str, value: dict[str, float]) -> None:
    looked = evidence("paper", 8)
    validator = Validator(looked, looked.test)
    base = [e for e in looked.base if e.id != effect]
    validator.real = looked.simulate((*base, effect_class(effect)(**value)), looked.test, Seed("test"))
    score = validator.score(looked.base)
    assert score.excess > LIMIT.excess or score.excess_by_axis.max() > LIMIT.excess_along_axis
    assert all(np.any(a != b) for a, b in combinations(validator.runs(looked.base, LIMIT.runs), 2))
