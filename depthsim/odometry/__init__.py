"""Running an odometry or a SLAM system on a run, and scoring what it estimates."""

from depthsim.odometry.score import Score, score
from depthsim.odometry.systems import SYSTEMS, Estimate, estimate

__all__ = ["SYSTEMS", "Estimate", "Score", "estimate", "score"]
