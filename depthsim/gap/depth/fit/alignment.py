"""The causes of a recording that was aligned to colour and does not say so, found in its own geometry.

Noise, its correlation and a pattern are of the left imager's pictures, before they are resampled. Beside an alignment
that is one cause among others, all of them would have to move at once. Its doubled rows show it, whatever else there
is: so it comes first, and everything else is looked for as in a recording that says that it is aligned.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.fitting import Say
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.select import Selection, confirm
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effects.align import AlignToColor
from depthsim.sensor.effects.shadow import StereoShadow
from depthsim.sensor.pipeline import camera_for

_LARGER = 1.1
"""Times the gap without the alignment: with more, rows were doubled in another way, and what is searched for in its own
geometry would be in vain. Beside a noise that is far off, a right one takes off next to nothing; so of the forms the
first is taken that does no harm, which is the driver's, and not the one that takes off most."""


def select_aligned(
    evidence: Evidence,
    validator: Validator,
    bank: Sequence[Candidate],
    find: Callable[[Evidence], Selection],
    say: Say,
) -> Selection | None:
    """The alignment that doubled the recording's rows, with the causes beside it; None where there is no such.

    find: the causes on frames that say that they are aligned.
    """
    forms = [one for one in bank if one.effect == AlignToColor.id]
    if evidence.doubled is None or not forms or any(isinstance(e, AlignToColor) for e in evidence.base):
        return None
    search = Search(evidence, validator, bank, evidence.base, say)
    say("taking the alignment that the doubled rows show")
    shown = [replace(one, starts=tuple(v for v in one.starts if evidence.doubled[0] in v)) for one in forms]
    begun = (search.begin(one, evidence.base) for one in shown)
    alone = next((one for one in begun if search.validated(one).gap <= _LARGER * search.before), None)
    if alone is None:
        return None
    alone = _beside_a_shadow(search, alone)
    alignment = AlignToColor(**alone.parameters(0))
    run = replace(evidence.run, camera=alignment.stored(camera_for(evidence.camera, [alignment])))
    base = *evidence.base, alignment
    beside = find(Evidence(run, evidence.scene, evidence.materials, base, evidence.threads, config=evidence.config))
    model = alone.plus(beside.model)
    if not search.makes_doubling(model, 0):  # the steps of a depth with little noise look alike
        return None
    found = confirm(search, replace(beside, model=search.refined(model)))
    named = {part.effect for part in found.model.parts}
    return found if AlignToColor.id in named else None


def _beside_a_shadow(search: Search, alone: Model) -> Model:
    """The colour camera at the other side, if it is nearer beside a stereo shadow than where it is nearest by itself.

    What a colour camera sees past an edge is a hole, as in a shadow: by itself, it may be put where it makes those.
    """
    shadows = [one for one in search.bank if one.effect == StereoShadow.id]

    def gap(begun: Model) -> float:
        beside = [begun.plus(search.begin(shadow, begun.build(search.base))) for shadow in shadows]
        return min(search.validated(model).gap for model in (begun, *(search.fit(model, 2) for model in beside)))

    (shown,), margin = alone.parts, search.config.select.tied * search.whole
    others = [values for values in shown.starts if not np.allclose(shown.encode(values), alone.x)]
    best, found = gap(alone), alone
    for values in others:
        begun = search.begin(replace(shown, starts=(values,)), search.base)  # what is fitted is kept by candidate
        if (nearer := gap(begun)) < best - margin:
            best, found = nearer, begun
    return found
