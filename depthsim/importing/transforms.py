"""ROS transforms: the poses of a camera from /tf and /tf_static."""

from collections.abc import Sequence

import numpy as np

from depthsim.trajectory import Trajectory
from depthsim.trajectory.rotation import Floats, multiply, rotation_matrices


class Transforms:
    """The tree of frames; each has one parent. A frame moves if its edge has more than one stamp."""

    def __init__(self) -> None:
        self._parents: dict[str, str] = {}
        self._edges: dict[str, dict[int, tuple[list[float], list[float]]]] = {}

    def add(self, parent: str, child: str, stamp: int, position: list[float], quaternion: list[float]) -> None:
        """One transform, child to parent; ``stamp`` [ns]."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        self._parents[child] = parent
        self._edges.setdefault(child, {})[stamp] = position, quaternion

    def path(self, frame: str) -> list[str]:
        """The frames from ``frame`` up to, but without, the root."""
        found: list[str] = []
        frame = frame.lstrip("/")
        while frame in self._parents and frame not in found:
            found.append(frame)
            frame = self._parents[frame]
        return found

    def poses(self, frame: str) -> Trajectory | None:
        """The poses of ``frame`` in the root, at the stamps of the edge that has most; None where nothing moves."""
        path = self.path(frame)
        moving = [child for child in path if len(self._edges[child]) > 1]
        if not moving:
            return None
        edges = {child: trajectory_of(self._edges[child]) for child in moving}
        busiest = max(moving, key=lambda child: len(edges[child]))
        first = max(edge.stamps[0] for edge in edges.values())
        last = min(edge.stamps[-1] for edge in edges.values())
        stamps = edges[busiest].stamps
        stamps = stamps[(stamps >= first) & (stamps <= last)]
        if not stamps.size:
            return None
        position, quaternion = np.zeros((len(stamps), 3)), np.tile([0, 0, 0, 1.0], (len(stamps), 1))
        for child in path:
            edge = edges[child].at(stamps) if child in edges else trajectory_of(self._edges[child])
            position, quaternion = _under(edge.positions, edge.quaternions, position, quaternion)
        return Trajectory(stamps, position, quaternion, "tf")

    def fixed(self, base: str, frame: str) -> tuple[Floats, Floats] | None:
        """``frame`` in ``base`` where nothing on the way up from it moves; None where there is no such way."""
        position, quaternion = np.zeros((1, 3)), np.array([[0, 0, 0, 1.0]])
        base = base.lstrip("/")
        for child in self.path(frame):
            if child == base:
                break
            if len(self._edges[child]) > 1:
                return None
            edge = trajectory_of(self._edges[child])
            position, quaternion = _under(edge.positions, edge.quaternions, position, quaternion)
            if self._parents[child] == base:
                return position[0], quaternion[0]
        return (position[0], quaternion[0]) if frame.lstrip("/") == base else None


def trajectory_of(poses: dict[int, tuple[list[float], list[float]]]) -> Trajectory:
    """Stamped poses [ns] as a trajectory, in the order of time."""
    stamps = sorted(poses)
    positions, quaternions = zip(*(poses[stamp] for stamp in stamps), strict=True)
    return Trajectory(seconds(stamps), np.array(positions), np.array(quaternions), "poses")


def seconds(stamps: Sequence[int]) -> Floats:
    """Stamps [ns] as the nearest doubles [s]: whole numbers past 2**53 must not become doubles before the division."""
    return np.array([stamp / 10**9 for stamp in stamps])


def mounted(body: Trajectory, position: Floats, quaternion: Floats) -> Trajectory:
    """The poses of what is mounted on a body at a fixed pose."""
    count = len(body)
    there = np.broadcast_to(position, (count, 3)), np.broadcast_to(quaternion, (count, 4))
    return Trajectory(body.stamps, *_under(body.positions, body.quaternions, *there), body.name)


def _under(position: Floats, quaternion: Floats, child: Floats, turn: Floats) -> tuple[Floats, Floats]:
    """The child's poses, given in frames of the poses (position, quaternion), in the parent of those."""
    turned = np.einsum("...ij,...j->...i", rotation_matrices(quaternion), child)
    return position + turned, multiply(quaternion, turn)
