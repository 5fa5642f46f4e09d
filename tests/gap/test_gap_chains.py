"""When causes are looked for once more: after one has taken another's place, and with another one first."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from depthsim.gap.config import DepthConfig, DepthSelect
from depthsim.gap.depth.fit import confirm, grow, hiding, optimize, select, ties
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.chain import Chain
from depthsim.gap.depth.fit.enough import _formula_of, _stood_for_both, is_alike, is_enough
from depthsim.gap.depth.fit.fitting import Fitting, Trial
from depthsim.gap.depth.fit.free import Free
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.pairs import INDEPENDENT
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.validate import Score

SCORE = cast("Score", SimpleNamespace(stands_out=lambda limit: True, above=0.3, floor=0.0))


def model(*effects: str) -> Model:
    """Causes without parameters."""
    return Model(tuple(Candidate(effect, (), {}, ((),)) for effect in effects), np.empty(0))


class FakeSearch:
    """A gap of 1 and a floor of 0. gaps: of models, by the names of their effects."""

    before, floor, whole, base, is_spent = 1.0, 0.0, 1.0, (), False
    config = DepthConfig()

    def __init__(self, **gaps: float) -> None:
        self.gaps = gaps
        self.validator = SimpleNamespace(score=lambda effects: SCORE)
        self.goes_together = lambda of: False
        self.refined = lambda of: of
        self.leaves = lambda of, score: True
        self.is_early = lambda of, beside=None: False
        self.is_known = self.is_theirs = self.is_its_own = lambda of: False
        self.left_in_all = lambda of: 1.0
        self.parameters_of = lambda trial, others: len(trial.newest.free)

    def validated(self, of: Model) -> Trial:
        return Trial(of, self.gaps["_".join(part.effect for part in of.parts)])

    def fit(self, of: Model, rounds: int, polished_below: float = np.inf, elsewhere: bool = False) -> Model:
        return of

    def begin_near(self, less: Model, candidate: Candidate, of: Model) -> Model | None:
        return less.plus(model(candidate.effect))

    def say(self, text: str) -> None:
        pass


def chain(gap: float, *effects: str) -> Any:
    return Chain(DepthSelect(), SCORE, gap, model(*effects))


def leaving(along: float | None, others: str | None, *, flexible: bool = False) -> Any:
    """A search in which what is tried acts where the gap lies, and makes no steps. along: what it leaves there; others:
    why a cause beside it is none."""
    search = FakeSearch()
    search.acts, search.makes_steps, search.is_flexible = (lambda of: True), (lambda of: False), (lambda one: flexible)
    search.left_along, search.disagreement = (lambda of: along), (lambda of, number, alone: others)
    return search


def closes_enough(search: Any, gap: float, named: str, trial: Trial, near: float = 0.5) -> bool:
    """Whether a trial closes enough of a gap, all of it over the floor, that a cause has left. near: what another
    effect closes, beside what this one does."""
    begun = chain(gap, named)
    begun.score = SimpleNamespace(above=gap, floor=0.0)
    return is_enough(search, begun, trial, [trial, Trial(model("specular_dropout"), gap - near * (gap - trial.gap))])


def test_a_cause_in_the_place_of_another_leaves_other_things(monkeypatch: pytest.MonkeyPatch) -> None:
    """A filter stands for small noise and for its correlation; with the noise in its place the correlation is found."""
    search, grown = cast("Search", FakeSearch(noise=0.3, noise_correlation=0.1)), []

    def grows(search: Search, chain: Any) -> None:
        grown.append(chain.named)
        chain.model = model("noise", "correlation") if chain.named == ("noise",) else model("filter")

    def compare(search: Search, of: Model, *rest: object) -> tuple[Model, dict[str, tuple[str, ...]]]:
        return (model("noise") if of.parts[0].effect == "filter" else of), {}

    monkeypatch.setattr(select, "grow", grows)
    monkeypatch.setattr(select, "compare_rivals", compare)
    monkeypatch.setattr(select, "confirmed", lambda search, chain, whole, first: whole)
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    found = select._chain(search, SCORE, Chain(DepthSelect(), SCORE, 1.0))
    assert grown == [(), ("noise",)]
    assert found.named == ("noise", "correlation")


@pytest.mark.parametrize(
    ("light", "anywhere", "flexible", "becomes"),
    [
        (0.200, 0.201, ("ambient_light",), "fill_rate"),
        (0.200, 0.206, ("ambient_light",), "ambient_light"),  # more than next to nothing
        (0.200, 0.201, (), "ambient_light"),
        (0.200, 0.201, ("ambient_light", "fill_rate"), "ambient_light"),
    ],
)
def test_what_has_few_parameters_takes_the_place_of_what_has_many(
    monkeypatch: pytest.MonkeyPatch, light: float, anywhere: float, flexible: tuple[str, ...], becomes: str
) -> None:
    """Light whose holes are everywhere, as holes anywhere do as well."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(ties, "_acts_where_left", lambda *_: False)
    monkeypatch.setattr(ties, "surely_worse", lambda *_: False)
    search: Any = FakeSearch(ambient_light=light, fill_rate=anywhere)
    search.floor, search.is_flexible = 0.03, lambda part: part.effect in flexible
    search.disagreement = lambda of, number: None
    search.shows_itself = lambda of, number: True
    leaders = [Trial(model("ambient_light"), light), Trial(model("fill_rate"), anywhere)]
    found, equals = ties.compare_rivals(search, leaders[0].model, light, [leaders], [1.0])
    assert [part.effect for part in found.parts] == [becomes]
    assert equals == ({} if becomes == "fill_rate" else {"ambient_light": ("fill_rate",)})


