"""Objects of a scene: which faces are whose, and where those that move are at any time."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthsim.trajectory.poses import Trajectory
from depthsim.trajectory.rotation import Floats, multiply, rotation_matrices, slerp

NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")
"""What an object may be called: its files have that name."""


_IDENTITY = Trajectory(np.zeros(1), np.zeros((1, 3)), np.array([[0.0, 0, 0, 1]]))


@dataclass(frozen=True)
class Instance:
    """One object: so many ``faces`` of its scene, after those of the objects before it."""

    name: str
    faces: int


@dataclass(frozen=True, eq=False)
class Mover:
    """A rigid object that moves. Its vertices are those of the scene, in its own frame [m].

    name: of its instance. faces, vertices: first and last + 1 of each in the scene's arrays.
    path: its poses in its parent's frame, or in the world; None for the identity. Before and after, it is held there,
    or begins anew if it is ``repeated``.
    parent: the place of its parent among the scene's movers, which is before its own; None for the world.
    begin: the stamp at which ``path`` begins; None where that is ``delay`` [s] after a run's first frame, which is
    taken to be at 0 until it is known.
    spec: the keys of ``moves:`` in a scene file, but for ``begin`` and ``stamp``.
    """

    name: str
    faces: tuple[int, int]
    vertices: tuple[int, int]
    path: Trajectory | None = None
    parent: int | None = None
    begin: float | None = None
    repeated: bool = False
    spec: dict[str, Any] = field(default_factory=dict)
    delay: float = 0.0

    @property
    def zero(self) -> float:
        """The stamp at which ``path`` begins, as far as it is known."""
        return self.delay if self.begin is None else self.begin

    def between(self, stamps: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats]:
        """(N,) places of the poses of ``path`` before and after each of ``stamps`` [s], and the share of the way."""
        path = self.path
        if path is None or len(path) == 1:
            none = np.zeros(len(stamps), np.int64)
            return none, none, np.zeros(len(stamps))
        first, last = path.stamps[0], path.stamps[-1]
        time = stamps if self.zero == first else stamps - self.zero + first
        if self.repeated and last > first:
            time = first + np.mod(time - first, last - first)
        time = np.minimum(np.maximum(time, first), last)
        after = np.minimum(np.searchsorted(path.stamps, time, side="right"), len(path) - 1)
        before = after - 1
        begin = path.stamps[before]
        return before, after, (time - begin) / (path.stamps[after] - begin)

    def held(self, stamps: ArrayLike) -> float:
        """How much of the time from the first to the last of ``stamps`` its path does not cover [s]."""
        if self.path is None or self.repeated or len(self.path) == 1:
            return 0.0
        first, last = float(np.min(stamps)), float(np.max(stamps))
        begin, end = self.zero, self.zero + self.path.duration
        covered = max(min(last, end) - max(first, begin), 0.0)
        return last - first - covered


def started(movers: Sequence[Mover], stamp: float) -> tuple[Mover, ...]:
    """The movers of a run whose first frame is at ``stamp`` [s]."""
    return tuple(
        replace(mover, begin=stamp + mover.delay) if mover.begin is None and mover.path is not None else mover
        for mover in movers
    )


def tracks(movers: Sequence[Mover], stamps: ArrayLike) -> list[tuple[Floats, Floats]]:
    """Of each mover (N, 3) positions [m] and (N, 4) quaternions x y z w in the world at ``stamps`` [s]."""
    if not movers:
        return []
    stamps = np.atleast_1d(np.asarray(stamps, np.float64))
    # One slerp for all: with a few stamps and some objects NumPy's calls are what takes the time.
    ends: tuple[list[Floats], ...] = ([], [], [], [], [])
    for mover in movers:
        before, after, share = mover.between(stamps)
        path = mover.path or _IDENTITY
        at = (path.positions[before], path.positions[after], path.quaternions[before], path.quaternions[after], share)
        for values, own in zip(ends, at, strict=True):
            values.append(own)
    p0, p1, q0, q1, share = (np.concatenate(values) for values in ends)
    positions = (p0 + share[:, None] * (p1 - p0)).reshape(len(movers), -1, 3)
    turns = slerp(q0, q1, share).reshape(len(movers), -1, 4)
    found: list[tuple[Floats, Floats]] = []
    for mover, position, turn in zip(movers, positions, turns, strict=True):
        if mover.parent is None:
            found.append((position, turn))
        else:
            base, base_turn = found[mover.parent]
            shift = np.einsum("nij,nj->ni", rotation_matrices(base_turn), position)
            found.append((base + shift, multiply(base_turn, turn)))
    return found


def poses(movers: Sequence[Mover], stamps: ArrayLike) -> Floats:
    """(N, movers, 4, 4) object to world at ``stamps`` [s]."""
    stamps = np.atleast_1d(np.asarray(stamps, np.float64))
    out = np.zeros((len(stamps), len(movers), 4, 4))
    out[..., 3, 3] = 1
    if movers:
        found = tracks(movers, stamps)
        turns = rotation_matrices(np.concatenate([turn for _, turn in found]))
        out[..., :3, :3] = turns.reshape(len(movers), len(stamps), 3, 3).swapaxes(0, 1)
        out[..., :3, 3] = np.stack([position for position, _ in found], axis=1)
    return out


def mover_of_face(movers: Sequence[Mover], face: NDArray[np.int32]) -> NDArray[np.int32]:
    """The place of the mover that each face belongs to; -1 for faces that stand and for no face."""
    if not movers:
        return np.full(face.shape, -1, np.int32)
    starts = [mover.faces[0] for mover in movers]
    return (np.searchsorted(starts, face, side="right") - 1).astype(np.int32)


def objects_seen(
    movers: Sequence[Mover], face: NDArray[np.int32], pose: Floats, stamp: float
) -> Iterator[tuple[int, NDArray[np.int64], Floats]]:
    """Of each mover in a picture its number, its pixels, and the camera's pose (4, 4) in its frame.

    face: (pixels,). pose: (4, 4) camera to world. stamp: when [s].
    """
    if not movers:
        return
    whose, places = mover_of_face(movers, face), poses(movers, stamp)[0]
    for number in np.unique(whose[whose >= 0]):
        yield int(number), np.flatnonzero(whose == number), np.linalg.inv(places[number]) @ pose
