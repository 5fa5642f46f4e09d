"""A bias that is locked to the pixel, learned from a recording: of other formulas than the effect's."""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recordings import ROOM_CAMERA, make_room_run
from scipy import ndimage
from shapes import Array

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.registration import register
from depthsim.gap.depth.fit.candidates import candidates, setting_of
from depthsim.gap.depth.fit.finer import with_fine_pattern, with_pattern_beside_biases
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.pattern import Pattern, _Learner, learn, learn_beside, learn_pattern
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.validate import Validator
from depthsim.materials import load_materials
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.scenefile import load_scene
from depthsim.sensor import Sensor
from depthsim.sensor.effects.calibration import DisparityOffset
from depthsim.sensor.effects.fixed_pattern import FixedPattern, picture
from depthsim.sensor.effects.noise import DisparityNoise

HEIGHT, WIDTH = ROOM_CAMERA.shape
FOCAL_BASELINE = ROOM_CAMERA.focal_baseline
V, U = np.mgrid[:HEIGHT, :WIDTH]


def cosines() -> Array:
    """Waves in four directions, as a bent sheet of glass has them; 0.1 px."""
    waves = [np.cos(2 * np.pi * (U * np.cos(a) + V * np.sin(a)) / length + a) for a, length in
             ((0.3, 61), (1.4, 47), (2.2, 70), (2.9, 55))]  # fmt: skip
    whole = np.sum(waves, axis=0)
    return np.asarray(0.1 * whole / whole.std())


def bumps() -> Array:
    """Dents of one depth and of several widths; 0.1 px."""
    rng = np.random.default_rng(3)
    whole = np.zeros((HEIGHT, WIDTH))
    for _ in range(14):
        u, v, size = rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT), rng.uniform(9, 18)
        whole += rng.choice([-1, 1]) / (1 + (((U - u) ** 2 + (V - v) ** 2) / size**2) ** 2)
    return np.asarray(0.1 * whole / whole.std())


@dataclass(frozen=True, eq=False)
class Off(Run):
    """A recording whose disparity has something added, and noise."""

    bias: Array | None = None
    noise: float = 0.03
    memory: float = 0.0

    def depth_raw(self, index: int) -> Any:
        """Depth as on disk."""
        z = super().depth_raw(index) * self.camera.depth_scale
        noise = np.zeros(z.shape)
        for k in range(12):
            weight = self.memory**k * np.sqrt(1 - self.memory**2)
            noise += weight * np.random.default_rng([7, index - k + 50]).normal(0, self.noise, z.shape)
        d = FOCAL_BASELINE / np.maximum(z, 1e-3) + noise + (0 if self.bias is None else self.bias)
        far = FOCAL_BASELINE / np.maximum(d, 0.1) / self.camera.depth_scale
        return np.where((z > 0) & (d > 0.1), far.round(), 0).astype(np.uint16)


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return make_room_run(tmp_path_factory.mktemp("pattern") / "run", frames=23)


@pytest.fixture(scope="module")
def caster(clean: Run) -> Caster:
    return Caster(load_scene(clean.path.with_suffix(".obj")))


def off(run: Run, **keys: Any) -> Off:
    return Off(**{one.name: getattr(run, one.name) for one in fields(run)}, **keys)


def shape_of(found: Pattern) -> Array:
    return picture(found.grid, (HEIGHT, WIDTH))


def without_plane(pattern: Array) -> Array:
    """Less what a turned mount and an offset look like."""
    columns = np.column_stack([np.ones(pattern.size), U.reshape(-1), V.reshape(-1)])
    flat = pattern.reshape(-1)
    return np.asarray(flat - columns @ np.linalg.lstsq(columns, flat, rcond=None)[0])


@pytest.mark.parametrize("make", [cosines, bumps])
def test_a_pattern_of_another_formula_is_learned(make: Any, clean: Run, caster: Caster) -> None:
    bias = make()
    found = learn(off(clean, bias=bias), caster)
    a, b = without_plane(shape_of(found)), without_plane(bias)
    assert np.corrcoef(a, b)[0, 1] > 0.95
    assert a.std() == pytest.approx(b.std(), rel=0.1)
    assert found.amplitude == pytest.approx(found.found, rel=0.25)
    assert 8 < found.size < 25 and found.noise == pytest.approx(0.03, rel=0.2)
    # All that there is to be removed, where it was not learned.
    share = b.var() / (b.var() + 0.03**2)
    assert found.removed == pytest.approx(share, abs=0.06) and not found.is_none


