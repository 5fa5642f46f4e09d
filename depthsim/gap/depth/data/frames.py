"""What a diagnosis looks at of a recording, and what is known of it before any sensor has looked.

The work is bounded by a budget of pixels. Frames are in blocks over the whole time. Of large frames it is bands of rows
in full width: what goes on beside an edge or between neighbours needs pixels that hang together, and all columns that
the right imager sees. A block has one in each third of the picture, so that blocks show the same kinds of things, and
every block other ones, so that each part of the blocks (see :class:`Evidence`) sees the picture from top to bottom.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain, pairwise, permutations
from math import gcd

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.gap.config import DepthData
from depthsim.gap.depth.data.counting import Together
from depthsim.raycast import Caster, Geometry

BANDS = 3
MARGIN = 12
"""[px] Rows at a cut that are simulated and not counted, as effects act on them from beyond the cut."""
_GOLDEN = (5**0.5 - 1) / 2
"""Multiples of it are spread evenly modulo 1, and never come back."""


@dataclass
class CleanFrame:
    """One frame without a sensor.

    camera: that of the rows that are looked at; counted: which of them are counted. across: (pixels,) the clean
    depth beyond an edge [m], 0 where there is none. per_spread: (pixels,) 1 over the simulator's own spread of the
    depth [1/m]. places: (axes, pixels that are counted), see :func:`counting.places`. together: the axes
    that are counted together, of which :func:`counting.bundles` says which these are. expected: (pixels,) the depth
    that errors are measured from [m]; the clean one where None.
    """

    index: int
    stamp: float
    pose: NDArray[np.float64]
    camera: Camera
    counted: NDArray[np.intp]
    geometry: Geometry
    across: NDArray[np.float32]
    per_spread: NDArray[np.float32]
    places: NDArray[np.unsignedinteger]
    together: list[Together] = field(default_factory=list)
    expected: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        """Many sensors will see the geometry."""
        self.geometry.kept = {}


def cast_clean(caster: Caster, camera: Camera, pose: NDArray[np.float64], stamp: float = 0.0) -> Geometry:
    """What a camera sees from a pose (4, 4) at ``stamp`` [s], and whether the imagers beside it see that, too.

    Of an aligned camera those are both imagers, of others the right one.
    """
    if not camera.aligned:
        return caster.cast(camera, pose, right=True, stamps=stamp, threads=1)
    left = float(camera.left_pose[0, 3])
    met = caster.cast(_beside(camera, left + camera.baseline), pose, right=True, stamps=stamp, threads=1)
    if abs(left) > 1e-6:
        other = caster.cast(_beside(camera, left), pose, right=True, stamps=stamp, threads=1)
        assert met.right_sees is not None and other.right_sees is not None
        np.minimum(met.right_sees, other.right_sees, out=met.right_sees)
    return met


def _beside(camera: Camera, x: float) -> Camera:
    """The same view with its other imager at ``x`` [m]; not checked, because that may be to the left."""
    plain = {"baseline": x, "color": None, "aligned": False, "depth": None}
    return Camera.model_construct(**{**dict(camera), **plain})


def select_frames(count: int, width: int, limit: DepthData, lag: int = 1) -> list[NDArray[np.int64]]:
    """Blocks of frames in a row, spread over the run; a short run is taken whole. width: of a frame [px]; lag: how far
    apart the frames of a block are.

    Neighbours in time are alike, and a block is never parted between fitting and validating.
    """
    wanted = int(np.clip(limit.pixels // (width * limit.least_rows), limit.least_frames, limit.most_frames))
    length = int(np.clip(min(count, wanted) // 10, 1 if count < 8 else 2, limit.block))
    number = max(min(count, wanted) // length, 1)
    if count <= wanted + length:
        return pair_frames(count, lag) if lag > 1 else [b for b in np.array_split(np.arange(count), number) if len(b)]
    starts = np.linspace(0, count - 1 - (length - 1) * lag, number).round().astype(np.int64)
    blocks: list[NDArray[np.int64]] = []
    taken: set[int] = set()
    for block in (np.arange(start, start + length * lag, lag) for start in np.unique(starts)):
        if taken.isdisjoint(block.tolist()):  # far apart, they would reach into the next one
            blocks.append(block)
            taken.update(block.tolist())
    return blocks


def pair_frames(count: int, lag: int) -> list[NDArray[np.int64]]:
    """All frames in pairs that are so many apart; those that are left at the end are alone."""
    firsts = [begin + k for begin in range(0, count - 2 * lag + 1, 2 * lag) for k in range(lag)]
    return [
        *(np.array([first, first + lag]) for first in firsts),
        *(np.array([k]) for k in range(2 * len(firsts), count)),
    ]


def deal_blocks(count: int, parts: int) -> list[list[int]]:
    """The numbers of the blocks in each part: of every ``parts`` in a row one each, in changing orders.

    In one order, what comes back after as many blocks, such as an exposure that hunts, would fall to one part alone.
    Two parts take turns, as they are of few blocks, and both are to span the time.
    """
    orders = list(permutations(range(parts))) if parts > 2 else [(0, 1)]
    turns = [orders[int(turn * _GOLDEN % 1 * len(orders))] for turn in range(count // parts)]
    dealt = [*chain(*turns), *range(count % parts)]
    return [[block for block, own in enumerate(dealt) if own == part] for part in range(parts)]


def select_rows(
    blocks: Sequence[NDArray[np.int64]], camera: Camera, dealt: Sequence[Sequence[int]], limit: DepthData
) -> list[Camera]:
    """The camera that each block is looked at with: the whole one, or the rows of a band in each third of its picture.

    dealt: the numbers of the blocks in each part. Its bands are spread evenly from the first row to the last, in an
    order that has little to do with time. All blocks have as many rows.
    """
    rows = max(limit.pixels // (sum(map(len, blocks)) * camera.width), limit.least_rows) // BANDS
    if BANDS * rows >= camera.height or camera.aligned:  # the imagers of an aligned camera have other rows
        return [camera] * len(blocks)
    found, ends = [camera] * len(blocks), np.linspace(0, camera.height, BANDS + 1)
    for part, own in enumerate(dealt):
        count = len(own)
        turn = next(k for k in range(round(0.62 * count) or 1, count + 2) if gcd(k, count) == 1)
        for place, number in enumerate(own):
            share = (place * turn + part * count // len(dealt)) % count / max(count - 1, 1)
            firsts = [round(a + share * (b - a - rows)) for a, b in pairwise(ends)]
            found[number] = camera.window(np.concatenate([np.arange(first, first + rows) for first in firsts]))
    return found


def inner_rows(camera: Camera) -> NDArray[np.bool_]:
    """(height,): which rows are not near a cut."""
    rows = np.concatenate([[-1], camera.rows, [camera.whole.height]])
    cuts = np.flatnonzero(np.diff(rows) > 1)  # above these
    near = np.abs(np.arange(camera.height)[:, None] + 0.5 - cuts).min(axis=1, initial=np.inf) < MARGIN
    return np.asarray(~near)


def counted_rows(camera: Camera, index: int, stride: int) -> NDArray[np.intp]:
    """One of every ``stride`` rows that are not near a cut, drawn anew for each frame, so that all have their turn.

    By turns, every other row would be told as every other frame.
    """
    rows = np.flatnonzero(inner_rows(camera))
    some = np.arange(0, len(rows) - stride + 1, stride)
    return rows[some + np.random.default_rng(index).integers(stride, size=len(some))]
