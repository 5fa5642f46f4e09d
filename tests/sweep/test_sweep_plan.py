"""From SWEEP.yaml to a plan: every run known, every draw its own, every fault reported in one line."""

import itertools
from pathlib import Path

import pytest
from sweeps import SWEEP, write_sweep

from depthsim.errors import InputError
from depthsim.sweep.draw import Distribution, uniform
from depthsim.sweep.plan import Plan, refuse_changed
from depthsim.sweep.resolve import resolve_sweep
from depthsim.sweep.vary import values_in_use


def planned(folder: Path, text: str = SWEEP) -> Plan:
    return resolve_sweep(write_sweep(folder, text))


def test_every_combination_is_one_run(tmp_path: Path) -> None:
    plan = planned(tmp_path)
    runs = [plan.run(index) for index in range(len(plan))]
    assert len(plan) == 16
    assert len({(run.scene, run.trajectory, run.profile, run.seed, run.draw) for run in runs}) == 16
    assert [run.scene for run in runs] == sorted(run.scene for run in runs)
    assert len({run.path for run in runs}) == 16
    with pytest.raises(IndexError):
        plan.run(16)


def test_a_draw_is_the_same_world_for_every_profile_and_another_for_the_rest(tmp_path: Path) -> None:
    plan = planned(tmp_path)
    worlds: dict[tuple[int, int, int], set[str]] = {}
    for run in map(plan.run, range(len(plan))):
        worlds.setdefault((run.scene, run.seed, run.draw), set()).add(f"{run.noise_seed} {run.values}")
    assert all(len(values) == 1 for values in worlds.values())
    assert len({next(iter(values)) for values in worlds.values()}) == 8


def test_draws_stay_when_the_sweep_grows(tmp_path: Path) -> None:
    small, large = planned(tmp_path / "a"), planned(tmp_path / "b", SWEEP.replace("seeds: 2", "seeds: [5, 1]"))
    kept = {(r.scene, r.draw): r.values for r in map(small.run, range(16)) if r.seed == 1}
    again = {(r.scene, r.draw): r.values for r in map(large.run, range(16)) if r.seed == 1}
    assert kept == again


def test_uniform_numbers_are_uniform() -> None:
    shares = [uniform(0, "scene", index, "path") for index in range(20_000)]
    counts = [sum(k / 10 <= share < (k + 1) / 10 for share in shares) for k in range(10)]
    chi_square = sum((count - 2000) ** 2 / 2000 for count in counts)
    assert chi_square < 33.7, "9 degrees of freedom: beyond this once in 10,000"
    pairs = list(itertools.pairwise(shares))
    correlation = sum((a - 0.5) * (b - 0.5) for a, b in pairs) / len(pairs) * 12
    assert abs(correlation) < 4 / len(pairs) ** 0.5


@pytest.mark.parametrize(
    ("keys", "low", "high"),
    [({"range": [2, 4]}, 2, 4), ({"log_range": [0.01, 10]}, 0.01, 10), ({"choice": [3, 5, 7]}, 3, 7)],
)
def test_distributions_reach_from_end_to_end(keys: dict[str, list[float]], low: float, high: float) -> None:
    drawn = Distribution.model_validate(keys)
    values = [drawn.value(share) for share in (0.0, 0.25, 0.5, 0.75, 1 - 2**-53)]
    assert values == sorted(values)
    assert values[0] == low
    assert values[-1] == pytest.approx(high)
    middle = {"range": 3, "log_range": pytest.approx(0.1**0.5), "choice": 5}[next(iter(keys))]
    assert values[2] == middle


def test_the_plan_survives_json(tmp_path: Path) -> None:
    plan = planned(tmp_path)
    again = Plan.from_json(plan.to_json(), "plan.json")
    assert again == plan
    assert again.digest == plan.digest
    assert [again.run(i) for i in range(16)] == [plan.run(i) for i in range(16)]
    with pytest.raises(InputError, match="is no plan of a sweep"):
        Plan.from_json(plan.to_json()[:-100], "plan.json")


def test_values_that_change_nothing_are_not_reported(tmp_path: Path) -> None:
    plan = planned(tmp_path)
    paper, d435 = (values_in_use(plan, plan.run(index)) for index in (0, 4))
    assert "effects.disparity_noise.sigma" not in paper
    assert set(d435) - set(paper) == {"effects.disparity_noise.sigma"}


