"""The causes of a recording that was decimated and scaled back to its size, found in tiles like its own.

Tiles show it, whatever else there is, and all else was there before it: so it comes first, as an alignment does that
doubled rows show.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.fitting import Say
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.select import Selection, confirm
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effects.decimation import Decimation


def select_tiled(
    evidence: Evidence,
    validator: Validator,
    bank: Sequence[Candidate],
    find: Callable[[Evidence], Selection],
    say: Say,
) -> Selection | None:
    """The decimation that made the recording's tiles, with the causes beside it; None where there are none.

    find: the causes of frames whose sensor has the same decimation.
    """
    shown = [one for one in bank if one.effect == Decimation.id]
    if evidence.tiled is None or not shown:
        return None
    search = Search(evidence, validator, bank, evidence.base, say)
    say("taking the decimation that the tiles show")
    alone = min((search.begin(one, evidence.base) for one in shown), key=lambda model: model.loss)
    base = alone.build(evidence.base)
    run, config = evidence.run, evidence.config
    beside = find(Evidence(run, evidence.scene, evidence.materials, base, evidence.threads, config=config))
    found = confirm(search, replace(beside, model=search.refined(alone.plus(beside.model))))
    return found if Decimation.id in {part.effect for part in found.model.parts} else None
