"""The sim-to-real gap of a depth sensor, diagnosed: where it lies, which effects cause it, how far they close it."""

from depthsim.gap.depth.diagnose import diagnose, investigate
from depthsim.gap.depth.findings import Findings
from depthsim.gap.depth.remeasure import remeasure
from depthsim.gap.diagnosis import Cause, Cut, Diagnosis, Gap, Unexplained

__all__ = ["Cause", "Cut", "Diagnosis", "Findings", "Gap", "Unexplained", "diagnose", "investigate", "remeasure"]
