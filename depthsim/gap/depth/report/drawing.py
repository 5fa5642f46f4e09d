"""All that the page of a depth diagnosis draws, measured once and kept as drawing.json."""

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Seed
from depthsim.gap.depth.findings import Findings
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.report.curves import AxisCurves, Series, axis_curves, best_axes
from depthsim.gap.depth.report.errors import Correlations, ErrorShares, Sample, correlations, error_shares, sample
from depthsim.gap.depth.report.where import ImageShare, MeshShare, image_shares, mesh_share
from depthsim.gap.report.drawing import Drawn
from depthsim.gap.report.figures import FIXED, REAL, SIMULATED
from depthsim.gap.report.words import Origin
from depthsim.sensor.effect import Effect, effect_class

_ROWS = 3
_SEED = Seed("drawing")
_TOGETHER = {"pixel_neighbours", "frame_neighbours"}
_STEPS = "first", "second", "third", "fourth", "fifth"


class CandidateBar(Drawn):
    """One of the leaders of a step. closed: the share of the gap; kind: whether it was named, equal, or not taken."""

    label: str
    closed: float
    kind: Literal["cause", "tie", "other"]


class CandidateStep(Drawn):
    """The leaders of one step, best first."""

    title: str
    bars: tuple[CandidateBar, ...]


class DepthDrawing(Drawn):
    """What the page draws beside diagnosis.json. origin: what was diagnosed, as it is named on the command line."""

    kind: Literal["depth"] = "depth"
    origin: Origin
    subtitle: str
    curves: tuple[AxisCurves, ...]
    errors: tuple[ErrorShares, ...]
    correlations: tuple[Correlations, ...]
    image: ImageShare | None
    mesh: MeshShare | None
    candidates: tuple[CandidateStep, ...]


def measure_drawing(found: Findings, origin: Origin) -> DepthDrawing:
    """Measure what is to be drawn of a diagnosis."""
    evidence, validator = found.evidence, found.validator
    sensors: list[tuple[str, str, Sequence[Effect]]] = [("simulation", SIMULATED, found.profile.effects)]
    if found.diagnosis.causes:
        sensors.append(("with the causes", FIXED, found.fixed.effects))
    series: list[Series] = [("recording", REAL, validator.real)]
    series += [(name, colour, validator.simulate(effects, _SEED)) for name, colour, effects in sensors]
    ranked = [place.axis for place in found.places if place.depends > evidence.config.where.least_share]
    samples = _samples(found, sensors)
    return DepthDrawing(
        origin=origin,
        subtitle=_subtitle(found),
        curves=tuple(axis_curves(evidence, number, series) for number in best_axes(evidence, ranked, _ROWS)),
        errors=tuple(map(error_shares, samples)),
        correlations=tuple(map(correlations, samples)) if _together(found) else (),
        image=image_shares(evidence, found.places, found.places_after),
        mesh=mesh_share(evidence, found.places),
        candidates=_candidates(found),
    )


def _subtitle(found: Findings) -> str:
    evidence, camera = found.evidence, found.evidence.camera
    return (
        f"{len(evidence.frames)} of {len(evidence.run)} frames, {camera.width} x {camera.height} px, against the "
        f"sensor {found.profile.name} in the scene {evidence.scene.name}"
    )


def _samples(found: Findings, sensors: Sequence[tuple[str, str, Sequence[Effect]]]) -> list[Sample]:
    evidence, blocks = found.evidence, found.validator.blocks

    def recorded(block: int) -> list[NDArray[np.uint16]]:
        return [evidence.recorded(int(i)) for i in evidence.blocks[block]]

    def simulated(effects: Sequence[Effect]) -> Callable[[int], list[NDArray[np.uint16]]]:
        return lambda block: evidence.pictures(effects, block, _SEED)

    samples = [sample(evidence, "recording", REAL, blocks, recorded)]
    for name, colour, effects in sensors:
        samples.append(sample(evidence, name, colour, blocks, simulated(effects)))
    return samples


def _together(found: Findings) -> bool:
    """Whether it matters how errors go together."""
    d = found.diagnosis
    cuts = [*d.where, *(d.unexplained.where if d.unexplained else ())]
    effects = [effect_class(name) for cause in d.causes for name in (cause.effect, *cause.indistinguishable_from)]
    return any(cut.axis in _TOGETHER for cut in cuts) or any(effect.kinds[0] == "correlation" for effect in effects)


def _candidates(found: Findings) -> tuple[CandidateStep, ...]:
    if found.selection is None:
        return ()
    before, causes = found.before.gap, found.diagnosis.causes
    whole = max(before - found.after.floor, 1e-12)
    named = {cause.effect for cause in causes}
    ties = {name for cause in causes for name in cause.indistinguishable_from}
    steps = []
    for number, step in enumerate(step for step in found.selection.looked_at if step):
        first = next((row for row, one in enumerate(step) if one.newest.effect in named), -1)
        beside = ", ".join(part.effect for part in step[0].model.parts[:-1])
        bars = tuple(
            CandidateBar(
                label=_label(one),
                closed=(before - one.gap) / whole,
                kind="cause" if row == first else "tie" if one.newest.effect in ties else "other",
            )
            for row, one in enumerate(step)
        )
        title = f"{_STEPS[min(number, 4)]} cause" + (f", beside {beside}" if beside else "")
        steps.append(CandidateStep(title=title, bars=bars))
    return tuple(steps)


def _label(one: Trial) -> str:
    gone = sorted(one.newest.replaces)
    return one.newest.effect + (f" for {', '.join(gone)}" if gone else "")
