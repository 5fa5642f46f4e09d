"""The generator of the withheld benchmark: its effects are there, alone, and made without depthsim's own."""

import ast
import itertools
import json
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from benchmarks.withheld_data import formulas
from benchmarks.withheld_data.axes import RIGHT_AXES
from benchmarks.withheld_data.case import Wanted, draw_case, write_case
from benchmarks.withheld_data.film import Base, Film, Formula
from benchmarks.withheld_data.route import draw_route
from benchmarks.withheld_data.strength import RANGES, STRENGTHS, Gauge, correlation, wanted_range
from benchmarks.withheld_data.world import draw_world
from benchmarks.withheld_score import score
from benchmarks.withheld_score.plan import planned, slice_cases
from benchmarks.withheld_score.tables import print_all
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.sensor import Sensor, effect_class, effect_ids, load_profile

ROOT = Path(__file__).parents[2]
KINDS = [kind for kinds in [*formulas.FORMULAS.values(), *formulas.OUTSIDE.values()] for kind in kinds]


def _film(kind: str, seed: int = 3, size: tuple[int, int] = (106, 60), frames: int = 4) -> Film:
    rng = np.random.default_rng(seed)
    world = draw_world(rng, kind)
    stamps = np.arange(frames) / 5
    route = draw_route(rng, world, float(stamps[-1]), "lively")
    m = {tag: world.materials[tag].m for tag in world.scene.tags}
    return Film(world, route, preset("d435", *size), stamps, Base(m), seed)


FILMS = [_film("clutter", seed=7), _film("yard", seed=8), _film("room", seed=6)]


@cache
def _shows(kind: type[Formula]) -> tuple[Film, Formula]:
    """A small film, and a formula of this kind that can act in it."""
    for film, seed in itertools.product(FILMS, range(8)):
        formula = kind(np.random.default_rng(seed), film)
        formula.amount = kind.span[1]
        if _statistic(film, formula) > 0.5 * wanted_range(kind, "weak")[0]:
            return film, formula
    raise AssertionError(f"{kind.__name__} does nothing in these films")


def _statistic(film: Film, formula: Formula) -> float:
    return Gauge(film, formula.statistic)(formula)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_the_statistic_grows_with_the_amount(kind: type[Formula]):
    film, formula = _shows(kind)
    low, high = np.log(kind.span)
    values = []
    for share in (0.0, 0.6, 1.0):
        formula.amount = float(np.exp(low + share * (high - low)))
        values.append(_statistic(film, formula))
    assert values[0] <= values[1] * 1.02 + 1e-3
    assert values[2] > 1.5 * values[0] + 0.3 * wanted_range(kind, "weak")[0]
    assert all(isinstance(key, str) for key in json.loads(json.dumps(formula.parameters())))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_an_effect_is_one_thing(kind: type[Formula]):
    """What only loses returns moves none; what is only noise biases none; what only correlates keeps the spread."""
    film, formula = _shows(kind)
    formula.amount = float(np.exp(np.log(kind.span).mean()))
    before, after = film.make(2, ()), film.make(2, [formula])
    if kind.statistic == "holes" and kind.__name__ not in ("Glare",):
        kept = after.z > 0
        assert np.array_equal(after.z[kept], before.z[kept])
    elif kind.statistic in ("spread", "ratio_m"):
        quiet = film.make(2, [formula], noise=False)
        there = quiet.z > 0
        assert np.array_equal(quiet.z[there], before.geometry.depth.astype(float)[there])
    elif kind.field is not Formula.field:
        fields = [formula.field(film.make(i, ()), film.rng("noise", i).standard_normal((60, 106))) for i in range(4)]
        assert np.std(fields) == pytest.approx(1, abs=0.12)
        if kind.statistic == "frames":
            assert abs(correlation(fields[0][:, 1:], fields[0][:, :-1])) < 0.05
        else:
            assert abs(correlation(fields[0], fields[1])) < 0.2


def test_the_base_is_the_simulator():
    """Without an effect the film is what depthsim simulates: no error but the paper's noise, the same holes."""
    film = _film("room", size=(212, 120), frames=4)
    sensor = Sensor(film.world.caster, film.camera, load_profile("paper").effects)
    ours, theirs = [], []
    for index in range(4):
        take = film.make(index)
        for units, errors in (
            (film.units(take), ours),
            (sensor.measure(film.poses[index], index=index, seed=5).depth_raw, theirs),
        ):
            error = np.where(units > 0, units * 0.001 - take.geometry.depth, np.nan)
            errors.append(error / take.sigma)
    a, b = np.array(ours), np.array(theirs)
    assert np.nanstd(a) == pytest.approx(np.nanstd(b), rel=0.02)
    assert np.nanmean(a) == pytest.approx(np.nanmean(b), abs=0.02)
    assert np.isnan(a).mean() == pytest.approx(np.isnan(b).mean(), abs=0.002)