def evidence_of(run: Run, caster: Caster) -> Evidence:
    return Evidence(run, caster.scene, load_materials(), (DisparityNoise(sigma=0.03),), 1)


def test_a_pattern_with_all_in_it_may_be_none(monkeypatch: pytest.MonkeyPatch, fine: Evidence) -> None:
    """A scale that drifts to and fro is left in it, and hides the rest: then there is the other one alone."""
    found = learn_pattern(fine)
    assert [one.is_none for one in found] == [False, False]
    whole = replace(found[1], grid=0 * found[1].grid, amplitude=0.0)
    shown = iter([found[0], whole])
    monkeypatch.setattr(_Learner, "learned", lambda learner: next(shown))
    assert learn_pattern(fine) == found[:1]


def fine_bias() -> Array:
    """Correlated by a half at 2.5 px: knots 5 px apart would lose most of it."""
    bias = ndimage.gaussian_filter(np.random.default_rng(5).normal(size=(HEIGHT, WIDTH)), 1.5)
    return np.asarray(0.1 * bias / bias.std())


@pytest.fixture(scope="module")
def fine(clean: Run, caster: Caster) -> Evidence:
    return evidence_of(off(clean, bias=fine_bias()), caster)


def test_beside_known_causes_a_pattern_is_as_fine_as_it_is(fine: Evidence, caster: Caster) -> None:
    found = learn_beside(fine, fine.base, fine=True)
    assert found is not None
    smooth = learn(fine.run, caster)
    rough, same = (np.corrcoef(shape_of(one).ravel(), fine_bias().ravel())[0, 1] for one in (smooth, found))
    assert same > 0.9 > rough and found.removed > smooth.removed + 0.1


@pytest.mark.parametrize("finely", [True, False])
def test_what_another_cause_does_is_not_the_patterns(finely: bool, clean: Run, caster: Caster) -> None:
    evidence = evidence_of(off(clean, bias=bumps() + 0.2), caster)
    both = evidence.base, (*evidence.base, DisparityOffset(offset=0.2))
    offset = [learn_beside(evidence, others, fine=finely) for others in both]
    with_it, without = (shape_of(one) for one in offset if one is not None)
    assert (with_it - without).mean() == pytest.approx(0.2, abs=0.02)
    assert np.corrcoef(without.ravel(), bumps().ravel())[0, 1] > 0.95


def test_a_thing_that_stays_is_in_a_fine_pattern(clean: Run, caster: Caster) -> None:
    """One that the scene does not have: nearer by 0.8 px, in the lower right corner."""
    thing = np.zeros((HEIGHT, WIDTH))
    thing[90:, 120:] = 0.8
    evidence = evidence_of(off(clean, bias=bumps() / 4 + thing), caster)
    found = learn_beside(evidence, evidence.base, fine=True)
    assert found is not None and shape_of(found)[95:, 125:].mean() == pytest.approx(0.8, rel=0.1)


def test_noise_has_no_fine_pattern(clean: Run, caster: Caster) -> None:
    evidence = evidence_of(off(clean, memory=0.7), caster)
    assert learn_beside(evidence, evidence.base, fine=True) is None


def test_the_causes_stay_with_a_finer_pattern(fine: Evidence, caster: Caster) -> None:
    setting = setting_of(fine, {FixedPattern.id: [learn(fine.run, caster).effect().model_dump()]})
    (one,) = (one for one in candidates(fine.base, setting) if one.effect == FixedPattern.id)
    validator = Validator(fine, fine.test)
    smooth = Selection(Model((one,), one.encode(one.starts[0])), {}, (), ())
    finer = with_fine_pattern(validator, smooth, print)
    before, after = (validator.quick(found.model.build(fine.base)) for found in (smooth, finer))
    assert [part.effect for part in finer.model.parts] == [FixedPattern.id] and after < 0.8 * before
    # What is nearer to the frames already is kept.
    true = tuple(map(tuple, fine_bias().tolist()))
    known = replace(one, fixed={**one.fixed, "grid": true})
    best = replace(smooth, model=Model((known,), known.encode((0.1,))))
    assert with_fine_pattern(validator, best, print) is best
    none = replace(smooth, model=Model((), np.empty(0)))
    assert with_fine_pattern(validator, none, print) is none