@pytest.mark.parametrize(
    ("by_range", "anywhere", "parameters", "acts", "becomes"),
    [
        (0.200, 0.1995, 2, False, "fill_rate"),
        (0.200, 0.2005, 2, False, "range_dropout"),  # a little more: they are equals
        (0.200, 0.1995, 1, False, "range_dropout"),  # which has as few
        (0.200, 0.2005, 1, True, "fill_rate"),  # but acts where the other leaves something
        (0.200, 0.2005, 0, True, "range_dropout"),  # which has fewer
    ],
)
def test_what_has_fewer_parameters_and_leaves_no_more_takes_the_place(
    monkeypatch: pytest.MonkeyPatch, by_range: float, anywhere: float, parameters: int, acts: bool, becomes: str
) -> None:
    """Holes by the range from 0 m on, behind a limit of the range, for more holes anywhere."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(ties, "surely_worse", lambda *_: False)
    monkeypatch.setattr(ties, "_acts_where_left", lambda *_: acts)
    search: Any = FakeSearch(range_dropout=by_range, fill_rate=anywhere)
    search.floor, search.is_flexible = 0.03, lambda part: False
    search.disagreement = lambda of, number: None
    search.shows_itself = lambda of, number: True

    def trial(effect: str, gap: float, count: int) -> Trial:
        free = tuple(Free(f"p{n}", 0, 1, False, 0.1) for n in range(count))
        return Trial(Model((Candidate(effect, free, {}, ((0.0,) * count,)),), np.zeros(count)), gap)

    leaders = [trial("range_dropout", by_range, parameters), trial("fill_rate", anywhere, 1)]
    found, equals = ties.compare_rivals(search, leaders[0].model, by_range, [leaders], [1.0])
    assert [part.effect for part in found.parts] == [becomes]
    assert equals == ({} if becomes == "fill_rate" else {"range_dropout": ("fill_rate",)})


@pytest.mark.parametrize(
    ("together", "why", "leaders", "become"),
    [
        (0.19, None, ("disparity_noise", "fill_rate"), ["disparity_noise", "fill_rate"]),
        (0.21, None, ("disparity_noise", "fill_rate"), ["ambient_light"]),  # they leave more
        (0.19, "leaves all of it", ("disparity_noise", "fill_rate"), ["ambient_light"]),
        (0.19, None, ("disparity_noise", "vignetting_noise"), ["ambient_light"]),  # of which none makes holes
        (0.19, None, ("material_noise", "fill_rate"), ["ambient_light"]),  # which has as many
    ],
)
def test_two_with_few_parameters_take_the_place_of_one_with_many(
    monkeypatch: pytest.MonkeyPatch, together: float, why: str | None, leaders: tuple[str, str], become: list[str]
) -> None:
    """Light all over the scene, for more noise and more holes anywhere."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    search: Any = FakeSearch(ambient_light=0.2, **{"_".join(leaders): together})
    search.is_flexible = lambda part: part.effect in ("ambient_light", "material_noise")
    search.disagreement = lambda of, number, alone=False: why
    step = [Trial(model("ambient_light"), 0.2), *(Trial(model(effect), 0.6) for effect in leaders)]
    found, equals = ties.compare_rivals(search, step[0].model, 0.2, [step], [1.0])
    assert [part.effect for part in found.parts] == become
    assert equals == {}


@pytest.mark.parametrize(("known", "found"), [((), ("noise",)), (("noise", "pattern"), ())])
def test_what_comes_back_to_causes_that_are_known_is_followed_no_farther(
    monkeypatch: pytest.MonkeyPatch, known: tuple[str, ...], found: tuple[str, ...]
) -> None:
    """A filter in the place of a noise, which the noise takes back."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(select, "grow", lambda search, chain: None)
    monkeypatch.setattr(select, "compare_rivals", lambda *_: (model("noise"), {}))
    monkeypatch.setattr(select, "confirmed", lambda search, refuse, whole, first: whole)
    search, begun = cast("Search", FakeSearch(noise=0.3)), chain(0.3, "filter")
    assert select._chain(search, SCORE, begun, known).named == found


def test_another_is_looked_for_in_the_place_of_one_that_is_dropped_before_the_rest_is_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A lens for a focal length that is wrong: without either, what noise leaves speaks against noise."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(confirm, "credit", lambda validator, base, whole: np.full(len(whole.parts), 0.5))
    monkeypatch.setattr(confirm, "_in_its_place", lambda search, whole, worst: None)
    search, grown = FakeSearch(noise=0.5, noise_focal=0.0), []

    def disagrees(whole: Model, number: int, *, alone: bool = False) -> str | None:
        effect, others = whole.parts[number].effect, [part.effect for part in whole.parts]
        return "is another" if effect == "lens" or (effect == "noise" and len(others) == 1) else None

    def grows(search: Search, chain: Any) -> None:
        grown.append(chain.named)
        chain.model = model("noise", "focal" if chain.is_out("lens") else "lens")

    search.disagreement = disagrees
    monkeypatch.setattr(select, "grow", grows)
    monkeypatch.setattr(select, "compare_rivals", lambda search, of, *_: (of, {}))
    found = select._chain(cast("Search", search), SCORE, Chain(DepthSelect(), SCORE, 1.0))
    assert grown == [(), ("noise",)]
    assert found.named == ("noise", "focal") and found.nearest[0].effect == "lens"


@pytest.mark.parametrize("is_in_its_place", [True, False])
def test_what_gives_its_place_to_another_is_asked_once_more_beside_it(
    monkeypatch: pytest.MonkeyPatch, is_in_its_place: bool
) -> None:
    """Holes far away that stood for those of one material, too, which were no cause beside them as they were fitted."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    search, begun = cast("Search", FakeSearch(offset_glossy=0.3, offset=0.3)), chain(0.3, "offset", "far")

    def confirmed(search: Search, refuse: Any, whole: Model, *, first: bool) -> Model:
        refuse("far", 0.1, "leaves all along material")
        return model("offset", "glossy") if is_in_its_place else model("offset")

    monkeypatch.setattr(select, "confirmed", confirmed)
    assert select._confirm(search, SCORE, begun, begun.model)
    assert begun.is_out("far") != is_in_its_place
    assert select._confirm(search, SCORE, begun, model("offset", "far"))
    assert begun.is_out("far")


def test_what_is_dropped_has_no_rivals_and_takes_others_like_it_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise that is drawn one by one, for errors that go together: no other such noise comes first after it."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    search = FakeSearch()
    search.goes_together = lambda of: of.parts[0].effect != "filter"
    begun = []

    def grows(search: Search, chain: Any) -> None:
        chain.looked = chain.looked or [tuple(Trial(model(name), 0.3) for name in ("noise", "other", "filter"))]
        begun.append([trial.newest.effect for trial in chain.looked[0]])
        chain.model = None if chain.dropped else model("noise")

    def confirmed(search: Search, refuse: Any, whole: Model, *, first: bool) -> Model:
        refuse("noise", 0.7, INDEPENDENT)
        return model()

    monkeypatch.setattr(select, "grow", grows)
    monkeypatch.setattr(select, "compare_rivals", lambda *_: pytest.fail("there is nothing to compare"))
    monkeypatch.setattr(select, "confirmed", confirmed)
    found = select._chain(cast("Search", search), SCORE, Chain(DepthSelect(), SCORE, 1.0))
    assert begun == [["noise", "other", "filter"], ["filter"]]
    assert found.model is None and found.nearest[0].effect == "noise"


