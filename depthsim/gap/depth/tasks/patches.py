"""librealsense's depth quality figures, on patches of the picture where the scene is a plane.

rs-depth-quality looks at one wall in the middle of the picture. A recording sees planes of any size, so the picture is
cut into patches, and those are taken where the clean depth is flat, and the recording and all its simulations have
depth. Source: librealsense, tools/depth-quality (a plane by least squares along its dominant axis; then without the
nearest and the farthest 0.5 % of the points: RMS of the distances from the plane, and of the disparities between point
and its foot).
"""

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.frames import inner_rows
from depthsim.gap.depth.tasks.view import Floats, View
from depthsim.kernels import kernel

Patches = NDArray[np.intp]
"""(patches, 4): first row, row after the last, first column, column after the last."""
PLANE, SUBPIXEL, ACCURACY, DISTANCE = range(4)
"""The columns of :func:`plane_errors`."""
_ACROSS, _WIDEST, _LEAST = 16, 32, 8
"""Patches in a row of the picture, about; the widest and the smallest side [px]. They are 4:3, lower in a low band."""
_FLAT = 1e-3
"""RMS of the clean depth about its plane, as a share of the distance: above it a patch is no plane."""


def cut_patches(view: View) -> Patches:
    """The patches of a picture; none lies across a cut between bands of rows."""
    counted = np.flatnonzero(inner_rows(view.camera))
    number = view.camera.rows[counted]
    width = int(np.clip(view.camera.width // _ACROSS, min(4 * _LEAST // 3, view.camera.width), _WIDEST))
    found = []
    for band in np.split(counted, np.flatnonzero(np.diff(number) > 1) + 1):
        height = min(max(3 * width // 4, _LEAST), len(band))
        if min(height, width) < _LEAST:
            continue
        for top in range(int(band[0]), int(band[0]) + len(band) - height + 1, height):
            found += [(top, top + height, u, u + width) for u in range(0, view.camera.width - width + 1, width)]
    return np.array(found, np.intp).reshape(-1, 4)


def flat_patches(view: View) -> Patches:
    """The patches where the scene is a plane."""
    patches = cut_patches(view)
    errors = plane_errors(view, view.depth_of_scene(), patches)
    with np.errstate(invalid="ignore"):
        return patches[errors[:, PLANE] < _FLAT * errors[:, DISTANCE]]


def plane_errors(view: View, depth: Floats, patches: Patches) -> NDArray[np.float64]:
    """(patches, 4) of one picture (rows, width) [m], NaN where less than half of a patch has depth.

    RMS distance from the plane [m]; RMS disparity from it [px]; magnitude of the median error of the depth, as a share
    of the true one; mean depth [m].
    """
    found = np.full((len(patches), 4), np.nan)
    x, y = view.camera.rays
    _plane_errors(depth, view.clean, x, y, patches, view.camera.focal_baseline, found)
    return found


def noise_between(view: View, depth: Floats, earlier: View, before: Floats, patches: Patches) -> NDArray[np.float64]:
    """(patches,) the temporal noise [m]: standard deviation of a pixel over two frames in a row, NaN as above.

    Of the errors and not of the depths, so that a camera that moves has it, too. Pixels beside a depth edge are left
    out, as there a moving camera has another surface in the next frame.
    """
    both = (depth > 0) & (before > 0) & (view.across == 0) & (earlier.across == 0)
    change = np.where(both, (depth - view.clean) - (before - earlier.clean), 0.0)
    found = np.full(len(patches), np.nan)
    for number, (top, bottom, left, right) in enumerate(patches):
        inside = both[top:bottom, left:right]
        if (pixels := int(inside.sum())) >= inside.size / 2:
            found[number] = np.sqrt((change[top:bottom, left:right] ** 2).sum() / 2 / pixels)
    return found


@kernel
def _plane_errors(depth, clean, x, y, patches, focal_baseline, found):
    for number in range(len(patches)):
        top, bottom, left, right = patches[number]
        size = (bottom - top) * (right - left)
        points, errors, count = np.empty((size, 3)), np.empty(size), 0
        for v in range(top, bottom):
            for u in range(left, right):
                z = np.float64(depth[v, u])
                if z > 0:
                    points[count, 0], points[count, 1], points[count, 2] = x[v, u] * z, y[v, u] * z, z
                    errors[count] = z / clean[v, u] - 1
                    count += 1
        if 2 * count < size:
            continue
        middle, spread = np.zeros(3), np.zeros((3, 3))
        for k in range(count):
            middle += points[k]
        middle /= count
        for k in range(count):
            for i in range(3):
                for j in range(3):
                    spread[i, j] += (points[k, i] - middle[i]) * (points[k, j] - middle[j])
        # The axis along which the plane is fitted: that of the greatest determinant of the other two.
        best, normal = 0.0, np.zeros(3)
        for a in range(3):
            i, j = (a + 1) % 3, (a + 2) % 3
            area = spread[i, i] * spread[j, j] - spread[i, j] * spread[i, j]
            if area > best:
                best = area
                normal[a] = 1.0
                normal[i] = (spread[i, j] * spread[a, j] - spread[a, i] * spread[j, j]) / area
                normal[j] = (spread[i, j] * spread[a, i] - spread[a, j] * spread[i, i]) / area
        if best <= 0:
            continue
        normal /= np.sqrt((normal**2).sum())
        order = np.argsort(points[:count, 2])[count // 200 : count - count // 200]
        squares, disparities, sum_z = 0.0, 0.0, 0.0
        for k in order:
            off = ((points[k] - middle) * normal).sum()
            foot = points[k] - off * normal
            disparity = focal_baseline / np.sqrt((points[k] ** 2).sum()) - focal_baseline / np.sqrt((foot**2).sum())
            squares += off * off
            disparities += disparity * disparity
            sum_z += points[k, 2]
        found[number, 0] = np.sqrt(squares / len(order))
        found[number, 1] = np.sqrt(disparities / len(order))
        found[number, 2] = abs(np.median(errors[order]))
        found[number, 3] = sum_z / len(order)
