"""kiss-icp: point-to-point ICP of each cloud against a local map (Vizzo et al., RA-L 2023), by the authors' package.

Made for lidar: the settings below scale it down to a room. Nothing is deskewed, as a D435 has a global shutter.

It is given 10 frames a second, as a lidar has, and voxels of 0.1 m. It matches points with points, and where a step is
below the spacing of the points, as the 2 to 5 cm between frames of 30 Hz are, each point of a wall finds its neighbour
of before and the camera seems to stand. The frame that stood goes into the map, and the next one agrees with it, until
the lag is as large as the spacing; from then on its constant velocity carries it, and the lag stays. So it was on our
clean runs, 5 s at 424x240: at 30 Hz and 0.05 m it ends 11 cm behind in the office, at 30 Hz and 0.1 m 18 cm in the
corridor (absolute trajectory error 2.5 cm); at 10 Hz and 0.1 m it is about 4 cm behind in both (0.8 and 1.3 cm).
Thresholds, shuffled points and ten frames at rest before the start change nothing; slower than 10 Hz the corridor gets
worse again.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from depthsim.exporting.tables import points_of
from depthsim.extras import load_extra
from depthsim.odometry.systems import DEPTH_MAX
from depthsim.runs import Run

RATE = 10.0
"""[Hz] Of the frames that it is given, at most."""
VOXEL = 0.1
"""[m] Its default is a hundredth of the range, which is 0.08 m."""
FIRST_THRESHOLD = 0.1
"""[m] Of correspondences at the start; 2 m by default, for cars."""
LEAST_MOTION = 0.01
"""[m] A deviation from constant velocity that counts; 0.1 m by default."""


def track(run: Run) -> Iterator[NDArray[np.float64] | None]:
    """The pose of each frame in the first one; None for a frame that is left out."""
    config = load_extra("kiss_icp.config", "slam").KISSConfig()
    config.data.max_range = DEPTH_MAX
    config.data.deskew = False
    config.mapping.voxel_size = VOXEL
    config.adaptive_threshold.initial_threshold = FIRST_THRESHOLD
    config.adaptive_threshold.min_motion_th = LEAST_MOTION
    config.registration.max_num_threads = 1  # then the same run gives the same poses
    odometry = load_extra("kiss_icp.kiss_icp", "slam").KissICP(config=config)
    step = max(round(1 / (RATE * float(np.median(np.diff(run.stamps))))), 1)
    for index in range(len(run)):
        if index % step:
            yield None
            continue
        points, _ = points_of(run, index)
        odometry.register_frame(points.astype(np.float64), np.empty(0))
        yield odometry.last_pose
