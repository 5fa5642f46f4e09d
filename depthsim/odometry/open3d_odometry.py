"""open3d-odometry: each frame against the last key frame, by Open3D's multi-scale RGB-D odometry.

Point to plane on depth alone (of its three methods the two that use intensity drift more on our clean runs). A frame
becomes the key frame when the camera has moved from the last one as far as below, so that the drift does not grow with
the frame rate.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from depthsim.odometry.open3d_images import colour_image, depth_image, intrinsic_matrix, matrix_of, quiet_open3d
from depthsim.odometry.systems import DEPTH_MAX
from depthsim.runs import Run

KEY_DISTANCE = 0.3
"""[m]"""
KEY_ANGLE = 15.0
"""[deg]"""
LEAST_FITNESS = 0.1


def track(run: Run) -> Iterator[NDArray[np.float64]]:
    """The pose of each frame in the first one, until the track is lost."""
    o3d = quiet_open3d()
    odometry = o3d.t.pipelines.odometry
    intrinsic = intrinsic_matrix(o3d, run.camera)
    scale = 1 / run.camera.depth_scale

    def image(index: int) -> object:
        return o3d.t.geometry.RGBDImage(colour_image(o3d, run, index), depth_image(o3d, run, index))

    key, key_pose, last = image(0), np.eye(4), np.eye(4)
    yield key_pose
    for index in range(1, len(run)):
        frame = image(index)
        try:
            found = odometry.rgbd_odometry_multi_scale(
                frame, key, intrinsic, o3d.core.Tensor(last), scale, DEPTH_MAX, method=odometry.Method.PointToPlane
            )
        except RuntimeError:  # the normal equations are singular: nothing fits
            return
        if found.fitness < LEAST_FITNESS:
            return
        last = matrix_of(found.transformation)
        pose = key_pose @ last
        yield pose
        angle = np.degrees(np.arccos(np.clip((np.trace(last[:3, :3]) - 1) / 2, -1, 1)))
        if np.linalg.norm(last[:3, 3]) > KEY_DISTANCE or angle > KEY_ANGLE:
            key, key_pose, last = frame, pose, np.eye(4)