def test_beside_another_bias_the_pattern_is_what_that_leaves(clean: Run, caster: Caster) -> None:
    """The bank's has what both have in common, and closes that of the offset as well."""
    evidence = evidence_of(off(clean, bias=bumps() + 0.2), caster)
    bank = learn(evidence.run, caster)
    whole = replace(bank, grid=bank.grid + 0.1).effect().model_dump()
    setting = setting_of(evidence, {FixedPattern.id: [whole]})
    parts = [one for one in candidates(evidence.base, setting) if one.effect in (FixedPattern.id, DisparityOffset.id)]
    search = Search(evidence, Validator(evidence, evidence.test), parts, evidence.base, lambda _: None)
    begun = [Model((one,), one.encode(one.starts[0])) for one in sorted(parts, key=lambda one: one.effect)]
    offset = replace(begun[0], x=begun[0].parts[0].encode((0.2,)))
    found = with_pattern_beside_biases(search, offset.plus(begun[-1]))
    before, after = (search.validated(one).gap for one in (offset.plus(begun[-1]), found))
    assert [part.effect for part in found.parts] == [DisparityOffset.id, FixedPattern.id] and after < 0.5 * before
    assert found.parameters(0)["offset"] == pytest.approx(0.2, abs=0.01)
    # One alone is left as it is.
    assert with_pattern_beside_biases(search, begun[-1]) is begun[-1]


def test_the_effect_is_what_was_learned(clean: Run, caster: Caster) -> None:
    found = learn(off(clean, bias=bumps()), caster)
    effect = found.effect()
    measured = Sensor(caster, ROOM_CAMERA, [effect]).measure(clean.poses[3])
    added = FOCAL_BASELINE * (1 / measured.depth.astype(float) - 1 / measured.clean.depth)
    assert np.abs(added - shape_of(found)).max() < 2e-3
    assert effect.size == pytest.approx(found.size)


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_noise_has_no_pattern(memory: float, clean: Run, caster: Caster) -> None:
    found = learn(off(clean, memory=memory), caster)
    assert found.is_none and found.amplitude < 0.01


def test_a_mount_that_is_turned_and_a_scale_are_no_patterns(clean: Run, caster: Caster, tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text(
        "effects: [extrinsic_rotation: {x: 0.4, y: -0.3, z: 0.2}, disparity_offset: {offset: 0.1}]", encoding="utf-8"
    )
    run = make_room_run(tmp_path / "run", str(tmp_path / "own.yaml"), frames=23)
    found = learn(off(run), caster)
    assert found.removed < 0.1


def test_no_pixel_in_sight(clean: Run, caster: Caster) -> None:
    empty = off(clean, bias=np.full((HEIGHT, WIDTH), -1e3))
    assert learn(empty, caster).is_none


DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


@pytest.mark.parametrize(
    ("name", "amplitude", "removed"), [("aligned_table", (0.06, 0.15), 0.5), ("d435_floor", (0.03, 0.09), 0.1)]
)
def test_real_cameras_have_one(name: str, amplitude: tuple[float, float], removed: float) -> None:
    if not (DATA / name).is_dir():
        pytest.skip(f"shared/data/{name} is not beside the repository")
    run = Run.open(DATA / name)
    caster = Caster(load_scene(run.path / "scene.obj"))
    found = learn(run, caster, range(0, len(run), 1 if len(run) < 40 else 4))
    assert amplitude[0] < found.amplitude < amplitude[1] and found.removed > removed and not found.is_none
    assert register(run, caster).errors.is_none  # the poses were fitted to these frames
