"""Errors that stay where they are in frames far apart: at their pixels, or at their places in the scene."""

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import distort
from depthsim.gap.depth.data.frames import CleanFrame

_LEAST = 100
"""Pixels that two frames share, with fewer of which nothing is said."""
_APART = 8
"""[px] A place in the scene must lie so far from where it was, as neighbours of a pixel may go together."""
_SAME = 0.01
"""Of the depth: what is seen where a place should be, if it is nearer or farther by more, is another one."""

_ENOUGH = 20_000
"""Pixels of a frame that are looked for in another one, about."""

Signs = NDArray[np.int8]


def locked_share(signs: Iterable[Signs]) -> float:
    """How errors of a pixel go together from frame to frame: the mean product of their signs over the frames' means.

    signs: (rows, columns) of frames far apart in time, as for :func:`~depthsim.gap.depth.data.waves.strongest_wave`.
    0 for noise that is drawn anew, or of fewer than two frames; 1 where every error stays on its side.
    """
    shares = [together(one.reshape(-1), other.reshape(-1)) for one, other in combinations(signs, 2)]
    return float(np.mean([share for share, pixels in shares if pixels >= _LEAST] or [0.0]))


class SeenAgain(NamedTuple):
    """Pixels of one frame whose places in the scene another frame sees, too, and the pixels there."""

    one: int
    other: int
    here: NDArray[np.intp]
    there: NDArray[np.intp]


def carried_share(signs: Sequence[Signs], seen: Iterable[SeenAgain]) -> float:
    """How errors of a place in the scene go together, as :func:`locked_share` of a pixel; 0 where none is seen twice.

    signs: (rows, columns) of frames; seen: of two of them each, see :func:`seen_again`.
    """
    flat = [one.reshape(-1) for one in signs]
    shares = [together(flat[pair.one][pair.here], flat[pair.other][pair.there]) for pair in seen]
    total = sum(pixels for _, pixels in shares)
    return sum(share * pixels for share, pixels in shares) / total if total >= _LEAST else 0.0


def seen_again(frames: Sequence[CleanFrame]) -> list[SeenAgain]:
    """Places in the scene that two frames see, as far as the camera's motion has moved them well over the picture."""
    return [
        SeenAgain(one, other, *_seen_again(frames[one], frames[other]))
        for one, other in combinations(range(len(frames)), 2)
    ]


def together(one: Signs, other: Signs) -> tuple[float, int]:
    """The mean product of signs over the product of the means, and of how many pixels."""
    both = (one != 0) & (other != 0)
    a, b = one[both].astype(np.float64), other[both].astype(np.float64)
    return (float((a * b).mean() - a.mean() * b.mean()) if len(a) else 0.0), len(a)


def _seen_again(first: CleanFrame, second: CleanFrame) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Some pixels of a frame whose surface is seen in another one, too, at another place, and the pixels there."""
    depth, camera = first.geometry.depth.reshape(-1), second.camera
    here = np.flatnonzero(depth > 0)
    here = here[:: max(1, len(here) // _ENOUGH)]
    depth = depth[here].astype(np.float64)
    x, y = first.camera.rays.reshape(2, -1)[:, here]
    a, b, z, _ = np.linalg.inv(second.pose) @ first.pose @ np.stack([x * depth, y * depth, depth, np.ones_like(depth)])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        a, b = distort(a / z, b / z, camera.distortion) if any(camera.distortion) else (a / z, b / z)
        u, v = np.rint(camera.fx * a + camera.cx), np.rint(camera.fy * b + camera.cy)
    inside = (z > 0) & (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.whole.height)
    row = np.full(camera.whole.height, -1, np.intp)
    row[camera.rows] = np.arange(camera.height)
    here, z, column = here[inside], z[inside], u[inside].astype(np.intp)
    line = row[v[inside].astype(np.intp)]
    there = line * camera.width + column
    from_row, from_column = np.divmod(here, first.camera.width)
    moved = np.hypot(column - from_column, v[inside] - first.camera.rows[from_row])
    known = (line >= 0) & (moved >= _APART)
    here, there, z = here[known], there[known], z[known]
    same = np.abs(second.geometry.depth.reshape(-1)[there] - z) <= _SAME * z
    return here[same], there[same]
