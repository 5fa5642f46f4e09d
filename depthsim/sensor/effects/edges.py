"""Depth edges: foreground grown over background, and depths in between."""

from typing import ClassVar

import numpy as np

from depthsim.kernels import kernel
from depthsim.raycast import Geometry
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_f = np.float32
_ZERO, _NONE = _f(0), _f(np.nan)
_PATCH = 4
"""[px] Depths in between come in clumps."""


@kernel
def _find_nearest(start, stop, width, reach, focal_baseline, clean, disparity, most):
    """The disparity, and the widest one within ``reach`` columns; rows ``start`` to ``stop``, in pixels."""
    for at in range(start, stop, width):
        z, d, m = clean[at : at + width], disparity[at : at + width], most[at : at + width]
        for u in range(width):
            d[u] = focal_baseline / z[u] if z[u] > _ZERO else _ZERO
        m[:] = d
        for k in range(1, min(reach, width - 1) + 1):
            for u in range(width - k):
                m[u] = max(m[u], d[u + k])
            for u in range(width - k):
                m[u + k] = max(m[u + k], d[u])


@kernel
def _grow(start, stop, width, reach, radius, aspect, step, uniform, disparity, most, before, after):
    """Background within ``radius`` of a foreground becomes it, ``aspect`` times that above and below; rows ``start`` to
    ``stop``, in pixels.

    before: (pixels,) each: measured depth, then clean depth, face, cosine and tag. after: copies of them, changed.
    """
    measured, clean, face, cosine, tag = before
    depth, new_clean, new_face, new_cosine, new_tag = after
    height, half = disparity.size // width, _f(0.5)
    tallest = np.empty(width, np.float32)
    for at in range(start, stop, width):
        v = at // width
        tallest[:] = most[at : at + width]
        down = np.int32(reach * aspect + half)
        for k in range(max(v - down, 0), min(v + down + 1, height)):
            row = most[k * width : k * width + width]
            for u in range(width):
                tallest[u] = max(tallest[u], row[u])
        own = disparity[at : at + width]
        for u in range(width):
            if tallest[u] <= own[u] + step or own[u] == _ZERO:
                continue
            best, found = own[u] + step, -1
            for ring in range(1, np.int32(radius + uniform[at + u]) + 1):
                down = np.int32(ring * aspect + half)
                for y in range(max(v - down, 0), min(v + down + 1, height)):
                    for x in range(max(u - ring, 0), min(u + ring + 1, width)):
                        if disparity[y * width + x] > best:
                            best, found = disparity[y * width + x], y * width + x
                if found >= 0:
                    break
            if found >= 0 and measured[found] > _ZERO:
                depth[at + u], new_clean[at + u] = measured[found], clean[found]
                new_face[at + u], new_cosine[at + u], new_tag[at + u] = face[found], cosine[found], tag[found]


@kernel
def _move_shadow(start, stop, width, radius, uniform, clean, grown, seen, sees):
    """What is hidden from the right imager when the foreground has grown; rows ``start`` to ``stop``, in pixels."""
    for at in range(start, stop, width):
        for i in range(at + 1, at + width):
            # Open background is not seen either, but nothing hides there.
            if seen[i] < seen[i - 1] and clean[i] > _ZERO:
                for k in range(max(i - np.int32(radius + uniform[i]), at), i):
                    sees[k] = np.uint8(0)
        g, z, s = grown[at : at + width], clean[at : at + width], sees[at : at + width]
        for u in range(width):
            s[u] = np.uint8(1) if g[u] < z[u] else s[u]


class EdgeFattening(Effect):
    """Foreground grown over background: within ``radius`` of a nearer surface a pixel gets that surface's depth.

    A matching window that lies over the edge follows the stronger texture. The radius is rounded up or down by chance,
    pixel by pixel. For later effects the pixel shows that surface, with its material and incidence, too; open
    background stays open. The shadow of :class:`~depthsim.sensor.effects.shadow.StereoShadow` moves with the edge.
    """

    id: ClassVar[str] = "edge_fattening"
    stage: ClassVar[Stage] = Stage.MIXING
    source: ClassVar[str] = "Scharstein and Szeliski 2002, section 3.2, on windows over depth discontinuities"
    axes = ("edge_distance",)
    kinds = ("bias", "tail")
    recording = "a sharp straight edge before a far background"
    forms: ClassVar = ({"aspect": 1.0}, {"aspect": 0.0})

    radius: float = parameter(
        1.5,
        low=0,
        high=8,
        unit="px",
        neutral=0,
        about="how far it grows",
        source="assumed; half a 7 px window is 3 px",
        starts=(0.5, 2.0),
    )
    step: float = parameter(
        1.0,
        low=0.1,
        high=20,
        unit="px",
        about="least step of the disparity that makes an edge",
        source="assumed",
        starts=(0.4,),
    )
    aspect: float = parameter(
        1.0,
        low=0,
        high=1,
        unit="1",
        about="how far it grows above and below over how far to the sides",
        source="assumed: a square window; 0 of one along a row",
        frozen=True,
    )

    def apply(self, frame: Frame) -> None:
        """Grow the foreground, in the depth and in what later effects take for the geometry."""
        geometry, width, reach = frame.geometry, frame.camera.width, int(np.ceil(self.radius))
        focal_baseline, radius = _f(frame.camera.focal_baseline), _f(self.radius)
        uniform, depth = frame.draws(self.id).uniform(frame.depth.shape).reshape(-1), frame.depth
        disparity, most, measured = (frame.empty().reshape(-1) for _ in range(3))
        pictures = geometry.depth, geometry.face, geometry.cosine, geometry.tag
        copies = [frame.empty(picture.dtype) for picture in pictures]
        for picture, copy in zip((depth, *pictures), (measured.reshape(depth.shape), *copies), strict=True):
            copy[:] = picture
        clean, grown = geometry.depth.reshape(-1), copies[0].reshape(-1)
        frame.run(_find_nearest, width, reach, focal_baseline, clean, disparity, most, multiple=width)
        before = measured, *(picture.reshape(-1) for picture in pictures)
        after = depth.reshape(-1), *(copy.reshape(-1) for copy in copies)
        shape = radius, _f(self.aspect), _f(self.step)
        frame.run(_grow, width, reach, *shape, uniform, disparity, most, before, after, multiple=width)
        sees = geometry.right_sees
        if sees is not None:
            seen, sees = sees, frame.empty(np.uint8)
            sees[:] = seen
            arrays = (uniform, clean, grown, seen.reshape(-1), sees.reshape(-1))
            frame.run(_move_shadow, width, radius, *arrays, multiple=width)
        frame.geometry = Geometry(copies[0], copies[1], copies[2], copies[3], sees)