@pytest.mark.parametrize("stays", [True, False])
def test_nothing_is_seen_behind_biases_that_are_no_causes_there(monkeypatch: pytest.MonkeyPatch, stays: bool) -> None:
    """A rolling shutter by another formula: from its own depth most of what is left is what the formula leaves."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(select, "first_axes", lambda validator, effects: [])
    monkeypatch.setattr(select, "Search", lambda *_, **__: SimpleNamespace(config=DepthConfig()))
    monkeypatch.setattr(select, "Fitting", lambda *_: FakeSearch(rolling_shutter=0.3))
    left = SimpleNamespace(stands_out=lambda limit: True, gap=0.3, floor=0.1)
    evidence = SimpleNamespace(config=DepthConfig(), base=())
    validator = SimpleNamespace(evidence=evidence, score=lambda effects: left, quick=lambda effects: 1.0)

    def again(search: Search, score: Score, begun: Chain) -> Chain:
        begun.model = begun.model if stays else None
        return begun

    monkeypatch.setattr(select, "_chain", again)
    found = Selection(model("rolling_shutter"), {}, (), ())
    assert select.select_more(cast("Any", validator), [], found, lambda _: None) is (found if stays else None)


def test_what_parameters_are_off_by_behind_biases_is_for_no_other_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    """A time offset that is fitted a little off: what that leaves, much beside the noise there, was taken for holes."""
    monkeypatch.setattr(Model, "build", lambda model, base: model.x)
    monkeypatch.setattr(select, "Search", lambda *_: pytest.fail("nothing is left"))
    found, better = Selection(model("time_offset"), {}, (), ()), replace(model("time_offset"), x=np.ones(1))
    fitting = SimpleNamespace(fit=lambda of, rounds: of, validated=lambda of: Trial(of, 0.1), refined=lambda of: better)
    monkeypatch.setattr(select, "Fitting", lambda *_: fitting)

    def score(effects: Any) -> Any:
        return SimpleNamespace(stands_out=lambda limit: effects is not better.x, gap=0.3, floor=0.1)

    evidence = SimpleNamespace(config=DepthConfig(), base=())
    validator = SimpleNamespace(evidence=evidence, score=score, quick=lambda effects: 1.0)
    more = select.select_more(cast("Any", validator), [], found, lambda _: None)
    assert more is not None and more.model is better


@pytest.mark.parametrize("replaced", [True, False])
def test_a_noise_gives_its_place_to_another_behind_biases_where_no_new_one_is_looked_for(
    monkeypatch: pytest.MonkeyPatch, replaced: bool
) -> None:
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(select, "first_axes", lambda validator, effects: [("bias", ("motion",))])
    searches: list[Any] = []

    def begins(evidence: Any, validator: Any, bank: Any, before: Any, say: Any, **given: Any) -> Any:
        searches.append(SimpleNamespace(bank=bank, refined=lambda of: of, **given))
        return searches[0]

    def again(search: Any, score: Score, begun: Chain) -> Chain:
        assert [one.effect for one in search.bank] == ["range_dropout"]
        assert [one.effect for one in search.replacing] == ["incidence_noise", "range_dropout"]
        if replaced:
            begun.refuse("lateral_noise", 0.1, "makes tails")
            begun.model = model("time_offset", "incidence_noise")
        return begun

    monkeypatch.setattr(select, "Search", begins)
    monkeypatch.setattr(select, "_chain", again)
    monkeypatch.setattr(select, "Fitting", lambda *_: FakeSearch(time_offset_lateral_noise=0.3))
    left = SimpleNamespace(stands_out=lambda limit: True, gap=0.3, floor=0.1)
    validator = SimpleNamespace(
        evidence=SimpleNamespace(config=DepthConfig(), base=()), score=lambda effects: left, quick=lambda effects: 1.0
    )
    found = Selection(model("time_offset", "lateral_noise"), {}, (), ())
    bank = model("baseline_scale", "incidence_noise", "range_dropout").parts
    more = select.select_more(cast("Any", validator), bank, found, lambda _: None)
    assert more is not None
    assert [part.effect for part in more.model.parts] == ["time_offset", ("lateral_noise", "incidence_noise")[replaced]]


@pytest.mark.parametrize("better", [True, False])
def test_what_is_refused_is_asked_in_its_other_form(monkeypatch: pytest.MonkeyPatch, better: bool) -> None:
    search, first, other = FakeSearch(light=0.2), Trial(model("light"), 0.2), Trial(model("light"), 0.1)
    search.in_other_form = lambda so_far, trial: other if better and trial is first else None
    search.disagreement = lambda of, number: "acts elsewhere" if of is first.model else None
    monkeypatch.setattr(grow, "is_enough", lambda *_: True)
    begun = Chain(DepthSelect(), SCORE, 1.0)
    found = grow._first_supported(cast("Search", search), begun, [first])
    assert found is (other if better else None)
    assert ("light" in begun.refused) == (not better)


@pytest.mark.parametrize(("on_few", "in_full"), [(0.6, False), (0.4, True)])
def test_another_form_is_fitted_in_full_only_where_it_is_nearer_on_a_few_frames(on_few: float, in_full: bool) -> None:
    search, fitted = FakeSearch(filter=0.2, form=0.1), []
    search.other_forms = lambda of, in_place: list(model("form").parts)  # type: ignore[attr-defined]
    search.begin = lambda one, base, roughly: model(one.effect)  # type: ignore[attr-defined]
    search.fit_roughly = lambda of, rounds: replace(of, loss=on_few)  # type: ignore[attr-defined]
    search.loss_on_few = lambda effects: 0.5  # type: ignore[attr-defined]
    search.fit = lambda of, rounds: (fitted.append(of), of)[1]  # type: ignore[method-assign, assignment]
    first = Trial(SimpleNamespace(parts=model("filter").parts, build=lambda base: ()), 0.2)  # type: ignore[arg-type]
    found = Search._best_other_form(cast("Search", search), None, first, nearer=True)
    assert (found is not None, bool(fitted)) == (in_full, in_full)
    assert Search._best_other_form(cast("Search", search), None, first) is not None


@pytest.mark.parametrize(("acts", "either"), [(True, True), (False, True), (False, False)])
@pytest.mark.parametrize("by_material", [True, False])
def test_what_has_a_parameter_for_each_material_is_taken_in_its_best_form(
    acts: bool, either: bool, by_material: bool
) -> None:
    """An m that is wrong, by few frames a factor. What is taken for the moment acts in neither form yet: light that
    makes the noise grow, beside noise at edges (blind n10)."""
    search, other = FakeSearch(), Trial(model("noise"), 0.1)
    part = SimpleNamespace(of_materials=by_material, effect="noise")
    first = Trial(cast("Model", SimpleNamespace(parts=(part,))), 0.2)
    search.in_other_form = lambda so_far, trial: other  # type: ignore[attr-defined]
    search.is_flexible = lambda one: False  # type: ignore[attr-defined]
    search.acts = lambda of: acts if of is other.model else either  # type: ignore[attr-defined]
    found = grow._in_best_form(cast("Search", search), Chain(DepthSelect(), SCORE, 1.0), first)
    assert found is (other if by_material and (acts or not either) else first)


@pytest.mark.parametrize("early", [True, False])
def test_what_makes_errors_go_together_waits_for_what_holds_them_at_their_pixels(
    monkeypatch: pytest.MonkeyPatch, early: bool
) -> None:
    """A filter that closes more than the noise beside a pattern, of which it makes nothing."""
    search, smooths, noise = FakeSearch(), Trial(model("filter"), 0.1), Trial(model("noise"), 0.2)
    search.is_early = lambda of, beside=None: early and of is smooths.model
    search.disagreement = lambda of, number: None  # type: ignore[attr-defined]
    monkeypatch.setattr(grow, "is_enough", lambda *_: True)
    begun = Chain(DepthSelect(), SCORE, 1.0)
    assert grow._first_supported(cast("Search", search), begun, [smooths, noise]) is (noise if early else smooths)
    assert grow._first_supported(cast("Search", search), begun, [smooths]) is (None if early else smooths)
    assert not begun.refused  # it is asked when the pattern is there


def test_the_first_is_refined_before_it_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    search, first, finer = FakeSearch(mount=0.05), Trial(model("mount"), 0.2), model("mount")
    search.refined = lambda of: finer
    search.disagreement = lambda of, number: None if of is finer else "leaves much"  # type: ignore[attr-defined]
    monkeypatch.setattr(grow, "is_enough", lambda *_: True)
    begun = Chain(DepthSelect(), SCORE, 1.0)
    found = grow._first_supported(cast("Search", search), begun, [first])
    assert found is not None and found.gap == 0.05 and not begun.refused


@pytest.mark.parametrize(
    ("effect", "gap", "acts", "enough"),
    [
        ("disparity_noise", 0.14, True, True), ("material_noise", 0.14, True, False),
        ("material_noise", 0.05, True, True), ("material_noise", 0.103, True, True),
        ("material_noise", 0.103, False, False),
    ],
)  # fmt: skip
def test_a_small_cause_has_no_parameter_for_each_material(
    monkeypatch: pytest.MonkeyPatch, effect: str, gap: float, acts: bool, enough: bool
) -> None:
    """What is left after another cause has closed 0.8 of the gap is closed by either, and all of it by its cause."""
    search = FakeSearch()
    search.acts = lambda of: acts
    search.makes_steps, search.is_flexible = (lambda of: False), (lambda candidate: False)
    search.closes_by_one_material = lambda trial, before: False
    begun = chain(0.2, "lens_distortion")
    begun.score = SimpleNamespace(above=0.1, floor=0.0)
    free = {"material_noise": (Free(("m", "wood"), 0, 1, log=False, step=0.1),)}.get(effect, ())
    trial = Trial(Model((Candidate(effect, free, {}, ((),)),), np.empty(0)), gap)
    assert is_enough(cast("Search", search), begun, trial, [trial]) == enough


@pytest.mark.parametrize(
    ("of_one", "along", "others", "enough"),
    [
        (True, 0.1, None, True), (False, 0.1, None, False), (True, 0.5, None, False), (True, None, None, False),
        (True, 0.1, "is another", False),
    ],
)  # fmt: skip
def test_holes_of_one_material_are_no_leftover_of_other_holes(
    of_one: bool, along: float | None, others: str | None, enough: bool
) -> None:
    """Less than a hundredth of the gap, half of what another cause of holes has left."""
    search = leaving(along, others)
    search.closes_by_one_material = lambda trial, before: of_one
    free = (Free(("rates", "wood"), 0, 1, log=False, step=0.02),)
    trial = Trial(Model((Candidate("material_dropout", free, {}, ((),)),), np.zeros(1)), 0.004)
    assert closes_enough(search, 0.008, "range_dropout", trial) == enough


@pytest.mark.parametrize(
    ("own", "along", "others", "flexible", "enough"),
    [
        (True, 0.1, None, False, True), (False, 0.1, None, False, False), (True, 0.5, None, False, False),
        (True, 0.1, "is another", False, False), (True, 0.1, None, True, False),
    ],
)  # fmt: skip
def test_a_small_bias_by_its_own_axis_is_no_leftover_of_another_bias(
    own: bool, along: float, others: str | None, flexible: bool, enough: bool
) -> None:
    search = leaving(along, others, flexible=flexible)
    search.is_its_own = lambda of: own
    assert closes_enough(search, 0.008, "rolling_shutter", Trial(model("subpixel_bias"), 0.004)) == enough


@pytest.mark.parametrize(
    ("trusted", "effect", "why", "is_one"),
    [
        ("max_range", "range_dropout", None, True), ("max_range", "range_dropout", "is soft", False),
        ("lens_distortion", "range_dropout", None, False), ("max_range", "incidence_dropout", None, False),
    ],
)  # fmt: skip
def test_what_stood_for_two_shapes_along_one_axis_is_one_of_them(
    trusted: str, effect: str, why: str | None, is_one: bool
) -> None:
    search, asked = FakeSearch(), []
    search.makes_steps, search.is_flexible = (lambda of: False), (lambda one: False)
    search.lies_apart = lambda of: False

    def disagreement(of: Model, number: int, alone: bool) -> str | None:
        asked.append(of.parts[number].effect)
        return why

    search.disagreement = disagreement
    begun = chain(0.2, "lens_distortion", "max_range")
    begun.trust(trusted)
    begun.score = SimpleNamespace(above=0.2, floor=0.0)
    trial = Trial(model("lens_distortion", "max_range", effect), 0.17)
    assert _stood_for_both(cast("Search", search), begun, trial) == is_one
    if is_one:  # each of the two is asked beside the other; less than a tenth of what was left is too little
        assert asked == ["max_range", effect]
        assert is_enough(cast("Search", search), begun, trial, [trial])
        little = replace(trial, gap=0.19)
        assert not is_enough(cast("Search", search), begun, little, [little])


@pytest.mark.parametrize("theirs", [True, False])
def test_noise_of_one_material_is_no_cause_where_another_noise_leaves_more(theirs: bool) -> None:
    search = leaving(0.1, None)
    search.closes_by_one_material, search.is_theirs = (lambda trial, before: True), (lambda of: theirs)
    free = (Free(("gain", "wood"), -9, 9, log=False, step=0.1),)
    trial = Trial(Model((Candidate("material_noise", free, {}, ((),)),), np.zeros(1)), 0.004)
    assert closes_enough(search, 0.008, "lateral_noise", trial) != theirs


@pytest.mark.parametrize(("of_steel", "is_one"), [(0.52, True), (0.6, False)])
def test_what_closes_as_much_by_one_material_alone_is_for_it(of_steel: float, is_one: bool) -> None:
    search, asked = FakeSearch(), []

    def validated(of: Model) -> Trial:
        asked.append(of.parameters(1))
        return Trial(of, of_steel if "steel" in asked[-1]["rates"] else 0.9)

    search.validated = validated  # type: ignore[method-assign]
    wood, steel = (Free(("rates", tag), 0, 1, log=False, step=0.02) for tag in ("wood", "steel"))
    newest = Candidate("material_dropout", (wood, steel), {"rates": {}}, ((0.0, 0.0),))
    trial = Trial(Model((*model("range_dropout").parts, newest), np.array([1.0, 2.0])), 0.5)
    assert Search.closes_by_one_material(cast("Search", search), trial, 1.0) == is_one
    assert asked == [{"rates": {"wood": 0.02}}, {"rates": {"steel": 0.04}}]


@pytest.mark.parametrize(("rival_acts", "enough"), [(False, True), (True, False)])
def test_holes_anywhere_beside_a_shadow_are_named_where_no_rival_acts(rival_acts: bool, enough: bool) -> None:
    """Whatever makes holes comes near; which of them is there is told by where it acts."""
    search = FakeSearch(fill_rate_range_dropout=0.045)
    search.acts = lambda of: of.parts[-1].effect == "fill_rate" or rival_acts
    search.makes_steps, search.is_flexible = (lambda of: False), (lambda one: False)
    search.left_along = lambda of: None
    begun = chain(0.07, "stereo_shadow")
    begun.score = SimpleNamespace(above=0.07, floor=0.0)
    trial, rival = Trial(model("fill_rate"), 0.045), Trial(model("range_dropout"), 0.046)
    assert is_enough(cast("Search", search), begun, trial, [trial, rival]) == enough


@pytest.mark.parametrize(("theirs", "enough"), [(0.0046, True), (0.0045, True), (0.0044, False)])
def test_of_holes_anywhere_one_with_more_parameters_is_no_rival_that_closes_no_more(
    theirs: float, enough: bool
) -> None:
    """1 % more holes everywhere beside a filter and edges, which holes along the range, that begin at once, are too."""
    search = FakeSearch(fill_rate_range_dropout=0.0044)
    search.acts = lambda of: True
    search.makes_steps, search.is_flexible = (lambda of: False), (lambda one: False)
    search.left_along = lambda of: None
    begun = chain(0.007, "spatial_filter")
    begun.score = SimpleNamespace(above=0.007, floor=0.0)
    free = tuple(Free(name, 0, 1, log=False, step=0.1) for name in ("start", "rate"))
    of = [Candidate(name, free[:count], {}, ((),)) for name, count in (("fill_rate", 1), ("range_dropout", 2))]
    trials = [Trial(Model((one,), np.zeros(len(one.free))), gap) for one, gap in zip(of, (0.0045, theirs), strict=True)]
    assert is_enough(cast("Search", search), begun, trials[0], trials) == enough


def test_the_rivals_of_a_cause_are_those_of_the_step_that_it_was_named_in() -> None:
    """Noise comes near to a time offset by itself; once that is there, its rivals are other noises."""
    alone = [Trial(model(name), gap) for name, gap in (("time_offset", 0.1), ("lateral_noise", 0.4))]
    beside = [
        Trial(model("time_offset", name), gap) for name, gap in (("lateral_noise", 0.02), ("incidence_noise", 0.01))
    ]
    step, mine, closed = ties._found_as("lateral_noise", [alone, beside], [1.0, 0.1])
    assert step is beside and mine is beside[0] and closed == pytest.approx(0.08)
    assert ties._found_as("time_offset", [alone, beside], [1.0, 0.1])[:2] == (alone, alone[0])


@pytest.mark.parametrize(
    ("along", "others", "enough"),
    [(0.1, None, True), (0.5, None, False), (None, None, False), (0.1, "is another", False)],
)
def test_a_small_cause_with_many_parameters_is_known_along_an_axis_of_its_own(
    along: float | None, others: str | None, enough: bool
) -> None:
    """A shadow beside light that makes most of the holes: the light must not be another effect beside it."""
    search = leaving(along, others, flexible=True)
    assert closes_enough(search, 0.07, "ambient_light", Trial(model("stereo_shadow"), 0.03)) == enough


@pytest.mark.parametrize(
    ("near", "along", "others", "enough"),
    [
        (0.3, None, None, True), (0.4, None, None, False), (0.3, 0.5, None, False),
        (0.3, None, "is another", False),
    ],
)  # fmt: skip
def test_where_no_other_comes_near_what_is_left_may_lie_along_axes_of_others(
    near: float, along: float | None, others: str | None, enough: bool
) -> None:
    """Light beside holes on a slant: where it falls, all of the scene's axes are the slant's as well."""
    search = leaving(along, others, flexible=True)
    trial = Trial(model("ambient_light"), 0.03)
    assert closes_enough(search, 0.07, "incidence_dropout", trial, near) == enough
    little = replace(trial, gap=0.04)  # less than half of what is left
    assert not closes_enough(search, 0.07, "incidence_dropout", little, near)


@pytest.mark.parametrize(("near", "left", "enough"), [(0.3, 0.05, True), (0.4, 0.05, False), (0.3, 0.06, False)])
def test_noise_by_material_that_leaves_none_is_no_leftover(near: float, left: float, enough: bool) -> None:
    """Beside a filter by another formula, whose axis has as much of it."""
    search = leaving(0.1, None)
    search.is_theirs, search.left_in_all = (lambda of: True), (lambda of: left)
    free = (Free(("gain", "wood"), -9, 9, log=False, step=0.1),)
    trial = Trial(Model((Candidate("material_noise", free, {}, ((),)),), np.zeros(1)), 0.004)
    assert closes_enough(search, 0.016, "spatial_filter", trial, near) == enough


@pytest.mark.parametrize(
    ("noise", "named", "gone", "begins"),
    [(0.35, 1, False, True), (0.45, 1, False, False), (0.35, 2, False, False), (0.35, 1, True, False)],
)
def test_another_beginning_is_tried_where_it_comes_near(
    monkeypatch: pytest.MonkeyPatch, noise: float, named: int, gone: bool, begins: bool
) -> None:
    """Near to a lone first cause, by what the two close; beside others, which have their parts, by what is left.

    gone: the first fills what the other has none of, so that it is as good.
    """
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(select, "is_filling", lambda effect: gone)
    search = cast("Search", FakeSearch(noise_offset=0.3))
    monkeypatch.setattr(search, "is_less", lambda trial, by: by > 0, raising=False)
    first = chain(0.2, *("filter", "offset")[:named])
    first.looked = [(Trial(model("filter"), 0.2), Trial(model("noise"), noise))]
    others = list(select._other_beginnings(search, first))
    assert [one.model.parts[-1].effect for one in others] == (["noise"] if begins else [])


@pytest.mark.parametrize(
    ("alone", "both", "along", "left", "other", "named"),
    [
        (0.5, 0.1, "image_radius", 0.0, "disparity_offset", True),
        (0.15, 0.1, "image_radius", 0.0, "disparity_offset", False),
        (0.15, 0.1, "range", 0.0, "disparity_offset", True),
        (None, 0.1, "range", 0.05, "disparity_offset", True),
        (None, 0.1, "range", 0.2, "disparity_offset", False),
        (None, 0.9, "range", 0.0, "disparity_offset", False),
        (None, 0.1, "time", 0.05, "thermal_drift", True),
        (None, 0.1, "time", 0.2, "thermal_drift", False),
        (None, 0.1, "range", 0.05, "thermal_drift", False),
    ],
)
def test_what_cancels_is_tried_as_one(
    monkeypatch: pytest.MonkeyPatch, alone: float | None, both: float, along: str, left: float, other: str, named: bool
) -> None:
    """Where what closes most by itself does not do nearly as well, or does not act where the gap lies, and the two are
    the recording's law of the range, or of the time if biases change with that."""
    monkeypatch.setattr(hiding, "first_axes", lambda validator, effects: [("bias", {along})])
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    search = FakeSearch(**{f"baseline_scale_{other}": both})
    search.bank = model("baseline_scale", "lens_distortion", other).parts  # type: ignore[attr-defined]
    search.begin = lambda one, base: Model((one,), np.empty(0))  # type: ignore[attr-defined]
    search.disagreement = lambda of, number, *, alone: None  # type: ignore[attr-defined]
    search.left_of_biases = lambda of, axis: left if axis == along else 0.0  # type: ignore[attr-defined]
    begun = Chain(DepthSelect(), SCORE, 1.0)
    first = None if alone is None else Trial(model("lens_distortion"), alone)
    found = hiding.cancelling(cast("Search", search), begun, first)
    assert (found is not None) == named
    begun.dropped.add("baseline_scale")
    assert hiding.cancelling(cast("Search", search), begun, first) is None


