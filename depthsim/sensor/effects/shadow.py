"""Where there is nothing to match: what the right imager does not see, and what lies outside its image."""

from typing import ClassVar

import numpy as np

from depthsim.kernels import inlined, kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_f = np.float32
_ZERO, _ONE = _f(0), _f(1)
_MOST = _f(4)
"""The widest hole, in medians; the 6 % that are wider in those frames also have other causes."""
_ROWS, _COLUMNS = 12, 32
"""[px] The patches of the image whose edges have one margin: in those frames the holes' widths are correlated by 0.9
from row to row, 0.75 over four rows and 0.5 to 0.65 over twelve."""
_FAR = 200
"""[px] Farther than any shadow reaches."""
_STRETCH = 32
"""[px] So much of a row is looked at at once."""
_MEASURED = "640x480 frames of a D435"


@inlined
def _hole_width(median, u):
    """Pixels of a hole, rounded: log-logistic of shape 2, median·√(u / (1 - u))."""
    return np.int32(median * min(np.sqrt(u / (_ONE - u)), _MOST) + _f(0.5))


@inlined
def _begins(d, seen, step):
    """Whether a shadow or an edge begins among pixels of a row; d: their disparities, after that of the one before."""
    before, own, some = d[: seen.size], d[1:], np.int32(0)
    for i in range(seen.size):
        some |= np.int32(seen[i] == np.uint8(0)) | np.int32(abs(before[i] - own[i]) > step)
    return some != 0


