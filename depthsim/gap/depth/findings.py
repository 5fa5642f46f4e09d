"""A depth sensor that was diagnosed, with all that a report needs."""

from dataclasses import dataclass

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.validate import Score, Validator
from depthsim.gap.depth.where.localize import Place
from depthsim.gap.diagnosis import Diagnosis
from depthsim.sensor.profile import Profile


@dataclass(frozen=True)
class Findings:
    """All that a report is made from.

    profile: the sensor before; fixed: with the causes added. selection: None without a gap. places: the axes, before
    and after.
    """

    diagnosis: Diagnosis
    evidence: Evidence
    validator: Validator
    profile: Profile
    fixed: Profile
    before: Score
    after: Score
    selection: Selection | None
    places: list[Place]
    places_after: list[Place]
