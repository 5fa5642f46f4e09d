"""open3d-slam: dense SLAM against a TSDF model, as `dense_slam.py` of Open3D's examples does it.

Each frame is aligned, point to plane, with the model as seen from the last pose, and fused into it (KinectFusion,
Newcombe et al., ISMAR 2011; voxel blocks after Dong et al., 2021). It uses depth alone. Settings that differ from the
example's default_config.yml are below; the example's are made for scenes of 3 m.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from depthsim.odometry.open3d_images import FUSING, colour_image, depth_image, intrinsic_matrix, matrix_of, quiet_open3d
from depthsim.odometry.systems import DEPTH_MAX
from depthsim.runs import Run

VOXEL = 0.02
"""[m] The example has 0.0058, for a room of 3 m."""
DEPTH_MIN = 0.1
BLOCKS = 40_000
TRUNCATION = 8.0
"""In voxels, as the example."""
OUTLIER = 0.15
"""[m] Distance from the model above which a point does not count; the example has 0.07."""
LEAST_FITNESS = 0.1
"""Share of pixels that must fit the model: below that the track is lost."""


def track(run: Run) -> Iterator[NDArray[np.float64]]:
    """The pose of each frame in the first one, until the track is lost."""
    o3d = quiet_open3d()
    device = o3d.core.Device("CPU:0")
    height, width = run.camera.shape
    scale = 1 / run.camera.depth_scale
    pose = o3d.core.Tensor(np.eye(4))
    model = o3d.t.pipelines.slam.Model(VOXEL, 16, BLOCKS, pose, device)
    seen = o3d.t.pipelines.slam.Frame(height, width, intrinsic_matrix(o3d, run.camera, FUSING), device)
    # Tracking goes by this one's intrinsics.
    known = o3d.t.pipelines.slam.Frame(height, width, intrinsic_matrix(o3d, run.camera), device)
    for index in range(len(run)):
        seen.set_data_from_image("depth", depth_image(o3d, run, index))
        seen.set_data_from_image("color", colour_image(o3d, run, index))
        if index:
            try:
                found = model.track_frame_to_model(seen, known, scale, DEPTH_MAX, OUTLIER)
            except RuntimeError:  # the normal equations are singular: nothing fits
                return
            if found.fitness < LEAST_FITNESS:
                return
            pose = pose @ found.transformation
        yield matrix_of(pose)
        model.update_frame_pose(index, pose)
        model.integrate(seen, scale, DEPTH_MAX, TRUNCATION)
        model.synthesize_model_frame(known, scale, DEPTH_MIN, DEPTH_MAX, TRUNCATION, False)
