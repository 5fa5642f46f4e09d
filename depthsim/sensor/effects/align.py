"""Depth in the colour camera's pictures, as most recordings have it."""

from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera, undistort
from depthsim.kernels import inlined, kernel
from depthsim.raycast import Geometry
from depthsim.sensor.effect import Effect, Setting, Stage, parameter, parameters_of
from depthsim.sensor.frame import Frame
from depthsim.sensor.view import View

_f = np.float32
_WIDEST = 0.1
"""The least zoom that is one."""
_BESIDE = -0.015, 0.059
"""[m] Where the colour cameras of a D435 and of a D455 are."""
_SMALL = 160, 120
"""Pictures of which nobody knows the size are as small as this."""
_FINEST_UNSEEN = 1.1
"""A zoom from which on doubled rows are seen, at 240x136, 424x240 and 848x480 alike."""
_ZERO, _ONE, _HALF, _MOST = _f(0), _f(1), _f(0.5), _f(np.inf)


@inlined
def _project(x, y, z, pose, lens):
    """The colour pixel of the point at depth z on the ray (x, y, 1), or nothing a picture has where it is behind.

    pose: (12,) left imager to colour camera, rotation row by row and translation. lens: fx, fy, cx, cy and k1 to k3.
    """
    a = (pose[0] * x + pose[1] * y + pose[2]) * z + pose[9]
    b = (pose[3] * x + pose[4] * y + pose[5]) * z + pose[10]
    c = (pose[6] * x + pose[7] * y + pose[8]) * z + pose[11]
    a, b = a / c, b / c
    r2 = a * a + b * b
    radial = _ONE + r2 * (lens[4] + r2 * (lens[5] + r2 * lens[8]))
    p = a * radial + _f(2) * lens[6] * a * b + lens[7] * (r2 + _f(2) * a * a)
    q = b * radial + lens[6] * (r2 + _f(2) * b * b) + _f(2) * lens[7] * a * b
    before = c > _ZERO
    return p * lens[0] + lens[2] if before else _f(-2), q * lens[1] + lens[3] if before else _f(-2)


@kernel
def _resample(depth, corner_x, corner_y, pose, lens, unit, within, out):
    """Each pixel of ``depth`` into all pixels of ``out`` between the places of its corners; the nearest stays.

    Where there is none, ``out`` becomes 0.
    corner_x, corner_y: (height + 1, width + 1) rays at z = 1 through the corners of the pixels. unit: of the depth
    that the camera rounds to before it resamples [m]. within: how much less than to their middles it must reach [px].
    """
    height, width = depth.shape
    rows, columns = out.shape
    out[:] = _MOST
    # Kept in registers: of an array that may be written to, each would be read again.
    p, c = pose, lens
    pose_of = p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11]
    lens_of = c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]
    # A row's places first, without a branch: several at once.
    begins_x, begins_y = np.empty(width, np.float32), np.empty(width, np.float32)
    ends_x, ends_y = np.empty(width, np.float32), np.empty(width, np.float32)
    for v in range(height):
        row, upper_x, upper_y = depth[v], corner_x[v], corner_y[v]
        lower_x, lower_y = corner_x[v + 1, 1:], corner_y[v + 1, 1:]
        for u in range(width):
            z = np.floor(row[u] / unit + _HALF) * unit
            left, top = _project(upper_x[u], upper_y[u], z, pose_of, lens_of)
            right, bottom = _project(lower_x[u], lower_y[u], z, pose_of, lens_of)
            begins_x[u] = left + _HALF + within if z > _ZERO else _f(-2)
            begins_y[u], ends_x[u], ends_y[u] = top + _HALF + within, right + _HALF - within, bottom + _HALF - within
        for u in range(width):
            left, top, right, bottom = begins_x[u], begins_y[u], ends_x[u], ends_y[u]
            # A whole number is what is left of the point, so that down to -1 a corner counts as on the border. Written
            # so that what is not a number is outside.
            if not (left > -_ONE and top > -_ONE and right < _f(columns) and bottom < _f(rows)):
                continue
            z, first, last = row[u], np.int64(left), np.int64(right)
            for y in range(np.int64(top), np.int64(bottom) + 1):
                for x in range(first, last + 1):
                    out[y, x] = min(out[y, x], z)  # a branch would be taken as the noise goes
    for y in range(rows):
        for x in range(columns):
            out[y, x] = out[y, x] if out[y, x] < _MOST else _ZERO


