"""What may be wrong with a simulator: every effect that it lacks, and every value of those that it has."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from depthsim.gap.config import DepthFit
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.fit.added import added, as_learned
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.otherwise import otherwise
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.sensor.parameter import Setting, learned_of


def setting_of(
    evidence: Evidence,
    learned: Mapping[str, Sequence[Mapping[str, Any]]] | None = None,
    errors: PoseErrors | None = None,
) -> Setting:
    """What of the recording decides where fits begin. learned: what was, by effect; errors: of the poses."""
    tags = tuple(t for i, t in enumerate(evidence.scene.tags) if evidence.cuts.shown_tags[i] >= 0)
    quantiles = np.quantile(evidence.depths, Setting.SHARES).astype(float)
    stamps = [frame.stamp for frame in evidence.frames.values()]
    span, camera = max(stamps) - min(stamps), evidence.camera
    left, doubled = camera.left, evidence.doubled
    late = errors.late if errors and abs(errors.late) < span else None
    return Setting(
        tags, quantiles, span, evidence.materials, evidence.cuts.own_steps, learned or {},
        size=(left.width, left.height), doubled=doubled, undoubled=doubled is None and evidence.shows_doubling,
        zoom=camera.color.fy / left.fy if camera.color is not None else None, late=late,
        turn=errors.turn if errors else None, shift=errors.shift if errors else None,
        border=evidence.border, tiled=evidence.tiled, aligned=camera.aligned,
    )  # fmt: skip


def candidates(
    base: Sequence[Effect],
    setting: Setting,
    without: Sequence[str] = (),
    config: DepthFit = DepthFit(),  # noqa: B008 - frozen
) -> list[Candidate]:
    """All that may be wrong with a sensor that has the effects ``base``."""
    present = {effect.id: effect for effect in base}
    found = []
    for name in effect_ids():
        if name in without:
            continue
        kind = effect_class(name)
        if name not in present and not kind.possible(setting):
            continue
        if name in setting.learned:
            forms = [as_learned(kind, values, setting, config) for values in setting.learned[name]]
            found += [replace(form, in_place=number > 0) for number, form in enumerate(forms)]
        if name in present:
            found += otherwise(present[name], setting, config)
        elif not learned_of(kind):  # whose table is none of this recording's otherwise
            others = frozenset(effect.id for effect in base if kind.law and effect.law == kind.law)
            ways = dict.fromkeys((frozenset(), others))
            found += [added(kind, setting, config, held, way) for held in kind.forms_in(setting) for way in ways]
            spare = (added(kind, setting, config, held, way) for held in kind.spare_forms for way in ways)
            found += [replace(one, in_place=True) for one in spare]
    return [h for h in found if h.free]