WITHOUT = {"threshold_filter", "matching_window", "empty_border"}
"""What no withheld case is made of: it is done in one way only, or has no second formula yet."""


def test_there_are_formulas_for_every_effect_of_the_bank():
    assert set(formulas.FORMULAS) == set(effect_ids()) - WITHOUT
    assert set(RIGHT_AXES) == set(effect_ids()) - {"fill_rate", "decimation"} - WITHOUT
    assert all(effect_class(name).axes[0] in axes for name, axes in RIGHT_AXES.items())
    assert all(len(kinds) >= 2 for kinds in formulas.FORMULAS.values())
    assert not set(formulas.OUTSIDE) & set(effect_ids())
    assert all(kind.axes for kinds in formulas.OUTSIDE.values() for kind in kinds)
    for ranges in RANGES.values():
        assert ranges[0][1] < ranges[1][0] and ranges[1][1] < ranges[2][0]


def test_the_generator_imports_no_sensor():
    for file in (ROOT / "benchmarks" / "withheld_data").rglob("*.py"):
        if file.name == "active.py":
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                foreign = "depthsim.sensor", "depthsim.stereo", "depthsim.runs.generate", "depthsim.draws"
                assert not name.startswith(foreign), (file, name)


def test_making_a_case_loads_no_sensor(tmp_path: Path):
    script = (
        "import sys; from pathlib import Path\n"
        "from benchmarks.withheld_data.case import Wanted, draw_case, write_case\n"
        "write_case(draw_case(Wanted('a', ('ambient_light',), ('strong',), 2, 4, (106, 60))), Path(sys.argv[1]))\n"
        "assert not [name for name in sys.modules if name.startswith(('depthsim.sensor', 'depthsim.stereo'))]\n"
    )
    subprocess.run([sys.executable, "-c", script, str(tmp_path)], cwd=ROOT, check=True)
    assert len(Run.open(tmp_path / "run")) == 4


@pytest.mark.parametrize(
    ("tier", "effects"),
    [("a", ("heavy_tails",)), ("b", ("row_banding",)), ("c", ("baseline_scale", "fill_rate")), ("d", ())],
)
def test_a_case_is_a_run_and_its_truth_apart(tier: str, effects: tuple[str, ...], tmp_path: Path):
    wanted = Wanted(tier, effects, ("strong",) * len(effects), 4, 5, (106, 60))
    for name in ("one", "two"):
        write_case(draw_case(wanted), tmp_path / name)
    run, again = Run.open(tmp_path / "one" / "run"), Run.open(tmp_path / "two" / "run")
    assert len(run) == 5 and run.camera.width == 106 and run.scene is not None
    assert all(np.array_equal(run.depth_raw(i), again.depth_raw(i)) for i in range(5))
    assert load_profile(tmp_path / "one" / "sensor.yaml").effects
    truth = json.loads((tmp_path / "one" / "case.json").read_text())
    assert [effect["effect"] for effect in truth["effects"]] == list(effects)
    assert ("right_axes" in truth) == (tier == "b")
    for file in (tmp_path / "one" / "run").iterdir():
        if file.suffix in (".yaml", ".txt"):
            assert not any(effect in file.read_text() for effect in effects)
    other = draw_case(replace(wanted, seed=5)).film
    assert not np.array_equal(other.poses[0], run.poses[0])


def test_strengths_are_ordered_by_what_they_change():
    for strength in STRENGTHS:
        case = draw_case(Wanted("a", ("baseline_scale",), (strength,), 1, 6, (106, 60)))
        formula = case.film.formulas[0]
        low, high = wanted_range(formula, strength)
        assert 0.9 * low < _statistic(case.film, formula) < 1.1 * high
        assert formula.known()["scale"] != 1


