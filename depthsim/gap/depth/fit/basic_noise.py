"""A simulator without noise, and a recording that has some: causes are looked for beside a law of it.

Next to none at all any noise is so much that one is like another: nothing is said any more of how it changes along an
axis, nor of what is small beside it. So the law that comes nearest to the noise that the recording shows from pixel to
pixel is put into the simulator before anything else is looked for, as a profile has one that somebody has fitted. In
the end it is a cause, with what the search has made of it, if it closes something and acts where the gap lies.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.compared import Compared
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.noise_scale import ENOUGH, ROUNDED, Nearby, spread
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.candidates import candidates, setting_of
from depthsim.gap.depth.fit.fitting import Say
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.select import Selection
from depthsim.sensor.effect import Effect
from depthsim.sensor.effects.material_noise import MaterialNoise
from depthsim.sensor.effects.noise import DisparityNoise

Floats = NDArray[np.float64]
_FLOOR = MaterialNoise().floor
_Values = Mapping[str | tuple[str, str], float]
_CUTS = 12
"""Cells of the range."""


def basic_noise(given: Evidence, without: Sequence[str]) -> Model | None:
    """The law that comes nearest to the recording's noise, by itself; None where the simulator has one, or some noise.

    without: effects that are not in the bank.
    """
    if any(effect.law for effect in given.base):
        return None
    recorded, simulated = given.nearby()
    if not (recorded.depth.size and simulated.depth.size):
        return None
    cuts = np.quantile(recorded.depth, np.arange(1, _CUTS) / _CUTS).astype(np.float64)
    cells = _Cells.of(recorded, cuts, len(given.scene.tags))
    simulator = _Cells.of(simulated, cuts, len(given.scene.tags))
    seen = cells.noise > 0
    least = np.maximum(simulator.noise, ROUNDED * given.camera.depth_scale)[seen]
    if not seen.any() or np.median(cells.noise[seen] / least) <= given.config.data.far_more_noise:
        return None
    laws = [one for one in (_in_disparity(given, cells), _by_material(given, cells)) if one.effect.id not in without]
    if not laws:
        return None
    law = min(laws, key=lambda one: one.off)
    bank = candidates(given.base, setting_of(given), without, given.config.fit)
    return _candidate(bank, law)


@dataclass(frozen=True)
class _Cells:
    """(tags, ranges) each: noise and mean range [m] of pixels, and their share of all; 0 where there are few."""

    noise: Floats
    depth: Floats
    weight: Floats

    @classmethod
    def of(cls, pairs: Nearby, cuts: Floats, tags: int) -> "_Cells":
        """By material, and range between the cuts."""
        noise, depth, weight = np.zeros((3, tags, len(cuts) + 1))
        place = np.searchsorted(cuts, pairs.depth)
        for t, k in np.ndindex(noise.shape):
            here = (pairs.tag == t) & (place == k)
            if (pixels := int(here.sum())) >= ENOUGH:
                noise[t, k], depth[t, k], weight[t, k] = spread(pairs.differ[here]), pairs.depth[here].mean(), pixels
        return cls(noise, depth, weight * (noise > 0) / max(float(weight[noise > 0].sum()), 1.0))


@dataclass(frozen=True)
class _Law:
    """off: how far the logarithms of the noise are off it, squared."""

    effect: type[Effect]
    values: _Values
    off: float


def _in_disparity(given: Evidence, cells: _Cells) -> _Law:
    """Noise that is constant in disparity."""
    seen = cells.weight > 0
    logs, w = np.log(cells.noise[seen] * given.camera.focal_baseline / cells.depth[seen] ** 2), cells.weight[seen]
    middle = float(w @ logs)
    return _Law(DisparityNoise, {"sigma": float(np.exp(middle))}, float(w @ np.square(logs - middle)))


def _by_material(given: Evidence, cells: _Cells) -> _Law:
    """The paper's law, with an m of each material."""
    off, values = 0.0, dict[str | tuple[str, str], float]()
    for number, tag in enumerate(given.scene.tags):
        seen = cells.weight[number] > 0
        if seen.any():
            z, w, noise = (x[number][seen] for x in (cells.depth, cells.weight, cells.noise))
            logs = np.log(noise / _FLOOR)
            values["m", tag] = m = max(float(w @ (z * logs) / (w @ np.square(z))), 0.0)
            off += float(w @ np.square(logs - m * z))
    return _Law(MaterialNoise, values, off)


