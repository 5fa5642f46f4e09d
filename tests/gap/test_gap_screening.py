"""The first look at the bank: what takes long is looked at on a part of the frames, and further if it promises much."""

from collections import Counter
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.fit import changes, screening, search
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.free import Free
from depthsim.gap.depth.fit.optimize import Model, loss, promised
from depthsim.gap.depth.fit.screening import Screening
from depthsim.gap.depth.fit.search import Search
from depthsim.presets import preset

LONG, SHORT = "extrinsic_rotation", "baseline_scale"


def candidate(effect: str, count: int = 1) -> Candidate:
    free = tuple(Free(f"p{k}", -9, 9, False, 1.0) for k in range(count))
    return Candidate(effect, free, {}, ((0.0,) * count,))


def test_slopes_promise_what_a_linear_model_takes_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Model, "build", lambda model, base, x=None: model.x if x is None else x)
    rng = np.random.default_rng(0)
    slopes, target = rng.normal(size=(20, 3)), rng.normal(size=20)

    def roots(x: Any) -> Any:
        return slopes @ x

    model = Model((candidate(LONG, 3),), np.zeros(3))
    least = loss(target, slopes @ np.linalg.lstsq(slopes, target, rcond=None)[0])
    found = promised(model, (), roots(model.x), target, roots, DepthConfig().fit)
    assert found == pytest.approx(loss(target, roots(model.x)) - least, rel=1e-3)


@pytest.mark.parametrize(
    ("share", "known", "looked_at"),
    [(0.2, "", True), (0.01, "", False), (0.01, "first", True), (0.01, "nearly", True)],
)
def test_what_takes_long_is_looked_at_if_it_promises_much(
    monkeypatch: pytest.MonkeyPatch, share: float, known: str, looked_at: bool
) -> None:
    """Begun on one of three blocks, for three times what it promises there; nothing is looked at twice."""
    begun: Counter[tuple[str, int]] = Counter()

    def starts(one: Candidate, base: Any, here: Any, target: Any, roots: Any) -> Any:
        begun[one.effect, len(target)] += 1
        return [Model((one,), np.zeros(1), loss=1.0)], np.inf if one.effect == LONG else 3.0

    monkeypatch.setattr(screening, "starts", starts)
    monkeypatch.setattr(screening, "promised", lambda *_: share)
    monkeypatch.setattr(screening, "refine", lambda place, *_: place)
    monkeypatch.setattr(screening, "first_axes", lambda *_: [("bias", {"image_position"})] if known == "first" else [])
    monkeypatch.setattr(screening, "plain_axes", lambda *_: [("bias", {"image_position"})] if known == "nearly" else [])
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    looks = object.__new__(Screening)
    looks.bank, looks.base = [candidate(LONG), candidate(SHORT)], ()
    looks.config, looks.say = DepthConfig(), lambda _: None
    looks.evidence = cast("Any", SimpleNamespace(camera=preset("d435", 64, 36), side_by_side=map))
    looks.validator, looks._few, looks._known = cast("Any", None), [0, 1, 2], {}
    on = {length: ((), np.ones(length), lambda _, n=length: np.zeros(n)) for length in (1, 3)}
    monkeypatch.setattr(looks, "_on", lambda blocks: on[len(blocks)])
    for _ in range(2):
        found = looks.screen(None, lambda _: False)
        assert ({part.effect for model in found for part in model.parts} == {LONG, SHORT}) == looked_at
    assert begun == {(LONG, 1): 1, (SHORT, 3): 1}


@pytest.mark.parametrize(
    ("effect", "taken", "worth"), [(LONG, 0.01, False), (LONG, 0.1, True), (SHORT, 0.01, True), (LONG, -np.inf, True)]
)
def test_what_takes_long_is_fitted_in_full_if_a_first_look_takes_off_much(
    effect: str, taken: float, worth: bool
) -> None:
    looks = object.__new__(Search)
    looks.config, looks.evidence = DepthConfig(), cast("Any", SimpleNamespace(camera=preset("d435", 64, 36)))
    assert looks._is_worth_it(Model((candidate(effect),), np.zeros(1), loss=1.0 - taken), 1.0, 1.0) == worth


@pytest.mark.parametrize("nearly", [True, False])
def test_what_is_known_along_nearly_the_first_axis_leads(monkeypatch: pytest.MonkeyPatch, nearly: bool) -> None:
    """Waves of the disparity beside a lens: both change biases first along the range of a material, by which neither is
    known, and four other biases come nearer on a few frames."""
    along = [("bias", {"range", "material"}), ("bias", {"disparity_phase"})]
    monkeypatch.setattr(search, "first_axes", lambda *_: along[:1])
    monkeypatch.setattr(search, "plain_axes", lambda *_: along[1:] if nearly else [])
    looks = object.__new__(Search)
    looks.config, looks.validator = DepthConfig(), cast("Any", None)
    looks.evidence = cast("Any", SimpleNamespace(cuts=SimpleNamespace(own_steps=None)))
    names = ("fixed_pattern", "lens_distortion", "thermal_drift", "disparity_offset", "subpixel_bias")
    leading = looks._leading([Model((candidate(name),), np.zeros(1)) for name in names], ())
    assert ("subpixel_bias" in {model.parts[-1].effect for model in leading}) == nearly


@pytest.mark.parametrize(("bias", "found"), [(0.6, True), (0.4, False)])
def test_axes_along_which_a_kind_changes_nearly_as_much_as_along_its_first(
    monkeypatch: pytest.MonkeyPatch, bias: float, found: bool
) -> None:
    crossed, phase, place = {"range", "material"}, {"disparity_phase"}, {"image_position"}
    axes = [SimpleNamespace(names=names) for names in (crossed, phase, place)]
    whole = np.array([1.0, 0.0, 0.0, 0.0, 1.0])
    validator = cast(
        "Any",
        SimpleNamespace(
            evidence=SimpleNamespace(axes=axes, config=DepthConfig()),
            once=lambda *_: SimpleNamespace(whole=whole),
        ),
    )
    worth = np.array([0.9, bias, 0.1])
    monkeypatch.setattr(changes, "worth_of", lambda *_: (worth > 0.0, worth))
    assert changes.plain_axes(validator, ()) == ([("bias", phase)] if found else [])