def test_recorded_poses_lights_and_active_stereo_are_planned(tmp_path: Path) -> None:
    text = """
scenes: ["*.obj"]
trajectories: [{shape: hover, position: [0, 0, 1], look_at: [1, 0, 1], duration: 1}, poses.txt]
profiles: [active_stereo, sun.yaml]
random:
  light: {azimuth: {range: [-180, 180]}, elevation: {range: [5, 80]}, sun: {range: [0, 900]}}
  stereo: {projector: {power: {range: [0.02, 0.1]}}}
"""
    file = write_sweep(tmp_path, text)
    (tmp_path / "poses.txt").write_text("0 0 0 1 0 0 0 1\n0.5 0 0 1.1 0 0 0 1\n")
    (tmp_path / "sun.yaml").write_text("effects: [ambient_light]\n")
    plan = resolve_sweep(file)
    assert len(plan) == 8
    assert [scene.name for scene in plan.scenes] == ["hall.obj", "room.obj"]
    from depthsim.sweep.vary import planned_frames, varied_profile

    assert [planned_frames(plan, plan.run(index)) for index in (0, 2)] == [31, 16]
    run = plan.run(0)
    stereo = varied_profile(plan.profiles[0], run.values).stereo
    sun = varied_profile(plan.profiles[1], run.values).effects[0]
    assert stereo is not None
    assert stereo.light.sun == run.values["light.sun"]
    assert stereo.projector.power == run.values["stereo.projector.power"]
    assert sun.azimuth == run.values["light.azimuth"]  # type: ignore[attr-defined]
    assert stereo.light.sun_direction == pytest.approx(tuple(map(float, sun.sun)), abs=1e-6)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ("scenes: [room.obj, hall.obj]", "scenes: []", "scenes: tuple should have at least 1 item"),
        ("scenes: [room.obj, hall.obj]", "scenes: [room.obj, room.obj]", "scenes: names room.obj twice"),
        ("scenes: [room.obj, hall.obj]", "scenes: [../room.obj]", "leaves the folder of this file"),
        ("scenes: [room.obj, hall.obj]", "scenes: [/etc/passwd]", "leaves the folder of this file"),
        ("scenes: [room.obj, hall.obj]", "scenes: ['../*.obj']", "leaves the folder of this file"),
        ("scenes: [room.obj, hall.obj]", "scenes: ['*.glb']", "no file matches"),
        ("scenes: [room.obj, hall.obj]", "scenes: [barn.obj]", "no such scene"),
        ("profiles: [paper, d435]", "profiles: [paper, paper]", "names one of its entries twice"),
        ("profiles: [paper, d435]", "profiles: [../paper.yaml]", "leaves the folder of this file"),
        ("seeds: 2", "seeds: 0", "seeds is below 1"),
        ("seeds: 2", "seeds: 100000000000", "seeds is over 1,000,000"),
        ("seeds: 2", "seed: 2\nseeds: !!python/object:os.system {}", "is not YAML"),
        ("draws: 2", "draws: 0", "draws: input should be greater than or equal to 1"),
        ("frames: 3", "frames: 3\nspeed: 4", "speed: extra inputs are not permitted"),
        ("frames: 3", "frames: 3\nstreams: [clean]", "streams lack depth"),
        ("frames: 3", "frames: 3\nstreams: [depth, ir_left]", "is a sensor without infrared images"),
        ("{range: [0.5, 2.0]}", "{range: [2.0, 0.5]}", "the range begins at 2, above its end 0.5"),
        ("{range: [0.5, 2.0]}", "{range: [-1, 2]}", "random.trajectory.speed: -1.0: input should be greater than 0"),
        ("speed: {range", "pace: {range", "random.trajectory.pace: no run of this sweep has that value"),
        ("[formboard, plastic]", "[formboard, marzipan]", "'marzipan': is no material tag"),
        ("{plastic: [formboard", "{glass: [formboard", "random.materials.glass: no run of this sweep has that value"),
        ("{cement: {m:", "{cement: {k:", "there is no 'k'"),
        ("sigma:", "omega:", "there is no 'omega'"),
        ("disparity_noise:", "disparity_nose:", "there is no 'disparity_nose'"),
        ("disparity_noise: {sigma", "fill_rate: {sigma", "there is no 'sigma'"),
        ("disparity_noise: {sigma", "max_range: {depth", "no run of this sweep has that value"),
        ("log_range: [0.02", "log_range: [0", "a log_range begins above 0"),
        ('"circle:center=0/0/1.2,radius=0.5,speed=1,heading=outward"', "tour", "'tour' is no trajectory of scene room"),
    ],
)
def test_a_bad_sweep_is_one_line(tmp_path: Path, old: str, new: str, reported: str) -> None:
    assert old in SWEEP
    with pytest.raises(InputError) as caught:
        planned(tmp_path, SWEEP.replace(old, new))
    assert reported in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ("draws: 2", "draws: 3", "draws is 2 in this target, but 3 is asked for"),
        ("[room.obj, hall.obj]", "[room.obj]", 'scenes is ["room.obj", "hall.obj"] in this target'),
        ("frames: 3", "frames: 3\nrate: 15", "profile paper: its camera differs"),
        ("radius=0.5", "radius=0.7", "scene room.obj: its trajectories differs"),
    ],
)
def test_another_sweep_is_refused_with_the_reason(tmp_path: Path, old: str, new: str, reported: str) -> None:
    with pytest.raises(InputError) as caught:
        refuse_changed(planned(tmp_path / "a"), planned(tmp_path / "b", SWEEP.replace(old, new)), "out")
    assert reported in str(caught.value)


def test_a_comment_is_no_change(tmp_path: Path) -> None:
    refuse_changed(planned(tmp_path / "a"), planned(tmp_path / "b", SWEEP + "# more\n"), "out")