@pytest.mark.parametrize(("cause", "named"), [("fill_rate", True), ("subpixel_bias", False)])
def test_what_cancels_is_tried_beside_causes_that_make_no_biases(
    monkeypatch: pytest.MonkeyPatch, cause: str, named: bool
) -> None:
    """What closes most may be of another kind, and neither of the two is supported alone beside it, either."""
    monkeypatch.setattr(hiding, "first_axes", lambda validator, effects: [("bias", {"time"})])
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    search = FakeSearch(**{f"{cause}_baseline_scale_thermal_drift": 0.05})
    search.bank = model("baseline_scale", "thermal_drift").parts  # type: ignore[attr-defined]
    search.begin = lambda one, base: Model((one,), np.empty(0))  # type: ignore[attr-defined]
    search.disagreement = lambda of, number, *, alone: None  # type: ignore[attr-defined]
    search.left_of_biases = lambda of, axis: 0.0  # type: ignore[attr-defined]
    found = hiding.cancelling(cast("Search", search), chain(0.3, cause), None)
    assert (found is not None) == named


@pytest.mark.parametrize(("gap", "agrees", "taken"), [(0.1, True, True), (0.3, True, False), (0.1, False, False)])
def test_what_is_known_where_the_gap_lies_takes_the_place_of_what_is_not(
    monkeypatch: pytest.MonkeyPatch, gap: float, agrees: bool, taken: bool
) -> None:
    """Holes on one material, in the place of holes anywhere."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    search = FakeSearch(disparity_noise_fill_rate=0.2, disparity_noise_material_dropout=gap)
    search.known_here = lambda of, kind: model("fill_rate", "material_dropout").parts  # type: ignore[attr-defined]
    search.disagreement = lambda of, number, alone: None if agrees else "leaves much"  # type: ignore[attr-defined]
    found = confirm._in_its_place(cast("Search", search), model("disparity_noise", "fill_rate"), 1)
    assert ([part.effect for part in found.parts] if found else None) == (
        ["disparity_noise", "material_dropout"] if taken else None
    )


@pytest.mark.parametrize(
    ("wrong", "replaceable", "first"),
    [
        ([1, 0], {"intrinsics", "flying_pixels"}, "intrinsics"),  # which may be all that is wrong
        ([1, 0], {"flying_pixels"}, "flying_pixels"),
        ([1, 0], set(), "flying_pixels"),
        ([1], {"intrinsics"}, "flying_pixels"),  # which is not wrong
        ([0, 1], {"flying_pixels"}, "intrinsics"),  # that closes least
    ],
)
def test_geometry_that_is_another_is_replaced_before_what_it_speaks_against_is_dropped(
    monkeypatch: pytest.MonkeyPatch, wrong: list[int], replaceable: set[str], first: str
) -> None:
    """Other intrinsics for a lens: pixels in between went together with what these left, and never came back."""
    whole = model("intrinsics", "flying_pixels")

    def in_its_place(search: Search, of: Model, worst: int) -> Model | None:
        return whole.less(worst) if of.parts[worst].effect in replaceable else None

    monkeypatch.setattr(confirm, "_in_its_place", in_its_place)
    worst, better = confirm._replaced(cast("Search", FakeSearch()), whole, wrong)
    assert whole.parts[worst].effect == first
    assert (better is not None) == (first in replaceable)


def test_nothing_is_alike_a_pattern_that_is_learned() -> None:
    """Which leaves nothing that is due to a formula: intrinsics beside it were taken for a lens."""
    assert not is_alike("intrinsics", ["fixed_pattern"]) and not is_alike("extrinsic_rotation", ["fixed_pattern"])
    assert is_alike("intrinsics", ["fixed_pattern", "extrinsic_rotation"])
    assert is_alike("max_range", ["range_dropout"]) and not is_alike("fill_rate", ["fill_rate"])


@pytest.mark.parametrize(("gap", "taken"), [(0.2005, True), (0.3, False)])
def test_what_is_plainer_and_does_as_well_takes_the_place(
    monkeypatch: pytest.MonkeyPatch, gap: float, taken: bool
) -> None:
    """Holes anywhere, in the place of holes on each of three materials that are alike."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    material = Candidate("material_dropout", (Free("rate", 0, 1, False, 0.1),) * 3, {}, ((0.1,) * 3,))
    search = FakeSearch(disparity_noise_fill_rate=gap, disparity_noise_material_dropout=0.2)
    search.known_here = lambda of, kind: model("fill_rate").parts  # type: ignore[attr-defined]
    search.disagreement = lambda of, number, alone: None  # type: ignore[attr-defined]
    whole = Model((*model("disparity_noise").parts, material), np.zeros(3))
    found = confirm._in_its_place(cast("Search", search), whole, 1)
    assert ([part.effect for part in found.parts] if found else None) == (
        ["disparity_noise", "fill_rate"] if taken else None
    )


