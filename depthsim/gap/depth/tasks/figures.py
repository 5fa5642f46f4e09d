"""The figures by name: their units, what they are, and why there may be none."""

from typing import NamedTuple


class Figure(NamedTuple):
    """unit: of the value. about: what it is, for people. none: the reason where there is no value."""

    unit: str
    about: str
    none: str


_PLANE = "no patch of the frames is a plane on which the recording and all simulations have depth"
FIGURES = {
    "fill_rate": Figure(
        "%", "pixels that have depth, of those that see the scene where it may be trusted", "no pixel sees the scene"
    ),
    "hole_width": Figure(
        "px", "the square root of a hole's area, on average over the pixels that lie in holes", "there are no holes"
    ),
    "flying_pixels": Figure(
        "%",
        "pixels in the middle half of the step, of those with depth within 12 px of a depth edge of 10 % or more",
        "there is no depth beside a depth edge",
    ),
    "z_accuracy": Figure(
        "%", "how far the depth of a plane is off, either way: the median of a patch, on average over patches", _PLANE
    ),
    "plane_rms": Figure("mm", "the points' distance from the plane that is fitted to a patch, RMS", _PLANE),
    "subpixel_rms": Figure("px", "plane RMS as disparity: of each point against its foot on the plane", _PLANE),
    "temporal_noise": Figure(
        "mm",
        "a pixel's standard deviation from frame to frame, on average over patches away from depth edges",
        "no two frames in a row with enough depth were looked at",
    ),
    "voxels_wrongly_free": Figure(
        "%",
        "voxels of 0.1 m out to 5 m that a frame's map has free and that are occupied, of those occupied",
        "nothing lies within 5 m",
    ),
    "voxels_wrongly_occupied": Figure(
        "%",
        "voxels that the map has occupied and that are free, of those free",
        "nothing within 5 m is seen to be free",
    ),
}
_WAY = "the frames that were looked at go less than a metre"
_DRIFT = "mean error over stretches of a metre of the way, as a share of it, of the odometry of "
_ATE = "absolute trajectory error (rigid alignment, root mean square), of the odometry of "
ODOMETRY = {
    "drift_open3d": Figure("%", f"{_DRIFT}Open3D", _WAY),
    "ate_open3d": Figure("mm", f"{_ATE}Open3D", _WAY),
    "drift_kiss_icp": Figure("%", f"{_DRIFT}KISS-ICP", _WAY),
    "ate_kiss_icp": Figure("mm", f"{_ATE}KISS-ICP", _WAY),
    "surface_error": Figure(
        "mm",
        "distance of the fused map from the scene, on average over its vertices, mapped at the recording's poses",
        "the scene moves or is itself fused from a recording, or no surface was seen often enough",
    ),
}
"""Of recordings that move."""