@lru_cache(maxsize=8)
def _corner_rays(camera: Camera) -> NDArray[np.float32]:
    """(2, height + 1, width + 1) rays at z = 1 half a pixel left of and above each pixel, and beyond the last ones."""
    x = (np.arange(camera.width + 1) - 0.5 - camera.cx) / camera.fx
    y = (np.arange(camera.height + 1) - 0.5 - camera.cy) / camera.fy
    rays = np.stack(np.broadcast_arrays(x, y[:, None]))
    if any(camera.distortion):
        rays = np.stack(undistort(rays[0], rays[1], camera.distortion))
    return rays.astype(np.float32)


@lru_cache(maxsize=8)
def _aligned(camera: Camera, x: float, zoom: float, roll: float) -> Camera:
    """A camera whose pictures are a colour camera's; kept, because it keeps its rays."""
    size = {"width": camera.width, "height": camera.height}
    own = {name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy", "distortion")}
    middle = {"cx": (camera.width - 1) / 2, "cy": (camera.height - 1) / 2}
    left = {**size, "fx": camera.fx / zoom, "fy": camera.fy / zoom, **middle}
    turned = np.radians(roll) / 2
    color = {**size, **own, "rotation": (0.0, 0.0, np.sin(turned), np.cos(turned)), "translation": (x, 0.0, 0.0)}
    return camera.model_copy(update={"color": color, "aligned": True, "depth": left})


def zoom_accuracy(width: int, height: int) -> float:
    """How well doubled rows show a zoom, relative: 0.005 where a picture has 160x120."""
    return float(0.7 / np.sqrt(width * height))


class AlignToColor(Effect):
    """Depth resampled into the colour camera: each pixel is projected as a rectangle, and the nearest one wins.

    The rectangle reaches from pixel to pixel between the projections of the two corners at ±0.5 px, both ends
    included, and holds the depth as the left imager has it. So pixels are doubled where the colour picture is finer,
    what the colour camera sees past an object's edge is a hole, and the background seen through it is not hidden.
    Of a camera that says where its colour camera is, nothing is left to choose. ``x``, ``zoom`` and ``roll`` are for
    one that does not: the left imager then has pictures of the same size, and looks the same way but for the roll.

    As a pixel also covers what it only touches, the nearest of several wins, and where neighbours have noise of their
    own all of the picture is nearer. Other software, which renders points or looks each pixel up, takes one of them:
    with an ``overlap`` of 0 a pixel covers those whose middles lie in its rectangle.
    """

    id: ClassVar[str] = "align_to_color"
    stage: ClassVar[Stage] = Stage.PROCESSING
    rank: ClassVar[int] = 100
    moves_camera: ClassVar[bool] = True
    source: ClassVar[str] = "librealsense, src/proc/align: depth to another stream, the way without SSE"
    axes = ("edge_distance", "pixel_neighbours", "image_column", "image_position", "incidence")
    kinds = ("missing", "correlation", "tail", "spread", "bias")
    recording = "near objects before a far wall, with the driver's alignment off and on"
    forms = ({"overlap": 1.0}, {"overlap": 0.0})

    x: float = parameter(
        -0.015, low=-0.1, high=0.1, unit="m", about="where the colour camera is, along the left imager's x",
        source="realsense-ros, realsense2_description: D415 and D435; 0.059 m of a D455",
        starts=_BESIDE, step=0.01,
    )  # fmt: skip
    zoom: float = parameter(
        1.53, low=0, high=3, unit="1", neutral=0, about="focal length of the pictures over that of the left imager's",
        source="datasheet 337029: D435 at 640x480; 1.38 at 16:9, 0.95 of a D455",
        starts=(1.55, 1.42, 0.96, 2.2), scale="linear", step=0.05,
    )  # fmt: skip

    roll: float = parameter(
        0.0, low=-5, high=5, unit="deg", about="by how much the colour camera is turned about its own axis, rightwards",
        source="1.1° in the frames of RobotCalibration, by which rows are doubled; 0 by construction", frozen=True,
    )  # fmt: skip
    overlap: float = parameter(
        1.0, low=0, high=1, unit="px", about="how much farther than to their middles a pixel covers those of a picture",
        source="librealsense, where it covers what it touches", frozen=True, starts=(0.0,), scale="linear", step=0.25,
    )  # fmt: skip

    @classmethod
    def possible(cls, setting: Setting) -> bool:
        """Not where rows would be doubled, and none are; of what says that it is aligned it is the way in which."""
        return setting.aligned or not setting.undoubled or setting.zoom is None or setting.zoom < _FINEST_UNSEEN

    @classmethod
    def thawed_in(cls, setting: Setting) -> Collection[str]:
        """How far pixels overlap, where it is known where the colour camera is."""
        return ("overlap",) if setting.aligned else ()

    @classmethod
    def forms_in(cls, setting: Setting) -> Sequence[Mapping[str, float]]:
        """With the roll that the lines of doubled rows show, where there are any."""
        if setting.aligned:
            return [{name: one.default for name, one in parameters_of(cls).items() if name != "overlap"}]
        if setting.doubled is None:  # without overlap and doubled rows it smooths, which other effects do
            return cls.forms[:1]
        return [{"roll": round(setting.doubled[1], 3), **form} for form in cls.forms]

    @classmethod
    def suggested(cls, setting: Setting) -> Sequence[Mapping[str, float]]:
        """The zoom by which rows are doubled; where the colour camera is, they do not show."""
        return [{"x": x, "zoom": setting.doubled[0]} for x in _BESIDE] if setting.doubled is not None else ()

    @classmethod
    def bounds_in(cls, setting: Setting) -> Mapping[str, tuple[float, float]]:
        """The zoom near that by which rows are doubled: a fit would take another one to move what is in the picture."""
        if setting.doubled is None:
            return {"zoom": (0, _FINEST_UNSEEN)} if setting.undoubled else {}
        zoom, off = setting.doubled[0], zoom_accuracy(*(setting.size or _SMALL))
        return {"zoom": (zoom * (1 - off), zoom * (1 + off))}

    @property
    def is_neutral(self) -> bool:
        """Whether nothing is aligned: no colour camera has so wide a lens."""
        return self.zoom < _WIDEST

    def stored(self, camera: Camera) -> Camera:
        """The camera as an aligned one: to its own colour camera, or to the one that the parameters put beside it."""
        return _aligned(camera, self.x, self.zoom, self.roll) if camera.color is None else camera.aligned_to_color()

    def bend(self, view: View) -> None:
        """From the colour camera's pose to that of the left imager, whose rays are cast."""
        assert view.camera.color is not None
        view.pose = view.pose @ np.linalg.inv(view.camera.color.pose)

    def apply(self, frame: Frame) -> None:
        """Resample the picture."""
        camera, color = frame.camera, frame.camera.color
        assert color is not None
        out = np.empty(color.shape, np.float32)
        to = np.linalg.inv(color.pose)
        pose = np.concatenate([to[:3, :3].reshape(-1), to[:3, 3]]).astype(np.float32)
        lens = np.array([color.fx, color.fy, color.cx, color.cy, *color.distortion], np.float32)
        within, unit = _f(0.5 * (1 - self.overlap)), _f(camera.depth_scale)
        _resample(frame.depth, *_corner_rays(camera), pose, lens, unit, within, out)
        frame.resize(out, self.stored(camera), Geometry.empty((0, 0), right=False))