def test_plans_begin_with_a_bit_of_everything():
    tier_a = [case for case, _ in zip(planned("a"), range(93), strict=False)]
    assert {case.effects[0] for case in tier_a} == set(effect_ids()) - WITHOUT
    assert len({case.name for case in tier_a}) == 93
    assert all(len(set(case.effects)) in (2, 3) for case, _ in zip(planned("c"), range(30), strict=False))
    cheap = list(slice_cases())
    assert 15 <= len(cheap) <= 25 and all(case.size == (212, 120) and case.frames == 16 for case in cheap)


def _result(truth: str, *causes: str, tier: str = "a", strength: str = "medium", **more: object) -> dict:
    effects = [{"effect": e, "strength": strength, "known_parameters": {"scale": 1.02}} for e in truth.split()]
    reported = [{"effect": c, "ci95": {"scale": [1.01, 1.03]}, "indistinguishable_from": ["max_range"]} for c in causes]
    gap = {"before": 1.0, "after": 0.1, "floor": 0.0, "closed_fraction": 0.9, "ci95": [0.85, 0.95]}
    diagnosis = {
        "verdict": "explained" if causes else "no_gap",
        "gap": gap,
        "causes": reported,
        "where": [{"axis": "range x time"}, {"axis": "height"}],
        "unexplained": None,
    }
    record = {"name": f"{tier}_{truth}_{len(causes)}", "tier": tier, "effects": effects, "m_offsets": {"wood": 0.02}}
    return {
        "truth": {**record, "right_axes": ["time"], "seed": 0, "against": "paper"},
        "diagnosis": {**diagnosis, **more},
        "seconds": 2.0,
        "peak_mb": 300.0,
        "remeasured": {"closed_fraction": 0.92},
        "rivals": {"rmse": "fill_rate", "importance": truth.split(maxsplit=1)[0] if truth else "no gap"},
    }


def test_scores():
    good = _result("baseline_scale", "material_noise", "baseline_scale")
    wrong = _result("max_range", "range_dropout")
    quiet = _result("min_range", strength="weak")
    counts = {count.what: count for count in score.tier_a([good, wrong, quiet])}
    assert (counts["first cause is right, medium and strong"].good, counts["no further cause"].good) == (1, 2)
    assert score.is_tie(wrong) and score.first(quiet) == "no gap" and score.named(good) == ["baseline_scale"]
    assert [count.good for count in score.coverage([good])] == [1, 1]
    nested = {"m": {"wood": 0.6}}
    assert score._pairs(nested, {"m.wood": [0.5, 0.7]}) == score._pairs(nested, {"m": {"wood": [0.5, 0.7]}})
    both = _result("fill_rate max_range", "max_range", "fill_rate", tier="c")
    one = {
        **_result("fill_rate max_range", "max_range", tier="c"),
        "alone": {"fill_rate": [], "max_range": ["max_range"]},
    }
    missed = {**one, "alone": {name: [name] for name in ("fill_rate", "max_range")}}
    counts = score.tier_c([both, {**both, "alone": missed["alone"]}, one, missed])
    assert [(c.good, c.of) for c in counts] == [(2, 4), (1, 2), (4, 4), (2, 2)]
    assert [c.good for c in score.tier_d([_result("", "material_noise", tier="d"), _result("", "max_range")])] == [1]
    reported = _result("time_offset", tier="b", verdict="unexplained")
    assert [c.good for c in score.tier_b([reported])] == [1, 1, 1]
    named = _result("time_offset", "motion_noise", tier="b", verdict="partly_explained")
    assert score.tier_b([named])[0].good == 0
    apart = [{**good, "apart": {"bits": bits, "null": 0.001}} for bits in (0.0015, 0.02)]
    assert [(c.good, c.of) for c in score.apart([*apart, good])] == [(1, 2)]
    low, high = score.wilson(95, 100)
    assert low == pytest.approx(0.8882, abs=1e-3) and high == pytest.approx(0.9785, abs=1e-3)


def test_tables_and_picture(tmp_path: Path):
    (tmp_path / "cases").mkdir()
    results = [_result("baseline_scale", "baseline_scale"), _result("max_range", "range_dropout", "fill_rate")]
    results += [_result("", tier="d"), _result("", "disparity_noise", tier="e")]
    for number, result in enumerate(results):
        (tmp_path / "cases" / f"{number}.json").write_text(json.dumps(result))
    print_all(tmp_path, Console(width=150, quiet=True))
    text = (tmp_path / "tables.txt").read_text()
    assert "(a) one effect withheld" in text and "range_dropout" in text and "a gap claimed" in text
    assert (tmp_path / "confusion.png").stat().st_size > 5000