@pytest.mark.parametrize(("gap", "taken"), [(0.15, False), (0.05, True)])
def test_what_is_alike_another_cause_takes_a_place_for_much_only(
    monkeypatch: pytest.MonkeyPatch, gap: float, taken: bool
) -> None:
    """Another shape of holes along the range, beside holes along the range, is what the formula of these leaves."""
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    search = FakeSearch(range_dropout=0.2, range_dropout_material_dropout=0.2, range_dropout_max_range=gap)
    search.known_here = lambda of, kind: model("max_range").parts  # type: ignore[attr-defined]
    search.disagreement = lambda of, number, alone: None  # type: ignore[attr-defined]
    found = confirm._in_its_place(cast("Search", search), model("range_dropout", "material_dropout"), 1)
    assert (found is not None) == taken


@pytest.mark.parametrize(
    ("known", "enough"), [(("material_dropout",), True), ((), False), (("material_dropout", "specular_dropout"), False)]
)
def test_of_two_that_do_as_well_one_is_named_that_is_known_where_the_gap_changes_first(
    monkeypatch: pytest.MonkeyPatch, known: tuple[str, ...], enough: bool
) -> None:
    monkeypatch.setattr("depthsim.gap.depth.fit.enough._stays", lambda *_: False)
    search = FakeSearch()
    search.is_known = lambda of: of.parts[-1].effect in known
    search.makes_steps = search.is_flexible = lambda of: False  # type: ignore[attr-defined]
    search.acts, search.left_along = (lambda of: True), (lambda of: 0.0)  # type: ignore[attr-defined]
    begun = chain(0.3, "spatial_filter")
    trials = [Trial(model("spatial_filter", name), 0.22) for name in ("material_dropout", "specular_dropout")]
    assert is_enough(cast("Search", search), begun, trials[0], trials) == enough