@kernel
def _mix(start, stop, width, reach, rate, step, by_place, focal_baseline, chance, weight, clean, measured, depth):
    """Mix the pixels of the drawn patches; rows ``start`` to ``stop``, in pixels."""
    height, disparity = clean.size // width, np.empty((2 * reach + 1, _PATCH + 2 * reach), np.float32)
    for v in range(start // width, stop // width):
        top, below = max(v - reach, 0), min(v + reach + 1, height)
        for patch in range(chance.shape[1]):
            if chance[v // _PATCH, patch] >= rate:
                continue
            w, first = weight[v // _PATCH, patch], patch * _PATCH
            left, end = max(first - reach, 0), min(first + _PATCH + reach, width)
            least, most = _f(np.inf), _ZERO
            for y in range(top, below):
                row = y * width
                z, m, d = clean[row + left : row + end], measured[row + left : row + end], disparity[y - top]
                for x in range(z.size):
                    # What is not a number lies across no edge.
                    d[x] = focal_baseline / z[x] if (z[x] > _ZERO) & (m[x] > _ZERO) else _NONE
                    least, most = d[x] if d[x] < least else least, d[x] if d[x] > most else most
            if not most - least > step:
                continue
            for u in range(first, min(first + _PATCH, width)):
                own, widest, other, i = disparity[v - top, u - left], step, -1, v * width + u
                begin, past = max(u - reach, 0), min(u + reach + 1, width)
                for y in range(top, below):
                    for x in range(begin, past):
                        if abs(disparity[y - top, x - left] - own) > widest:
                            widest, other = abs(disparity[y - top, x - left] - own), y * width + x
                if other >= 0 and by_place:
                    beyond = 0
                    for y in range(top, below):
                        for x in range(begin, past):
                            beyond += abs(disparity[y - top, x - left] - own) > _f(0.5) * widest
                    w = _f(beyond) / _f((below - top) * (past - begin))
                if other >= 0:
                    depth[i] = measured[i] * measured[other] / (measured[other] + w * (measured[i] - measured[other]))


class FlyingPixels(Effect):
    """Depths in between at depth edges: the disparity is (1 - w)·d + w·d', d' from across the edge.

    An edge is where the disparity steps by more than ``step`` within ``reach`` rows and columns; d' is the one there
    that differs most. Whole patches of 4x4 pixels are drawn, of which those near an edge are mixed, by a uniform w for
    each patch; or ``by_place``: w is how much of the window around a pixel lies across the edge.
    """

    id: ClassVar[str] = "flying_pixels"
    stage: ClassVar[Stage] = Stage.MIXING
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "640x480 frames of a D435; form assumed"
    axes = ("edge_distance", "residual_tail")
    kinds = ("tail", "spread")
    recording = "a thin object before a far background"
    forms: ClassVar = ({"by_place": 0}, {"by_place": 1})
    shown: ClassVar = {"rate": 0.5}

    rate: float = parameter(
        0.024,
        low=0,
        high=1,
        unit="share",
        neutral=0,
        about="share of the pixels near edges",
        source="640x480 frames of a D435: 2.4 % of what is near edges, nearly all of it at steps below 6 px",
        starts=(0.1, 0.5),
    )
    reach: int = parameter(
        2, low=1, high=8, unit="px", about="how far from the edge", source="assumed", starts=(1, 2, 3)
    )
    step: float = parameter(
        1.0,
        low=0.1,
        high=20,
        unit="px",
        about="least step of the disparity that makes an edge",
        source="assumed",
        starts=(0.3, 1.0),
    )
    by_place: int = parameter(
        0,
        low=0,
        high=1,
        unit="1",
        about="1: both sides are mixed by how much of each is in the window of ``reach``; 0: by chance",
        source="a matching window over an edge sees both surfaces",
        frozen=True,
    )

    def apply(self, frame: Frame) -> None:
        """Mix the drawn pixels with what is across the edge."""
        draws, depth, width = frame.draws(self.id), frame.depth.reshape(-1), frame.camera.width
        patches, measured = (-(-frame.camera.height // _PATCH), -(-width // _PATCH)), frame.empty().reshape(-1)
        measured[:] = depth
        frame.run(
            _mix, width, self.reach, _f(self.rate), _f(self.step), bool(self.by_place), _f(frame.camera.focal_baseline),
            draws.uniform(patches), draws.uniform(patches, stream=1), frame.geometry.depth.reshape(-1), measured,
            depth, multiple=width,
        )  # fmt: skip
