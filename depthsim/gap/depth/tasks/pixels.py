"""Figures of single pictures: how many pixels have depth, how wide the holes are, and what flies at depth edges."""

import numpy as np
from scipy import ndimage

from depthsim.gap.depth.tasks.view import Floats, Shares, View

_STEP = 0.1
"""Least step of a depth edge, as a share of the nearer depth: noise alone seldom gets into the middle of it."""
_TOUCHING = np.ones((3, 3), np.int8)


def pixel_figures(view: View, depth: Floats) -> Shares:
    """fill_rate, hole_width and flying_pixels of one picture (rows, width) [m]."""
    asked, filled = int(view.asked.sum()), depth > 0
    labels, holes = ndimage.label(view.asked & ~filled, _TOUCHING)
    areas = np.bincount(labels.ravel(), minlength=holes + 1)[1:].astype(float)
    near, far = np.minimum(view.clean, view.across), np.maximum(view.clean, view.across)
    step = far - near
    beside = filled & (view.across > 0) & (step > _STEP * near)
    # The middle half of the step is neither side, with its noise.
    flying = beside & (np.abs(depth - (near + far) / 2) < step / 4)
    return {
        "fill_rate": (100.0 * int(filled.sum()), asked),
        "hole_width": (float((areas * np.sqrt(areas)).sum()), float(areas.sum())),
        "flying_pixels": (100.0 * int(flying.sum()), int(beside.sum())),
    }