@pytest.mark.parametrize(
    ("effect", "acts", "enough"),
    [("edge_fattening", True, True), ("edge_fattening", False, False), ("material_dropout", True, False)],
)
def test_effects_of_other_kinds_of_error_are_no_rivals(
    monkeypatch: pytest.MonkeyPatch, effect: str, acts: bool, enough: bool
) -> None:
    """Holes at a slant leave most of what an outline that has grown closes, but not all of it."""
    monkeypatch.setattr("depthsim.gap.depth.fit.enough._stays", lambda *_: False)
    search, trials = FakeSearch(), [Trial(model("filter", name), 0.22) for name in ("incidence_dropout", effect)]
    search.makes_steps = search.is_flexible = lambda of: False  # type: ignore[attr-defined]
    search.left_along = lambda of: None  # type: ignore[attr-defined]
    search.acts = lambda of: acts or of.parts[-1].effect == "incidence_dropout"  # type: ignore[attr-defined]
    begun = chain(0.3, "spatial_filter")
    assert is_enough(cast("Search", search), begun, trials[0], trials) == enough


def test_beside_what_is_taken_for_the_moment_the_others_are_asked_once_more() -> None:
    """Holes at a slant were refused twice for holes far away, by themselves and beside a noise."""
    begun = chain(1.0)
    for _ in range(begun.config.asked):
        begun.refuse("incidence_dropout", 0.4, "leaves 53% of how holes change along incidence")
    assert begun.is_out("incidence_dropout")
    begun.trust("max_range")
    assert not begun.is_out("incidence_dropout") and begun.trusted == ["max_range"]
    begun.refuse("incidence_dropout", 0.4, "leaves 53% of how holes change along incidence")
    assert begun.is_out("incidence_dropout")