@kernel
def _lose_hidden(
    start,
    stop,
    width,
    share,
    left,
    right,
    inside,
    step,
    focal_baseline,
    uniform,
    turn,
    clean,
    right_sees,
    depth,
    shadow,
):
    """Rows ``start`` to ``stop``, in pixels. shadow: 1 where what is hidden stays empty, of all pixels or of none."""
    row_disparity = np.empty(width + 1, np.float32)
    for at in range(start, stop, width):
        z, seen, measured = clean[at : at + width], right_sees[at : at + width], depth[at : at + width]
        draw, chance = uniform[at // width // _ROWS], turn[at // width // _ROWS]
        d = row_disparity[:width]
        for u in range(width):
            d[u] = focal_baseline / z[u] if z[u] > _ZERO else _ZERO
        first = -1
        for begin in range(0, width + 1, _STRETCH):
            end = min(begin + _STRETCH, width + 1)
            # Nothing begins in most stretches: a look at all their pixels at once costs a fifth of one at each.
            if first < 0 and begin > 0 and end <= width and not _begins(d[begin - 1 : end], seen[begin:end], step):
                continue
            for u in range(begin, end):
                if u < width and seen[u] == np.uint8(0):
                    # Open background is not seen either, but nothing hides there; a shadow may reach across it.
                    first = u if first < 0 and z[u] > _ZERO else first
                elif first >= 0 or (0 < u < width and _ZERO < d[u - 1] < d[u] - step):
                    # Left of a thin thing both imagers see the background: there is the margin alone.
                    first = first if first >= 0 else u
                    if chance[(u - 1) // _COLUMNS] < share:
                        near = d[u] - step if u < width else _f(np.inf)
                        for k in range(first, u):
                            measured[k] = _ZERO
                        if shadow.size and u - first >= step:
                            shadow[at + first : at + u] = 1
                        wider = _hole_width(left, draw[(u - 1) // _COLUMNS])
                        for k in range(first - 1, max(first - 1 - wider, -1), -1):
                            if d[k] > near:
                                break
                            measured[k] = _ZERO
                        for k in range(u, min(u + _hole_width(inside, draw[(u - 1) // _COLUMNS]), width)):
                            if d[k] <= near:
                                break
                            measured[k] = _ZERO
                    first = -1
                if 0 < u < width and d[u - 1] > d[u] + step and chance[u // _COLUMNS] < share:
                    for k in range(u, min(u + _hole_width(right, draw[u // _COLUMNS]), width)):
                        if d[k] > d[u - 1] - step:
                            break
                        measured[k] = _ZERO


@kernel
def _along_row(start, stop, width, shadow):
    """Rows ``start`` to ``stop``, in pixels. In place of a shadow how far away in its row the next one is [px]."""
    for at in range(start, stop, width):
        row = shadow[at : at + width]
        away = np.int32(_FAR)
        for u in range(width):
            away = np.int32(0) if row[u] == 1 else min(away + 1, _FAR)
            row[u] = away
        for u in range(width - 1, -1, -1):
            away = min(np.int32(row[u]), away + 1)
            row[u] = away


@kernel
def _lose_around(start, stop, width, around, dither, away, depth):
    """Rows ``start`` to ``stop``, in pixels. away: as :func:`_along_row` leaves it, of the whole picture."""
    reach, squared = np.int32(around + _ONE), np.empty(width, np.int32)
    for at in range(start, stop, width):
        measured, row = depth[at : at + width], dither[at // width // _ROWS]
        for u in range(width):
            radius = max(around + row[u // _COLUMNS] - _f(0.5), _ZERO)
            squared[u] = np.int32(radius * radius)
        for dv in range(max(-reach, -(at // width)), min(reach + 1, (away.size - at) // width)):
            other = away[at + dv * width : at + (dv + 1) * width]
            for u in range(width):
                across = np.int32(other[u])
                measured[u] = _ZERO if across * across + dv * dv <= squared[u] else measured[u]


class StereoShadow(Effect):
    """No depth where a near object hides the background from the right imager.

    The shadow lies left of the object and is as wide as the disparity's step, plus a margin; on the object's right, and
    left of one that is narrower than the step, both imagers see the background, and there is a narrow margin alone,
    because the matching window is on both sides of the edge. Some matchers lose the object's own pixels beside its
    shadow, too, or all that is near a shadow, above and below it as well, whatever it is. Open background, where
    nothing is hit, hides nothing. A margin is median·√(u / (1 - u)), u uniform, at most four medians; it is drawn for
    patches of 12 rows and 32 columns, and so is by how much of a pixel the distance all round is rounded up.
    """

    id: ClassVar[str] = "stereo_shadow"
    stage: ClassVar[Stage] = Stage.HOLES
    needs_right: ClassVar[bool] = True
    source: ClassVar[str] = f"geometry of two imagers; margins and their law measured on {_MEASURED}"
    axes = ("edge_distance", "pixel_neighbours")
    kinds = ("missing",)
    recording = "a near object before a far background"
    besides = ("inside",)
    forms = ({"around": 0.0}, {"left": 0.0, "right": 0.0, "inside": 0.0})

    share: float = parameter(
        0.998,
        low=0,
        high=1,
        unit="share",
        neutral=0,
        about="share of the shadows that stay empty",
        source=f"{_MEASURED}: 0.2 % of the jumps to something nearer have no hole",
        starts=(0.9,),
    )
    left: float = parameter(
        1.6,
        low=0,
        high=20,
        unit="px",
        about="median of what the shadow is wider than the step",
        source=f"{_MEASURED}: quartiles 0.8, 1.7, 4.2",
        starts=(1.0,),
    )
    right: float = parameter(
        3.0,
        low=0,
        high=20,
        unit="px",
        about="median width of the holes on an object's right",
        source=f"{_MEASURED}: quartiles 2, 3, 6; 3.5 % have none",
        starts=(0.5,),
    )
    inside: float = parameter(
        0.0,
        low=0,
        high=20,
        unit="px",
        about="median of what is lost of the object itself, beside its shadow",
        source="none: for matchers that invalidate what is around a shadow, too",
        starts=(0.5,),
    )
    around: float = parameter(
        0.0,
        low=0,
        high=20,
        unit="px",
        about="how far from a shadow, in any direction, all else is lost as well",
        source="none: for matchers that invalidate pixels whose neighbours have no match",
        starts=(1.0, 4.0),
    )
    step: float = parameter(
        1.0,
        low=0.1,
        high=20,
        unit="px",
        about="least step of the disparity that makes an edge, and least width of a shadow that reaches around it",
        source="assumed",
        starts=(0.4,),
    )

    def apply(self, frame: Frame) -> None:
        """Set what is hidden, and the margins, to 0."""
        seen = frame.geometry.right_sees
        if seen is None:
            raise ValueError("stereo_shadow needs geometry that was cast with right=True")
        draws, width = frame.draws(self.id), frame.camera.width
        patches = -(-frame.camera.height // _ROWS), -(-width // _COLUMNS)
        uniform, turn = (draws.uniform(patches, stream) for stream in (0, 1))
        shadow = np.zeros(seen.size if self.around > 0 else 0, np.uint8)
        frame.run(
            _lose_hidden, width, _f(self.share), _f(self.left), _f(self.right), _f(self.inside),
            _f(self.step), _f(frame.camera.focal_baseline), uniform, turn, frame.geometry.depth.reshape(-1),
            seen.reshape(-1), frame.depth.reshape(-1), shadow, multiple=width,
        )  # fmt: skip
        if self.around > 0:
            dither = draws.uniform(patches, 2)
            frame.run(_along_row, width, shadow, multiple=width)
            frame.run(
                _lose_around, width, _f(self.around), dither, shadow, frame.depth.reshape(-1), multiple=width
            )  # fmt: skip


@kernel
def _lose_band(start, stop, width, slope, margin, clean, depth):
    """Rows ``start`` to ``stop``, in pixels. slope: f·b times the slope."""
    for at in range(start, stop, width):
        z, measured = clean[at : at + width], depth[at : at + width]
        for u in range(width):
            measured[u] = measured[u] if (_f(u) - margin) * z[u] >= slope else _ZERO


class InvalidBand(Effect):
    """No depth in columns u < slope · disparity + margin: their match lies left of the right image's border."""

    id: ClassVar[str] = "invalid_band"
    stage: ClassVar[Stage] = Stage.HOLES
    source: ClassVar[str] = f"geometry of two imagers; margin measured on {_MEASURED}"
    axes = ("image_column", "image_position")
    kinds = ("missing",)
    recording = "a near wall that fills the left border of the picture"

    slope: float = parameter(
        1.0,
        low=0,
        high=4,
        unit="px/px",
        neutral=0,
        about="band's width per disparity",
        source="geometry; 1.01 measured",
        frozen=True,
    )
    margin: float = parameter(
        7.0,
        low=0,
        high=100,
        unit="px",
        neutral=0,
        about="band's width besides",
        source=f"{_MEASURED}: bands are 7.5 px wider than the disparity, half a pixel of it from rounding up",
        starts=(0.5, 4.0, 12.0),
    )

    @property
    def is_neutral(self) -> bool:
        """Whether the band has no width at any disparity."""
        return self.slope == 0 and self.margin == 0

    def apply(self, frame: Frame) -> None:
        """Set the band to 0."""
        width, slope = frame.camera.width, _f(self.slope * frame.camera.focal_baseline)
        clean = frame.geometry.depth.reshape(-1)
        frame.run(_lose_band, width, slope, _f(self.margin), clean, frame.depth.reshape(-1), multiple=width)
