"""Running an odometry or a SLAM system on a run, and scoring what it estimates."""

from depthsim.slam.score import Score, score
from depthsim.slam.systems import SYSTEMS, Estimate, estimate

__all__ = ["SYSTEMS", "Estimate", "Score", "estimate", "score"]