@pytest.mark.parametrize(("held_out", "fitted_on", "left"), [(9.0, 5.0, True), (9.0, 3.0, False), (7.0, 9.0, False)])
def test_what_is_left_stands_out_where_it_was_fitted_too(held_out: float, fitted_on: float, left: bool) -> None:
    """A scale fitted on a few frames is off on others by as much as they are unlike: no cause is looked for there."""

    def score(excess: float) -> Score:
        return Score(1.0, 0.5, np.ones(1), np.ones(1), np.full(1, excess), 0.0)

    fitting = SimpleNamespace(
        config=DepthConfig(), base=(), _fitted_on=SimpleNamespace(score=lambda _: score(fitted_on))
    )
    assert Fitting.leaves(cast("Fitting", fitting), model(), score(held_out)) is left


@pytest.mark.parametrize(("refused", "enough"), [("spatial_filter", False), ("material_noise", True)])
def test_what_was_refused_leaves_no_room_for_a_lesser_name_of_its_kind(refused: str, enough: bool) -> None:
    search = cast(
        "Search",
        SimpleNamespace(
            config=DepthConfig(), whole=1.0, before=1.0, base=(), makes_steps=lambda of: False,
            validator=SimpleNamespace(score=lambda effects: SCORE),
        ),
    )  # fmt: skip
    lesser = Trial(Model((Candidate("spatial_correlation", (), {"x": 1.0, "y": 1.0}, ((),)),), np.empty(0)), 0.9)
    begun = chain(1.0)
    begun.model, begun.looked = None, [(Trial(model(refused), 0.4), lesser)]
    assert is_enough(search, begun, lesser, [lesser]) is enough


@pytest.mark.parametrize(
    ("effect", "kinds"),
    [
        ("spatial_filter", ["correlation", "spread"]),
        ("temporal_correlation", ["correlation"]),
        ("baseline_scale", ["bias"]),
    ],
)
def test_a_filter_takes_spread_away_by_a_formula_of_its_own(effect: str, kinds: list[str]) -> None:
    assert _formula_of(effect) == kinds


