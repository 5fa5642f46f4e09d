"""The sim-to-real gap of a depth sensor, diagnosed: where it lies, which effects cause it, how far they close it."""

from depthsim.gap.depth.diagnose import Findings, diagnose, investigate, remeasure
from depthsim.gap.diagnosis import Cause, Cut, Diagnosis, Gap, Unexplained

__all__ = ["Cause", "Cut", "Diagnosis", "Findings", "Gap", "Unexplained", "diagnose", "investigate", "remeasure"]
