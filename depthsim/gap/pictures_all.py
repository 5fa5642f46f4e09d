"""All pictures of a diagnosis."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.curves import best_views
from depthsim.gap.diagnose import Findings
from depthsim.gap.pictures import FIXED, REAL, SIMULATED, Picture
from depthsim.gap.pictures_candidates import candidates_picture
from depthsim.gap.pictures_curves import Series, curves_picture
from depthsim.gap.pictures_errors import Sample, correlation_picture, errors_picture, sample
from depthsim.gap.pictures_where import image_picture, mesh_picture
from depthsim.sensor.draws import Seed
from depthsim.sensor.effect import Effect

_ROWS = 3
_SEED = Seed("drawing")
_TOGETHER = {"pixel_neighbours", "frame_neighbours"}
_TOGETHER_EFFECTS = {"spatial_correlation", "temporal_correlation", "spatial_filter"}


def pictures(found: Findings) -> dict[str, Picture]:
    """By name: curves, errors, correlation, image, mesh, candidates; those for which there is something to draw."""
    evidence, judge = found.evidence, found.judge
    sensors: list[tuple[str, str, Sequence[Effect]]] = [("simulation", SIMULATED, found.profile.effects)]
    if found.diagnosis.causes:
        sensors.append(("with the causes", FIXED, found.fixed.effects))
    series: list[Series] = [("recording", REAL, judge.real)]
    series += [(name, colour, judge.simulate(effects, _SEED)) for name, colour, effects in sensors]
    ranked = [place.view for place in found.places if place.depends > 0.02]
    drawn = {
        "curves": curves_picture(evidence, best_views(evidence, ranked, _ROWS), series),
        "image": image_picture(evidence, found.places, found.places_after),
        "mesh": mesh_picture(evidence, found.places),
        "candidates": _candidates(found),
    }
    samples = _samples(found, sensors)
    drawn["errors"] = errors_picture(samples)
    if _together(found):
        drawn["correlation"] = correlation_picture(samples)
    return {name: picture for name, picture in drawn.items() if picture is not None}


def _candidates(found: Findings) -> Picture | None:
    if found.choice is None:
        return None
    return candidates_picture(found.choice, found.diagnosis.causes, found.before.gap, found.after.floor)


def _samples(found: Findings, sensors: Sequence[tuple[str, str, Sequence[Effect]]]) -> list[Sample]:
    evidence, blocks = found.evidence, found.judge.blocks

    def recorded(block: int) -> list[NDArray[np.uint16]]:
        return [evidence.run.depth_raw(int(i)) for i in evidence.blocks[block]]

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
    effects = {name for cause in d.causes for name in (cause.effect, *cause.indistinguishable_from)}
    return any(cut.axis in _TOGETHER for cut in cuts) or bool(effects & _TOGETHER_EFFECTS)