@pytest.mark.parametrize(
    ("effect", "acting", "ahead"),
    [("", 1.0, True), ("material_noise", 0.6, True), ("material_noise", 0.3, False), ("min_range", 0.6, False)],
)
def test_what_closes_most_is_trusted_where_what_acts_is_far_behind(effect: str, acting: float, ahead: bool) -> None:
    """Light beside a wave of the disparities, of which more noise on every material closes half.

    What is too near is there beside any noise, though light that is none closes three times as much.
    """
    search = cast("Search", FakeSearch())
    selected = Trial(model(effect), acting) if effect else None
    assert grow._is_far_ahead(search, Trial(model("ambient_light"), 0.2), selected) == ahead


@pytest.mark.parametrize(
    ("selected", "is_itself", "taken"),
    [("decimation", True, "spatial_filter"), ("decimation", False, None), ("disparity_noise", True, None)],
)
def test_a_filter_comes_before_what_takes_many_times_the_pixels(
    monkeypatch: pytest.MonkeyPatch, selected: str, is_itself: bool, taken: str | None
) -> None:
    """Beside a decimation that closes more an edge-preserving filter was found at the end of the search's budget."""
    monkeypatch.setattr(grow, "is_enough", lambda *_: True)
    monkeypatch.setattr(grow, "has_more_pixels", lambda effect, _: effect == "decimation")
    search = FakeSearch()
    search.evidence = SimpleNamespace(camera=None)  # type: ignore[attr-defined]
    search.stands_for_another = lambda of: not is_itself  # type: ignore[attr-defined]
    search.is_flexible = lambda one: False  # type: ignore[attr-defined]
    leaders = [Trial(model(selected), 0.5), Trial(model("spatial_filter"), 0.6)]
    found = grow._for_the_moment(cast("Search", search), chain(1.0), leaders, leaders[0])
    assert (found.newest.effect if found else None) == taken


@pytest.mark.parametrize(
    ("holding", "early", "acting", "taken"),
    [
        ("extrinsic_translation", True, None, "extrinsic_translation"),
        ("extrinsic_translation", False, None, "spatial_filter"),
        ("extrinsic_translation", True, "material_noise", "decimation"),
        ("", True, None, "decimation"),
    ],
)
def test_the_bias_that_holds_errors_comes_before_what_looks_like_the_filter_of_a_larger_noise(
    monkeypatch: pytest.MonkeyPatch, holding: str, early: bool, acting: str | None, taken: str
) -> None:
    """A mount that is off beside a filter, in a corridor: decimation was taken, and the rest was not found."""
    monkeypatch.setattr(grow, "is_enough", lambda *_: True)
    monkeypatch.setattr(grow, "has_more_pixels", lambda *_: False)
    gaps = {"spatial_filter": 0.1, "decimation": 0.11, "extrinsic_translation": 0.8, "baseline_scale": 0.7}
    leaders = [Trial(model(effect), gap) for effect, gap in gaps.items()]
    search = FakeSearch()
    search.evidence = SimpleNamespace(camera=None)  # type: ignore[attr-defined]
    search.stands_for_another = search.is_flexible = lambda of: False  # type: ignore[attr-defined]
    filters = leaders[0].model
    search.is_early = lambda of, beside=None: (
        early and of is filters and (beside is None or beside.parts[-1].effect != holding)
    )
    selected = Trial(model(acting), 0.9) if acting else None
    found = grow._for_the_moment(cast("Search", search), chain(1.0), leaders, selected)
    assert found is not None and found.newest.effect == taken


@pytest.mark.parametrize(
    ("light", "plain", "noise", "taken"),
    [
        (0.1, 0.25, "disparity_noise", "disparity_noise"),
        (0.1, 0.45, "disparity_noise", "ambient_light"),  # far behind
        (0.1, 0.25, "material_noise", "ambient_light"),  # which has many parameters, too
        (0.1, 0.25, "baseline_scale", "ambient_light"),  # which makes another kind of errors
        (0.1, 0.25, "motion_noise", "ambient_light"),  # which is for another
        (0.3, 0.25, "disparity_noise", "disparity_noise"),
    ],
)
def test_what_has_few_parameters_is_taken_for_the_moment_where_it_comes_near(
    monkeypatch: pytest.MonkeyPatch, light: float, plain: float, noise: str, taken: str
) -> None:
    """Four times the noise by its own law, beside fattened edges and holes far away: light came near to all three."""
    monkeypatch.setattr(grow, "is_enough", lambda *_: True)
    search = FakeSearch()
    search.stands_for_another = lambda of: of.parts[-1].effect == "motion_noise"  # type: ignore[attr-defined]
    many = {"ambient_light", "material_noise"}
    search.is_flexible = lambda one: one.effect in many  # type: ignore[attr-defined]
    leaders = sorted([Trial(model("ambient_light"), light), Trial(model(noise), plain)], key=lambda one: one.gap)
    found = grow._for_the_moment(cast("Search", search), chain(1.0), leaders, None)
    assert found is not None and found.newest.effect == taken


def test_holes_beside_light_are_holes_beside_holes() -> None:
    """Light makes noise and holes by one formula, a dropout's noise is none of its own."""
    assert _formula_of("ambient_light") == ["spread", "missing"]
    assert _formula_of("range_dropout") == ["missing"]


@pytest.mark.parametrize("nothing", [False, True])
def test_a_fit_begins_on_the_right_side_however_much_too_strong(nothing: bool) -> None:
    """Of two places it begins at the one that leads to the recording, and not at the one that does less harm.

    But at one that does nothing, if there is one: slopes are known there.
    """
    azimuth = Free("azimuth", -180, 180, log=False, step=1.0)
    candidate = Candidate("ambient_light", (azimuth,), {}, ((-90.0,), (90.0,), *([(0.0,)] if nothing else [])))
    shows = {-90.0: np.array([0.0, 0.5]), 90.0: np.array([9.0, 0.0]), 0.0: np.zeros(2)}

    def roots(effects: Any) -> Any:
        return shows[effects[-1].azimuth]

    found, gain = optimize.starts(candidate, (), np.zeros(2), np.array([1.0, 0.0]), roots)
    assert [float(place.x[0]) for place in found] == ([0.0, 90.0, -90.0] if nothing else [90.0, -90.0])
    assert [place.loss for place in found[-2:]] == [64.0, 1.25]
    assert gain == (np.inf if nothing else 1.0)