def _candidate(bank: Sequence[Candidate], law: _Law) -> Model | None:
    """A law as it is added; what of it else is free stays where it begins."""
    for one in bank:
        if one.effect == law.effect.id and not one.replaces and {free.key for free in one.free} >= law.values.keys():
            begun = zip(one.free, one.starts[0], strict=True)
            return Model((one,), one.encode([law.values.get(free.key, value) for free, value in begun]))
    return None


def as_cause(
    compared: Compared, selection: Selection, law: Model, without: Sequence[str], say: Say
) -> Selection | None:
    """What was found beside a law, against the simulator that has none, with the law as one of the causes.

    Without it, if there is next to nothing of it in the end: the noise that showed was that of other causes. None if
    there is some, but not where it acts: what was found beside it is worth nothing then. without: effects that are not
    in the bank.
    """
    validator, base, model = compared.selecting, compared.evidence.base, selection.model
    is_there = any(law.parts[0].effect in (part.effect, *part.replaces) for part in model.parts)
    search = Search(validator.evidence, validator, (), base, say)
    model = search.refined(model if is_there else law.plus(model))
    number = next((k for k, effect in enumerate(model.effects) if effect.law), None)
    if number is None:
        return replace(selection, model=model)
    less, several = model.less(number), sum(effect.kinds[0] == "spread" for effect in model.effects) > 1
    with_it, without_it = (one.build(base) for one in (model, less))
    closed, faint = validator.quick(without_it) - validator.quick(with_it), search.config.significance.faint
    least = search.config.select.supposed * _size(search.evidence, law.build(base))
    is_little = several and _size(search.evidence, with_it) < least
    if closed >= faint * validator.score(with_it).floor and not is_little:
        why = search.disagreement(model, number, alone=True)
        if why is not None:
            say(f"{model.parts[number].effect} is no cause: it {why}")
        return None if why else replace(selection, model=model)
    say(f"{model.parts[number].effect} is no cause: there is next to nothing of it beside the others")
    bank = candidates(base, setting_of(search.evidence), without, search.config.fit)
    ties = {cause: equals for cause, equals in selection.ties.items() if cause != model.parts[number].effect}
    return replace(selection, model=_by_themselves(search, bank, less), ties=ties)


def _size(evidence: Evidence, effects: Sequence[Effect]) -> float:
    """The noise [m] that laws of a sensor make at a middle range, in the mean over the materials."""
    depth, tags, found = float(np.median(evidence.depths)), evidence.scene.tags, 0.0
    for one in effects:
        if isinstance(one, DisparityNoise):
            found += one.sigma * depth**2 / evidence.camera.focal_baseline
        elif isinstance(one, MaterialNoise):
            m = [one.m.get(tag, evidence.materials[tag].m) for tag in tags]
            more = [1 + one.gain.get(tag, 0.0) for tag in tags]
            found += float(np.mean(np.multiply(more, one.floor * np.exp(np.multiply(m, depth)))))
    return found


def _by_themselves(search: Search, bank: Sequence[Candidate], model: Model) -> Model:
    """A model that had a law with it, with each noise in the form that comes nearest: some multiply what there is."""
    for name in [one.id for one in model.effects if one.kinds[0] == "spread"]:
        less = model.less([part.effect for part in model.parts].index(name))
        forms = (one for one in bank if one.effect == name and not (one.replaces or one.in_place))
        begun = (less.plus(search.begin(one, less.build(search.base))) for one in forms)
        tried = [search.fit(one, 4) for one in (model, *begun)]
        model = min(tried, key=lambda one: search.validated(one).gap)
    return search.refined(model) if model.parts else model
